#include "io/packs/node_pack.h"

#include <array>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <quoin/core/axis_orientation.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/io/block_packs.h>

#include "core/bytes/text.h"
#include "io/luanti/luanti.h"
#include "io/packs/pack_looks.h"
#include "io/packs/pack_own.h"
#include "io/packs/packs_for_tests.h"

namespace quoin::packs {
namespace {

namespace fs = std::filesystem;
using packs_test::plain_png;

/// The type of a node with the look that the tables give it, or a folder.
VoxelProperties shown_node(std::string_view node, const std::vector<fs::path>& folders = {}, bool has_own = true) {
  const auto files = PackStack::open(folders, {});
  EXPECT_TRUE(files);
  BlockLooks looks(*files, has_own ? OwnPack::instance() : nullptr);
  const auto type = models::node_properties(node);
  EXPECT_TRUE(type) << node;
  VoxelProperties made = looks.applied(*type);
  EXPECT_EQ(looks.report().without_look, 0U) << node << ": " << to_string(looks.report());
  EXPECT_TRUE(validate_type(made)) << node;
  return made;
}

const ShapeModel& node_model(const VoxelProperties& type, std::uint32_t state, const ShapeSurroundings& around = {}) {
  return type.shapes.model(state, type.orientations.of(state), around);
}

bool fills_node(const ShapeModel& model, IVec3 at) {
  return (model.bits[static_cast<std::size_t>(at.y + 16 * at.z)] >> at.x & 1U) != 0;
}

int filled_of_node(const ShapeModel& model) {
  int count = 0;
  for (const std::uint16_t row : model.bits) count += std::popcount(row);
  return count;
}

/// A box in Luanti's axes and units: the node spans -0.5 to 0.5.
using NodeBox = std::array<double, 6>;

/// Returns the sixteenths inside boxes that are turned by a facedir and moved to the axes of grids, written after
/// Luanti's description of boxes: turned about y by the lowest two bits, then the top to one of six directions.
std::array<std::uint16_t, 256> turned_bits(const std::vector<NodeBox>& boxes, int facedir) {
  using Point = std::array<double, 3>;
  const auto back = [&](Point p) {  // from the turned node to the unturned one
    const auto [x, y, z] = p;
    const std::array<Point, 6> tops = {Point{x, y, z},  Point{x, z, -y}, Point{x, -z, y},
                                       Point{-y, x, z}, Point{y, -x, z}, Point{-x, -y, z}};
    p = tops[static_cast<std::size_t>(facedir / 4)];
    for (int i = 0; i < facedir % 4; ++i) p = {-p[2], p[1], p[0]};
    return p;
  };
  std::array<std::uint16_t, 256> bits{};
  for (int i = 0; i < 4096; ++i) {
    const IVec3 at{i & 15, i >> 4 & 15, i >> 8};
    const Point middle = back({(at.x + 0.5) / 16.0 - 0.5, (at.y + 0.5) / 16.0 - 0.5, 0.5 - (at.z + 0.5) / 16.0});
    for (const NodeBox& box : boxes) {
      bool is_inside = true;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        is_inside = is_inside && middle[axis] > box[axis] && middle[axis] < box[axis + 3];
      }
      if (is_inside) bits[static_cast<std::size_t>(at.y + 16 * at.z)] |= static_cast<std::uint16_t>(1U << at.x);
    }
  }
  return bits;
}

TEST(NodePack, TurnsBoxesByAllFacedirs) {
  const std::map<std::string, std::vector<NodeBox>> nodes = {
      {"stairs:stair_wood", {{-0.5, -0.5, -0.5, 0.5, 0.0, 0.5}, {-0.5, 0.0, 0.0, 0.5, 0.5, 0.5}}},
      {"stairs:stair_inner_cobble",
       {{-0.5, -0.5, -0.5, 0.5, 0.0, 0.5}, {-0.5, 0.0, 0.0, 0.5, 0.5, 0.5}, {-0.5, 0.0, -0.5, 0.0, 0.5, 0.0}}},
      {"stairs:stair_outer_straw", {{-0.5, -0.5, -0.5, 0.5, 0.0, 0.5}, {-0.5, 0.0, 0.0, 0.0, 0.5, 0.5}}},
      {"stairs:slab_stone", {{-0.5, -0.5, -0.5, 0.5, 0.0, 0.5}}},
      {"doors:trapdoor", {{-0.5, -0.5, -0.5, 0.5, -0.375, 0.5}}},
      {"doors:trapdoor_open", {{-0.5, -0.5, 0.375, 0.5, 0.5, 0.5}}},
  };
  for (const auto& [name, boxes] : nodes) {
    const VoxelProperties type = shown_node(name);
    ASSERT_FALSE(type.shapes.empty()) << name;
    std::set<std::array<std::uint16_t, 256>> different;
    for (int facedir = 0; facedir < 24; ++facedir) {
      const auto expected = turned_bits(boxes, facedir);
      EXPECT_EQ(node_model(type, static_cast<std::uint32_t>(facedir)).bits, expected) << name << " " << facedir;
      different.insert(expected);
    }
    EXPECT_GE(different.size(), 6U) << name;
    // The upper bits are a colour.
    EXPECT_EQ(node_model(type, 0xE5).bits, turned_bits(boxes, 5)) << name;
  }
}

TEST(NodePack, HasOrientationsOfEveryTurn) {
  const StateOrientations facedir = node_orientations("facedir");
  const StateOrientations quarters = node_orientations("4dir");
  ASSERT_EQ(facedir.by_value.size(), 32U);
  ASSERT_EQ(quarters.by_value.size(), 4U);
  std::set<int> different;
  for (std::size_t value = 0; value < 24; ++value) {
    different.insert(facedir.by_value[value].index());
    EXPECT_FALSE(facedir.by_value[value].is_mirrored());
    EXPECT_TRUE(value >= 4 || quarters.by_value[value] == facedir.by_value[value]) << value;
  }
  EXPECT_EQ(different.size(), 24U);
  EXPECT_EQ(quarters.of(0xFD), quarters.by_value[1]) << "the upper bits are a colour";
  EXPECT_TRUE(node_orientations("sideways").empty());
  // The front of facedir 1 is at +x: nodes look towards -z, which is +z of grids.
  EXPECT_EQ(facedir.by_value[0].apply(Direction::NegZ), Direction::NegZ);
  EXPECT_EQ(facedir.by_value[1].apply(Direction::NegZ), Direction::PosX);
}

TEST(NodePack, MountsOnSixWalls) {
  const VoxelProperties sign = shown_node("default:sign_wall_wood");
  // +y, -y, +x, -x, +z, -z of Luanti, whose z is mirrored in grids.
  const std::array<IVec3, 6> next_to_wall = {IVec3{8, 15, 8}, {8, 0, 8}, {15, 8, 8}, {0, 8, 8}, {8, 8, 0}, {8, 8, 15}};
  for (std::size_t wall = 0; wall < 6; ++wall) {
    const ShapeModel& model = node_model(sign, static_cast<std::uint32_t>(wall));
    EXPECT_EQ(filled_of_node(model), 14 * 10) << wall;
    EXPECT_TRUE(fills_node(model, next_to_wall[wall])) << wall;
    EXPECT_FALSE(fills_node(model, next_to_wall[wall ^ 1U])) << wall;
  }
  // Signs on walls are wider than high.
  const ShapeModel& side = node_model(sign, 3);
  EXPECT_TRUE(fills_node(side, {0, 12, 8}) && fills_node(side, {0, 8, 14}));
  EXPECT_FALSE(fills_node(side, {0, 14, 8}));
  // Torches of worlds before 5.0 have one name for floor and walls.
  const VoxelProperties torch = shown_node("default:torch");
  EXPECT_FALSE(node_model(torch, 1).boxes.front().is_turned);
  EXPECT_TRUE(node_model(torch, 2).boxes.front().is_turned);
  const float leans_from_wall = node_model(torch, 3).max.x;
  EXPECT_GT(leans_from_wall, 0.2F);
  EXPECT_LT(leans_from_wall, 0.5F);
}

TEST(NodePack, JoinsFencesWallsAndPanes) {
  const VoxelProperties fence = shown_node("default:fence_wood");
  const VoxelProperties pane = shown_node("xpanes:pane");
  const VoxelProperties wall = shown_node("walls:mossycobble");
  EXPECT_EQ(fence.shapes.rules().neighbours, ShapeNeighbours::Connected);
  EXPECT_EQ(fence.shapes.rules().groups, wall.shapes.rules().groups);
  EXPECT_EQ(fence.shapes.rules().groups & pane.shapes.rules().groups, 0U);
  EXPECT_FALSE(fence.shapes.rules().connects_to_full_sides);
  EXPECT_TRUE(pane.shapes.rules().connects_to_full_sides);
  ShapeSurroundings around;
  EXPECT_EQ(filled_of_node(node_model(fence, 0, around)), 4 * 4 * 16);
  around.connected.insert(Direction::NegZ);
  const ShapeModel& joined = node_model(fence, 0, around);
  EXPECT_EQ(filled_of_node(joined), 4 * 4 * 16 + 2 * 2 * 2 * 6);
  EXPECT_TRUE(fills_node(joined, {8, 12, 0}));
  // Rails choose among straight, curved, and two kinds of crossings.
  const VoxelProperties rail = shown_node("carts:rail");
  around.connected.insert(Direction::PosX);
  EXPECT_EQ(node_model(rail, 0, around).boxes.size(), 1U);
  for (unsigned bits = 0; bits < 16; ++bits) {
    ShapeSurroundings sides;
    constexpr std::array kSides = {Direction::NegX, Direction::PosX, Direction::NegZ, Direction::PosZ};
    for (unsigned i = 0; i < 4; ++i) {
      if ((bits >> i & 1U) != 0) sides.connected.insert(kSides[i]);
    }
    EXPECT_EQ(node_model(rail, 0, sides).boxes.size(), 1U) << "one piece of rail for sides " << bits;
  }
}

TEST(NodePack, GivesPlantsTheStyleOfTheirState) {
  const VoxelProperties shrub = shown_node("default:dry_shrub");
  const std::array<std::size_t, 5> plates = {2, 2, 3, 4, 4};
  for (std::uint32_t style = 0; style < 5; ++style) {
    EXPECT_EQ(node_model(shrub, style).boxes.size(), plates[style]) << style;
    EXPECT_EQ(node_model(shrub, style | 8U).boxes.size(), plates[style]) << "with a random offset";
  }
  EXPECT_TRUE(node_model(shrub, 0).boxes[0].is_turned);
  EXPECT_FALSE(node_model(shrub, 1).boxes[0].is_turned);
  EXPECT_EQ(node_model(shown_node("flowers:rose"), 4).boxes.size(), 2U) << "other plants have no styles";
}

TEST(NodePack, MakesLiquidsWithLevels) {
  const VoxelProperties source = shown_node("default:water_source");
  const VoxelProperties flowing = shown_node("default:water_flowing");
  EXPECT_EQ(source.shapes.rules().neighbours, ShapeNeighbours::Fluid);
  EXPECT_EQ(source.shapes.rules().groups, flowing.shapes.rules().groups);
  EXPECT_NE(source.shapes.rules().groups, shown_node("default:river_water_source").shapes.rules().groups);
  EXPECT_EQ(source.visibility, Visibility::Transparent);
  EXPECT_EQ(shown_node("default:lava_source").visibility, Visibility::Opaque);
  // The highest level is the smallest drop, and the falling bit is kept. States keep all of param2.
  EXPECT_EQ(models::node_state("default:water_flowing", 7), 0U);
  EXPECT_EQ(models::node_state("default:water_flowing", 0), 7U);
  EXPECT_EQ(models::node_state("default:water_flowing", 0xFB), 0xFCU);
  EXPECT_EQ(models::node_state("default:water_source", 3), 3U);
  // Worlds that were converted before have other states: they keep whole cubes.
  BlockLooks looks(std::make_shared<MemoryPack>(), OwnPack::instance());
  auto old = *models::node_properties("default:water_flowing");
  old.attributes[models::kNodeStatesAttribute] = "param2:n8";
  EXPECT_TRUE(looks.applied(old).shapes.empty());
}

TEST(NodePack, KnowsEveryNodeOfTheStandardGameInItsColours) {
  const std::vector<std::string> names = {
      "stone",        "cobble",    "stonebrick", "desert_stone", "sandstone",  "silver_sandstone_brick",
      "obsidian",     "dirt",      "dry_dirt",   "sand",         "gravel",     "clay",
      "ice",          "snowblock", "wood",       "junglewood",   "aspen_wood", "leaves",
      "pine_needles", "coalblock", "steelblock", "tinblock",     "mese",       "brick",
      "silver_sand",  "cloud"};
  for (const std::string& name : names) {
    const VoxelProperties plain = *models::node_properties("default:" + name);
    const VoxelProperties type = shown_node("default:" + name);
    ASSERT_FALSE(type.faces.empty()) << name;
    EXPECT_TRUE(type.shapes.empty()) << name;
    const VoxelFace& face = type.faces[Direction::PosX];
    const Rgba8 mean = face.texture.level(face.texture.level_count() - 1)[0];
    const auto near = [](std::uint8_t a, std::uint8_t b) { return std::abs(int{a} - int{b}) <= 12; };
    EXPECT_TRUE(near(mean.r, plain.colour.r) && near(mean.g, plain.colour.g) && near(mean.b, plain.colour.b))
        << name << ": " << int{mean.r} << " " << int{mean.g} << " " << int{mean.b} << " instead of "
        << int{plain.colour.r} << " " << int{plain.colour.g} << " " << int{plain.colour.b};
  }
}

TEST(NodePack, GivesUnknownNodesTheNearestLook) {
  EXPECT_FALSE(shown_node("moreblocks:slab_marble").shapes.empty());
  EXPECT_EQ(shown_node("farming_plus:orange_sapling").shapes.rules().parts.front().shape.elements().size(), 2U);
  // By a block of the same name.
  EXPECT_FALSE(shown_node("mcl_core:ladder").shapes.empty());
  EXPECT_TRUE(shown_node("mcl_core:bedrock").shapes.empty());
  // Otherwise a cube that keeps the mark of a guessed colour.
  const VoxelProperties strange = shown_node("strange:thing");
  EXPECT_TRUE(strange.shapes.empty());
  EXPECT_FALSE(strange.faces.empty());
  EXPECT_TRUE(strange.attributes.contains(models::kNodeGuessAttribute));
  for (const char* name : {"", ":", "a:", ":b", "no_colon", "x:y:z", "bad name:with blanks", "a:\xFF\xFE", "m:../../x",
                           "stairs:stair_", "stairs:stair_../x", "m:n%s{name}{1}"}) {
    BlockLooks looks(std::make_shared<MemoryPack>(), OwnPack::instance());
    const auto type = models::node_properties(name);
    EXPECT_TRUE(!type || validate_type(looks.applied(*type))) << name;
  }
}

TEST(NodePack, HidesNodesThatTheGameHides) {
  const VoxelProperties hidden = shown_node("doors:hidden");
  EXPECT_TRUE(node_model(hidden, 0).faces.empty());
  EXPECT_EQ(filled_of_node(node_model(hidden, 0)), 0);
}

/// A folder that is removed at the end.
class GameFolder {
 public:
  GameFolder() {
    fs::remove_all(path);
    fs::create_directories(path);
  }
  ~GameFolder() { fs::remove_all(path); }
  GameFolder(const GameFolder&) = delete;
  GameFolder& operator=(const GameFolder&) = delete;
  void put(const fs::path& file, const std::string& content) const {
    fs::create_directories((path / file).parent_path());
    std::ofstream(path / file, std::ios::binary) << content;
  }
  fs::path path = fs::temp_directory_path() / "quoin_node_pack_test";
};

Rgba8 node_face_colour(const VoxelProperties& type, Direction direction) {
  const VoxelFace& face = type.faces[direction];
  return face.texture.is_null() ? face.tint : face.texture.level(0)[0];
}

TEST(NodeFolder, FindsTilesByTheirNames) {
  const Rgba8 red{250, 10, 10};
  const Rgba8 green{10, 200, 10};
  const Rgba8 blue{10, 10, 200};
  const GameFolder game;
  game.put("game.conf", "title = Test\n");
  game.put("mods/default/textures/default_stone.png", plain_png(red));
  game.put("mods/pack/extra/textures/more/extra_box_top.png", plain_png(green));
  game.put("mods/pack/extra/textures/extra_box.png", plain_png(blue));
  game.put("mods/default/textures/default_wood.png", plain_png(green, 64));
  game.put("mods/default/drawings/default_dirt.png", plain_png(red));
  const VoxelProperties stone = shown_node("default:stone", {game.path}, false);
  EXPECT_EQ(node_face_colour(stone, Direction::PosX), red);
  const VoxelProperties box = shown_node("extra:box", {game.path}, false);
  EXPECT_EQ(node_face_colour(box, Direction::PosY), green);
  EXPECT_EQ(node_face_colour(box, Direction::NegX), blue);
  const VoxelProperties stairs = shown_node("stairs:stair_wood", {game.path}, false);
  EXPECT_EQ(node_face_colour(stairs, Direction::PosY), green);
  EXPECT_EQ(stairs.faces[Direction::PosY].texture.size(), 64);
  // Files outside of folders `textures` are no tiles, and a node whose tiles are missing keeps its colour.
  BlockLooks looks(*PackStack::open(std::vector{game.path}, {}));
  const auto dirt = looks.applied(*models::node_properties("default:dirt"));
  EXPECT_TRUE(dirt.faces.empty());
  EXPECT_EQ(looks.report().missing_textures, 1U);
  // The own pack fills the gap, and Minecraft blocks do not see the folder.
  EXPECT_FALSE(shown_node("default:dirt", {game.path}).faces.empty());
  EXPECT_EQ(node_face_colour(shown_node("default:stone", {game.path}), Direction::PosX), red);
}

TEST(NodeFolder, ReplacesLooksOfEarlierConversions) {
  const GameFolder game;
  game.put("textures/default_stone.png", plain_png({250, 10, 10}));
  const auto files = PackStack::open(std::vector{game.path}, {});
  ASSERT_TRUE(files);
  BlockLooks with_folder(*files, OwnPack::instance());
  const VoxelProperties drawn = shown_node("default:stone");
  EXPECT_EQ(node_face_colour(with_folder.applied(drawn), Direction::PosX), (Rgba8{250, 10, 10}));
  BlockLooks without(std::make_shared<MemoryPack>(), OwnPack::instance());
  EXPECT_EQ(without.applied(drawn), drawn);
}

TEST(NodeFolder, PrefersExactTilesOfLowerFolders) {
  const auto put = [](const fs::path& folder, const std::string& name, const std::string& png) {
    fs::create_directories(folder);
    std::ofstream(folder / (name + ".png"), std::ios::binary) << png;
  };
  const GameFolder folder;
  const Rgba8 red{250, 10, 10};
  const Rgba8 green{10, 200, 10};
  const std::string strip = packs_test::png(
      16,
      [](int, int y) {
        return y < 16 ? Rgba8{1, 2, 3} : Rgba8{0, 0, 255};
      },
      4);
  put(folder.path / "game/textures", "default_tree_side", plain_png(green));
  put(folder.path / "top/textures", "default_tree", strip);
  const auto files = PackStack::open(std::vector{folder.path / "game", folder.path / "top"}, {});
  ASSERT_TRUE(files);
  const auto is_same = [&](const std::string& tile, const std::string& png) {
    const auto bytes = (*files)->read(tile_path(tile), kMaxImageBytes);
    return bytes && *bytes && text_of(**bytes) == png;
  };
  const auto is_animated = [&](const std::string& tile) {
    const auto bytes = (*files)->read(tile_path(tile) + ".mcmeta", kMaxJsonBytes);
    return bytes && *bytes;
  };
  EXPECT_TRUE(is_same("default_tree_side", plain_png(green))) << "a lower folder has it";
  EXPECT_TRUE(is_same("default_tree_top", strip)) << "no folder has it";
  EXPECT_TRUE((*files)->has(tile_path("default_tree_front")));
  EXPECT_FALSE((*files)->has(tile_path("default_tree_back")));
  EXPECT_FALSE((*files)->has(tile_path("_top")));
  EXPECT_TRUE(is_animated("default_tree"));
  EXPECT_TRUE(is_animated("default_tree_top"));
  EXPECT_FALSE(is_animated("default_tree_side")) << "the animation belongs to another image";
  put(folder.path / "top/textures", "default_tree_side", plain_png(red));
  const auto again = PackStack::open(std::vector{folder.path / "game", folder.path / "top"}, {});
  ASSERT_TRUE(again);
  const auto bytes = (*again)->read(tile_path("default_tree_side"), kMaxImageBytes);
  EXPECT_TRUE(bytes && *bytes && text_of(**bytes) == plain_png(red));
}

TEST(NodeFolder, BlendsTilesAndShowsFirstFrames) {
  const GameFolder mod;
  mod.put("init.lua", "");
  mod.put("textures/default_dirt.png", plain_png({100, 60, 30}));
  mod.put("textures/default_grass.png", plain_png({60, 160, 40}));
  mod.put("textures/default_grass_side.png", packs_test::png(16, [](int, int y) {
            return y < 4 ? Rgba8{60, 160, 40} : Rgba8{0, 0, 0, 0};
          }));
  const VoxelProperties grass = shown_node("default:dirt_with_grass", {mod.path}, false);
  const VoxelFace& side = grass.faces[Direction::PosX];
  EXPECT_EQ(side.texture.level(0)[0], (Rgba8{60, 160, 40}));
  EXPECT_EQ(side.texture.level(0)[16 * 10], (Rgba8{100, 60, 30}));
  EXPECT_EQ(node_face_colour(grass, Direction::PosY), (Rgba8{60, 160, 40}));
  mod.put("textures/default_lava_source_animated.png", packs_test::png(
                                                           16,
                                                           [](int, int y) {
                                                             return y < 16 ? Rgba8{240, 100, 10} : Rgba8{0, 0, 255};
                                                           },
                                                           4));
  const VoxelProperties lava = shown_node("default:lava_source", {mod.path});
  for (const Rgba8& texel : lava.faces[Direction::PosY].texture.level(0)) EXPECT_EQ(texel, (Rgba8{240, 100, 10}));
}

TEST(NodeFolder, RefusesOtherFoldersAndDamagedImages) {
  const GameFolder other;
  other.put("readme.txt", "");
  const auto refused = open_pack(other.path);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("no Luanti game or mod"), std::string::npos);
  other.put("mod.conf", "");
  other.put("textures/default_stone.png", "no image");
  other.put("textures/default_cobble.png", "");
  other.put("textures/default_wood.png", plain_png({1, 2, 3}).substr(0, 40));
  const auto files = PackStack::open(std::vector{other.path}, {});
  ASSERT_TRUE(files);
  BlockLooks looks(*files);
  for (const char* name : {"default:stone", "default:cobble", "default:wood", "stairs:stair_wood"}) {
    EXPECT_TRUE(validate_type(looks.applied(*models::node_properties(name)))) << name;
  }
  EXPECT_EQ(looks.report().missing_textures, 3U);
  // A folder instead of a file, and a name that is no pack path.
  fs::create_directories(other.path / "textures" / "default_dirt.png");
  other.put("textures/odd name.png", plain_png({1, 2, 3}));
  EXPECT_TRUE(open_pack(other.path));
}

TEST(NodeTables, GiveEveryRuleModelsAndTiles) {
  using Json = nlohmann::json;
  // Names that the patterns of the rules stand for; "x" for stars.
  const NodePack pack(true);
  std::ifstream file(fs::path(QUOIN_SOURCE_DIR) / "src/io/packs/data/node_rules.json");
  const Json rules = Json::parse(file);
  int models = 0;
  for (const Json& rule : rules) {
    std::string names;
    for (const Json& part : rule[0].is_array() ? rule[0] : Json::array({rule[0]})) {
      names += part.get<std::string>() + " ";
    }
    for (const std::string& pattern : words(names)) {
      ResourceName node =
          split_resource_name(replaced(pattern, "*", pattern.starts_with("*:") || pattern == "*" ? "x" : "x1"));
      if (pattern.find(':') == std::string::npos) node.space = "x";
      const auto states = pack.read("assets/" + node.space + "/blockstates/" + node.path + ".json", kMaxJsonBytes);
      ASSERT_TRUE(states && *states) << pattern;
      const Json json = Json::parse(std::string(reinterpret_cast<const char*>((*states)->data()), (*states)->size()));
      std::set<std::string> used;
      if (json.contains("variants")) {
        for (const auto& [key, value] : json["variants"].items()) used.insert(value["model"].get<std::string>());
      } else {
        for (const Json& part : json["multipart"]) used.insert(part["apply"]["model"].get<std::string>());
      }
      for (const std::string& name : used) {
        const ResourceName model = split_resource_name(name);
        const auto text = pack.read("assets/" + model.space + "/models/" + model.path + ".json", kMaxJsonBytes);
        ASSERT_TRUE(text && *text) << name;
        ++models;
        const Json made = Json::parse(std::string(reinterpret_cast<const char*>((*text)->data()), (*text)->size()));
        for (const Json& element : made["elements"]) {
          for (const auto& [side, face] : element["faces"].items()) {
            const std::string variable = face["texture"].get<std::string>().substr(1);
            ASSERT_TRUE(made["textures"].contains(variable)) << name << " has no texture " << variable;
            const ResourceName texture = split_resource_name(made["textures"][variable].get<std::string>());
            const auto png =
                pack.read("assets/" + texture.space + "/textures/" + texture.path + ".png", kMaxImageBytes);
            ASSERT_TRUE(png) << texture.path;
            EXPECT_TRUE(*png) << name << ": " << texture.path;
          }
        }
      }
    }
  }
  EXPECT_GT(models, 200);
}

TEST(NodeTables, NameFaultsOfTraits) {
  const auto fault = [](const std::string& trait) {
    const auto made = BlockFamilies::from_text(R"({"models": [{"cube": ["0 0 0 16 16 16 *:all"]}],
        "families": [{"cube": {)" + trait + R"("models": {"": "cube"}, "states": ["> ."]}}]})",
                                               R"([["*", "cube", "all=x"]])", "luanti");
    return made ? std::string("none") : made.error().message;
  };
  EXPECT_EQ(fault(R"("turn": "facedir", "joins": "fence", "fluid": "source", )"), "none");
  EXPECT_NE(fault(R"("turn": "sideways", )").find("unknown turn sideways"), std::string::npos);
  EXPECT_NE(fault(R"("joins": "hands", )").find("unknown joins hands"), std::string::npos);
  EXPECT_NE(fault(R"("fluid": "gas", )").find("unknown fluid gas"), std::string::npos);
  EXPECT_NE(fault(R"("mirror": "sideways", )").find("unknown mirror sideways"), std::string::npos);
  EXPECT_NE(fault(R"("turn": 4, )").find("unknown key turn"), std::string::npos);
}

}  // namespace
}  // namespace quoin::packs
