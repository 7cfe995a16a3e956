#include <algorithm>
#include <cmath>
#include <random>
#include <set>

#include <gtest/gtest.h>

#include "core/death_for_tests.h"
#include "io/vox/chunks.h"
#include "io/vox/vox_for_tests.h"
#include "io/vox/vox_reader.h"
#include "io/vox/write/vox_parts.h"

namespace quoin {
namespace {

using vox_test::difference;
using vox_test::difference_after_round_trip;

class Random {
 public:
  explicit Random(std::uint32_t seed) : engine_(seed) {}
  int between(int low, int high) {
    return low + static_cast<int>(engine_() % static_cast<std::uint32_t>(high - low + 1));
  }

 private:
  std::mt19937 engine_;
};

AxisOrientation random_orientation(Random& random) {
  while (true) {
    const auto found = vox::orientation_from_byte(static_cast<std::uint8_t>(random.between(0, 127)));
    if (found.has_value()) return *found;
  }
}

vox::Attributes random_attributes(Random& random) {
  const std::array<const char*, 7> types = {"_diffuse", "_metal", "_glass", "_emit", "_blend", "_media", "_plastic"};
  vox::Attributes attributes;
  if (random.between(0, 3) != 0) attributes["_type"] = types[static_cast<std::size_t>(random.between(0, 6))];
  for (const char* key : {"_rough", "_metal", "_trans", "_emit", "_weight", "_ri", "_sp"}) {
    if (random.between(0, 2) == 0) attributes[key] = "0." + std::to_string(random.between(0, 9999));
  }
  if (random.between(0, 2) == 0) attributes["_flux"] = std::to_string(random.between(0, 4));
  return attributes;
}

void add_random_types(Random& random, Scene& scene) {
  for (int type = 1; type < 256; ++type) {
    const auto channel = [&] { return static_cast<std::uint8_t>(random.between(0, 255)); };
    const Rgba8 colour{channel(), channel(), channel(), 255};
    const Result<VoxelType> added =
        scene.types.add(vox::decode_material(vox::default_type_name(type), colour, random_attributes(random)));
    ASSERT_TRUE(added);
  }
}

/// Returns a grid laid out in the same way as the reader lays out a model.
SceneGrid random_grid(Random& random) {
  const IVec3 size{random.between(1, 80), random.between(1, 20), random.between(1, 20)};
  SceneGrid grid;
  grid.canvas = vox::canvas_of(size);
  grid.pivot = vox::pivot_of(size);
  const int count = random.between(0, 3000);
  for (int i = 0; i < count; ++i) {
    const IVec3 max = grid.canvas.max - 1;
    grid.grid.set({random.between(0, max.x), random.between(0, max.y), random.between(0, max.z)},
                  static_cast<VoxelType>(random.between(1, 255)));
  }
  return grid;
}

Scene random_scene(std::uint32_t seed) {
  Random random(seed);
  Scene scene;
  add_random_types(random, scene);
  std::vector<GridHandle> grids;
  for (int i = random.between(1, 4); i > 0; --i) grids.push_back(scene.add_grid(random_grid(random)));
  for (int i = random.between(0, 8); i > 0; --i) {
    const vox::InstanceTurn turn = vox::turn_from_orientation(random_orientation(random));
    Instance instance;
    instance.grid = grids[static_cast<std::size_t>(random.between(0, static_cast<int>(grids.size()) - 1))];
    if (random.between(0, 1) == 0) instance.name = "thing " + std::to_string(random.between(0, 3));
    instance.position = {random.between(-1000, 1000), random.between(-1000, 1000), random.between(-1000, 1000)};
    instance.rotation = turn.rotation;
    instance.mirrored = turn.mirrored;
    instance.visible = random.between(0, 3) != 0;
    scene.add_instance(instance);
    SceneGrid& grid = scene.edit(instance.grid);
    if (grid.name.empty() && random.between(0, 2) == 0) grid.name = "grid";
  }
  // Names that the file cannot hold come from the first instance with a name.
  for (const InstanceHandle handle : scene.instances().handles()) {
    std::string& name = scene.edit(scene.instances()[handle].grid).name;
    if (name.empty()) name = scene.instances()[handle].name;
  }
  return scene;
}

TEST(VoxWrite, RoundTripsRandomScenes) {
  for (std::uint32_t seed = 1; seed <= 60; ++seed) {
    const Scene scene = random_scene(seed);
    const auto written = write_vox(scene);
    ASSERT_TRUE(written) << seed;
    const auto loaded = read_vox(written->bytes);
    ASSERT_TRUE(loaded) << seed;
    EXPECT_EQ(difference(scene, loaded->scene), "") << seed;
    EXPECT_EQ(difference_after_round_trip(loaded->scene), "") << seed;
    EXPECT_TRUE(written->warnings.empty());
    EXPECT_EQ(write_vox(loaded->scene)->bytes, written->bytes) << seed;
  }
}

using WorldVoxels = std::set<std::array<std::int64_t, 4>>;

WorldVoxels world_voxels(const Scene& scene) {
  WorldVoxels voxels;
  for (const InstanceHandle handle : scene.instances().handles()) {
    const Instance& instance = scene.instances()[handle];
    const SceneGrid& grid = scene.grids()[instance.grid];
    grid.grid.for_each([&](IVec3 voxel, VoxelType type) {
      const DVec3 centre = world_from_grid(instance, grid, DVec3(voxel) + 0.5);
      voxels.insert({std::llround(std::floor(centre.x)), std::llround(std::floor(centre.y)),
                     std::llround(std::floor(centre.z)), type});
    });
  }
  return voxels;
}

Scene reread(const Scene& scene, std::vector<std::string>& warnings) {
  auto written = write_vox(scene);
  EXPECT_TRUE(written) << to_string(written.error());
  warnings = std::move(written->warnings);
  auto loaded = read_vox(written->bytes);
  EXPECT_TRUE(loaded) << to_string(loaded.error());
  return std::move(loaded->scene);
}

/// Returns a scene with the types 1 to `count`, each of its own colour.
Scene scene_with_types(int count) {
  Scene scene;
  for (int i = 1; i <= count; ++i) {
    VoxelProperties properties;
    properties.name = "kind " + std::to_string(i);
    properties.colour = {static_cast<std::uint8_t>(i), static_cast<std::uint8_t>(i >> 8), 7, 255};
    EXPECT_TRUE(scene.types.add(properties));
  }
  return scene;
}

TEST(VoxWrite, KeepsPositionsForAnyBoundsAndPivot) {
  Scene scene = scene_with_types(5);
  SceneGrid grid;
  grid.grid.fill_box({{-3, -70, 5}, {5, -59, 10}}, 2);
  grid.grid.set({100, 40, -90}, 5);
  grid.pivot = {-1, 2, 11};
  const GridHandle handle = scene.add_grid(std::move(grid));
  for (int byte = 0; byte < 128; ++byte) {
    const auto orientation = vox::orientation_from_byte(static_cast<std::uint8_t>(byte));
    if (!orientation.has_value()) continue;
    const vox::InstanceTurn turn = vox::turn_from_orientation(*orientation);
    scene.add_instance({"i", handle, {byte * 300.0, -7, 9}, turn.rotation, 1.0, turn.mirrored, true});
  }
  std::vector<std::string> warnings;
  const Scene again = reread(scene, warnings);
  ASSERT_EQ(warnings.size(), 1U) << "positions beyond MagicaVoxel's world";
  EXPECT_NE(warnings[0].find("1,000 voxels from the origin"), std::string::npos) << warnings[0];
  EXPECT_EQ(world_voxels(again), world_voxels(scene));
  EXPECT_EQ(again.grids().size(), 1U);
}

TEST(VoxWrite, WarnsOfPositionsBeyondMagicaVoxelWorld) {
  for (const auto& [position, count] : {std::pair(DVec3(1000, -1000, 1000), 0), std::pair(DVec3(0, 0, -1001), 1)}) {
    Scene scene = scene_with_types(2);
    SceneGrid grid;
    grid.canvas = vox::canvas_of({1, 1, 1});
    grid.pivot = vox::pivot_of({1, 1, 1});
    grid.grid.set({0, 0, 0}, 1);
    const GridHandle handle = scene.add_grid(std::move(grid));
    for (int i = 0; i < count + 1; ++i) scene.add_instance({"i", handle, i == 0 ? position : DVec3(0.0)});
    const auto written = write_vox(scene);
    ASSERT_TRUE(written);
    ASSERT_EQ(written->warnings.size(), static_cast<std::size_t>(count));
    if (count > 0) {
      EXPECT_TRUE(written->warnings[0].ends_with("world: 1")) << written->warnings[0];
    }
  }
}

TEST(VoxWrite, SplitsGridsBeyond256InPlace) {
  Scene scene = scene_with_types(5);
  SceneGrid grid;
  grid.grid.fill_box({{-300, 0, 0}, {311, 2, 2}}, 3);
  grid.grid.fill_box({{0, -200, 0}, {1, 401, 1}}, 4);
  grid.grid.set({5, 5, 700}, 5);
  const GridHandle handle = scene.add_grid(std::move(grid));
  for (const int byte : {4, 17, 33, 52, 105, 84}) {
    const auto turn = vox::turn_from_orientation(*vox::orientation_from_byte(static_cast<std::uint8_t>(byte)));
    scene.add_instance({"tower", handle, {byte * 5000.0, 1, 2}, turn.rotation, 1.0, turn.mirrored, byte != 17});
  }
  std::vector<std::string> warnings;
  const Scene again = reread(scene, warnings);
  EXPECT_EQ(world_voxels(again), world_voxels(scene));
  EXPECT_EQ(again.voxel_count(), scene.voxel_count());
  EXPECT_EQ(again.instances().size(), 6 * again.grids().size());
  for (const InstanceHandle instance : again.instances().handles()) {
    EXPECT_EQ(again.instances()[instance].name, "tower");
  }
  for (const GridHandle piece : again.grids().handles()) {
    const IVec3 size = again.grids()[piece].canvas.size();
    EXPECT_LE(std::max({size.x, size.y, size.z}), 256);
  }
  EXPECT_EQ(difference_after_round_trip(again), "");
}

TEST(VoxWrite, KeepsIndicesAndPropertiesOfTypesBelow256) {
  Scene scene = scene_with_types(200);
  VoxelProperties lamp = scene.types[150];
  lamp.emission = 3.0F;
  lamp.visibility = Visibility::Transparent;
  lamp.collides = false;
  scene.types.replace(150, lamp);
  SceneGrid grid;
  grid.grid.set({0, 0, 0}, 150);
  grid.grid.set({1, 0, 0}, 200);
  scene.add_instance({"", scene.add_grid(std::move(grid))});
  std::vector<std::string> warnings;
  const Scene again = reread(scene, warnings);
  EXPECT_EQ(world_voxels(again), world_voxels(scene));
  for (VoxelType type = 1; type <= 200; ++type) {
    VoxelProperties properties = again.types[type];
    properties.attributes.clear();
    EXPECT_EQ(properties, scene.types[type]);
  }
}

// MagicaVoxel has no such key: it is stored under Quoin's own key, independent of the type's other properties.
TEST(VoxWrite, KeepsCollisionOfTypesWithoutWarning) {
  Scene scene = scene_with_types(4);
  for (VoxelType type = 1; type <= 4; ++type) {
    VoxelProperties properties = scene.types[type];
    properties.collides = type % 2 == 0;
    if (type > 2) properties.emission = 1.0F;
    scene.types.replace(type, properties);
  }
  SceneGrid grid;
  for (int i = 0; i < 4; ++i) grid.grid.set({i, 0, 0}, static_cast<VoxelType>(i + 1));
  scene.add_instance({"", scene.add_grid(std::move(grid))});
  std::vector<std::string> warnings;
  const Scene again = reread(scene, warnings);
  EXPECT_TRUE(warnings.empty());
  for (VoxelType type = 1; type <= 4; ++type) EXPECT_EQ(again.types[type].collides, type % 2 == 0);
}

TEST(VoxWrite, RenumbersUsedTypes) {
  Scene scene = scene_with_types(1000);
  SceneGrid grid;
  grid.grid.set({0, 0, 0}, 900);
  grid.grid.set({1, 0, 0}, 40);
  scene.add_instance({"", scene.add_grid(std::move(grid))});
  std::vector<std::string> warnings;
  const Scene again = reread(scene, warnings);
  const SceneGrid& read = again.grids()[again.grids().handles()[0]];
  EXPECT_EQ(read.grid.types(), (std::vector<VoxelType>{1, 2}));
  EXPECT_EQ(again.types[1].name, "kind 40");
  EXPECT_EQ(again.types[2].name, "kind 900");
  EXPECT_EQ(again.types[2].colour, scene.types[900].colour);
}

TEST(VoxWrite, RefusesMoreThan255Types) {
  Scene scene = scene_with_types(300);
  SceneGrid grid;
  for (int i = 1; i <= 256; ++i) grid.grid.set({i, 0, 0}, static_cast<VoxelType>(i));
  scene.add_grid(std::move(grid));
  const auto written = write_vox(scene);
  ASSERT_FALSE(written);
  EXPECT_EQ(written.error().code, ErrorCode::LimitExceeded);
  EXPECT_EQ(written.error().message, "the scene uses 256 voxel types, more than the 255 of a .vox file");
}

TEST(VoxWrite, RefusesGridsWiderThanOffsets) {
  Scene scene = scene_with_types(1);
  SceneGrid grid;
  grid.grid.set({-1'500'000'000, 0, 0}, 1);
  grid.grid.set({0, 0, 0}, 1);
  const GridHandle handle = scene.add_grid(std::move(grid));
  scene.add_instance({"wide", handle});
  EXPECT_TRUE(write_vox(scene));
  scene.edit(handle).grid.set({1'500'000'000, 0, 0}, 1);
  const auto written = write_vox(scene);
  ASSERT_FALSE(written);
  EXPECT_EQ(written.error().code, ErrorCode::LimitExceeded);
  EXPECT_EQ(written.error().message, "instance \"wide\" is too wide for .vox");
}

TEST(VoxWrite, RefusesScenesThatVoxCannotHold) {
  Scene scene = scene_with_types(1);
  SceneGrid grid;
  grid.grid.set({0, 0, 0}, 1);
  const GridHandle handle = scene.add_grid(std::move(grid));
  const InstanceHandle instance = scene.add_instance({"crooked", handle});
  std::vector<std::string> warnings;
  const auto code = [&] {
    const auto written = write_vox(scene);
    if (!written) return std::optional(written.error().code);
    warnings = written->warnings;
    return std::optional<ErrorCode>{};
  };
  EXPECT_EQ(code(), std::nullopt);
  scene.edit(instance).voxel_size = 2.0;
  EXPECT_EQ(code(), std::nullopt) << "a size that all have is left out, with a warning";
  ASSERT_FALSE(warnings.empty());
  EXPECT_NE(warnings.back().find("2 units"), std::string::npos) << warnings.back();
  const InstanceHandle other = scene.add_instance(scene.instances()[instance]);
  scene.edit(other).voxel_size = 1.0;
  EXPECT_EQ(code(), ErrorCode::Unsupported) << "two sizes";
  ASSERT_TRUE(scene.remove_instance(other));
  scene.edit(instance).voxel_size = 1.0;
  scene.edit(instance).rotation = glm::angleAxis(0.5, DVec3(0, 1, 0));
  EXPECT_EQ(code(), ErrorCode::Unsupported);
  scene.edit(instance).rotation = {1, 0, 0, 0};
  scene.edit(instance).position = {1e12, 0, 0};
  EXPECT_EQ(code(), ErrorCode::LimitExceeded);
  scene.edit(instance).position = {0, std::nan(""), 0};
  EXPECT_EQ(code(), ErrorCode::LimitExceeded);
  scene.edit(instance).position = {0, 0.25, 0};
  EXPECT_EQ(code(), std::nullopt);
  EXPECT_EQ(warnings, std::vector<std::string>{"instances rounded to whole voxels: 1"});
}

TEST(VoxWrite, WritesEmptyGridsAndScenes) {
  Scene scene;
  EXPECT_EQ(difference_after_round_trip(scene), "number of types");
  std::vector<std::string> warnings;
  EXPECT_TRUE(reread(scene, warnings).grids().empty());
  scene.add_instance({"nothing", scene.add_grid({})});
  const Scene again = reread(scene, warnings);
  EXPECT_EQ(again.grids().size(), 1U);
  EXPECT_EQ(again.voxel_count(), 0);
  EXPECT_EQ(difference_after_round_trip(again), "");
}

TEST(VoxWrite, VisitsVoxelsInGridOrder) {
  const Scene scene = random_scene(3);
  for (const GridHandle handle : scene.grids().handles()) {
    vox_test::VoxelList expected;
    const Grid& grid = scene.grids()[handle].grid;
    grid.for_each([&](IVec3 v, VoxelType type) { expected.emplace_back(v.x, v.y, v.z, type); });
    EXPECT_EQ(vox_test::voxels_of(grid), expected);
  }
}

TEST(VoxWrite, ReportsProgressAndCanBeCancelled) {
  Scene scene;
  VoxelProperties grey;
  grey.colour = {9, 9, 9, 255};
  const VoxelType type = scene.types.add(grey).value();
  for (int i = 0; i < 5; ++i) {
    SceneGrid grid;
    grid.grid.fill_box({{0, 0, 0}, {4 + i, 4, 4}}, type);
    Instance instance;
    instance.grid = scene.add_grid(std::move(grid));
    scene.add_instance(instance);
  }
  std::vector<double> reported;
  const auto written = write_vox(scene, [&](double share) { return reported.push_back(share), true; });
  ASSERT_TRUE(written);
  EXPECT_EQ(reported, (std::vector<double>{0.2, 0.4, 0.6, 0.8, 1.0}));
  auto loaded = read_vox(written->bytes);
  ASSERT_TRUE(loaded);
  loaded->scene.edit(loaded->scene.grids().handles()[2]).grid.set({0, 0, 0}, kAir);
  reported.clear();
  ASSERT_TRUE(write_vox(*loaded, [&](double share) { return reported.push_back(share), true; }));
  EXPECT_EQ(reported.size(), 5U);
  for (const std::size_t last : {1, 3}) {
    const Progress until = [&reported, last](double share) {
      return reported.push_back(share), reported.size() < last;
    };
    reported.clear();
    const auto anew = write_vox(scene, until);
    ASSERT_FALSE(anew);
    EXPECT_EQ(anew.error().code, ErrorCode::Cancelled);
    EXPECT_EQ(reported.size(), last);
    reported.clear();
    EXPECT_EQ(write_vox(*loaded, until).error().code, ErrorCode::Cancelled);
    EXPECT_EQ(reported.size(), last);
  }
}

TEST(VoxWrite, IsDeterministic) {
  EXPECT_EQ(write_vox(random_scene(7))->bytes, write_vox(random_scene(7))->bytes);
}

TEST(VoxDeathTest, AssertsOnUnplacedPieces) {
  const std::vector<vox::Piece> pieces(1);
  QUOIN_EXPECT_MISTAKE(vox::write_voxels({}, {}, pieces, {}, {}), "a place for every piece");
}

}  // namespace
}  // namespace quoin
