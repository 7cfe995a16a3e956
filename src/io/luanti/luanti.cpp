#include "io/luanti/luanti.h"

#include <algorithm>
#include <array>
#include <bit>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include <quoin/core/assert.h>

#include "core/bytes/bytes.h"
#include "core/bytes/text.h"
#include "io/byte_stream.h"
#include "io/format_driver.h"
#include "io/minecraft/block_looks.h"
#include "io/models/model_builder.h"

// Luanti schematics: node names, and three arrays in a zlib stream. The axes are left-handed, so z is reversed.

namespace quoin::models {

namespace {

constexpr std::string_view kMagic = "MTSM";

std::uint16_t read_u16(ByteReader& reader) {
  const auto bytes = reader.take(2);
  return bytes.empty() ? std::uint16_t{0} : load<std::uint16_t>(bytes.data(), std::endian::big);
}

bool is_mts(std::span<const std::byte> beginning) {
  return ByteReader(beginning).text(4) == kMagic;
}

Result<LoadedScene> read_mts(std::span<const std::byte> bytes) {
  ByteReader reader(bytes);
  static_cast<void>(reader.take(4));
  const int version = read_u16(reader);
  if (version < 1 || version > 4) {
    return make_error(ErrorCode::Unsupported,
                      "Luanti schematic version " + std::to_string(version) + " is not supported", {}, 4);
  }
  const int size_x = read_u16(reader);
  const int size_y = read_u16(reader);
  const int size_z = read_u16(reader);
  if (version >= 3) static_cast<void>(reader.take(static_cast<std::size_t>(size_y)));  // the probability of each layer
  // A name has at least two bytes. Nodes of truncated files are not looked up, since that takes longer than reading.
  const std::size_t count = read_u16(reader);
  std::vector<std::string_view> names(count <= reader.remaining() / 2 ? count : 0);
  for (std::string_view& name : names) name = reader.text(read_u16(reader));
  if (reader.failed() || names.size() < count) return bad_at(bytes.size(), "the file ends before its nodes");
  std::vector<std::optional<VoxelProperties>> nodes(count);  // nullopt: air
  std::ranges::transform(names, nodes.begin(), node_properties);
  const std::size_t begin = reader.position();
  const std::uint64_t volume =
      static_cast<std::uint64_t>(size_x) * static_cast<std::uint64_t>(size_y) * static_cast<std::uint64_t>(size_z);
  if (volume == 0) {
    return bad_at(6, "invalid size: " + std::to_string(size_x) + " x " + std::to_string(size_y) + " x " +
                         std::to_string(size_z) + " nodes");
  }
  constexpr std::uint64_t kMaxNodes = std::uint64_t{1} << 24;
  if (volume > kMaxNodes) return make_error(ErrorCode::LimitExceeded, "the schematic has more than 2^24 nodes", {}, 6);
  ByteStream stream(bytes, begin, Compression::Zlib);
  if (volume * 4 > stream.max_bytes()) return bad_at(6, "the size claims more nodes than the file can hold");
  std::vector<std::byte> content(volume * 4);
  const auto read = stream.read(content);
  if (!read) return read.error();
  if (*read < volume * 3) return bad_at(bytes.size(), "the file ends before its nodes");
  ModelBuilder builder;
  Model model;
  model.canvas = {IVec3(0), {size_x, size_y, size_z}};
  builder.begin(std::move(model));
  std::vector<std::uint32_t> materials;
  materials.reserve(nodes.size());
  for (const auto& node : nodes) materials.push_back(node ? builder.add_material(*node) : 0);
  std::vector<std::pair<IVec3, std::uint32_t>> states;
  std::size_t at = 0;
  for (int z = 0; z < size_z; ++z) {
    for (int y = 0; y < size_y; ++y) {
      for (int x = 0; x < size_x; ++x, ++at) {
        QUOIN_ASSERT(at < volume, "a node of the schematic");
        const auto index = load<std::uint16_t>(content.data() + 2 * at, std::endian::big);
        if (index >= nodes.size()) return bad_at(begin, "a node index is beyond the names");
        // The node's probability, out of 127 since version 4 and out of 255 before.
        const auto chance = std::to_integer<unsigned>(content[2 * volume + at]);
        if (version >= 2 && (version >= 4 ? chance & 0x7FU : chance >> 1) == 0) continue;
        if (!nodes[index]) continue;
        builder.use_material(materials[index]);
        const IVec3 voxel{x, y, size_z - 1 - z};
        if (auto put = builder.put(voxel, nodes[index]->colour); !put) return put.error();
        const auto state = node_state(names[index], std::to_integer<std::uint8_t>(content[3 * volume + at]));
        if (state != 0) states.emplace_back(voxel, state);
      }
    }
  }
  auto loaded = builder.take("luanti");
  if (!loaded || states.empty()) return loaded;
  SceneGrid& grid = loaded->scene.edit(loaded->scene.grids().handles().front());
  for (const auto& [voxel, state] : states) grid.grid.set_data(voxel, {.state = state});
  return loaded;
}

}  // namespace

}  // namespace quoin::models

namespace quoin {

extern constinit const FormatDriver kLuantiSchematicFormat = {
    .info = {FileFormat::LuantiSchematic, ".mts", "Luanti schematic", FormatCapability::Read},
    .detect = models::is_mts,
    .read = [](const FormatInput& input) { return models::read_mts(input.bytes); },
};

}  // namespace quoin

namespace quoin::models {

namespace {

using minecraft::BlockLook;
using minecraft::Knowledge;

/// A node of Luanti's own game, and the Minecraft block that looks like it.
struct Alike {
  std::string_view node;
  std::string_view block;
};

// Sorted. Other nodes are recognised by words in their names.
constexpr std::array kAlike = std::to_array<Alike>({
    {"acacia_leaves", "acacia_leaves"},
    {"acacia_tree", "acacia_log"},
    {"acacia_wood", "acacia_planks"},
    {"apple", "red_wool"},
    {"aspen_leaves", "birch_leaves"},
    {"aspen_tree", "birch_log"},
    {"aspen_wood", "birch_planks"},
    {"brick", "bricks"},
    {"cloud", "white_wool"},
    {"coalblock", "coal_block"},
    {"cobble", "cobblestone"},
    {"copperblock", "copper_block"},
    {"desert_cobble", "red_sandstone"},
    {"desert_sand", "red_sand"},
    {"desert_stone", "red_sandstone"},
    {"diamondblock", "diamond_block"},
    {"dirt_with_coniferous_litter", "podzol"},
    {"dirt_with_dry_grass", "hay_block"},
    {"dirt_with_grass", "grass_block"},
    {"dirt_with_grass_footsteps", "grass_block"},
    {"dirt_with_rainforest_litter", "podzol"},
    {"dirt_with_snow", "snow_block"},
    {"dry_dirt", "coarse_dirt"},
    {"goldblock", "gold_block"},
    {"junglegrass", "fern"},
    {"jungleleaves", "jungle_leaves"},
    {"jungletree", "jungle_log"},
    {"junglewood", "jungle_planks"},
    {"lava_flowing", "lava"},
    {"lava_source", "lava"},
    {"leaves", "oak_leaves"},
    {"mese", "gold_block"},
    {"meselamp", "glowstone"},
    {"mossycobble", "mossy_cobblestone"},
    {"papyrus", "sugar_cane"},
    {"permafrost", "coarse_dirt"},
    {"pine_needles", "spruce_leaves"},
    {"pine_tree", "spruce_log"},
    {"pine_wood", "spruce_planks"},
    {"river_water_flowing", "water"},
    {"river_water_source", "water"},
    {"silver_sand", "white_concrete_powder"},
    {"snowblock", "snow_block"},
    {"steelblock", "iron_block"},
    {"stone_with_coal", "coal_ore"},
    {"stone_with_copper", "copper_ore"},
    {"stone_with_diamond", "diamond_ore"},
    {"stone_with_gold", "gold_ore"},
    {"stone_with_iron", "iron_ore"},
    {"stone_with_mese", "gold_ore"},
    {"stone_with_tin", "iron_ore"},
    {"stonebrick", "stone_bricks"},
    {"tree", "oak_log"},
    {"water_flowing", "water"},
    {"water_source", "water"},
    {"wood", "oak_planks"},
});
static_assert(std::ranges::is_sorted(kAlike, {}, &Alike::node));

BlockLook look_of_node(std::string_view name) {
  constexpr std::string_view kOwnGame = "default:";
  if (name.starts_with(kOwnGame)) {
    const std::string_view rest = name.substr(kOwnGame.size());
    const auto alike = std::ranges::lower_bound(kAlike, rest, {}, &Alike::node);
    if (alike != kAlike.end() && alike->node == rest) return minecraft::look_of_block(alike->block, false, false);
    BlockLook look = minecraft::look_of_block(rest, false, false);
    if (look.knowledge == Knowledge::Table) return look;
  }
  return minecraft::look_of_block(name, false, false);
}

// Sets the passage of light of nodes that differ from the blocks of the same look, as the mods of Luanti's own game
// register them: "paramtype light" lets light through, at no cost to the sun with "sunlight_propagates".
void set_passage(std::string_view name, VoxelProperties& type) {
  const auto is_of = [&](std::string_view mod) { return name.starts_with(mod); };
  constexpr std::string_view kAtCost[] = {"stairs:", "walls:", "beds:", "default:chest"};
  constexpr std::string_view kFree[] = {"xpanes:", "doors:"};  // also gates: "doors:gate_wood_closed"
  if (name == "default:cactus" || name == "vessels:shelf") {   // whole nodes without "paramtype light"
    type.blocks_light = std::nullopt;
    return;
  }
  const bool has_cost = name == "default:snow" || std::ranges::any_of(kAtCost, is_of);
  if (!has_cost && !std::ranges::any_of(kFree, is_of)) return;
  type.light_cost = has_cost ? 1 : 0;
  if (type.visibility == Visibility::Opaque) type.blocks_light = false;
}

bool is_flowing(std::string_view name) {
  return name.ends_with("_flowing");
}

}  // namespace

std::optional<VoxelProperties> node_properties(std::string_view name) {
  if (name == "air" || name == "ignore") return std::nullopt;
  const BlockLook look = look_of_node(name);
  VoxelProperties type;
  minecraft::set_look(look, type);
  set_passage(name, type);
  type.name = printable(name);
  type.colour = minecraft::tinted_colour(look.colour, minecraft::colour_of(look.tint, {}));
  type.colour.a = std::max<std::uint8_t>(type.colour.a, 1);
  if (look.knowledge != Knowledge::Table) {
    type.attributes[kNodeGuessAttribute] = look.knowledge == Knowledge::Words ? "words" : "nothing";
  }
  type.state_bits = 8;
  type.attributes[kNodeStatesAttribute] = is_flowing(name) ? "drop:n3,falls:b1,rest:n4" : "param2:n8";
  return type;
}

std::uint32_t node_state(std::string_view name, std::uint8_t param2) {
  constexpr std::uint32_t kLevel = 7;
  return is_flowing(name) ? param2 ^ kLevel : param2;
}

}  // namespace quoin::models

namespace quoin {

bool is_luanti_map(std::span<const std::byte> beginning) {
  constexpr std::string_view kSqliteHeader{"SQLite format 3\0", 16};
  constexpr std::size_t kIdAt = 68;  // the application id
  const std::string_view text = text_of(beginning);
  if (!text.starts_with(kSqliteHeader) || text.size() < kIdAt + 4) return false;
  if (text.substr(kIdAt, 4) != std::string_view("\0\0\0\0", 4)) return false;  // the application id of another program
  // The first page lists the tables, as SQL.
  const std::size_t page =
      std::to_integer<std::size_t>(beginning[16]) << 8 | std::to_integer<std::size_t>(beginning[17]);
  const std::string_view tables = text.substr(0, page == 1 ? 65536 : page);
  constexpr std::string_view kTable = "CREATE TABLE ";
  for (std::size_t at = tables.find(kTable); at != std::string_view::npos; at = tables.find(kTable, at + 1)) {
    std::string_view name = tables.substr(at + kTable.size());
    if (name.starts_with("IF NOT EXISTS ")) name.remove_prefix(14);
    if (!name.empty() && (name.front() == '`' || name.front() == '"' || name.front() == '[')) name.remove_prefix(1);
    constexpr std::string_view kBlocks = "blocks";
    if (name.starts_with(kBlocks) && name.size() > kBlocks.size() &&
        std::string_view("`\"] (").find(name[kBlocks.size()]) != std::string_view::npos) {
      return true;
    }
  }
  return false;
}

#if !defined(QUOIN_HAVE_STORE)

Result<std::unique_ptr<ChunkSource>> open_luanti(const std::filesystem::path& path) {
  return make_error(ErrorCode::Unsupported,
                    "cannot read Luanti worlds: not supported by this build: " QUOIN_STORE_MISSING, path.string());
}
Result<std::unique_ptr<ChunkSource>> open_luanti(std::span<const std::byte>) {
  return open_luanti(std::filesystem::path());
}

#endif

extern constinit const FormatDriver kLuantiMapFormat = {
    .info = {FileFormat::LuantiMap, ".sqlite", "Luanti world: its folder or map.sqlite",
             FormatCapability::Read | FormatCapability::Chunks},
    .detect_path =
        [](const std::filesystem::path& path) {
          std::error_code error;
          return std::filesystem::is_regular_file(path / "world.mt", error);
        },
    .detect = is_luanti_map,
    .source = FormatDriver::Source::Path,
    .open_chunks = [](const std::filesystem::path& path, std::span<const std::byte> bytes, std::string_view)
        -> Result<std::unique_ptr<ChunkSource>> { return path.empty() ? open_luanti(bytes) : open_luanti(path); },
};

}  // namespace quoin
