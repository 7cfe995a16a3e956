#include <bit>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>
#include <quoin/io/formats.h>
#include <quoin/io/loaded_scene.h>

#include "io/minecraft/bedrock_blocks.h"
#include "io/minecraft/block_types.h"
#include "io/minecraft/minecraft_for_tests.h"

namespace quoin::minecraft {
namespace {

using minecraft_test::NbtWriter;

struct StructureText {
  std::vector<int> size{2, 2, 3};
  std::vector<int> blocks{0, 1, 2, 3, 0, -1, 0, 0, 4, 3, 0, 0};  // by x, then y, then z
  std::vector<int> water{-1, -1, 5, -1, 5, 5, -1, -1, -1, -1, -1, -1};
};

/// Writes a structure of stone, stairs, a slab, a torch, an unknown block and water.
std::vector<std::byte> structure_of(const StructureText& text = {}) {
  NbtWriter nbt(std::endian::little);
  nbt.compound("").integer("format_version", 1).list("size", 3, text.size.size());
  for (const int edge : text.size) nbt.number(static_cast<std::uint64_t>(edge), 4);
  nbt.compound("structure").list("block_indices", 9, 2).integers(text.blocks).integers(text.water);
  nbt.list("entities", 10, 1).string("identifier", "minecraft:pig").end();
  nbt.compound("palette").compound("default").list("block_palette", 10, 6);
  const auto block = [&](const char* name) -> NbtWriter& {
    return nbt.string("name", name).integer("version", 18'000'000).compound("states");
  };
  block("minecraft:stone").string("stone_type", "granite").end().end();
  block("minecraft:oak_stairs").integer("weirdo_direction", 2).byte("upside_down_bit", 1).end().end();
  block("minecraft:stone_block_slab").string("stone_slab_type", "quartz").byte("top_slot_bit", 1).end().end();
  block("minecraft:torch").string("torch_facing_direction", "west").end().end();
  block("mod:strange").string("mod:mood", "odd").integer("mod:size", 3).end().end();
  block("minecraft:water").integer("liquid_depth", 0).end().end();
  nbt.compound("block_position_data").compound("7").compound("block_entity_data").end().end().end();
  nbt.end().end().end();
  nbt.list("structure_world_origin", 3, 3).number(0, 4).number(0, 4).number(0, 4);
  return nbt.end().bytes;
}

std::string bedrock_block_at(const LoadedScene& loaded, IVec3 voxel) {
  const Grid& grid = loaded.scene.grids()[loaded.scene.grids().handles().front()].grid;
  const VoxelType type = grid.get(voxel);
  return type == kAir ? "air" : to_string(block_text(loaded.scene.types[type], grid.data(voxel).state));
}

TEST(BedrockStructure, ReadsBlocksAtTheirPositions) {
  const auto bytes = structure_of();
  EXPECT_EQ(detect_format(bytes), FileFormat::Schematic);
  const auto loaded = load_scene(bytes);
  ASSERT_TRUE(loaded) << to_string(loaded.error());
  const Grid& grid = loaded->scene.grids()[loaded->scene.grids().handles().front()].grid;
  EXPECT_EQ(grid.voxel_count(), 12);  // one of the two empty positions has water
  const auto at = [&](IVec3 voxel) { return bedrock_block_at(*loaded, voxel); };
  EXPECT_EQ(at({0, 0, 0}), "minecraft:granite[waterlogged=false]");
  EXPECT_EQ(at({0, 1, 1}), "minecraft:granite[waterlogged=true]");
  EXPECT_EQ(at({0, 0, 1}), "minecraft:oak_stairs[facing=south,half=top]");
  EXPECT_EQ(at({0, 0, 2}), "minecraft:quartz_slab[type=top,waterlogged=true]");
  EXPECT_EQ(at({0, 1, 0}), "minecraft:wall_torch[facing=east]");
  EXPECT_EQ(at({0, 1, 2}), "minecraft:water[level=0]");
  EXPECT_EQ(at({1, 0, 2}), "mod:strange[mood=odd,size=3]");
  EXPECT_EQ(at({1, 1, 0}), "minecraft:wall_torch[facing=east]");
  std::map<std::string, int> counts;
  for (int i = 0; i < 12; ++i) ++counts[at({i / 6, i / 3 % 2, i % 3})];
  EXPECT_EQ(counts["minecraft:granite[waterlogged=false]"], 5);
  EXPECT_EQ(counts["minecraft:granite[waterlogged=true]"], 1);
  EXPECT_EQ(counts["minecraft:wall_torch[facing=east]"], 2);
  std::string warnings;
  for (const std::string& line : loaded->warnings) warnings += line + "\n";
  EXPECT_NE(warnings.find("1 block entities"), std::string::npos);
  EXPECT_NE(warnings.find("1 entities"), std::string::npos);
  EXPECT_EQ(warnings.find("same voxels"), std::string::npos) << warnings;
}

// A voxel holds one block; a second one that is not water is only counted.
TEST(BedrockStructure, CountsSecondBlocksOfAVoxel) {
  StructureText text;
  text.water = {4, 4, 4, -1, 4, 4, -1, -1, -1, -1, 5, -1};
  const auto loaded = load_scene(structure_of(text));
  ASSERT_TRUE(loaded) << to_string(loaded.error());
  EXPECT_EQ(bedrock_block_at(*loaded, {0, 0, 0}), "minecraft:granite[waterlogged=false]");
  EXPECT_EQ(bedrock_block_at(*loaded, {0, 1, 2}), "mod:strange[mood=odd,size=3]") << "the only block there";
  std::string warnings;
  for (const std::string& line : loaded->warnings) warnings += line + "\n";
  EXPECT_NE(warnings.find("left out: 4 blocks in the same voxels as others (snow around flowers)"), std::string::npos)
      << warnings;
}

TEST(BedrockStructure, RefusesDamagedContent) {
  const auto error_of = [](const StructureText& text) {
    const auto loaded = load_scene(structure_of(text));
    return loaded ? std::string("none") : loaded.error().message;
  };
  EXPECT_EQ(error_of({}), "none");
  EXPECT_NE(error_of({.size = {2, 2}}).find("has no size"), std::string::npos);
  EXPECT_NE(error_of({.size = {2, 0, 3}}).find("invalid region size"), std::string::npos);
  EXPECT_NE(error_of({.size = {-2, -2, 3}}).find("invalid region size"), std::string::npos);
  EXPECT_NE(error_of({.size = {2, 2, 4}}).find("has 12 block indices"), std::string::npos);
  EXPECT_NE(error_of({.size = {1 << 20, 1 << 20, 1 << 20}}).find("too large"), std::string::npos);
  StructureText wrong;
  wrong.blocks[4] = 6;
  EXPECT_NE(error_of(wrong).find("beyond the 6 blocks"), std::string::npos);
  wrong.blocks[4] = -2;
  EXPECT_NE(error_of(wrong).find("beyond the 6 blocks"), std::string::npos);
  StructureText wrong_water;
  wrong_water.water[0] = 99;
  EXPECT_NE(error_of(wrong_water).find("beyond the 6 blocks"), std::string::npos);
  const auto whole = structure_of();
  for (std::size_t size = 0; size < whole.size(); ++size) {
    EXPECT_FALSE(load_scene(std::span(whole).first(size))) << size;
  }
  for (std::size_t at = 0; at < whole.size(); ++at) {
    auto changed = whole;
    changed[at] ^= std::byte{0x85};
    static_cast<void>(load_scene(changed));  // must not crash
  }
}

TEST(BedrockBlocks, BecomeBlocksOfTheJavaEdition) {
  const auto java = [](std::string_view name, const std::vector<Property>& states) {
    return to_string(java_block(name, states));
  };
  const std::vector<std::array<std::string, 2>> cases = {
      {java("minecraft:wool", {{"color", "silver"}}), "minecraft:light_gray_wool"},
      {java("minecraft:planks", {{"wood_type", "birch"}}), "minecraft:birch_planks"},
      {java("minecraft:oak_log", {{"pillar_axis", "x"}}), "minecraft:oak_log[axis=x]"},
      {java("minecraft:log2", {{"new_log_type", "acacia"}, {"pillar_axis", "z"}}), "minecraft:acacia_log[axis=z]"},
      {java("minecraft:grass", {}), "minecraft:grass_block"},
      {java("minecraft:snow_layer", {{"height", "3"}, {"covered_bit", "1"}}), "minecraft:snow[layers=4]"},
      {java("minecraft:wooden_door",
            {{"direction", "0"}, {"upper_block_bit", "1"}, {"door_hinge_bit", "1"}, {"open_bit", "0"}}),
       "minecraft:oak_door[facing=east,half=upper,hinge=right,open=false]"},
      {java("minecraft:spruce_trapdoor", {{"direction", "3"}, {"upside_down_bit", "1"}, {"open_bit", "1"}}),
       "minecraft:spruce_trapdoor[facing=north,half=top,open=true]"},
      {java("minecraft:fence_gate", {{"minecraft:cardinal_direction", "west"}, {"in_wall_bit", "0"}}),
       "minecraft:oak_fence_gate[facing=west,in_wall=false]"},
      {java("minecraft:ladder", {{"facing_direction", "5"}}), "minecraft:ladder[facing=east]"},
      {java("minecraft:piston", {{"facing_direction", "2"}}), "minecraft:piston[facing=south]"},
      {java("minecraft:sticky_piston", {{"facing_direction", "5"}}), "minecraft:sticky_piston[facing=west]"},
      {java("minecraft:end_rod", {{"facing_direction", "1"}}), "minecraft:end_rod[facing=up]"},
      {java("minecraft:dispenser", {{"facing_direction", "2"}}), "minecraft:dispenser[facing=north]"},
      {java("minecraft:observer", {{"minecraft:facing_direction", "up"}}), "minecraft:observer[facing=up]"},
      {java("minecraft:torch", {{"torch_facing_direction", "top"}}), "minecraft:torch"},
      {java("minecraft:unlit_redstone_torch", {{"torch_facing_direction", "north"}}),
       "minecraft:redstone_wall_torch[facing=south,lit=false]"},
      {java("minecraft:lit_furnace", {{"minecraft:cardinal_direction", "south"}}),
       "minecraft:furnace[facing=south,lit=true]"},
      {java("minecraft:cobblestone_wall", {{"wall_post_bit", "1"}, {"wall_connection_type_north", "short"}}),
       "minecraft:cobblestone_wall[north=low,up=true]"},
      {java("minecraft:oak_double_slab", {{"minecraft:vertical_half", "bottom"}}), "minecraft:oak_slab[type=double]"},
      {java("minecraft:golden_rail", {{"rail_direction", "2"}, {"rail_data_bit", "1"}}),
       "minecraft:powered_rail[powered=true,shape=ascending_east]"},
      {java("minecraft:lever", {{"lever_direction", "south"}, {"open_bit", "1"}}),
       "minecraft:lever[face=wall,facing=south,powered=true]"},
      {java("minecraft:stone_button", {{"facing_direction", "1"}, {"button_pressed_bit", "0"}}),
       "minecraft:stone_button[face=floor,facing=north,powered=false]"},
      {java("minecraft:wheat", {{"growth", "7"}}), "minecraft:wheat[age=7]"},
      {java("minecraft:bed", {{"direction", "2"}, {"head_piece_bit", "1"}, {"occupied_bit", "0"}}),
       "minecraft:red_bed[facing=north,occupied=false,part=head]"},
      // Others keep their names and states.
      {java("minecraft:new_thing", {{"minecraft:glow", "2"}}), "minecraft:new_thing[glow=2]"},
      {java("mod:planks", {{"wood_type", "birch"}}), "mod:planks[wood_type=birch]"},
      {java("minecraft:wool", {}), "minecraft:wool"},
      {java("", {}), "minecraft:"},
  };
  for (const auto& [made, expected] : cases) EXPECT_EQ(made, expected);
}

}  // namespace
}  // namespace quoin::minecraft
