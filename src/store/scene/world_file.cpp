#include "store/scene/world_file.h"

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <string>
#include <system_error>
#include <utility>

#include <quoin/core/memory.h>
#include <quoin/io/file.h>
#include <quoin/store/world_saver.h>

#include "core/bytes/text.h"
#include "core/database/connection.h"
#include "store/database/schema.h"
#include "store/store_formats.h"
#include "store/world/world_changes.h"
#include "store/world/world_open.h"

namespace quoin {

using namespace store;

namespace {

std::string megabytes(std::uint64_t bytes) {
  return std::to_string((bytes + 500'000) / 1'000'000) + " MB";
}

// Returns an error if memory is too small, instead of letting the system end the process.
Status check_memory(const WorldStore& world) {
  constexpr std::uint64_t kSmall = std::uint64_t{64} << 20;
  const auto needed = memory_of_world(world);
  if (!needed || *needed < kSmall) return {};
  const auto available = available_memory();
  if (!available || *needed <= *available) return {};
  return make_error(ErrorCode::LimitExceeded,
                    "loading the whole world needs about " + megabytes(*needed) + " of memory; " +
                        megabytes(*available) + " are available",
                    world.path().string());
}

Result<LoadedScene> load(const WorldStore& world, const LoadOptions& options, Threads threads,
                         const Progress& progress) {
  if (auto fits = check_memory(world); !fits) return fits.error();
  auto loaded = load_world(world, options, threads, progress);
  if (!loaded) return loaded.error();
  const auto values = world.value_names();
  if (!values) return values.error();
  if (!values->empty()) {
    loaded->loaded.warnings.push_back("application values left out: " + std::to_string(values->size()) +
                                      " (quoin world backup copies them)");
  }
  return std::move(loaded->loaded);
}

}  // namespace

Result<LoadedScene> read_world_format(const std::filesystem::path& path, const LoadOptions& options, Threads threads,
                                      const Progress& progress) {
  const auto world = WorldStore::open(path, WorldAccess::Read, threads);
  if (!world) return world.error();
  return load(*world, options, threads, progress);
}

Result<LoadedScene> read_world_format(std::span<const std::byte> bytes, const LoadOptions& options, Threads threads,
                                      const Progress& progress) {
  const auto world = WorldParts::open(bytes);
  if (!world) return world.error();
  return load(*world, options, threads, progress);
}

namespace {

// Estimates the bytes of a grid's loaded chunks from a sample.
std::optional<double> memory_of_grid(const WorldStore& world, std::uint32_t number) {
  constexpr std::size_t kSamples = 64;
  const auto places = world.chunks(number, 0);
  if (!places) return std::nullopt;
  double bytes = 0.0;
  std::size_t read = 0;
  const std::size_t step = std::max<std::size_t>(places->size() / kSamples, 1);
  for (std::size_t i = 0; i < places->size(); i += step) {
    const auto chunk = world.load_chunk({number, 0, (*places)[i]});
    if (!chunk || !*chunk) continue;
    ++read;
    bytes += static_cast<double>((*chunk)->voxels.bytes());
    if ((*chunk)->densities) bytes += static_cast<double>((*chunk)->densities->bytes());
  }
  return read == 0 ? 0.0 : bytes / static_cast<double>(read) * static_cast<double>(places->size());
}

}  // namespace

std::optional<std::uint64_t> memory_of_world(const WorldStore& world) {
  const auto grids = world.grids();
  if (!grids) return std::nullopt;
  double total = 0.0;
  for (const auto& [number, grid] : *grids) {
    const auto bytes = memory_of_grid(world, number);
    if (!bytes) return std::nullopt;
    total += *bytes;
  }
  return static_cast<std::uint64_t>(total);
}

WholeGridLimit WholeGridLimit::of(std::uint64_t max_bytes) {
  const std::uint64_t available = available_memory().value_or(max_bytes);
  return {std::min(max_bytes, available), available < max_bytes};
}

Error WholeGridLimit::error(const WorldStore& world, std::uint32_t number, const std::string& name,
                            std::uint64_t needed) const {
  return make_error(ErrorCode::LimitExceeded,
                    "cannot load grid " + std::to_string(number) + " \"" + printable(name) +
                        "\" as a whole: the whole grids up to it need about " + megabytes(needed) + " of memory; " +
                        megabytes(bytes) + (is_memory ? " are available" : " are allowed"),
                    world.path().string());
}

Status check_whole_grids(const WorldStore& world, const WholeGridLimit& limit) {
  constexpr std::uint64_t kLargestChunk = std::uint64_t{2} << 20;  // 16-bit voxels, densities and materials; no data
  const auto grids = world.grids();
  if (!grids) return grids.error();
  std::uint64_t chunks = 0;
  for (const auto& [number, grid] : *grids) {
    if (!grid.whole) continue;
    const auto places = world.chunks(number, 0);
    if (!places && places.error().code == ErrorCode::BadFormat) continue;  // loading it reports the damage
    if (!places) return places.error();
    chunks += places->size();
  }
  if (chunks <= limit.bytes / kLargestChunk) return {};
  double needed = 0.0;
  for (const auto& [number, grid] : *grids) {
    if (!grid.whole) continue;
    needed += memory_of_grid(world, number).value_or(0.0);
    if (needed > static_cast<double>(limit.bytes)) {
      return limit.error(world, number, grid.name, static_cast<std::uint64_t>(needed));
    }
  }
  return {};
}

namespace {

/// Empties the log of a world that is about to be replaced, so that the new world does not find it. Other readers keep
/// their open files.
Status clear_log(const std::filesystem::path& path) {
  const auto beginning = read_file_beginning(path, kWorldHeaderBytes);
  if (!beginning) return beginning.error();
  if (is_world_format(*beginning)) {
    auto connection = Connection::open(path.string(), Connection::Mode::Write);
    if (!connection) return connection.error();
    // If a world is damaged beyond reading, its log is useless too.
    Status sound = check_schema(*connection);
    if (!sound && sound.error().code != ErrorCode::BadFormat) return sound;
    if (sound) {
      if (!end_writing(*connection)) return make_error(ErrorCode::CannotWrite, "another program is reading it");
      if (auto done = connection->close(); !done) return done;
    }
  }
  remove_database_log(path);
  return {};
}

/// A world written under a temporary name in the same folder; deleted unless `put_in_place` is called.
class FreshWorld {
 public:
  explicit FreshWorld(std::filesystem::path path) : path_(std::move(path)), fresh_(fresh_name(path_)) {}
  FreshWorld(const FreshWorld&) = delete;
  FreshWorld& operator=(const FreshWorld&) = delete;
  ~FreshWorld() { remove_database(fresh_); }

  Status begin() {
    auto lock = WorldLock::take(path_);
    if (!lock) return lock.error();
    lock_ = std::move(*lock);
    return {};
  }
  [[nodiscard]] const std::filesystem::path& fresh() const { return fresh_; }

  Status put_in_place() { return put_world_in_place(fresh_, path_); }

 private:
  std::filesystem::path path_;
  std::filesystem::path fresh_;
  WorldLock lock_;
};

Result<SavedScene> write(const Scene& scene, WorldView view, const std::filesystem::path& path, Threads threads,
                         const Progress& progress, WorldChanges more) {
  const std::filesystem::path target = follow_links(path);
  FreshWorld fresh(target);
  if (auto done = fresh.begin(); !done) return done.error();
  {
    auto world = WorldParts::create_unsynced(fresh.fresh(), threads);
    if (!world) return world.error();
    WorldSaver saver;
    saver.set_view(std::move(view));
    if (progress && !progress(0.0)) return make_error(ErrorCode::Cancelled, "cancelled");
    const auto ticket = saver.save(*world, scene, std::move(more));
    if (!ticket) return ticket.error();
    if (auto done = world->flush(); !done) return done.error();
    if (progress && !progress(0.95)) return make_error(ErrorCode::Cancelled, "cancelled");
  }
  if (auto done = fresh.put_in_place(); !done) return done.error();
  std::error_code error;
  SavedScene saved;
  saved.bytes = std::filesystem::file_size(target, error);
  return saved;
}

}  // namespace

Status store::put_world_in_place(const std::filesystem::path& from, const std::filesystem::path& to) {
  std::error_code error;
  const auto status = std::filesystem::status(to, error);
  if (std::filesystem::exists(status)) {
    if (!std::filesystem::is_regular_file(status)) {
      return make_error(ErrorCode::CannotWrite, "not a regular file");
    }
    if (auto done = clear_log(to); !done) return done;
    std::filesystem::permissions(from, status.permissions(), error);
  }
  return move_in_place(from, to, Existing::Replaced);
}

// Errors name the requested file, not the temporary one.
Result<SavedScene> write_world(const Scene& scene, const std::filesystem::path& path, Threads threads,
                               const Progress& progress, WorldChanges more) {
  auto saved = write(scene, {}, path, threads, progress, std::move(more));
  if (!saved) saved.error().path = path.string();
  return saved;
}

Result<SavedScene> write_world(const LoadedScene& loaded, const std::filesystem::path& path, Threads threads,
                               const Progress& progress, WorldChanges more) {
  auto saved = write(loaded.scene, {loaded.camera, loaded.cameras}, path, threads, progress, std::move(more));
  if (!saved) saved.error().path = path.string();
  return saved;
}

}  // namespace quoin
