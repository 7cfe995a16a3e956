#include "io/minecraft/state_turns.h"

#include <array>
#include <bit>
#include <cstdint>
#include <map>
#include <random>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

#include <glm/gtc/quaternion.hpp>
#include <quoin/core/axis_orientation.h>
#include <quoin/grid/copy_box.h>
#include <quoin/grid/grid.h>
#include <quoin/io/block_packs.h>
#include <quoin/io/formats.h>

#include "io/luanti/luanti.h"
#include "io/minecraft/block_types.h"

namespace quoin::minecraft {
namespace {

std::string turned_text(std::string_view text, const AxisOrientation& turn) {
  const auto block = parse_block(text);
  EXPECT_TRUE(block) << text;
  auto made = turned_properties(block->name, block->properties, turn);
  return made ? to_string({block->name, std::move(*made)}) : "none";
}

TEST(StateTurns, MoveDirectionsOfProperties) {
  const AxisOrientation left = AxisOrientation::quarter_turns(1, 1);  // north becomes west
  const AxisOrientation over = AxisOrientation::quarter_turns(0, 2);  // upside down, east stays
  const AxisOrientation side = AxisOrientation::quarter_turns(0, 1);  // up becomes south
  const AxisOrientation mirror = AxisOrientation::mirror(0);
  const std::vector<std::pair<std::string, std::string>> cases = {
      {turned_text("furnace[facing=north]", left), "furnace[facing=west]"},
      {turned_text("furnace[facing=east]", mirror), "furnace[facing=west]"},
      {turned_text("furnace[facing=east]", over), "none"},
      {turned_text("observer[facing=east]", over), "observer[facing=east]"},
      {turned_text("observer[facing=up]", side), "observer[facing=south]"},
      {turned_text("hopper[enabled=true,facing=down]", left), "hopper[enabled=true,facing=down]"},
      {turned_text("hopper[enabled=true,facing=down]", mirror), "hopper[enabled=true,facing=down]"},
      {turned_text("hopper[enabled=true,facing=down]", over), "none"},
      {turned_text("hopper[enabled=true,facing=north]", side), "none"},
      {turned_text("torch", over), "none"},
      {turned_text("redstone_torch[lit=true]", over), "none"},
      {turned_text("redstone_torch[lit=true]", left), "redstone_torch[lit=true]"},
      {turned_text("wall_torch[facing=east]", over), "none"},
      {turned_text("oak_trapdoor[facing=north,half=bottom,open=true]", side), "none"},
      {turned_text("oak_trapdoor[facing=north,half=bottom,open=true]", over),
       "oak_trapdoor[facing=south,half=top,open=true]"},
      {turned_text("oak_log[axis=y]", side), "oak_log[axis=z]"},
      {turned_text("oak_log[axis=x]", left), "oak_log[axis=z]"},
      {turned_text("oak_stairs[facing=east,half=bottom,shape=outer_left]", over),
       "oak_stairs[facing=east,half=top,shape=outer_right]"},
      {turned_text("oak_stairs[facing=east,half=bottom,shape=inner_left]", mirror),
       "oak_stairs[facing=west,half=bottom,shape=inner_right]"},
      {turned_text("oak_stairs[facing=east,half=bottom,shape=straight]", side), "none"},
      {turned_text("oak_slab[type=bottom]", over), "oak_slab[type=top]"},
      {turned_text("oak_slab[type=double]", side), "oak_slab[type=double]"},
      {turned_text("oak_slab[type=top]", side), "none"},
      {turned_text("oak_door[facing=north,half=lower,hinge=left,open=false]", left),
       "oak_door[facing=west,half=lower,hinge=left,open=false]"},
      {turned_text("oak_door[facing=north,half=lower,hinge=left,open=false]", mirror),
       "oak_door[facing=north,half=lower,hinge=right,open=false]"},
      {turned_text("oak_door[facing=north,half=upper,hinge=left,open=true]", over), "none"},
      {turned_text("oak_fence[east=true,north=false,south=false,west=false]", left),
       "oak_fence[east=false,north=true,south=false,west=false]"},
      {turned_text("oak_fence[east=true,north=false,south=false,west=false]", over), "none"},
      {turned_text("cobblestone_wall[east=low,north=none,south=tall,up=true,west=none]", left),
       "cobblestone_wall[east=tall,north=low,south=none,up=true,west=none]"},
      {turned_text("chorus_plant[down=true,east=false,north=false,south=false,up=false,west=false]", side),
       "chorus_plant[down=false,east=false,north=true,south=false,up=false,west=false]"},
      {turned_text("oak_sign[rotation=1]", left), "oak_sign[rotation=13]"},
      {turned_text("oak_sign[rotation=1]", mirror), "oak_sign[rotation=15]"},
      {turned_text("rail[shape=ascending_north]", left), "rail[shape=ascending_west]"},
      {turned_text("rail[shape=south_east]", left), "rail[shape=north_east]"},
      {turned_text("rail[shape=north_south]", left), "rail[shape=east_west]"},
      {turned_text("rail[shape=north_west]", AxisOrientation::mirror(2)), "rail[shape=south_west]"},
      {turned_text("lever[face=wall,facing=north,powered=true]", side), "lever[face=floor,facing=north,powered=true]"},
      {turned_text("lever[face=floor,facing=north,powered=true]", left), "lever[face=floor,facing=west,powered=true]"},
      {turned_text("crafter[orientation=up_north]", left), "crafter[orientation=up_west]"},
      {turned_text("crafter[orientation=north_up]", over), "none"},
      {turned_text("wheat[age=3]", left), "wheat[age=3]"},
      {turned_text("wall_torch[facing=strange]", left), "wall_torch[facing=strange]"},
  };
  for (const auto& [made, expected] : cases) EXPECT_EQ(made, expected);
}

TEST(StateTurns, ReturnAfterTheInverseTurn) {
  const std::vector<std::string> blocks = {
      "oak_stairs[facing=south,half=top,shape=inner_right]",
      "oak_door[facing=east,half=upper,hinge=left,open=true]",
      "rail[shape=south_west]",
      "powered_rail[shape=ascending_east]",
      "vine[east=true,north=false,south=true,west=false]",
      "lever[face=wall,facing=west,powered=false]",
      "stone_button[face=ceiling,facing=east,powered=false]",
      "oak_sign[rotation=6]",
      "jigsaw[orientation=down_east]",
      "piston[facing=down]",
      "brown_mushroom_block[down=true,east=false,north=true,south=false,up=false,west=true]"};
  for (const std::string& block : blocks) {
    int found = 0;
    for (int i = 0; i < AxisOrientation::kCount; ++i) {
      const AxisOrientation turn = AxisOrientation::at(i);
      const std::string made = turned_text(block, turn);
      if (made == "none") continue;
      ++found;
      // The other vertical face of a button's wall is the same.
      if (block.starts_with("stone_button")) continue;
      EXPECT_EQ(turned_text(made, turn.inverse()), block) << i;
    }
    EXPECT_GE(found, 8) << block << ": at least the turns and mirrors that keep it upright";
  }
}

/// Returns the bits of a model's sixteenths after a turn about the middle of the voxel.
std::array<std::uint16_t, 256> turned_bits_of(const ShapeModel* model, const AxisOrientation& turn) {
  std::array<std::uint16_t, 256> bits{};
  for (int i = 0; model != nullptr && i < 4096; ++i) {
    const IVec3 at{i & 15, i >> 4 & 15, i >> 8};
    if ((model->bits[static_cast<std::size_t>(at.y + 16 * at.z)] >> at.x & 1U) == 0) continue;
    const IVec3 to = (turn.apply(2 * at - 15) + 15) / 2;
    bits[static_cast<std::size_t>(to.y + 16 * to.z)] |= static_cast<std::uint16_t>(1U << to.x);
  }
  return bits;
}

/// Blocks apart from each other, so that none follows a neighbour.
struct Garden {
  Scene scene;
  Grid grid;
  std::vector<std::pair<IVec3, std::string>> blocks;
  IBox box{IVec3(0), {3, 3, 1}};

  void add(const std::string& name, const VoxelProperties& type, std::uint32_t state) {
    const auto number = scene.types.find_or_add(type);
    ASSERT_TRUE(number);
    const IVec3 at{1, 1, 2 * static_cast<int>(blocks.size())};
    grid.set(at, *number, {.state = state});
    blocks.emplace_back(at, name);
    box.max.z = at.z + 2;
  }
  void add_block(const std::string& text) {
    const auto block = parse_block(text);
    BlockTypes types;
    const auto made = types.block("minecraft:" + block->name, block->properties);
    ASSERT_TRUE(made) << text;
    add(text, types.types()[made->type], made->state);
  }
  void add_node(const std::string& name, std::uint8_t param2) {
    add(name + " " + std::to_string(param2), *models::node_properties(name), models::node_state(name, param2));
  }
  void apply_pack() {
    const std::vector<std::filesystem::path> packs = {kBuiltinPack};
    (*BlockPacks::open(packs))->apply(scene.types);
  }

  /// Copies the blocks with a turn. Returns the names of blocks that have no state for it. The shapes of all others
  /// must be those of the originals, turned.
  [[nodiscard]] std::set<std::string> check(const AxisOrientation& turn) const {
    std::set<std::string> without;
    CopyOptions options{.types = &scene.types};
    options.turn_state = [&](const VoxelProperties& type, std::uint32_t state, const AxisOrientation& by) {
      return turned_block_state(type, state, by).value_or(state);
    };
    Grid copy;
    copy_box(grid, box, copy, IVec3(0), turn, options);
    const IVec3 size = turn.size_of(box.size());
    for (const auto& [at, name] : blocks) {
      // The middle of a voxel, doubled, about the middle of the box.
      const IVec3 to = (turn.apply(2 * (at - box.min) + 1 - box.size()) + size - 1) / 2;
      EXPECT_EQ(copy.get(to), grid.get(at)) << name;
      const VoxelProperties& type = scene.types[grid.get(at)];
      const auto state = turned_block_state(type, grid.data(at).state, turn);
      if (!state) {
        without.insert(name);
        EXPECT_EQ(copy.data(to).state, grid.data(at).state) << name;
        continue;
      }
      EXPECT_EQ(copy.data(to).state, *state) << name;
      if (type.shapes.empty()) {
        const auto faces = [&](std::uint32_t of) { return type.orientations.of(of).apply(Direction::PosY); };
        const bool is_column = name.find("log") != std::string::npos;
        if (is_column) {
          EXPECT_EQ(frame_of(faces(*state)).axis, frame_of(turn.apply(faces(grid.data(at).state))).axis) << name;
        }
        continue;
      }
      const auto expected = turned_bits_of(shape_at(grid, scene.types, at), turn);
      EXPECT_EQ(turned_bits_of(shape_at(copy, scene.types, to), AxisOrientation()), expected)
          << name << " by orientation " << turn.index();
    }
    return without;
  }
};

Garden garden_of_blocks() {
  Garden garden;
  for (const char* facing : {"north", "east", "south", "west"}) {
    const std::string f = std::string("facing=") + facing;
    for (const char* half : {"bottom", "top"}) {
      for (const char* shape : {"straight", "inner_left", "inner_right", "outer_left", "outer_right"}) {
        garden.add_block("oak_stairs[" + f + ",half=" + half + ",shape=" + shape + "]");
      }
      for (const char* open : {"false", "true"}) {
        garden.add_block("oak_trapdoor[" + f + ",half=" + half + ",open=" + open + "]");
      }
    }
    for (const char* half : {"lower", "upper"}) {
      for (const char* hinge : {"left", "right"}) {
        for (const char* open : {"false", "true"}) {
          garden.add_block("oak_door[" + f + ",half=" + half + ",hinge=" + hinge + ",open=" + open + "]");
        }
      }
    }
    garden.add_block("ladder[" + f + "]");
    garden.add_block("oak_fence_gate[" + f + ",in_wall=false,open=true]");
  }
  for (unsigned sides = 0; sides < 16; ++sides) {
    const auto value = [&](unsigned i) { return (sides >> i & 1U) != 0 ? "true" : "false"; };
    garden.add_block(std::string("oak_fence[east=") + value(0) + ",north=" + value(1) + ",south=" + value(2) +
                     ",west=" + value(3) + "]");
    const auto height = [&](unsigned i) { return (sides >> i & 1U) == 0 ? "none" : i % 2 == 0 ? "low" : "tall"; };
    garden.add_block(std::string("cobblestone_wall[east=") + height(0) + ",north=" + height(1) + ",south=" + height(2) +
                     ",up=true,west=" + height(3) + "]");
  }
  for (const char* axis : {"x", "y", "z"}) garden.add_block(std::string("oak_log[axis=") + axis + "]");
  for (const char* type : {"bottom", "top", "double"}) garden.add_block(std::string("oak_slab[type=") + type + "]");
  garden.apply_pack();
  return garden;
}

TEST(StateTurns, CopiesHaveTheTurnedShapesOfBlocks) {
  const Garden garden = garden_of_blocks();
  std::map<int, std::size_t> without;  // numbers of turns by the number of blocks that have no state for them
  for (int i = 0; i < AxisOrientation::kCount; ++i) {
    const AxisOrientation turn = AxisOrientation::at(i);
    const std::set<std::string> missing = garden.check(turn);
    const Direction up = turn.apply(Direction::PosY);
    if (up == Direction::PosY) {
      EXPECT_EQ(missing, std::set<std::string>()) << i;
      continue;
    }
    for (const auto& [at, name] : garden.blocks) {
      const bool is_never = name.starts_with("oak_log") || name == "oak_slab[type=double]";
      const bool is_flippable = name.starts_with("oak_stairs") || name.starts_with("oak_slab") ||
                                (name.starts_with("oak_trapdoor") && name.find("open=false") != std::string::npos);
      if (is_never) {
        EXPECT_FALSE(missing.contains(name)) << name;
      }
      if (up == Direction::NegY && is_flippable) {
        EXPECT_FALSE(missing.contains(name)) << name;
      }
      if (name.starts_with("oak_door") || name.starts_with("oak_fence")) {
        EXPECT_TRUE(missing.contains(name)) << name;
      }
    }
    ++without[static_cast<int>(missing.size())];
  }
  EXPECT_EQ(without.size(), 2U) << "lying and upside down";
}

TEST(StateTurns, WithoutThemCopiesDiffer) {
  // As above, but copies by orientations alone keep the states of fences and doors.
  const Garden garden = garden_of_blocks();
  const AxisOrientation turn = AxisOrientation::quarter_turns(1, 1);
  const CopyOptions options{.types = &garden.scene.types};
  Grid copy;
  copy_box(garden.grid, garden.box, copy, IVec3(0), turn, options);
  int differing = 0;
  for (const auto& [at, name] : garden.blocks) {
    const IVec3 to =
        (turn.apply(2 * (at - garden.box.min) + 1 - garden.box.size()) + turn.size_of(garden.box.size()) - 1) / 2;
    const ShapeModel* const shape = shape_at(garden.grid, garden.scene.types, at);
    if (shape == nullptr) continue;
    const ShapeModel* const turned = shape_at(copy, garden.scene.types, to);
    differing += turned_bits_of(turned, AxisOrientation()) != turned_bits_of(shape, turn) ? 1 : 0;
  }
  EXPECT_GT(differing, 20);
}

TEST(StateTurns, CopiesHaveTheTurnedShapesOfNodes) {
  Garden garden;
  for (int facedir = 0; facedir < 24; ++facedir) {
    const auto param2 = static_cast<std::uint8_t>(facedir);
    for (const char* name : {"stairs:stair_wood", "stairs:stair_inner_wood", "stairs:stair_outer_wood",
                             "stairs:slab_wood", "xpanes:pane_flat", "doors:trapdoor_open"}) {
      garden.add_node(name, param2);
    }
  }
  for (int wall = 0; wall < 6; ++wall) garden.add_node("default:sign_wall_wood", static_cast<std::uint8_t>(wall));
  garden.apply_pack();
  for (int i = 0; i < AxisOrientation::kCount; ++i) {
    const std::set<std::string> missing = garden.check(AxisOrientation::at(i));
    for (const std::string& name : missing) EXPECT_TRUE(name.starts_with("default:sign")) << name << " " << i;
    if (AxisOrientation::at(i).apply(Direction::PosY) == Direction::PosY) {
      for (const std::string& name : missing) EXPECT_TRUE(name.ends_with(" 0") || name.ends_with(" 1")) << name;
    }
  }
}

TEST(StateTurns, SchematicsOfRotatedInstancesHaveThem) {
  Scene scene;
  SceneGrid grid;
  const std::vector<std::string> blocks = {"minecraft:oak_fence[east=true,north=false,south=false,west=false]",
                                           "minecraft:oak_door[facing=north,half=lower,hinge=right,open=true]"};
  for (const std::string& text : blocks) {
    const auto block = parse_block(text);
    BlockTypes types;
    const auto made = types.block(block->name, block->properties);
    ASSERT_TRUE(made);
    const auto type = scene.types.find_or_add(types.types()[made->type]);
    grid.grid.set({static_cast<int>(&text - blocks.data()), 0, 0}, *type, {.state = made->state});
  }
  Instance instance;
  instance.rotation = glm::angleAxis(glm::half_pi<double>(), DVec3(0.0, 1.0, 0.0));  // north becomes west
  instance.grid = scene.add_grid(std::move(grid));
  scene.add_instance(std::move(instance));
  const auto path = std::filesystem::temp_directory_path() / "quoin_state_turns_test.schem";
  const auto saved = save_scene(scene, path);
  ASSERT_TRUE(saved) << to_string(saved.error());
  const auto loaded = load_scene(path);
  std::filesystem::remove(path);
  ASSERT_TRUE(loaded);
  std::set<std::string> found;
  const Grid& written = loaded->scene.grids()[loaded->scene.grids().handles().front()].grid;
  written.for_each([&](IVec3 at, VoxelType type) {
    found.insert(to_string(block_text(loaded->scene.types[type], written.data(at).state)));
  });
  EXPECT_EQ(found, (std::set<std::string>{"minecraft:oak_fence[east=false,north=true,south=false,west=false]",
                                          "minecraft:oak_door[facing=west,half=lower,hinge=right,open=true]"}));
}

TEST(StateTurns, IgnoreOtherTypesAndDamagedAttributes) {
  const AxisOrientation turn = AxisOrientation::quarter_turns(1, 1);
  VoxelProperties type{.name = "thing", .state_bits = 8};
  EXPECT_EQ(turned_block_state(type, 3, turn), std::nullopt);
  std::minstd_rand random(11);
  for (const char* layout : {"facing:w3,half:w2", "facing:w9", "facing", "a:b,:n3", "north:w3,north:w3", "axis:n5",
                             "shape:w4,rotation:n5", ""}) {
    for (const char* name : {"minecraft:oak_stairs", "x[", "x[facing=up]", "rail[shape=_]", ""}) {
      type.name = name;
      type.attributes[kStatesAttribute] = layout;
      for (int i = 0; i < 48; ++i) {
        static_cast<void>(turned_block_state(type, static_cast<std::uint32_t>(random()), AxisOrientation::at(i)));
      }
    }
  }
}

}  // namespace
}  // namespace quoin::minecraft
