#include <quoin/store/world_import.h>
#include <quoin/store/world_maintenance.h>
#include <quoin/store/world_meshes.h>
#include <quoin/store/world_saver.h>
#include <quoin/store/world_store.h>

#include "store/store_formats.h"

// Builds without SQLite, zstd or xxHash: all world functions return an error. Parameters are the same as in complete
// builds.
// NOLINTBEGIN(performance-unnecessary-value-param)

namespace quoin {

namespace store {
struct ChangeSet {};
}  // namespace store

namespace {

Error absent(const std::filesystem::path& path = {}) {
  return make_error(ErrorCode::Unsupported, "cannot open worlds: not supported by this build: " QUOIN_STORE_MISSING,
                    path.string());
}

}  // namespace

struct WorldStore::Impl {
  std::filesystem::path path;
};
struct WorldSaver::Impl {};

WorldChanges::WorldChanges() = default;
WorldChanges::WorldChanges(WorldChanges&&) noexcept = default;
WorldChanges& WorldChanges::operator=(WorldChanges&&) noexcept = default;
WorldChanges::~WorldChanges() = default;
void WorldChanges::put_chunk(const ChunkAddress&, StoredChunk) {}
void WorldChanges::remove_chunk(const ChunkAddress&) {}
void WorldChanges::put_types(const VoxelRegistry&, VoxelType) {}
void WorldChanges::put_type(VoxelType, const VoxelProperties&) {}
void WorldChanges::put_grid(std::uint32_t, const WorldGrid&) {}
void WorldChanges::remove_grid(std::uint32_t) {}
void WorldChanges::put_value(std::string, std::vector<std::byte>) {}
void WorldChanges::remove_value(std::string) {}
void WorldChanges::put_thumbnail(std::vector<std::byte>) {}
void WorldChanges::remove_thumbnail() {}
bool WorldChanges::empty() const {
  return true;
}
std::size_t WorldChanges::chunk_count() const {
  return 0;
}

Status validate_chunk(const StoredChunk&, const VoxelRegistry&, float) {
  return absent();
}

WorldStore::WorldStore(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
WorldStore::WorldStore(WorldStore&&) noexcept = default;
WorldStore& WorldStore::operator=(WorldStore&&) noexcept = default;
WorldStore::~WorldStore() = default;
Result<WorldStore> WorldStore::create(const std::filesystem::path& path, Threads) {
  return absent(path);
}
Result<WorldStore> WorldStore::open(const std::filesystem::path& path, WorldAccess, Threads) {
  return absent(path);
}
Result<WorldStore> WorldStore::open_or_create(const std::filesystem::path& path, Threads) {
  return absent(path);
}
Result<std::optional<StoredChunk>> WorldStore::load_chunk(const ChunkAddress&) const {
  return absent();
}
Result<std::vector<IVec3>> WorldStore::chunks(std::uint32_t, std::uint8_t, const IBox&) const {
  return absent();
}
Result<std::vector<IVec3>> WorldStore::chunks(std::uint32_t, std::uint8_t) const {
  return absent();
}
Result<VoxelRegistry> WorldStore::types() const {
  return absent();
}
Result<std::map<std::uint32_t, WorldGrid>> WorldStore::grids() const {
  return absent();
}
std::uint32_t WorldStore::next_grid() {
  return 0;
}
Result<std::optional<std::vector<std::byte>>> WorldStore::value(std::string_view) const {
  return absent();
}
Result<std::optional<std::vector<std::byte>>> WorldStore::thumbnail() const {
  return absent();
}
Result<std::vector<std::string>> WorldStore::value_names() const {
  return absent();
}
Result<SaveTicket> WorldStore::save(WorldChanges, std::function<void(const Status&)>) {
  return absent();
}
Status WorldStore::wait(SaveTicket) {
  return absent();
}
Status WorldStore::flush() {
  return absent();
}
WorldStats WorldStore::stats() const {
  return {};
}
const std::filesystem::path& WorldStore::path() const {
  return impl_->path;
}
bool WorldStore::is_writable() const {
  return false;
}

WorldSaver::WorldSaver() = default;
WorldSaver::WorldSaver(WorldSaver&&) noexcept = default;
WorldSaver& WorldSaver::operator=(WorldSaver&&) noexcept = default;
WorldSaver::~WorldSaver() = default;
Result<SaveTicket> WorldSaver::save(WorldStore&, const Scene&, WorldChanges, std::function<void(const Status&)>) {
  return absent();
}
void WorldSaver::follow(const Scene&, FunctionRef<void(GridHandle, std::optional<IVec3>)>) {}
Status WorldSaver::begin(WorldStore&, const Scene&, WorldChanges, std::function<void(const Status&)>) {
  return absent();
}
bool WorldSaver::is_begun() const {
  return false;
}
Result<std::optional<SaveTicket>> WorldSaver::step(WorldStore&, double) {
  return absent();
}
void WorldSaver::set_view(WorldView) {}
std::optional<std::uint32_t> WorldSaver::number_of(GridHandle) const {
  return std::nullopt;
}
Result<LoadedWorld> load_world(const WorldStore&, const LoadOptions&, Threads, const Progress&) {
  return absent();
}
Result<LoadedWorld> load_partial_world(const WorldStore&, const LoadOptions&, std::uint64_t) {
  return absent();
}
Result<SavedScene> write_world(const Scene&, const std::filesystem::path& path, Threads, const Progress&,
                               WorldChanges) {
  return absent(path);
}
Result<SavedScene> write_world(const LoadedScene&, const std::filesystem::path& path, Threads, const Progress&,
                               WorldChanges) {
  return absent(path);
}

Result<ImportedWorld> import_world(const ChunkSource&, const std::filesystem::path& path, Threads, const Progress&) {
  return absent(path);
}

Result<WorldSummary> summarize_world(const std::filesystem::path& path, const Progress&) {
  return absent(path);
}
Result<WorldCheck> check_world(const std::filesystem::path& path, const Progress&) {
  return absent(path);
}
Result<WorldRepair> repair_world(const std::filesystem::path& from, const std::filesystem::path&, const Progress&) {
  return absent(from);
}
Result<std::uint64_t> back_up_world(const std::filesystem::path& from, const std::filesystem::path&) {
  return absent(from);
}
Result<WorldCopy> copy_world(const std::filesystem::path& from, const std::filesystem::path&, const Progress&) {
  return absent(from);
}
Result<WorldMeshes> mesh_world(const WorldStore&, const LoadedWorld&, const WorldMeshOptions&, Threads,
                               const Progress&) {
  return absent();
}
Result<std::uint64_t> compact_world(const std::filesystem::path& path) {
  return absent(path);
}

Result<LoadedScene> read_world_format(const std::filesystem::path& path, const LoadOptions&, Threads, const Progress&) {
  return absent(path);
}
Result<LoadedScene> read_world_format(std::span<const std::byte>, const LoadOptions&, Threads, const Progress&) {
  return absent();
}

}  // namespace quoin
// NOLINTEND(performance-unnecessary-value-param)
