// Writes Sponge schematics, version 2, which most programs read: a block palette, and a palette index for each
// position.

#include <algorithm>
#include <array>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <quoin/core/thousands.h>

#include "core/work/progress_steps.h"
#include "io/byte_stream.h"
#include "io/minecraft/block_looks.h"
#include "io/minecraft/block_types.h"
#include "io/minecraft/minecraft.h"
#include "io/minecraft/nbt.h"
#include "io/placed_grids.h"

namespace quoin::minecraft {

namespace {

constexpr models::FormatHolds kHolds = {
    .extension = ".schem", .names = true, .transparency = true, .materials = true, .type_names = true};
constexpr int kMaxWrittenEdge = 65'535;
constexpr std::int64_t kMaxWrittenBlocks = (std::int64_t{1} << 30) - (std::int64_t{1} << 20);
constexpr std::int32_t kVersion = 2;
// The data version of the game's 1.20.1.
constexpr std::int32_t kDataVersion = 3465;

constexpr std::array<std::string_view, 16> kWrittenDyes = {
    "white",      "orange", "magenta", "light_blue", "yellow", "lime",  "pink", "gray",
    "light_gray", "cyan",   "purple",  "blue",       "brown",  "green", "red",  "black"};

/// Full blocks of one colour.
std::vector<std::string> plain_blocks() {
  std::vector<std::string> names = {
      "stone",         "smooth_stone", "deepslate",       "dirt",       "sand",       "red_sand",   "oak_planks",
      "spruce_planks", "birch_planks", "dark_oak_planks", "snow_block", "bricks",     "obsidian",   "iron_block",
      "gold_block",    "quartz_block", "netherrack",      "end_stone",  "prismarine", "coal_block", "diamond_block",
      "emerald_block", "lapis_block",  "terracotta"};
  for (const std::string_view kind : {"_concrete", "_wool", "_terracotta"}) {
    for (const std::string_view dye : kWrittenDyes) names.push_back(std::string(dye).append(kind));
  }
  return names;
}

std::vector<std::string> glass_blocks() {
  std::vector<std::string> names;
  names.reserve(kWrittenDyes.size());
  for (const std::string_view dye : kWrittenDyes) names.push_back(std::string(dye).append("_stained_glass"));
  return names;
}

std::vector<std::string> light_blocks() {
  return {"glowstone", "sea_lantern", "shroomlight", "ochre_froglight", "verdant_froglight", "pearlescent_froglight"};
}

/// The blocks available for colour matching.
class Blocks {
 public:
  explicit Blocks(const std::vector<std::string>& names) {
    for (const std::string& name : names) all_.emplace_back(name, look_of_block(name, false, false).colour);
  }
  /// Returns the available block of the nearest colour, weighting channels like human vision.
  [[nodiscard]] std::string nearest(Rgba8 colour) const {
    const auto distance = [&](Rgba8 other) {
      const auto squared = [](int a, int b) { return (a - b) * (a - b); };
      return 2 * squared(colour.r, other.r) + 4 * squared(colour.g, other.g) + 3 * squared(colour.b, other.b);
    };
    const auto found = std::ranges::min_element(
        all_, [&](const auto& a, const auto& b) { return distance(a.second) < distance(b.second); });
    return "minecraft:" + found->first;
  }

 private:
  std::vector<std::pair<std::string, Rgba8>> all_;
};

/// A type that was read from the game, or has the name of one of its blocks.
bool is_block(const VoxelProperties& type) {
  constexpr std::string_view kGame = "minecraft:";
  if (!type.name.starts_with(kGame) && !type.attributes.contains(kStatesAttribute)) return false;
  const std::string_view name = std::string_view(type.name).substr(0, type.name.find('['));
  return std::ranges::count(name, ':') == 1 && std::ranges::all_of(name, [](char c) {
           return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') ||
                  std::string_view("_.-/:").find(c) != std::string_view::npos;
         });
}

/// Adds properties that block_state drops and whose default in the game differs: campfires and torches that do not
/// burn, and leaves that do not decay (their distance from wood is lost).
BlockText as_in_game(BlockText block) {
  const auto has = [&](std::string_view key) {
    return std::ranges::any_of(block.properties, [&](const Property& property) { return property.first == key; });
  };
  constexpr std::array<std::string_view, 4> kBurning = {"minecraft:campfire", "minecraft:soul_campfire",
                                                        "minecraft:redstone_torch", "minecraft:redstone_wall_torch"};
  if (std::ranges::find(kBurning, block.name) != kBurning.end() && !has("lit")) {
    block.properties.emplace_back("lit", "false");
  }
  if (block.name.ends_with("_leaves") && !has("persistent")) block.properties.emplace_back("persistent", "true");
  std::ranges::sort(block.properties);
  return block;
}

/// The blocks of a scene's types, and their palette numbers.
class Palette {
 public:
  explicit Palette(const VoxelRegistry& types) : types_(types), guessed_(types.size(), false) {
    static_cast<void>(number_of("minecraft:air"));
    plain_.assign(types.size(), kNone);
    plain_[kAir] = 0;
    for (std::size_t i = 1; i < types.size(); ++i) of_game_[i] = is_block(types[static_cast<VoxelType>(i)]);
  }
  [[nodiscard]] bool is_of_game(VoxelType type) const { return of_game_[type]; }
  [[nodiscard]] std::int32_t number(VoxelType type, std::uint32_t state) {
    if (state == 0 && plain_[type] != kNone) return plain_[type];
    const std::int32_t number = number_of(text_of(type, state));
    if (state == 0) plain_[type] = number;
    return number;
  }
  /// By their names.
  [[nodiscard]] const std::map<std::string, std::int32_t>& all() const { return numbers_; }
  [[nodiscard]] std::int64_t guessed() const { return std::ranges::count(guessed_, true); }

 private:
  static constexpr std::int32_t kNone = -1;
  std::int32_t number_of(const std::string& text) {
    return numbers_.try_emplace(text, static_cast<std::int32_t>(numbers_.size())).first->second;
  }
  [[nodiscard]] std::string text_of(VoxelType type, std::uint32_t state) {
    const VoxelProperties& properties = types_[type];
    if (is_of_game(type)) return to_string(as_in_game(block_text(properties, state)));
    guessed_[type] = true;
    static const Blocks plain(plain_blocks());
    static const Blocks glass(glass_blocks());
    static const Blocks lights(light_blocks());
    if (properties.emission > 0.0F) return lights.nearest(properties.colour);
    return (properties.visibility == Visibility::Transparent ? glass : plain).nearest(properties.colour);
  }

  const VoxelRegistry& types_;
  std::map<std::string, std::int32_t> numbers_;
  std::vector<std::int32_t> plain_;  // palette numbers of types without a state
  std::vector<bool> guessed_;
  std::vector<bool> of_game_ = std::vector<bool>(types_.size(), false);
};

/// Writes seven bits per byte, lowest first; the eighth bit marks that more bytes follow.
void put_varint(std::uint32_t value, std::vector<std::byte>& out) {
  for (; value >= 0x80; value >>= 7) out.push_back(static_cast<std::byte>(value | 0x80));
  out.push_back(static_cast<std::byte>(value));
}

Result<std::vector<std::byte>> blocks_of(const models::MergedGrid& merged, Palette& palette, std::int64_t& lost_data,
                                         const Progress& progress) {
  const bool has_data = merged.voxels.data_count() != 0;
  const IBox& box = merged.box;
  std::vector<std::byte> blocks;
  std::vector<VoxelType> row(static_cast<std::size_t>(box.size().x));
  ProgressSteps steps(progress, static_cast<std::size_t>(box.size().y));
  for (int y = box.min.y; y < box.max.y; ++y) {
    for (int z = box.min.z; z < box.max.z; ++z) {
      models::read_voxels(merged.voxels, {box.min.x, y, z}, row);
      for (std::size_t x = 0; x < row.size(); ++x) {
        const IVec3 voxel{box.min.x + static_cast<int>(x), y, z};
        const VoxelData data = has_data && row[x] != kAir ? merged.voxels.data(voxel) : VoxelData();
        const bool is_kept = data.bytes.empty() && (data.state == 0 || palette.is_of_game(row[x]));
        lost_data += is_kept ? 0 : 1;
        const std::uint32_t state = palette.is_of_game(row[x]) ? data.state : 0;
        put_varint(static_cast<std::uint32_t>(palette.number(row[x], state)), blocks);
      }
    }
    steps.step();
    if (steps.cancelled()) return make_error(ErrorCode::Cancelled, "cancelled");
  }
  return blocks;
}

}  // namespace

Result<EncodedFile> write_schematic(const Scene& scene, const Progress& progress) {
  auto merged = models::merge_grids(scene, kHolds);
  if (!merged) return merged.error();
  if (merged->box.empty())
    return make_error(ErrorCode::Unsupported, "the scene has no voxels, and .schem needs at least one");
  const IVec3 size = merged->box.size();
  if (std::max({size.x, size.y, size.z}) > kMaxWrittenEdge ||
      std::int64_t{size.x} * size.y > kMaxWrittenBlocks / std::max(size.z, 1)) {
    return make_error(ErrorCode::LimitExceeded, "more than 65,535 blocks per side, or about 2^30 in total");
  }
  Palette palette(scene.types);
  std::int64_t lost_data = 0;
  const auto blocks = blocks_of(*merged, palette, lost_data, progress);
  if (!blocks) return blocks.error();
  nbt::DocumentWriter out;
  out.begin("Schematic");
  out.int32("Version", kVersion);
  out.int32("DataVersion", kDataVersion);
  out.begin("Metadata");
  out.string("Name", merged->name);
  out.end();
  out.int16("Width", static_cast<std::int16_t>(size.x));
  out.int16("Height", static_cast<std::int16_t>(size.y));
  out.int16("Length", static_cast<std::int16_t>(size.z));
  const std::array<std::int32_t, 3> offset = {merged->box.min.x, merged->box.min.y, merged->box.min.z};
  out.ints("Offset", offset);
  out.int32("PaletteMax", static_cast<std::int32_t>(palette.all().size()));
  out.begin("Palette");
  for (const auto& [name, number] : palette.all()) out.int32(name, number);
  out.end();
  out.bytes("BlockData", *blocks);
  out.empty_list("BlockEntities");
  out.end();
  if (palette.guessed() != 0) {
    merged->warnings.push_back("types that are not Minecraft blocks, written as the block of the nearest colour: " +
                               with_thousands(palette.guessed()));
  }
  if (lost_data != 0) {
    merged->warnings.push_back("data of voxels left out, not supported by .schem: " + with_thousands(lost_data));
  }
  // The limit of readers.
  constexpr std::size_t kMost = std::size_t{1} << 30;
  if (out.document().size() > kMost) return make_error(ErrorCode::LimitExceeded, "more than 1 GiB of blocks");
  constexpr int kLevel = 6;
  return EncodedFile{gzipped(out.document(), kLevel), std::move(merged->warnings)};
}

}  // namespace quoin::minecraft
