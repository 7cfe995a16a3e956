#include <quoin/io/block_packs.h>

#include <algorithm>
#include <array>
#include <mutex>
#include <optional>
#include <span>
#include <string_view>
#include <utility>

#include <quoin/core/assert.h>
#include <quoin/core/thousands.h>

#include "io/packs/pack_files.h"
#ifndef QUOIN_WITHOUT_GAME_WORLDS
#include "io/luanti/luanti.h"
#include "io/minecraft/block_types.h"
#include "io/minecraft/state_turns.h"
#include "io/packs/node_pack.h"
#include "io/packs/pack_looks.h"
#include "io/packs/pack_own.h"
#endif

namespace quoin {

namespace {

std::string counted(std::size_t count, const char* one, const char* many) {
  return with_thousands(static_cast<std::int64_t>(count)) + " " + (count == 1 ? one : many);
}

/// A source whose types have the looks of packs, with the same numbers.
class PackedSource final : public ChunkSource {
 public:
  PackedSource(std::unique_ptr<ChunkSource> source, std::shared_ptr<BlockPacks> packs)
      : ChunkSource(with_identity(source->info(), *packs), {source->parts().begin(), source->parts().end()}),
        source_(std::move(source)),
        packs_(std::move(packs)) {}

  [[nodiscard]] VoxelRegistry types() const override {
    const VoxelRegistry plain = source_->types();
    std::size_t first = 0;
    {
      const std::scoped_lock lock(mutex_);
      first = types_.size();
    }
    // Without the lock: a thread that waits for the others may meanwhile be asked for types.
    if (first < plain.size()) packs_->prepare(plain, first);
    const std::scoped_lock lock(mutex_);
    while (types_.size() < plain.size()) {
      const auto added = types_.add(packs_->applied(plain[static_cast<VoxelType>(types_.size())]));
      QUOIN_ASSERT(added, "valid types, as many as in the source");
    }
    return types_;
  }

  [[nodiscard]] Result<SourcePart> read_part(std::size_t part) const override { return source_->read_part(part); }
  [[nodiscard]] Result<VisitedColumns> visit_columns(
      std::size_t part, int top, FunctionRef<bool(IVec3 voxel, VoxelType type)> visit) const override {
    return source_->visit_columns(part, top, visit);
  }
  [[nodiscard]] Result<std::uint64_t> part_stamp(std::size_t part) const override { return source_->part_stamp(part); }

 private:
  static ChunkSourceInfo with_identity(ChunkSourceInfo info, const BlockPacks& packs) {
    info.packs += (info.packs.empty() ? "" : "; ") + packs.identity();
    return info;
  }

  std::unique_ptr<ChunkSource> source_;
  std::shared_ptr<BlockPacks> packs_;
  mutable std::mutex mutex_;
  mutable VoxelRegistry types_;
};

}  // namespace

std::string to_string(const BlockPackReport& report) {
  std::string text;
  const auto add = [&](const std::string& more) { text += (text.empty() ? "resource packs: " : ", ") + more; };
  if (report.without_look > 0) {
    add(counted(report.without_look, "block type", "block types") + " of " +
        with_thousands(static_cast<std::int64_t>(report.types)) + " without a look");
  }
  if (report.replaced_looks > 0) add(counted(report.replaced_looks, "look", "looks") + " replaced by the own pack");
  if (report.missing_textures > 0) add(counted(report.missing_textures, "texture", "textures") + " missing");
  if (report.missing_models > 0) add(counted(report.missing_models, "model", "models") + " missing");
  if (report.without_choices > 0) {
    add(counted(report.without_choices, "block type", "block types") + " without choices by position");
  }
  std::string names;
  for (const std::string& name : report.names) names += (names.empty() ? ": " : ", ") + name;
  const std::size_t all = report.without_look + report.replaced_looks + report.missing_textures +
                          report.missing_models + report.without_choices;
  return text + names + (report.names.size() < all ? ", ..." : "");
}

std::vector<std::filesystem::path> packs_for_images(std::vector<std::filesystem::path> named) {
  if (named == std::vector<std::filesystem::path>{kNoPack}) return {};
  if (std::ranges::find(named, std::filesystem::path(kBuiltinPack)) == named.end()) named.emplace_back(kBuiltinPack);
  return named;
}

Result<std::shared_ptr<BlockPacks>> BlockPacks::open(std::span<const std::filesystem::path> paths) {
  return open(paths, {});
}

Result<std::shared_ptr<BlockPacks>> BlockPacks::open(std::vector<std::vector<std::byte>> zips) {
  return open({}, std::move(zips));
}

#ifdef QUOIN_WITHOUT_GAME_WORLDS

// There are no objects in such builds.
struct BlockPacks::Content {
  struct {
    [[nodiscard]] static VoxelProperties applied(const VoxelProperties& type) { return type; }
    static void prepare(const VoxelRegistry& /*types*/, std::size_t /*first*/, Threads /*threads*/) {}
    [[nodiscard]] static BlockPackReport report() { return {}; }
    [[nodiscard]] static std::string identity() { return {}; }
  } looks;
};

namespace {

Error packs_left_out(const std::string& verb = "read") {
  return make_error(ErrorCode::Unsupported,
                    "cannot " + verb + " resource packs: Quoin was built with QUOIN_WITH_GAME_WORLDS=OFF");
}

}  // namespace

Result<std::shared_ptr<BlockPacks>> BlockPacks::open(std::span<const std::filesystem::path> paths,
                                                     std::vector<std::vector<std::byte>> zips) {
  const std::filesystem::path own(kBuiltinPack);
  const bool has_others = !zips.empty() || std::ranges::any_of(paths, [&](const auto& path) { return path != own; });
  // Without readers of blocks there are none to give a look to.
  return has_others ? Result<std::shared_ptr<BlockPacks>>(packs_left_out())
                    : std::shared_ptr<BlockPacks>(new BlockPacks(std::make_unique<Content>()));
}

std::shared_ptr<BlockPacks> BlockPacks::stacked(std::span<const std::shared_ptr<BlockPacks>> /*packs*/) {
  return std::shared_ptr<BlockPacks>(new BlockPacks(std::make_unique<Content>()));
}

Result<std::string> hash_of_pack(const std::filesystem::path& /*path*/) {
  return packs_left_out();
}

std::optional<std::uint32_t> turned_block_state(const VoxelProperties&, std::uint32_t, const AxisOrientation&) {
  return std::nullopt;
}

Result<std::vector<std::byte>> write_builtin_pack(std::span<const std::string> /*blocks*/) {
  return packs_left_out("write");
}

#else

std::optional<std::uint32_t> turned_block_state(const VoxelProperties& type, std::uint32_t state,
                                                const AxisOrientation& turn) {
  if (type.attributes.contains(minecraft::kStatesAttribute)) return minecraft::turned_state(type, state, turn);
  if (type.attributes.contains(models::kNodeStatesAttribute)) return packs::turned_node_state(type, state, turn);
  return std::nullopt;
}

namespace {

/// The own pack, whose tables are parsed when the first file is read: many scenes have no blocks.
class LazyOwnPack final : public packs::PackFiles {
 public:
  [[nodiscard]] Result<std::optional<std::vector<std::byte>>> read(std::string_view path,
                                                                   std::size_t max_bytes) const override {
    return packs::OwnPack::instance()->read(path, max_bytes);
  }
  [[nodiscard]] std::string identity() const override { return "builtin"; }
};

}  // namespace

struct BlockPacks::Content {
  Content(std::shared_ptr<const packs::PackStack> stack, std::shared_ptr<const packs::PackFiles> own_pack)
      : files(std::move(stack)), own(std::move(own_pack)), looks(files, own) {}
  std::shared_ptr<const packs::PackStack> files;
  std::shared_ptr<const packs::PackFiles> own;  // null: without kBuiltinPack
  packs::BlockLooks looks;
};

Result<std::shared_ptr<BlockPacks>> BlockPacks::open(std::span<const std::filesystem::path> paths,
                                                     std::vector<std::vector<std::byte>> zips) {
  std::vector<std::filesystem::path> named(paths.begin(), paths.end());
  const bool has_own = std::erase(named, std::filesystem::path(kBuiltinPack)) > 0;
  auto files = packs::PackStack::open(named, std::move(zips));
  if (!files) return files.error();
  std::shared_ptr<const packs::PackFiles> own;
  if (has_own) own = std::make_shared<const LazyOwnPack>();
  return std::shared_ptr<BlockPacks>(new BlockPacks(std::make_unique<Content>(std::move(*files), std::move(own))));
}

std::shared_ptr<BlockPacks> BlockPacks::stacked(std::span<const std::shared_ptr<BlockPacks>> packs) {
  std::vector<std::shared_ptr<const packs::PackFiles>> files;
  std::shared_ptr<const packs::PackFiles> own;
  for (const std::shared_ptr<BlockPacks>& opened : packs) {
    const std::span all = opened->content_->files->packs();
    files.insert(files.end(), all.begin(), all.end());
    if (opened->content_->own != nullptr) own = opened->content_->own;
  }
  auto stack = std::make_shared<const packs::PackStack>(std::move(files));
  return std::shared_ptr<BlockPacks>(new BlockPacks(std::make_unique<Content>(std::move(stack), std::move(own))));
}

Result<std::string> hash_of_pack(const std::filesystem::path& path) {
  const auto hash = packs::hash_of_files(path);
  if (!hash) return hash.error();
  constexpr int kDigits = 16;
  std::array<char, kDigits> digits{};
  for (int i = 0; i < kDigits; ++i) digits[i] = "0123456789abcdef"[*hash >> 4 * (kDigits - 1 - i) & 0xFU];
  return std::string(digits.begin(), digits.end());
}

Result<std::vector<std::byte>> write_builtin_pack(std::span<const std::string> blocks) {
  return packs::OwnPack::instance()->zip(blocks);
}

#endif

BlockPacks::BlockPacks(std::unique_ptr<Content> content) : content_(std::move(content)) {}
BlockPacks::~BlockPacks() = default;

void BlockPacks::apply(VoxelRegistry& types, Threads threads) {
  prepare(types, 1, threads);
  for (std::size_t i = 1; i < types.size(); ++i) {
    const auto type = static_cast<VoxelType>(i);
    VoxelProperties made = content_->looks.applied(types[type]);
    if (!(made == types[type])) types.replace(type, std::move(made));
  }
}

VoxelProperties BlockPacks::applied(const VoxelProperties& type) {
  return content_->looks.applied(type);
}

void BlockPacks::prepare(const VoxelRegistry& types, std::size_t first, Threads threads) {
  content_->looks.prepare(types, first, threads);
}

std::string BlockPacks::identity() const {
  return content_->looks.identity();
}

BlockPackReport BlockPacks::report() const {
  return content_->looks.report();
}

std::unique_ptr<ChunkSource> with_packs(std::unique_ptr<ChunkSource> source, std::shared_ptr<BlockPacks> packs) {
  QUOIN_ASSERT(source != nullptr && packs != nullptr, "a source and packs");
  return std::make_unique<PackedSource>(std::move(source), std::move(packs));
}

}  // namespace quoin
