#include "io/packs/pack_looks.h"
#include "io/packs/pack_own.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <quoin/core/image.h>
#include <quoin/io/image_files.h>

#include "io/minecraft/minecraft.h"
#include "io/minecraft/minecraft_for_tests.h"
#include "io/packs/pack_shapes.h"
#include "io/packs/packs_for_tests.h"
#include "io/zip.h"

namespace quoin::packs {
namespace {

using packs_test::block;
using packs_test::PackBuilder;
using packs_test::TypeAndState;

constexpr Rgba8 kRed{200, 20, 20};
constexpr Rgba8 kGreen{20, 200, 20};
constexpr Rgba8 kClear{0, 0, 0, 0};

// Adds blocks with one model in all states.
void add_block(PackBuilder& pack, const std::string& name, const std::string& model) {
  pack.model("block/" + name, model);
  pack.states(name, R"({"variants": {"": {"model": "block/)" + name + "\"}}}");
}

PackBuilder small_pack() {
  PackBuilder pack;
  packs_test::add_parents(pack);
  pack.texture("block/red", packs_test::plain_png(kRed));
  pack.texture("block/green", packs_test::plain_png(kGreen));
  pack.texture("block/leaf", packs_test::png(16, [](int x, int y) { return (x + y) % 2 == 0 ? kGreen : kClear; }));
  pack.texture("block/glass", packs_test::plain_png({100, 100, 200, 120}));
  add_block(pack, "stone", R"({"parent": "block/cube_all", "textures": {"all": "block/red"}})");
  add_block(pack, "oak_leaves", R"({"parent": "block/cube_all", "textures": {"all": "block/leaf"}})");
  add_block(pack, "blue_stained_glass", R"({"parent": "block/cube_all", "textures": {"all": "block/glass"}})");
  return pack;
}

VoxelProperties look(const PackBuilder& pack, const VoxelProperties& type) {
  return BlockLooks(pack.files()).applied(type);
}

BlockPackReport report_of(const PackBuilder& pack, const VoxelProperties& type) {
  BlockLooks looks(pack.files());
  EXPECT_TRUE(validate_type(looks.applied(type)));
  return looks.report();
}

// Returns the directions in which a type in a state shows a texture.
DirectionSet shows(const VoxelProperties& type, std::uint32_t state, const std::string& texture) {
  DirectionSet found;
  for (const Direction direction : kDirections) {
    if (turned_face(type.faces, direction, type.orientations.of(state)).texture.name() == texture)
      found.insert(direction);
  }
  return found;
}

const ShapeModel& shape_of(const VoxelProperties& type, std::uint32_t state) {
  return type.shapes.model(state, type.orientations.of(state), {});
}

TEST(PackLooks, CubesHaveFacesAndStayOpaque) {
  const VoxelProperties stone = look(small_pack(), block("minecraft:stone").type);
  ASSERT_FALSE(stone.faces.empty());
  EXPECT_TRUE(stone.shapes.empty());
  EXPECT_TRUE(stone.orientations.empty());
  EXPECT_EQ(stone.visibility, Visibility::Opaque);
  EXPECT_EQ(stone.faces[Direction::PosY].texture.name(), "minecraft:block/red");
  VoxelRegistry types;
  const auto added = types.add(stone);
  ASSERT_TRUE(added);
  EXPECT_EQ(types[*added].colour, kRed) << "the mean of its textures";
}

TEST(PackLooks, AlphaFollowsTexels) {
  const PackBuilder pack = small_pack();
  const VoxelProperties leaves = look(pack, block("minecraft:oak_leaves").type);
  EXPECT_EQ(leaves.visibility, Visibility::Transparent);
  EXPECT_EQ(leaves.faces[Direction::PosX].alpha, FaceAlpha::Cutout);
  const VoxelProperties glass = look(pack, block("minecraft:blue_stained_glass").type);
  EXPECT_EQ(glass.faces[Direction::PosX].alpha, FaceAlpha::Translucent);
}

TEST(PackLooks, OrientationsFollowStates) {
  PackBuilder pack = small_pack();
  pack.model("block/furnace", R"({"parent": "block/cube", "textures": {"north": "block/green", "south": "block/red",
    "west": "block/red", "east": "block/red", "up": "block/red", "down": "block/red"}})");
  pack.states(
      "furnace",
      R"({"variants": {"facing=north": {"model": "block/furnace"}, "facing=east": {"model": "block/furnace", "y": 90},
    "facing=south": {"model": "block/furnace", "y": 180}, "facing=west": {"model": "block/furnace", "y": 270}}})");
  pack.states("observer",
              R"({"variants": {"facing=up": {"model": "block/furnace", "x": 270},
        "facing=down": {"model": "block/furnace", "x": 90}}})");
  const std::vector<std::pair<std::string, Direction>> facings = {
      {"north", Direction::NegZ}, {"east", Direction::PosX}, {"south", Direction::PosZ}, {"west", Direction::NegX}};
  for (const auto& [facing, direction] : facings) {
    const TypeAndState furnace = block("minecraft:furnace", {{"facing", facing}, {"lit", "false"}});
    const VoxelProperties made = look(pack, furnace.type);
    ASSERT_TRUE(made.shapes.empty());
    EXPECT_EQ(shows(made, furnace.state, "minecraft:block/green"), DirectionSet{direction}) << facing;
  }
  for (const bool is_up : {false, true}) {
    const TypeAndState observer =
        block("minecraft:observer", {{"facing", is_up ? "up" : "down"}, {"powered", "false"}});
    const VoxelProperties made = look(pack, observer.type);
    EXPECT_EQ(shows(made, observer.state, "minecraft:block/green"),
              DirectionSet{is_up ? Direction::PosY : Direction::NegY});
  }
}

TEST(PackLooks, ShapesFollowStates) {
  PackBuilder pack = small_pack();
  const std::string textures = R"("textures": {"top": "block/red", "bottom": "block/red", "side": "block/green"})";
  pack.model("block/oak_slab", R"({"parent": "block/slab", )" + textures + "}");
  pack.model("block/oak_slab_top",
             R"({"elements": [{"from": [0, 8, 0], "to": [16, 16, 16], "faces": {"up": {"texture": "block/red"}}}]})");
  pack.model("block/oak_planks", R"({"parent": "block/cube_all", "textures": {"all": "block/red"}})");
  pack.states("oak_slab",
              R"({"variants": {"type=bottom": {"model": "block/oak_slab"}, "type=top": {"model": "block/oak_slab_top"},
    "type=double": {"model": "block/oak_planks"}}})");
  const auto model = [&](const char* type) {
    const TypeAndState slab = block("minecraft:oak_slab", {{"type", type}, {"waterlogged", "false"}});
    const VoxelProperties made = look(pack, slab.type);
    EXPECT_EQ(made.visibility, Visibility::Opaque);
    return std::pair(shape_of(made, slab.state).min, shape_of(made, slab.state).max);
  };
  EXPECT_EQ(model("bottom"), std::pair(Vec3(0.0F), Vec3(1.0F, 0.5F, 1.0F)));
  EXPECT_EQ(model("top"), std::pair(Vec3(0.0F, 0.5F, 0.0F), Vec3(1.0F)));
  EXPECT_EQ(model("double"), std::pair(Vec3(0.0F), Vec3(1.0F)));
}

TEST(PackLooks, CombinesPartsOfFences) {
  PackBuilder pack = small_pack();
  const std::string textures = R"("textures": {"top": "block/red", "bottom": "block/red", "side": "block/red"})";
  pack.model("block/post", R"({"parent": "block/fence_post", )" + textures + "}");
  pack.model("block/side", R"({"parent": "block/fence_side", )" + textures + "}");
  pack.states("oak_fence", R"({"multipart": [{"apply": {"model": "block/post"}},
    {"when": {"north": "true"}, "apply": {"model": "block/side", "uvlock": true}},
    {"when": {"east": "true"}, "apply": {"model": "block/side", "y": 90, "uvlock": true}},
    {"when": {"south": "true"}, "apply": {"model": "block/side", "y": 180, "uvlock": true}},
    {"when": {"west": "true"}, "apply": {"model": "block/side", "y": 270, "uvlock": true}}]})");
  const TypeAndState fence =
      block("minecraft:oak_fence", {{"north", "false"}, {"south", "false"}, {"west", "false"}, {"east", "true"}});
  const VoxelProperties made = look(pack, fence.type);
  const ShapeModel& model = shape_of(made, fence.state);
  EXPECT_EQ(model.boxes.size(), 3U);
  EXPECT_EQ(model.min, Vec3(0.375F, 0.0F, 0.375F));
  EXPECT_EQ(model.max, Vec3(1.0F, 1.0F, 0.625F));
  // Without sides in the state, neighbours count.
  const VoxelProperties old = look(pack, block("minecraft:oak_fence").type);
  EXPECT_EQ(old.shapes.rules().neighbours, ShapeNeighbours::Connected);
  EXPECT_EQ(old.shapes.model(0, {}, {.connected = {Direction::NegX}}).max.x, 0.625F);
  EXPECT_EQ(old.shapes.model(0, {}, {.connected = {Direction::NegX}}).min.x, 0.0F);
}

// Variants of stairs as packs have them: a model for straight stairs and one for each kind of corner.
std::string variants_of_stairs() {
  std::string all;
  const std::array<const char*, 4> facings = {"east", "south", "west", "north"};
  for (int facing = 0; facing < 4; ++facing) {
    for (const bool is_top : {false, true}) {
      for (const std::string shape : {"straight", "inner_left", "inner_right", "outer_left", "outer_right"}) {
        int y = facing;
        if (shape.ends_with("left") && !is_top) y += 3;
        if (shape.ends_with("right") && is_top) y += 1;
        const std::string model = shape.substr(0, shape.find('_'));
        all += (all.empty() ? "" : ", ") + std::string("\"facing=") + facings[static_cast<std::size_t>(facing)] +
               ",half=" + (is_top ? "top" : "bottom") + ",shape=" + shape + R"(": {"model": "block/)" + model +
               R"(", "uvlock": true, "x": )" + (is_top ? "180" : "0") + R"(, "y": )" + std::to_string(90 * (y % 4)) +
               "}";
      }
    }
  }
  return R"({"variants": {)" + all + "}}";
}

TEST(PackLooks, StairsOfOldWorldsFollowNeighbours) {
  PackBuilder pack = small_pack();
  const auto model = [&](const std::string& name, const std::string& more) {
    pack.model("block/" + name,
               R"({"elements": [{"from": [0, 0, 0], "to": [16, 8, 16], "faces": {"up": {"texture": "block/red"}}})" +
                   more + "]}");
  };
  const auto box = [](const std::string& from, const std::string& to) {
    return R"(, {"from": [)" + from + R"(], "to": [)" + to + R"(], "faces": {"up": {"texture": "block/green"}}})";
  };
  model("straight", box("8, 8, 0", "16, 16, 16"));
  model("inner", box("8, 8, 0", "16, 16, 16") + box("0, 8, 8", "8, 16, 16"));
  model("outer", box("8, 8, 8", "16, 16, 16"));
  pack.states("oak_stairs", variants_of_stairs());
  // The models of worlds that store the shape are the expected ones.
  const std::array<std::pair<const char*, StairCorner>, 5> shapes = {{{"straight", StairCorner::Straight},
                                                                      {"inner_left", StairCorner::InnerLeft},
                                                                      {"inner_right", StairCorner::InnerRight},
                                                                      {"outer_left", StairCorner::OuterLeft},
                                                                      {"outer_right", StairCorner::OuterRight}}};
  for (const std::string facing : {"east", "south", "west", "north"}) {
    for (const std::string half : {"bottom", "top"}) {
      const TypeAndState old = block("minecraft:oak_stairs", {{"facing", facing}, {"half", half}});
      const VoxelProperties of_old = look(pack, old.type);
      EXPECT_EQ(of_old.shapes.rules().neighbours, ShapeNeighbours::Stairs);
      const AxisOrientation turn = of_old.orientations.of(old.state);
      EXPECT_EQ(turn.apply(Direction::PosY), half == "top" ? Direction::NegY : Direction::PosY);
      for (const auto& [shape, corner] : shapes) {
        const TypeAndState today =
            block("minecraft:oak_stairs", {{"facing", facing}, {"half", half}, {"shape", shape}});
        const VoxelProperties of_today = look(pack, today.type);
        // Left is on the left of a person who walks up: in the game also for stairs upside down.
        StairCorner wanted = corner;
        if (half == "top" && corner != StairCorner::Straight) {
          wanted = static_cast<StairCorner>(((static_cast<int>(corner) - 1) ^ 1) + 1);
        }
        const ShapeModel& made = of_old.shapes.model(old.state, turn, {.corner = wanted});
        EXPECT_EQ(made.bits, shape_of(of_today, today.state).bits) << facing << " " << half << " " << shape;
        EXPECT_FALSE(made.empty());
      }
    }
  }
}

TEST(PackLooks, StairsWithoutAllVariantsAreStraight) {
  PackBuilder pack = small_pack();
  pack.model("block/low",
             R"({"elements": [{"from": [0, 0, 0], "to": [16, 8, 16], "faces": {"up": {"texture": "block/red"}}}]})");
  pack.model("block/high",
             R"({"elements": [{"from": [0, 0, 0], "to": [16, 9, 16], "faces": {"up": {"texture": "block/red"}}}]})");
  pack.states(
      "oak_stairs",
      R"({"variants": {"shape=straight": {"model": "block/low"}, "shape=inner_left": {"model": "block/high"}}})");
  const TypeAndState stairs = block("minecraft:oak_stairs", {{"facing", "west"}, {"half", "top"}});
  const VoxelProperties made = look(pack, stairs.type);
  ASSERT_FALSE(made.shapes.empty());
  EXPECT_EQ(made.shapes.rules().neighbours, ShapeNeighbours::None);
  EXPECT_EQ(shape_of(made, stairs.state).max.y, 0.5F);
  pack.states("oak_stairs", R"({"variants": {"shape=inner_left": {"model": "block/high"}}})");
  EXPECT_EQ(report_of(pack, stairs.type).without_look, 1U);
}

TEST(PackLooks, FieldsOfOtherProgramsAreNoHang) {
  PackBuilder pack = small_pack();
  pack.states("oak_stairs", variants_of_stairs());
  VoxelProperties type = block("minecraft:oak_stairs", {{"facing", "east"}, {"half", "top"}}).type;
  for (const char* layout :
       {"facing:w3,half:w29", "facing:w31", "facing:w0,half:w2", "facing:n5,half:b1", ":", "facing"}) {
    type.attributes[minecraft::kStatesAttribute] = layout;
    type.state_bits = 32;
    EXPECT_TRUE(validate_type(look(pack, type))) << layout;
  }
}

TEST(PackLooks, BlendsOverlaysWithTints) {
  PackBuilder pack = small_pack();
  pack.texture("block/grey", packs_test::plain_png({255, 255, 255}));
  pack.texture("block/over", packs_test::png(16, [](int, int y) { return y < 8 ? Rgba8{255, 255, 255} : kClear; }));
  const std::string sides =
      R"("north": {"texture": "#s"}, "south": {"texture": "#s"}, "west": {"texture": "#s"}, "east": {"texture": "#s"})";
  std::string tinted = sides;
  for (std::size_t at = tinted.find("#s\""); at != std::string::npos; at = tinted.find("#s\"", at + 1)) {
    tinted.replace(at, 3, "#over\", \"tintindex\": 0");
  }
  add_block(pack, "grass_block",
            R"({"textures": {"s": "block/red", "over": "block/over", "top": "block/grey"}, "elements": [
    {"from": [0, 0, 0], "to": [16, 16, 16], "faces": {)" +
                sides + R"(, "down": {"texture": "#s"}, "up": {"texture": "#top", "tintindex": 0}}},
    {"from": [0, 0, 0], "to": [16, 16, 16], "faces": {)" +
                tinted + "}}]}");
  minecraft::BiomeTints tints;
  tints.grass = 0x30C040;
  const VoxelProperties grass = look(pack, block("minecraft:grass_block", {{"snowy", "false"}}, tints).type);
  ASSERT_FALSE(grass.faces.empty());
  EXPECT_TRUE(grass.shapes.empty()) << "one cube";
  EXPECT_EQ(grass.faces[Direction::PosY].tint, (Rgba8{0x30, 0xC0, 0x40}));
  const VoxelFace& side = grass.faces[Direction::PosX];
  EXPECT_EQ(side.alpha, FaceAlpha::Opaque);
  EXPECT_EQ(side.texture.level(0)[0], (Rgba8{0x30, 0xC0, 0x40}));
  EXPECT_EQ(side.texture.level(0)[8 * 16], kRed);
}

TEST(PackLooks, FluidsHaveHeights) {
  PackBuilder pack = small_pack();
  pack.texture("block/water_still", packs_test::png(
                                        16,
                                        [](int, int y) {
                                          return y < 16 ? Rgba8{200, 200, 200, 180} : kRed;
                                        },
                                        4));
  pack.put("textures/block/water_still.png.mcmeta", R"({"animation": {"frametime": 2}})");
  pack.texture("block/water_flow", packs_test::png(32, [](int x, int y) {
                 return x < 16 && y < 16 ? Rgba8{100, 100, 100, 180} : kRed;
               }));
  const TypeAndState water = block("minecraft:water", {{"level", "3"}});
  const VoxelProperties made = look(pack, water.type);
  ASSERT_FALSE(made.shapes.empty());
  EXPECT_EQ(made.shapes.rules().neighbours, ShapeNeighbours::Fluid);
  EXPECT_EQ(water.state & 7U, 3U);
  EXPECT_EQ(made.visibility, Visibility::Transparent);
  EXPECT_EQ(made.faces[Direction::PosY].texture.size(), 16);
  EXPECT_EQ(made.faces[Direction::PosY].texture.level(0)[255], (Rgba8{200, 200, 200, 180})) << "the first frame";
  EXPECT_EQ(made.faces[Direction::PosX].texture.size(), 16);
  EXPECT_EQ(made.faces[Direction::PosX].texture.level(0)[255], (Rgba8{100, 100, 100, 180})) << "a quarter of the image";
  EXPECT_EQ(made.faces[Direction::PosX].tint, (Rgba8{0x3F, 0x76, 0xE4}));
}

TEST(PackLooks, WaterloggedBlocksContainWater) {
  PackBuilder pack = small_pack();
  pack.texture("block/water_still", packs_test::plain_png({200, 200, 200, 180}));
  add_block(pack, "oak_slab", R"({"elements": [{"from": [0, 0, 0], "to": [16, 8, 16],
        "faces": {"up": {"texture": "block/red"}, "north": {"texture": "block/red"}}}]})");
  add_block(pack, "seagrass", R"({"elements": [{"from": [0, 0, 8], "to": [16, 16, 8],
        "faces": {"north": {"texture": "block/leaf"}, "south": {"texture": "block/leaf"}}}]})");
  const VoxelProperties water = look(pack, block("minecraft:water", {{"level", "0"}}).type);
  const auto fluid_of = [&](const TypeAndState& from) -> std::uint32_t {
    const VoxelProperties made = look(pack, from.type);
    EXPECT_TRUE(validate_type(made));
    const ShapeRules& rules = made.shapes.rules();
    return rules.fluid && rules.fluid->is_present(from.state) ? rules.fluid->groups : 0;
  };
  const std::uint32_t groups = water.shapes.rules().groups;
  EXPECT_EQ(fluid_of(block("minecraft:oak_slab", {{"type", "bottom"}, {"waterlogged", "true"}})), groups);
  EXPECT_EQ(fluid_of(block("minecraft:oak_slab", {{"type", "bottom"}, {"waterlogged", "false"}})), 0U);
  EXPECT_EQ(fluid_of(block("minecraft:oak_slab", {{"type", "bottom"}})), 0U);
  EXPECT_EQ(fluid_of(block("minecraft:seagrass", {})), groups);
  // Water of another biome is of the same kind, lava is not.
  EXPECT_NE(groups & look(pack, block("minecraft:bubble_column", {{"drag", "true"}}).type).shapes.rules().groups, 0U);
  pack.texture("block/lava_still", packs_test::plain_png(kRed));
  EXPECT_EQ(groups & look(pack, block("minecraft:lava", {{"level", "0"}}).type).shapes.rules().groups, 0U);
}

TEST(PackLooks, WiresAreColouredByPower) {
  PackBuilder pack = small_pack();
  pack.states("redstone_wire", R"({"multipart": [{"apply": {"model": "block/dot"}}]})");
  pack.model("block/dot",
             R"({"elements": [{"from": [0, 0.25, 0], "to": [16, 0.25, 16],
        "faces": {"up": {"texture": "block/red", "tintindex": 0}}}]})");
  const auto tint = [&](const char* power) {
    const TypeAndState wire = block("minecraft:redstone_wire", {{"power", power}});
    const VoxelProperties made = look(pack, wire.type);
    const ShapeModel& model = shape_of(made, wire.state);
    return model.faces.size() == 1 ? look_of(model, model.faces[0], made.faces)->tint : Rgba8{};
  };
  EXPECT_EQ(tint("0"), (Rgba8{76, 0, 0}));
  EXPECT_EQ(tint("15"), (Rgba8{255, 50, 0}));
}

TEST(PackLooks, TintsOfStatesKeepTheirVariants) {
  PackBuilder pack = small_pack();
  for (const std::string texture : {"red", "green"}) {
    pack.model("block/" + texture, R"({"elements": [{"from": [0, 4, 0], "to": [16, 4, 16],
        "faces": {"up": {"texture": "block/)" +
                                       texture + R"(", "tintindex": 0}}}]})");
  }
  pack.states("melon_stem", R"({"variants": {"age=7": {"model": "block/red"}, "": {"model": "block/green"}}})");
  for (int age = 0; age < 8; ++age) {
    const TypeAndState stem = block("minecraft:melon_stem", {{"age", std::to_string(age)}});
    const VoxelProperties made = look(pack, stem.type);
    const ShapeModel& model = shape_of(made, stem.state);
    ASSERT_EQ(model.faces.size(), 1U) << age;
    const VoxelFace* const face = look_of(model, model.faces[0], made.faces);
    EXPECT_EQ(face->texture.name(), age == 7 ? "minecraft:block/red" : "minecraft:block/green") << age;
    EXPECT_EQ(face->tint.r, age * 32) << age;
  }
}

TEST(PackLooks, TexturesOfOldPacksAreFound) {
  auto below = std::make_shared<MemoryPack>();
  auto above = std::make_shared<MemoryPack>();
  below->put("assets/minecraft/textures/block/stone.png", packs_test::plain_png(kRed));
  above->put("assets/minecraft/textures/blocks/stone.png", packs_test::plain_png(kGreen));
  below->put("assets/minecraft/blockstates/stone.json", R"({"variants": {"normal": {"model": "stone"}}})");
  below->put("assets/minecraft/models/block/stone.json", R"({"elements": [{"from": [0, 0, 0], "to": [16, 16, 16],
    "faces": {"up": {"texture": "block/stone"}}}]})");
  BlockLooks looks(std::make_shared<PackStack>(std::vector<std::shared_ptr<const PackFiles>>{below, above}));
  const VoxelProperties stone = looks.applied(block("minecraft:stone").type);
  ASSERT_FALSE(stone.faces.empty());
  EXPECT_EQ(stone.faces[Direction::PosY].texture.level(0)[0], kGreen);
}

TEST(PackLooks, ReportsMissingParts) {
  PackBuilder pack = small_pack();
  EXPECT_EQ(report_of(pack, block("minecraft:stone").type).without_look, 0U);
  EXPECT_EQ(to_string(report_of(pack, block("minecraft:stone").type)), "");
  EXPECT_EQ(report_of(pack, VoxelProperties{.name = "minecraft:stone"}).types, 0U) << "not of a Minecraft file";
  const BlockPackReport absent = report_of(pack, block("minecraft:dirt").type);
  EXPECT_EQ(to_string(absent), "resource packs: 1 block type of 1 without a look: minecraft:dirt (not in the packs)");
  add_block(pack, "sand", R"({"parent": "block/cube_all", "textures": {"all": "block/sand"}})");
  const BlockPackReport untextured = report_of(pack, block("minecraft:sand").type);
  EXPECT_EQ(untextured.missing_textures, 1U);
  EXPECT_EQ(untextured.without_look, 0U);
  pack.texture("block/sand", std::string("\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\x40\0\0\0\x40\0\x08\6\0\0\0", 29));
  const BlockPackReport large = report_of(pack, block("minecraft:sand").type);
  ASSERT_EQ(large.names.size(), 1U);
  EXPECT_NE(large.names[0].find("16384 x 16384"), std::string::npos) << large.names[0];
  pack.states("clay", R"({"variants": {"": {"model": "block/none"}}})");
  EXPECT_EQ(report_of(pack, block("minecraft:clay").type).missing_models, 1U);
  pack.states("gravel", "[");
  const BlockPackReport broken = report_of(pack, block("minecraft:gravel").type);
  ASSERT_EQ(broken.names.size(), 1U);
  EXPECT_NE(broken.names[0].find("assets/minecraft/blockstates/gravel.json"), std::string::npos);
}

TEST(PackLooks, SplitsModelsOfManyElements) {
  PackBuilder pack = small_pack();
  const auto boxes = [](int count) {
    std::string all;
    for (int i = 0; i < count; ++i) {
      all += (i == 0 ? "" : ", ") +
             (R"({"from": [0, )" + std::to_string(i % 15) + R"(, 0], "to": [)" + std::to_string(1 + i % 16)) +
             R"(, 15.5, 16], "faces": {"up": {"texture": "block/red"}}})";
    }
    return R"({"elements": [)" + all + "]}";
  };
  add_block(pack, "anvil", boxes(200));
  const VoxelProperties anvil = look(pack, block("minecraft:anvil").type);
  ASSERT_FALSE(anvil.shapes.empty());
  EXPECT_EQ(anvil.shapes.rules().parts.size(), 2U);
  add_block(pack, "anvil", boxes(600));
  EXPECT_EQ(report_of(pack, block("minecraft:anvil").type).without_look, 1U);
}

TEST(PackLooks, OwnPackFillsModelsThatTheGameDraws) {
  PackBuilder pack = small_pack();
  add_block(pack, "chest", R"({"parent": "builtin/entity", "textures": {"particle": "block/red"}})");
  EXPECT_EQ(report_of(pack, block("minecraft:chest").type).without_look, 1U);
  PackBuilder own;
  add_block(own, "chest",
            R"({"elements": [{"from": [1, 0, 1], "to": [15, 14, 15], "faces": {"up": {"texture": "block/red"}}}]})");
  BlockLooks looks(pack.files(), own.files());
  const VoxelProperties chest = looks.applied(block("minecraft:chest").type);
  ASSERT_FALSE(chest.shapes.empty());
  EXPECT_EQ(chest.faces[Direction::PosY].texture.name(), "minecraft:block/red") << "a texture of the other pack";
  EXPECT_EQ(looks.report().without_look, 0U);
}

TEST(PackLooks, LimitsTheConditionsOfAType) {
  // Each case has 31 * 31 conditions.
  std::string cases;
  for (int i = 0; i < 16; ++i) {
    cases += (i == 0 ? "" : ",") + (R"({"apply": {"model": "block/stone", "y": )" + std::to_string(i % 4 * 90)) +
             R"(}, "when": {"a": "!0", "b": "!0"}})";
  }
  PackBuilder pack = small_pack();
  pack.states("thing", R"({"multipart": [)" + cases + "]}");
  const BlockPackReport report = report_of(pack, block("minecraft:thing", {{"a", "1"}, {"b", "2"}}).type);
  ASSERT_EQ(report.without_look, 1U);
  EXPECT_NE(report.names.at(0).find("conditions of a block"), std::string::npos) << report.names[0];
}

TEST(PackLooks, ReportsDamagedTexturesOnModelsOfTheOwnPack) {
  PackBuilder pack;
  pack.texture("block/red", "no image");
  BlockLooks looks(pack.files(), small_pack().files());
  EXPECT_FALSE(looks.applied(block("minecraft:stone").type) == block("minecraft:stone").type);
  const BlockPackReport report = looks.report();
  EXPECT_EQ(report.without_look, 0U);
  EXPECT_EQ(report.missing_textures, 1U);
  EXPECT_NE(to_string(report).find("block/red"), std::string::npos) << to_string(report);
}

TEST(PackLooks, ReportsNamesOnOneLine) {
  const BlockPackReport report = report_of(small_pack(), block("mod:a\x1B[2J\nb").type);
  EXPECT_EQ(report.names.at(0), "mod:a [2J b (not in the packs)");
}

TEST(PackLooks, OwnPackKeepsFluidsOfEarlierConversions) {
  PackBuilder red = small_pack();
  red.texture("block/water_still", packs_test::plain_png(kRed));
  PackBuilder own;
  own.texture("block/water_still", packs_test::plain_png(kGreen));
  const VoxelProperties water = block("minecraft:water", {{"level", "0"}}).type;
  const VoxelProperties converted = look(red, water);
  ASSERT_FALSE(converted.faces.empty());
  BlockLooks looks(small_pack().files(), own.files());
  EXPECT_EQ(looks.applied(converted), converted);
  const VoxelProperties fresh = looks.applied(water);
  ASSERT_FALSE(fresh.faces.empty());
  EXPECT_EQ(fresh.faces[Direction::PosY].texture.level(0)[0], kGreen);
  // A pack that has the texture replaces the look.
  BlockLooks both(red.files(), own.files());
  EXPECT_EQ(both.applied(fresh).faces[Direction::PosY].texture.level(0)[0], kRed);
}

TEST(PackShapes, DefaultTexturesStayWhenTheModelTurns) {
  PackElement cube;
  for (auto& face : cube.faces) face = PackFace{.texture = "#all"};
  PackElement box = cube;
  box.from = {1.0F, 2.0F, 3.0F};
  box.to = {9.0F, 12.0F, 16.0F};
  for (int x = 0; x < 4; ++x) {
    for (int y = 0; y < 4; ++y) {
      const AxisOrientation turn = orientation_of({.x = x, .y = y});
      const PackElement turned = turned_with_world(cube, turn);
      for (const auto& face : turned.faces) {
        EXPECT_EQ(face->turn, 0) << x << ", " << y;
        EXPECT_EQ(face->uv, (std::array<float, 4>{0.0F, 0.0F, 16.0F, 16.0F}));
      }
      // A box shows the part at its place, which the identity gives.
      const PackElement moved = turned_with_world(box, turn);
      PackElement plain = moved;
      for (auto& face : plain.faces) face->uv.reset();
      const PackElement expected = turned_with_world(plain, {});
      for (std::size_t i = 0; i < 6; ++i) {
        EXPECT_EQ(moved.faces[i]->uv, expected.faces[i]->uv) << x << ", " << y << ", face " << i;
        EXPECT_EQ(moved.faces[i]->turn, 0);
      }
      const PackElement back = turned_with_world(moved, turn.inverse());
      EXPECT_EQ(back.from, box.from);
      EXPECT_EQ(back.to, box.to);
    }
  }
}

TEST(PackShapes, PartsOfTexturesTurnWithTheWorld) {
  // A quarter turn about y moves the left half of the top to its upper half.
  PackElement plate;
  plate.faces[2] = PackFace{.texture = "#t", .uv = std::array<float, 4>{0.0F, 0.0F, 8.0F, 16.0F}};
  plate.to = {8.0F, 16.0F, 16.0F};
  const PackElement turned = turned_with_world(plate, orientation_of({.y = 1}));
  EXPECT_EQ(turned.from, Vec3(0.0F));
  EXPECT_EQ(turned.to, Vec3(16.0F, 16.0F, 8.0F));
  EXPECT_EQ(turned.faces[2]->uv, (std::array<float, 4>{0.0F, 0.0F, 16.0F, 8.0F}));
  EXPECT_EQ(turned.faces[2]->turn, 0);
}

std::vector<std::byte> bytes_of(std::string_view text) {
  const auto bytes = std::as_bytes(std::span(text));
  return {bytes.begin(), bytes.end()};
}

TEST(PackTextures, TakesTheFirstFrame) {
  const auto two = [](int, int y) { return y < 16 ? kRed : kGreen; };
  const std::vector<std::byte> bytes = bytes_of(packs_test::png(16, two, 2));
  const auto first = texture_of_png("a", bytes, R"({"animation": {}})");
  ASSERT_TRUE(first);
  EXPECT_EQ(first->texture.level(0)[0], kRed);
  EXPECT_EQ(first->texture.level(0)[255], kRed);
  const auto second = texture_of_png("a", bytes, R"({"animation": {"frames": [1, 0]}})");
  EXPECT_EQ(second->texture.level(0)[0], kGreen);
  const auto whole = texture_of_png("a", bytes);
  EXPECT_EQ(whole->texture.size(), 32);
  EXPECT_EQ(whole->texture.level(0)[0], kRed);
  EXPECT_EQ(whole->texture.level(0)[32 * 31], kGreen);
  for (const char* odd : {"[", "{}", R"({"animation": 1})", R"({"animation": {"frames": [{"index": -3}]}})",
                          R"({"animation": {"width": 0, "height": 99999}})", R"({"animation": {"frames": [7]}})"}) {
    EXPECT_TRUE(texture_of_png("a", bytes, odd)) << odd;
  }
}

TEST(PackTextures, SquareImagesHaveFramesToo) {
  PackBuilder pack = small_pack();
  const auto quarter = [](int x, int y) { return x < 16 && y < 16 ? kRed : kGreen; };
  pack.texture("block/sheet", packs_test::png(32, quarter));
  const auto files = pack.files();
  EXPECT_EQ((*TextureReader(*files).texture({"minecraft", "block/sheet"}))->texture.size(), 32);
  pack.put("textures/block/sheet.png.mcmeta", R"({"animation": {"width": 16, "height": 16}} // four frames)");
  const PackTexture first = **TextureReader(*files).texture({"minecraft", "block/sheet"});
  EXPECT_EQ(first.texture.size(), 16);
  EXPECT_EQ(first.texture.mean(), linear_colour(kRed));
  pack.put("textures/block/sheet.png.mcmeta", R"({"animation": {}})");
  EXPECT_EQ((*TextureReader(*files).texture({"minecraft", "block/sheet"}))->texture.size(), 32);
}

TEST(PackTextures, LongImagesAreSampledInTheirWholeHeight) {
  constexpr int kHeight = 1 << 19;
  AlphaImage image{1, kHeight, {}};
  image.rgba.assign(std::size_t{4} * kHeight, 255);
  for (std::size_t row = kHeight / 2; row < kHeight; ++row) image.rgba[4 * row] = 0;
  const auto png = write_png(image);
  ASSERT_TRUE(png);
  const auto made = texture_of_png("a", *png);
  ASSERT_TRUE(made) << made.error().message;
  ASSERT_EQ(made->texture.size(), 1'024);
  EXPECT_EQ(made->texture.level(0)[511 * 1'024].r, 255);
  EXPECT_EQ(made->texture.level(0)[512 * 1'024].r, 0);
  EXPECT_EQ(made->texture.level(0)[1'023 * 1'024].r, 0);
}

TEST(PackTextures, LargeTexturesKeepTheirImageUntilTheyAreRead) {
  const std::string large = packs_test::png(128, [](int x, int y) {
    return Rgba8{static_cast<std::uint8_t>(x), static_cast<std::uint8_t>(y), 7, static_cast<std::uint8_t>(x * y % 3)};
  });
  const auto made = texture_of_png("a", bytes_of(large));
  ASSERT_TRUE(made);
  EXPECT_FALSE(made->texture.has_texels());
  EXPECT_EQ(made->alpha, FaceAlpha::Cutout) << "nearly clear everywhere";
  EXPECT_EQ(made->texture.level(0)[128 * 5 + 9], (Rgba8{9, 5, 7, 0})) << "as exact as when it was measured";
  EXPECT_TRUE(made->texture.has_texels());
  EXPECT_TRUE(texture_of_png("a", bytes_of(packs_test::plain_png(kRed)))->texture.has_texels()) << "a small one";
}

TEST(PackTextures, AcceptsOtherSizesAndRejectsOtherFiles) {
  const std::string small = packs_test::plain_png(kRed, 8);
  EXPECT_EQ(texture_of_png("a", bytes_of(small))->texture.size(), 16);
  const std::string odd = packs_test::plain_png(kRed, 48);
  EXPECT_EQ(texture_of_png("a", bytes_of(odd))->texture.size(), 64);
  EXPECT_FALSE(texture_of_png("a", {}));
  EXPECT_FALSE(texture_of_png("a", bytes_of(small.substr(0, 40))));
  const std::string nearly = packs_test::plain_png({1, 2, 3, 252});
  EXPECT_EQ(texture_of_png("a", bytes_of(nearly))->alpha, FaceAlpha::Opaque);
}

// Returns a zip file with the looks of stone and of stairs in all states.
std::vector<std::byte> zip_of_stone_and_stairs() {
  ZipFile zip;
  const auto put = [&](const char* name, const std::string& content) {
    zip.begin(std::string("assets/minecraft/") + name);
    zip.put(content);
  };
  std::string faces;
  for (const char* side : {"down", "up", "north", "south", "west", "east"}) {
    faces += (faces.empty() ? "\"" : ", \"") + std::string(side) + R"(": {"texture": "block/red"})";
  }
  put("textures/block/red.png", packs_test::plain_png(kRed));
  put("models/block/stone.json",
      R"({"elements": [{"from": [0, 0, 0], "to": [16, 16, 16], "faces": {)" + faces + "}}]}");
  put("models/block/low.json", R"({"elements": [{"from": [0, 0, 0], "to": [16, 8, 16], "faces": {)" + faces + "}}]}");
  put("blockstates/stone.json", R"({"variants": {"": {"model": "block/stone"}}})");
  put("blockstates/oak_stairs.json", R"({"variants": {"": {"model": "block/low"}}})");
  return *zip.take();
}

TEST(BlockPacks, GivesTypesOfChunkSourcesLooks) {
  const std::vector<std::byte> region = minecraft_test::region_with(minecraft_test::chunk_of_stairs(0));
  auto plain = minecraft::open_minecraft(region);
  auto inner = minecraft::open_minecraft(region);
  ASSERT_TRUE(plain && inner);
  const auto packs = BlockPacks::open(std::vector<std::vector<std::byte>>{zip_of_stone_and_stairs()});
  ASSERT_TRUE(packs) << packs.error().message;
  const std::unique_ptr<ChunkSource> source = with_packs(std::move(*inner), *packs);
  EXPECT_EQ(source->types().size(), 1U) << "no part was read";
  const auto part = source->read_part(0);
  const auto plain_part = (*plain)->read_part(0);
  ASSERT_TRUE(part && plain_part);
  const VoxelRegistry types = source->types();
  const VoxelRegistry plain_types = (*plain)->types();
  ASSERT_EQ(types.size(), plain_types.size());
  EXPECT_EQ(part->chunks.at(0).voxels.types(), plain_part->chunks.at(0).voxels.types());
  for (std::size_t i = 1; i < types.size(); ++i) {
    const VoxelProperties& type = types[static_cast<VoxelType>(i)];
    EXPECT_EQ(type.name, plain_types[static_cast<VoxelType>(i)].name);
    EXPECT_FALSE(type.faces.empty()) << type.name;
    EXPECT_EQ(type.shapes.empty(), type.name == "minecraft:stone");
  }
  EXPECT_EQ(to_string((*packs)->report()), "");
  EXPECT_EQ((*packs)->report().types, 2U);
}

TEST(BlockPacks, AppliesToRegistries) {
  VoxelRegistry types;
  const VoxelProperties stone = block("minecraft:stone").type;
  ASSERT_TRUE(types.add({.name = "other", .colour = kGreen}));
  const auto type = types.add(stone);
  const auto packs = BlockPacks::open(std::vector<std::vector<std::byte>>{});
  ASSERT_TRUE(packs);
  (*packs)->apply(types);
  EXPECT_EQ(types[*type], stone) << "no pack has it";
  EXPECT_EQ((*packs)->report().without_look, 1U);
  EXPECT_EQ((*packs)->report().types, 1U);
}

TEST(PackLooks, ModelsOfModsInheritFromOwnPack) {
  const auto files = std::make_shared<MemoryPack>();
  files->put("assets/mod/blockstates/lamp.json", R"({"variants": {"": {"model": "mod:block/lamp"}}})");
  files->put("assets/mod/models/block/lamp.json",
             R"({"parent": "minecraft:block/cube_all", "textures": {"all": "mod:block/lamp"}})");
  files->put("assets/mod/textures/block/lamp.png", packs_test::plain_png(kRed));
  files->put("assets/minecraft/blockstates/stone.json", "{");
  const VoxelProperties lamp = block("mod:lamp").type;
  EXPECT_EQ(BlockLooks(files).applied(lamp), lamp) << "no pack has the parent";
  BlockLooks looks(files, OwnPack::instance());
  const VoxelProperties made = looks.applied(lamp);
  ASSERT_FALSE(made.faces.empty());
  VoxelRegistry types;
  const auto added = types.add(made);
  ASSERT_TRUE(added);
  EXPECT_EQ(types[*added].colour, kRed);
  EXPECT_EQ(looks.report().replaced_looks, 0U);
  // A damaged look is replaced and named. Chests have no elements in packs of the game.
  EXPECT_FALSE(looks.applied(block("minecraft:stone").type).faces.empty());
  EXPECT_FALSE(looks.applied(block("minecraft:chest").type).shapes.empty());
  EXPECT_EQ(looks.report().replaced_looks, 1U);
  EXPECT_NE(to_string(looks.report()).find("1 look replaced by the own pack: minecraft:stone"), std::string::npos)
      << to_string(looks.report());
}

TEST(PackLooks, BlendedTexturesAreLimited) {
  PackBuilder pack;
  pack.texture("block/a", packs_test::plain_png(kGreen));
  pack.texture("block/b", packs_test::plain_png(kRed));
  TextureReader textures(*pack.files(), 16 * 16);
  const auto layer = [&](const char* name) {
    const auto read = textures.texture({"minecraft", std::string("block/") + name});
    EXPECT_TRUE(read && *read);
    return FaceLayer{.look = {.texture = (*read)->texture, .alpha = (*read)->alpha}};
  };
  const FaceLayer a = layer("a");
  const FaceLayer b = layer("b");
  EXPECT_NE(textures.blended(a, &b).look, a.look);
  EXPECT_EQ(textures.refused_blends(), 0U);
  EXPECT_NE(textures.blended(a, &b).look, a.look) << "made once";
  EXPECT_EQ(textures.blended(b, &a).look, b.look);
  EXPECT_EQ(textures.refused_blends(), 1U);
}

// Returns a model with one box of a height.
std::string box_of_height(int height) {
  return R"({"elements": [{"from": [0, 0, 0], "to": [16, )" + std::to_string(height) +
         R"(, 16], "faces": {"up": {"texture": "block/red"}}}]})";
}

float height_at(const VoxelProperties& type, std::uint32_t state, IVec3 at) {
  const auto position = static_cast<std::uint16_t>(position_number(at) % type.shapes.position_count());
  return type.shapes.model(state, type.orientations.of(state), {.position = position}).max.y * 16.0F;
}

TEST(PackChoices, ModelsAreChosenByPositionAndWeight) {
  PackBuilder pack = small_pack();
  for (const int height : {1, 2, 3}) pack.model("block/h" + std::to_string(height), box_of_height(height));
  pack.states("dead_bush", R"({"variants": {"": [{"model": "block/h1"}, {"model": "block/h2", "weight": 2},
    {"model": "block/h3", "y": 90}]}})");
  const TypeAndState bush = block("minecraft:dead_bush");
  const VoxelProperties made = look(pack, bush.type);
  ASSERT_FALSE(made.shapes.empty());
  EXPECT_EQ(made.shapes.position_count(), 4U);
  for (int i = 0; i < 500; ++i) {
    const IVec3 at{i * 7 - 1'000, i % 19, 3 - i * 13};
    const std::uint32_t chance = position_number(at) % 4;
    EXPECT_EQ(height_at(made, bush.state, at), chance == 0 ? 1.0F : chance < 3 ? 2.0F : 3.0F);
  }
  // The same without weights: one model everywhere.
  pack.states("dead_bush", R"({"variants": {"": {"model": "block/h1"}}})");
  EXPECT_EQ(look(pack, bush.type).shapes.position_count(), 1U);
}

TEST(PackChoices, StatesHaveTheirOwnChoices) {
  PackBuilder pack = small_pack();
  for (const int height : {1, 2, 3, 4}) pack.model("block/h" + std::to_string(height), box_of_height(height));
  pack.states("snow", R"({"variants": {"layers=1": [{"model": "block/h1"}, {"model": "block/h2"}],
    "layers=2": [{"model": "block/h3", "weight": 2}, {"model": "block/h4"}], "": {"model": "block/h4"}}})");
  const auto of_layers = [&](const char* layers) { return block("minecraft:snow", {{"layers", layers}}); };
  const VoxelProperties made = look(pack, of_layers("1").type);
  EXPECT_EQ(made.shapes.position_count(), 6U);
  for (int i = 0; i < 100; ++i) {
    const IVec3 at{i, 2 * i, -i};
    const std::uint32_t number = position_number(at);
    EXPECT_EQ(height_at(made, of_layers("1").state, at), number % 2 == 0 ? 1.0F : 2.0F);
    EXPECT_EQ(height_at(made, of_layers("2").state, at), number % 3 < 2 ? 3.0F : 4.0F);
    EXPECT_EQ(height_at(made, of_layers("5").state, at), 4.0F) << "the variant without properties";
  }
}

TEST(PackChoices, CubesStayCubes) {
  PackBuilder pack = small_pack();
  pack.states("stone", R"({"variants": {"": [{"model": "block/stone"}, {"model": "block/stone", "y": 90}]}})");
  const VoxelProperties stone = look(pack, block("minecraft:stone").type);
  EXPECT_FALSE(stone.faces.empty());
  EXPECT_TRUE(stone.shapes.empty());
  EXPECT_TRUE(stone.orientations.empty());
}

TEST(PackChoices, TooManyAreNamed) {
  PackBuilder pack = small_pack();
  pack.model("block/h1", box_of_height(1));
  pack.model("block/h2", box_of_height(2));
  pack.states("dead_bush", R"({"variants": {"": [{"model": "block/h1"}, {"model": "block/h2", "weight": 4096}]}})");
  BlockLooks looks(pack.files());
  const TypeAndState bush = block("minecraft:dead_bush");
  const VoxelProperties heavy = looks.applied(bush.type);
  EXPECT_EQ(heavy.shapes.position_count(), 1U);
  EXPECT_EQ(height_at(heavy, bush.state, {1, 2, 3}), 2.0F) << "the heaviest one";
  EXPECT_EQ(looks.report().without_choices, 1U);
  EXPECT_NE(
      to_string(looks.report()).find("1 block type without choices by position: minecraft:dead_bush (the weights"),
      std::string::npos)
      << to_string(looks.report());
  std::string many;
  for (int i = 0; i < 65; ++i) {
    const std::string name = "block/m" + std::to_string(i);
    pack.model(name, box_of_height(1 + i % 15));
    many += (i == 0 ? "{" : ", {") + (R"("model": ")" + name + "\"}");
  }
  pack.states("dead_bush", R"({"variants": {"": [)" + many + "]}}");
  EXPECT_EQ(report_of(pack, bush.type).without_choices, 1U) << "more than 64 parts";
}

TEST(PackLooks, UsesTheFirstVariant) {
  PackBuilder pack = small_pack();
  for (const int height : {1, 2, 3}) pack.model("block/h" + std::to_string(height), box_of_height(height));
  // The variant without properties shows in all states without another one; overlapping variants do not add up.
  pack.states("snow", R"({"variants": {"layers=3": {"model": "block/h3"}, "": {"model": "block/h1"}}})");
  const auto height_of = [&](const char* layers) {
    const TypeAndState snow = block("minecraft:snow", {{"layers", layers}});
    return height_at(look(pack, snow.type), snow.state, IVec3(0));
  };
  EXPECT_EQ(height_of("3"), 3.0F);
  EXPECT_EQ(height_of("1"), 1.0F);
  EXPECT_EQ(height_of("8"), 1.0F);
  const TypeAndState snow = block("minecraft:snow", {{"layers", "3"}});
  EXPECT_EQ(look(pack, snow.type).shapes.model(snow.state, {}, {}).boxes.size(), 1U);
}

// Corners follow neighbours, so states alone do not turn a cube.
TEST(PackLooks, CornersOfStairsAreNoOrientations) {
  PackBuilder pack = small_pack();
  std::string variants;
  for (const char* facing : {"east", "south", "west", "north"}) {
    for (const char* half : {"bottom", "top"}) {
      for (const char* shape : {"straight", "inner_left", "inner_right", "outer_left", "outer_right"}) {
        variants += std::string(variants.empty() ? "" : ",") + "\"facing=" + facing + ",half=" + half +
                    ",shape=" + shape + R"(": {"model": "block/stone", "y": )" +
                    (shape == std::string("straight") ? "0" : "90") + "}";
      }
    }
  }
  pack.states("oak_stairs", R"({"variants": {)" + variants + "}}");
  const VoxelProperties old = look(pack, block("minecraft:oak_stairs", {{"facing", "west"}, {"half", "top"}}).type);
  ASSERT_FALSE(old.shapes.empty());
  EXPECT_EQ(old.shapes.rules().neighbours, ShapeNeighbours::Stairs);
}

TEST(PackLooks, ColourMapsGiveTintsByClimate) {
  PackBuilder pack = small_pack();
  add_block(pack, "grass_block", R"({"parent": "block/cube", "textures": {"up": "block/red", "down": "block/red",
    "north": "block/red", "south": "block/red", "east": "block/red", "west": "block/red"}})");
  pack.model("block/cube", R"({"elements": [{"from": [0, 0, 0], "to": [16, 16, 16], "faces": {
    "up": {"texture": "#up", "tintindex": 0}, "down": {"texture": "#down"}, "north": {"texture": "#north"},
    "south": {"texture": "#south"}, "east": {"texture": "#east"}, "west": {"texture": "#west"}}}]})");
  const auto tint_in = [&](const char* biome) {
    const TypeAndState grass = block("minecraft:grass_block", {{"snowy", "false"}}, minecraft::tints_of_biome(biome));
    return look(pack, grass.type).faces[Direction::PosY].tint;
  };
  EXPECT_EQ(tint_in("minecraft:plains"), minecraft::colour_of_rgb(0x91BD59)) << "without a map";
  // The map's red is its column, its green the row.
  pack.texture("colormap/grass", packs_test::png(256, [](int x, int y) {
                 return Rgba8{static_cast<std::uint8_t>(x), static_cast<std::uint8_t>(y), 77};
               }));
  const auto pixel = [](double share) { return static_cast<std::uint8_t>((1.0F - static_cast<float>(share)) * 255); };
  EXPECT_EQ(tint_in("minecraft:plains"), (Rgba8{pixel(0.8), pixel(0.8F * 0.4F), 77}));
  EXPECT_EQ(tint_in("minecraft:desert"), (Rgba8{0, 255, 77}));
  EXPECT_EQ(tint_in("minecraft:snowy_plains"), (Rgba8{255, 255, 77}));
  EXPECT_EQ(tint_in("minecraft:swamp"), minecraft::colour_of_rgb(0x6A7039)) << "not from a map";
  const Rgba8 forest = tint_in("minecraft:forest");
  const Rgba8 dark = tint_in("minecraft:dark_forest");
  EXPECT_EQ(dark.r, (forest.r / 2 * 2 + 0x28) / 2);
  EXPECT_EQ(dark.b, (76 + 0x0A) / 2);
  pack.texture("colormap/grass", packs_test::plain_png(kRed, 16));
  EXPECT_EQ(tint_in("minecraft:plains"), minecraft::colour_of_rgb(0x91BD59));
  const TypeAndState grass = block("minecraft:grass_block", {{"snowy", "false"}}, minecraft::BiomeTints());
  EXPECT_NE(to_string(report_of(pack, grass.type)).find("a colour map has 256 x 256 pixels"), std::string::npos);
}

TEST(BlockPacks, BuiltinPackHasEveryBlock) {
  const std::filesystem::path names[] = {kBuiltinPack};
  const auto packs = BlockPacks::open(names);
  ASSERT_TRUE(packs) << packs.error().message;
  const VoxelProperties stone = (*packs)->applied(block("minecraft:stone").type);
  EXPECT_FALSE(stone.faces.empty());
  EXPECT_TRUE(stone.shapes.empty());
  EXPECT_FALSE((*packs)->applied(block("mod:purple_fence").type).shapes.empty());
  EXPECT_EQ((*packs)->report().types, 2U);
  EXPECT_EQ((*packs)->report().without_look, 0U) << to_string((*packs)->report());
  // Looks that another pack gave stay.
  const auto red = BlockPacks::open(std::vector<std::vector<std::byte>>{zip_of_stone_and_stairs()});
  ASSERT_TRUE(red);
  const VoxelProperties red_stone = (*red)->applied(block("minecraft:stone").type);
  ASSERT_FALSE(red_stone.faces == stone.faces);
  EXPECT_EQ((*packs)->applied(red_stone), red_stone);
}

}  // namespace
}  // namespace quoin::packs
