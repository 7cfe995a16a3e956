#include "io/packs/pack_own.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <quoin/grid/texture.h>
#include <quoin/io/block_packs.h>
#include <quoin/io/image_files.h>

#include "io/minecraft/block_looks.h"
#include "io/minecraft/block_types.h"
#include "io/packs/families.h"
#include "io/packs/pack_looks.h"
#include "io/packs/patterns/pack_patterns.h"

namespace quoin::packs {
namespace {

using Json = nlohmann::json;

std::string text_of_own(const std::string& path) {
  const auto bytes = OwnPack::instance()->read(path, kMaxJsonBytes);
  if (!bytes) return "error: " + bytes.error().message;
  if (!*bytes) return "absent";
  return {reinterpret_cast<const char*>((*bytes)->data()), (*bytes)->size()};
}

AlphaImage own_texture(const std::string& name) {
  const auto png = OwnPack::instance()->read("assets/minecraft/textures/block/" + name + ".png", kMaxImageBytes);
  EXPECT_TRUE(png && *png) << name;
  auto image = read_alpha_image(**png);
  EXPECT_TRUE(image) << name;
  return std::move(*image);
}

/// A small valid table, in which tests replace a piece.
std::string families_with(const std::string& old, const std::string& by) {
  std::string text = R"({"models": [{"cube": ["0 0 0 16 16 16 *:all"]}],
    "families": [{"cube": {"models": {"": "cube"}, "states": ["> ."]},
                  "log": {"models": {"": "cube all=end"}, "states": ["axis=y > ."]}}]})";
  const std::size_t at = text.find(old);
  EXPECT_NE(at, std::string::npos) << old;
  return text.replace(at, old.size(), by);
}

constexpr const char* kRules = R"([["*_log", "log", "end={name}_top"], ["*", "cube", "all=quoin:{space}/{name}"]])";

std::string fault_of(const std::string& families, const std::string& rules = kRules) {
  const auto made = BlockFamilies::from_text(families, rules);
  return made ? "none" : made.error().message;
}

TEST(OwnPack, LongNamesHaveTheModelsOfShortOnes) {
  const BlockFamilies& families = OwnPack::instance()->families();
  const std::string name = "mod_" + std::string(200, '_') + "a_stairs";
  EXPECT_TRUE(families.model({"mod", "block/" + name}));
  EXPECT_FALSE(families.model({"mod", "block/" + name + "_none"}));
}

TEST(NamePatterns, MatchesStarsWithAsFewCharactersAsPossible) {
  EXPECT_EQ(match_name("*_stairs", "oak_stairs"), std::vector<std::string>{"oak"});
  EXPECT_EQ(match_name("dead_*_coral", "dead_tube_coral"), std::vector<std::string>{"tube"});
  EXPECT_EQ(match_name("*_b_*", "a_b_b_c"), (std::vector<std::string>{"a", "b_c"}));
  EXPECT_EQ(match_name("*_stairs", "_stairs"), std::nullopt);
  EXPECT_EQ(match_name("*_stairs", "stairs"), std::nullopt);
  EXPECT_EQ(match_name("stone", "stones"), std::nullopt);
}

TEST(NamePatterns, PrefersExactNamesThenTheFirstPattern) {
  NamePatterns names;
  ASSERT_TRUE(names.add("*_door *_gate", 0));
  ASSERT_TRUE(names.add("iron_door", 1));
  ASSERT_TRUE(names.add("*", 2));
  EXPECT_EQ(names.find("iron_door")->row, 1U);
  EXPECT_EQ(names.find("oak_door")->row, 0U);
  EXPECT_EQ(names.find("oak_door")->stars, std::vector<std::string>{"oak"});
  EXPECT_FALSE(names.find("oak_door")->is_fallback);
  EXPECT_TRUE(names.find("stone")->is_fallback);
  EXPECT_FALSE(names.add("iron_door", 3));
  EXPECT_FALSE(names.add("*a*b*", 3));
}

TEST(BlockFamilies, NamesFaultsOfTables) {
  EXPECT_EQ(fault_of(families_with("16 16 16", "16 16 16")), "none");
  const std::vector<std::array<std::string, 3>> cases = {
      {"16 16 16 *", "16 16 40 *", "invalid corner 40"},
      {"0 0 0 16", "20 0 0 16", "exchanged corners"},
      {"*:all", "", "needs six numbers"},
      {"*:all", "q:all", "unknown direction"},
      {"*:all", "*:all@0,0,20,8", "invalid texture part"},
      {"*:all", "*:all/45", "invalid texture turn"},
      {"*:all", "*:all turn=y,nan,8,8,8", "invalid turn"},
      {"\"0 0 0 16 16 16 *:all\"", "\"+other\"", "no earlier model"},
      {"\"cube\"}, \"states\"", "\"cone\"}, \"states\"", "no model for"},
      {"axis=y > .", "axis=y .", "needs '>'"},
      {"axis=y > .", "axis > .", "a property without a value"},
      {"axis=y > .", "axis=y > _top", "no model _top"},
      {"axis=y > .", "axis=y > . y=45", "invalid turn y=45"},
      {"axis=y > .", "axis=y > . spin:north", "unknown option spin"},
      {"axis=y > .", "axis=y > . facing:up", "unknown direction up"},
      {"\"states\": [\"> .\"]", "\"cases\": [\"> .\"]", "unknown key cases"},
      {"\"states\": [\"> .\"]", "\"states\": []", "must be a list"},
      {"\"models\": [{\"cube\"", "\"model\": [{\"cube\"", "no JSON object with models"},
  };
  for (const auto& [old, by, expected] : cases) {
    EXPECT_NE(fault_of(families_with(old, by)).find(expected), std::string::npos)
        << by << ": " << fault_of(families_with(old, by));
  }
}

TEST(BlockFamilies, NamesFaultsOfRules) {
  const std::string families = families_with("16 16 16", "16 16 16");
  EXPECT_NE(fault_of(families, "{}").find("no JSON list"), std::string::npos);
  EXPECT_NE(fault_of(families, R"([["a", "cube"]])").find("no rule for all names"), std::string::npos);
  EXPECT_NE(fault_of(families, R"([["a", "cone"]])").find("no family cone"), std::string::npos);
  EXPECT_NE(fault_of(families, R"([["a", 1]])").find("2 to 4 texts"), std::string::npos);
  EXPECT_NE(fault_of(families, R"([["a a", "cube"]])").find("in two rows"), std::string::npos);
  EXPECT_NE(fault_of(families, R"([["a", "cube", "all"]])").find("without a texture"), std::string::npos);
}

TEST(BlockFamilies, RenamesVariablesAndPutsNamesIntoTextures) {
  const auto made = BlockFamilies::from_text(families_with("16 16 16", "16 16 16"), kRules);
  ASSERT_TRUE(made);
  const Json model = Json::parse(*made->model({"minecraft", "block/oak_log"}));
  EXPECT_EQ(model["textures"]["end"], "minecraft:block/oak_log_top");
  EXPECT_EQ(model["elements"][0]["faces"]["up"]["texture"], "#end");
  EXPECT_EQ(Json::parse(made->block_state({"mod", "oak_log"}))["variants"]["axis=y"]["model"], "mod:block/oak_log");
  EXPECT_EQ(Json::parse(made->block_state({"mod", "thing"}))["variants"][""]["model"], "quoin:block/mod/thing");
  EXPECT_FALSE(made->model({"mod", "block/thing"}));
  EXPECT_TRUE(made->model({"quoin", "block/mod/thing"}));
}

TEST(BlockFamilies, MovesDefaultPartsIntoTextures) {
  const auto faces_of = [](const std::string& box) {
    const auto made = BlockFamilies::from_text(families_with("0 0 0 16 16 16 *:all", box), kRules);
    EXPECT_TRUE(made) << box;
    return Json::parse(*made->model({"minecraft", "block/oak_log"}))["elements"][0]["faces"];
  };
  const Json inside = faces_of("2 0 0 16 16 16 *:all");
  for (const auto& [direction, face] : inside.items()) EXPECT_FALSE(face.contains("uv")) << direction;
  const Json outside = faces_of("8 9 0 24 17.5 12 *:all e:all@1,2,3,4");
  EXPECT_EQ(outside["up"]["uv"], Json::parse("[0.0, 0.0, 16.0, 12.0]"));
  EXPECT_EQ(outside["down"]["uv"], Json::parse("[0.0, 4.0, 16.0, 16.0]"));
  EXPECT_EQ(outside["north"]["uv"], Json::parse("[0.0, 0.0, 16.0, 8.5]"));
  EXPECT_EQ(outside["south"]["uv"], Json::parse("[0.0, 0.0, 16.0, 8.5]"));
  EXPECT_EQ(outside["west"]["uv"], Json::parse("[0.0, 0.0, 12.0, 8.5]"));
  EXPECT_EQ(outside["east"]["uv"], Json::parse("[1.0, 2.0, 3.0, 4.0]"));
  const Json large = faces_of("-16 0 8 32 16 8 ns:all");
  EXPECT_EQ(large["north"]["uv"], Json::parse("[0.0, 0.0, 16.0, 16.0]"));
}

const std::vector<std::string> kSomeBlocks = {"oak_stairs", "minecraft:stone", "water",
                                              "oak_fence",  "grass_block",     "redstone_wire",
                                              "mod:thing",  "white_sign",      "air"};

/// Returns types of some blocks: each by its name, with the states that its own look depends on.
std::vector<VoxelProperties> types_of_some_blocks() {
  minecraft::BlockTypes types;
  for (const std::string& name : kSomeBlocks) {
    const std::string full = name.find(':') == std::string::npos ? "minecraft:" + name : name;
    const auto block = types.block(full, {{"facing", "north"}, {"half", "top"}, {"shape", "straight"}});
    EXPECT_TRUE(block && (block->tint == minecraft::Tint::None || types.tinted(*block, {}))) << name;
  }
  const VoxelRegistry registry = types.types();
  std::vector<VoxelProperties> all;
  for (std::size_t i = 1; i < registry.size(); ++i) all.push_back(registry[static_cast<VoxelType>(i)]);
  return all;
}

TEST(OwnPack, WrittenPackGivesTheSameLooks) {
  const auto zip = write_builtin_pack(kSomeBlocks);
  ASSERT_TRUE(zip) << zip.error().message;
  const auto written = open_pack(*zip);
  ASSERT_TRUE(written) << written.error().message;
  EXPECT_TRUE((*written)->read("pack.mcmeta", kMaxJsonBytes)->has_value());
  BlockLooks of_written(*written);
  BlockLooks of_own(std::make_shared<MemoryPack>(), OwnPack::instance());
  const std::vector<VoxelProperties> types = types_of_some_blocks();
  EXPECT_EQ(types.size(), kSomeBlocks.size() - 1);  // without air
  for (const VoxelProperties& type : types) {
    const VoxelProperties made = of_written.applied(type);
    EXPECT_TRUE(made == of_own.applied(type)) << type.name;
    EXPECT_FALSE(made.faces.empty() && made.shapes.empty()) << type.name;
  }
  EXPECT_EQ(of_written.report().missing_textures, 0U);
  // The pack has only the blocks that were named.
  EXPECT_FALSE((*written)->read("assets/minecraft/blockstates/dirt.json", kMaxJsonBytes)->has_value());
}

TEST(OwnPack, WritesTheSameBytesForAnyOrder) {
  std::vector<std::string> names = kSomeBlocks;
  const auto first = write_builtin_pack(names);
  std::ranges::reverse(names);
  names.push_back(names.front());
  const auto second = write_builtin_pack(names);
  ASSERT_TRUE(first && second);
  EXPECT_TRUE(*first == *second);
  EXPECT_TRUE(
      open_pack(write_builtin_pack(std::vector<std::string>()).value_or(std::vector<std::byte>())).error().code ==
      ErrorCode::InvalidArgument);  // no block, no folder `assets`
}

TEST(OwnPack, WritesNoPackForInvalidNames) {
  for (const std::string name : {"", "a b", "..", "../x", "a:b:c", "oak_log[axis=y]", "x\ny"}) {
    const auto zip = write_builtin_pack(std::vector{name});
    ASSERT_FALSE(zip) << name;
    EXPECT_EQ(zip.error().code, ErrorCode::InvalidArgument);
    EXPECT_NE(zip.error().message.find("is not the name of a block"), std::string::npos);
  }
}

TEST(OwnPack, WritesNoPackForNamesWithoutAPath) {
  const std::string overhead = "assets/minecraft/blockstates/.json";
  EXPECT_TRUE(write_builtin_pack(std::vector{std::string(400, 'a')}));
  for (const std::size_t size : {513 - overhead.size(), std::size_t{512}}) {
    ASSERT_TRUE(resource_name(std::string(size, 'a')));
    const auto zip = write_builtin_pack(std::vector{std::string(size, 'a')});
    ASSERT_FALSE(zip) << size;
    EXPECT_EQ(zip.error().code, ErrorCode::InvalidArgument);
    EXPECT_NE(zip.error().message.find("the name of a block is too long"), std::string::npos) << zip.error().message;
  }
}

TEST(OwnPack, StairsTurnWithTheirProperties) {
  const Json states = Json::parse(text_of_own("assets/minecraft/blockstates/oak_stairs.json"));
  EXPECT_EQ(states["variants"].size(), 40U);
  const Json& turned = states["variants"]["half=top,shape=inner_right,facing=south"];
  EXPECT_EQ(turned["model"], "minecraft:block/oak_stairs_inner");
  EXPECT_EQ(turned["x"], 180);
  EXPECT_EQ(turned["y"], 180);
  EXPECT_EQ(turned["uvlock"], true);
  const Json model = Json::parse(text_of_own("assets/minecraft/models/block/oak_stairs_inner.json"));
  EXPECT_EQ(model["elements"].size(), 3U);
  EXPECT_EQ(model["textures"]["side"], "minecraft:block/oak_planks");
}

TEST(OwnPack, MaterialsOfShapesHaveTheirSides) {
  const auto textures = [](const std::string& block) {
    return Json::parse(text_of_own("assets/minecraft/models/block/" + block + ".json"))["textures"];
  };
  EXPECT_EQ(textures("sandstone_stairs")["top"], "minecraft:block/sandstone_top");
  EXPECT_EQ(textures("sandstone_stairs")["side"], "minecraft:block/sandstone");
  EXPECT_EQ(textures("stone_brick_slab")["side"], "minecraft:block/stone_bricks");
  EXPECT_EQ(textures("quartz_slab")["bottom"], "minecraft:block/quartz_block_bottom");
  EXPECT_EQ(textures("waxed_cut_copper_stairs")["side"], "minecraft:block/cut_copper");
  EXPECT_EQ(textures("bamboo_fence_post")["texture"], "minecraft:block/bamboo_planks");
}

TEST(OwnPack, NamesOfModsGetTheNearestFamily) {
  const BlockFamilies& families = OwnPack::instance()->families();
  EXPECT_EQ(families.family({"mod", "maple_stairs"}), "stairs");
  EXPECT_EQ(families.family({"mod", "tin_bars_pane"}), "pane");
  EXPECT_EQ(families.family({"mod", "blue_flower"}), "cross");
  EXPECT_EQ(families.family({"mod", "ruby_ore"}), "cube_all");
  EXPECT_TRUE(families.is_known({"mod", "ruby_ore"}));
  EXPECT_FALSE(families.is_known({"mod", "strange_machine"}));
  const Json states = Json::parse(text_of_own("assets/mod/blockstates/strange_machine.json"));
  EXPECT_EQ(states["variants"][""]["model"], "quoin:block/mod/strange_machine");
  const Json model = Json::parse(text_of_own("assets/quoin/models/block/mod/strange_machine.json"));
  EXPECT_EQ(model["textures"]["all"], "quoin:block/mod/strange_machine");
  EXPECT_NE(text_of_own("assets/quoin/textures/block/mod/strange_machine.png"), "absent");
}

TEST(OwnPack, HasNoOtherFiles) {
  EXPECT_EQ(text_of_own("assets/minecraft/models/block/no_such_thing.json"), "absent");
  EXPECT_EQ(text_of_own("assets/minecraft/textures/block/no_such_thing.png"), "absent");
  EXPECT_EQ(text_of_own("assets/minecraft/models/item/stick.json"), "absent");
  EXPECT_EQ(text_of_own("assets/minecraft/lang/en_us.json"), "absent");
  EXPECT_EQ(text_of_own("assets/minecraft/blockstates/.json"), "absent");
  EXPECT_EQ(text_of_own("assets/minecraft/blockstates/../oak_stairs.json"), "absent");
  EXPECT_EQ(text_of_own("pack.mcmeta"), "absent");
  const auto large = OwnPack::instance()->read("assets/minecraft/blockstates/oak_stairs.json", 100);
  ASSERT_FALSE(large);
  EXPECT_EQ(large.error().code, ErrorCode::LimitExceeded);
}

TEST(OwnPack, PublishedParentsHaveVariables) {
  const Json parent = Json::parse(text_of_own("assets/minecraft/models/block/cube_all.json"));
  EXPECT_EQ(parent["elements"][0]["faces"]["north"]["texture"], "#all");
  EXPECT_FALSE(parent.contains("textures"));
}

/// Returns the mean of the visible texels in sRGB.
Rgba8 mean_of(const AlphaImage& image) {
  return srgb_colour(Texture::from_image("test", image)->mean());
}

bool is_near(const Rgba8& a, const Rgba8& b) {
  return std::abs(a.r - b.r) <= 3 && std::abs(a.g - b.g) <= 3 && std::abs(a.b - b.b) <= 3;
}

TEST(OwnPack, PlainTexturesHaveTheMeanColourOfTheirBlock) {
  for (const std::string name :
       {"oak_planks", "stone", "cobblestone", "red_wool", "dirt", "netherrack", "gold_block"}) {
    const Rgba8 expected = minecraft::look_of_block("minecraft:" + name, false, false).colour;
    EXPECT_TRUE(is_near(mean_of(own_texture(name)), expected)) << name;
  }
  EXPECT_FALSE(is_near(mean_of(own_texture("oak_planks")), minecraft::look_of_block("stone", false, false).colour));
}

TEST(OwnPack, TexturesInFoldersHaveTheirOwnRecipes) {
  const auto made = TextureRecipes::from_text(
      R"([["*_wool", "flat #FF0000"], ["bed/*", "flat #00FF00"], ["unknown", "flat #0000FF"]])");
  ASSERT_TRUE(made);
  const auto colour = [&](const ResourceName& name) { return made->draw(name)->rgba; };
  EXPECT_GT(colour({"quoin", "block/bed/red_wool"})[1], 200);  // by its folder
  EXPECT_GT(colour({"minecraft", "block/red_wool"})[0], 200);  // by its name
  EXPECT_GT(colour({"quoin", "block/mod/red_wool"})[0], 200);  // of a block of a mod
  EXPECT_GT(colour({"quoin", "block/mod/machine"})[2], 200);   // unknown
  EXPECT_FALSE(made->draw({"minecraft", "block/bed2/red_wool"}));
}

TEST(OwnPack, TexturesAreDrawnTheSameEveryTime) {
  EXPECT_EQ(own_texture("oak_log").rgba, own_texture("oak_log").rgba);
  EXPECT_NE(own_texture("oak_log").rgba, own_texture("oak_planks").rgba);
}

TEST(OwnPack, OnlyCutoutsHaveClearTexels) {
  const auto clear = [](const AlphaImage& image) {
    std::size_t count = 0;
    for (std::size_t i = 3; i < image.rgba.size(); i += 4) count += image.rgba[i] == 0 ? 1U : 0U;
    return count;
  };
  for (const char* name : {"oak_planks", "stone", "furnace_front", "bookshelf", "sand", "diamond_ore"}) {
    EXPECT_EQ(clear(own_texture(name)), 0U) << name;
  }
  for (const char* name : {"poppy", "oak_leaves", "rail", "ladder", "glass", "fire_0", "oak_door_top", "iron_bars"}) {
    EXPECT_GT(clear(own_texture(name)), 10U) << name;
    EXPECT_LT(clear(own_texture(name)), 250U) << name;
  }
}

TEST(TextureRecipes, NamesFaultsOfTables) {
  const auto fault = [](const std::string& text) {
    const auto made = TextureRecipes::from_text(text);
    return made ? "none" : made.error().message;
  };
  EXPECT_EQ(fault(R"([["a", "flat #112233"]])"), "none");
  EXPECT_NE(fault("{}").find("no JSON list"), std::string::npos);
  EXPECT_NE(fault(R"([["a"]])").find("1 to 8 layers"), std::string::npos);
  EXPECT_NE(fault(R"([["a", "fluff #112233"]])").find("no pattern fluff"), std::string::npos);
  EXPECT_NE(fault(R"([["a", "flat #11223"]])").find("invalid colour"), std::string::npos);
  EXPECT_NE(fault(R"([["a", "flat self y2"]])").find("invalid factor"), std::string::npos);
  EXPECT_NE(fault(R"([["a", "flat self x9"]])").find("invalid factor"), std::string::npos);
  EXPECT_NE(fault(R"([["a a", "flat self"]])").find("in two rows"), std::string::npos);
}

TEST(Patterns, AreDrawnByNameAndNumber) {
  EXPECT_TRUE(draw_pattern("planks"));
  EXPECT_TRUE(draw_pattern("wheat7"));
  EXPECT_FALSE(draw_pattern("planks1234"));
  EXPECT_FALSE(draw_pattern(""));
  EXPECT_FALSE(draw_pattern("no_such_pattern"));
  EXPECT_TRUE(has_pattern("wheat7"));
  EXPECT_FALSE(has_pattern("wheat7777"));
  const auto covered = [](const Pattern& pattern) {
    return std::ranges::count_if(pattern, [](const PatternTexel& texel) { return texel.alpha > 0.0F; });
  };
  EXPECT_EQ(covered(*draw_pattern("planks")), 256);
  EXPECT_LT(covered(*draw_pattern("wheat0")), covered(*draw_pattern("wheat7")));
}

}  // namespace
}  // namespace quoin::packs
