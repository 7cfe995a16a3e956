#include <quoin/scene/scene_faces.h>

#include <gtest/gtest.h>

#include <random>
#include <utility>
#include <vector>

#include <quoin/scene/scene_meshes.h>

#include "grid/shapes/shape_types_for_tests.h"
#include "mesh/mesh_oracle.h"

namespace quoin {
namespace {

/// Counts one voxel and one face at a time.
FaceCounts slow_counts(const Scene& scene, InstanceFilter filter) {
  FaceCounts counts;
  for (const GridHandle handle : scene.grids().handles()) {
    bool is_counted = false;
    scene.instances().for_each([&](InstanceHandle, const Instance& instance) {
      is_counted = is_counted || (instance.grid == handle && is_drawn(scene, instance, filter));
    });
    if (!is_counted) continue;
    const Grid& grid = scene.grids()[handle].grid;
    counts +=
        {static_cast<std::int64_t>(oracle::visible_faces(grid, scene.types, false).size()), 6 * grid.voxel_count()};
  }
  return counts;
}

GridHandle add_random_grid(Scene& scene, std::mt19937& random) {
  SceneGrid grid;
  grid.grid = oracle::random_world(random(), {IVec3{-9}, IVec3{9}}, 5, 0.2);
  return scene.add_grid(std::move(grid));
}

/// Makes a random change of a scene.
void change(Scene& scene, std::mt19937& random) {
  const auto grids = scene.grids().handles();
  const auto instances = scene.instances().handles();
  const auto any_grid = [&] { return grids[random() % grids.size()]; };
  const auto voxel = [&] { return IVec3(random() % 18, random() % 18, random() % 18) - 9; };
  switch (random() % 9) {
    case 0:
      if (random() % 3 == 0) add_random_grid(scene, random);
      break;
    case 1:
      scene.add_instance({.name = "", .grid = any_grid(), .visible = random() % 2 == 0});
      break;
    case 2:
      if (!instances.empty()) scene.remove_instance(instances[random() % instances.size()]);
      break;
    case 3:
      if (grids.size() > 2) scene.remove_grid(any_grid());
      break;
    case 4:
      if (!instances.empty()) {
        Instance& instance = scene.edit(instances[random() % instances.size()]);
        instance.visible = !instance.visible;
        instance.position.x += 1.0;
      }
      break;
    case 5:
      if (random() % 4 == 0) scene.edit(any_grid()).grid.clear();
      break;
    case 6: {
      const auto type = static_cast<VoxelType>(1 + random() % 5);
      VoxelProperties properties = scene.types[type];
      properties.visibility = random() % 2 == 0 ? Visibility::Opaque : Visibility::Transparent;
      scene.types.replace(type, properties);
      break;
    }
    default:
      for (int i = 0; i < 3; ++i) scene.edit(any_grid()).grid.set(voxel(), static_cast<VoxelType>(random() % 6));
  }
}

TEST(SceneFaces, FollowSceneChanges) {
  constexpr unsigned kSeed = 31;
  std::mt19937 random(kSeed);
  Scene scene;
  scene.types = oracle::mixed_types();
  for (int i = 0; i < 3; ++i) add_random_grid(scene, random);
  SceneFaces visible;
  SceneFaces all(InstanceFilter::All);
  for (int round = 0; round < 400; ++round) {
    change(scene, random);
    if (random() % 3 == 0) continue;  // several changes at once
    ASSERT_EQ(visible.update(scene), slow_counts(scene, InstanceFilter::Visible)) << "seed " << kSeed << " " << round;
    ASSERT_EQ(all.update(scene), slow_counts(scene, InstanceFilter::All)) << "seed " << kSeed << " " << round;
    ASSERT_EQ(all.counts(), count_faces(scene, InstanceFilter::All));
  }
}

TEST(SceneFaces, MatchMesher) {
  std::mt19937 random(5);
  Scene scene;
  scene.types = oracle::mixed_types();
  for (int i = 0; i < 4; ++i) {
    const GridHandle grid = add_random_grid(scene, random);
    for (int placed = 0; placed < i; ++placed) {
      scene.add_instance({.name = "", .grid = grid, .visible = placed % 2 == 0 && i != 1});
    }
  }
  for (const InstanceFilter filter : {InstanceFilter::Visible, InstanceFilter::All}) {
    const auto meshes = mesh_scene(scene, {.instances = filter});
    ASSERT_TRUE(meshes);
    const FaceCounts counts = count_faces(scene, filter);
    EXPECT_EQ(counts, (FaceCounts{meshes->stats.faces_visible, meshes->stats.faces_total}));
    EXPECT_GT(counts.visible, 0);
  }
}

TEST(SceneFaces, CountAnotherSceneFromScratch) {
  std::mt19937 random(6);
  SceneFaces faces;
  EXPECT_EQ(faces.update(Scene()), FaceCounts());
  for (int i = 0; i < 3; ++i) {
    Scene scene;
    scene.types = oracle::mixed_types();
    const GridHandle grid = add_random_grid(scene, random);
    scene.add_instance({.name = "", .grid = grid});
    EXPECT_EQ(faces.update(scene), slow_counts(scene, InstanceFilter::Visible));
    scene.edit(grid).grid.set({40, 40, 40}, 1);
    EXPECT_EQ(faces.update(scene.snapshot()), slow_counts(scene, InstanceFilter::Visible));
  }
}

TEST(SceneFaces, FollowShapesAndTheirStates) {
  constexpr unsigned kSeed = 7;
  std::mt19937 random(kSeed);
  Scene scene;
  const ShapeTypes types(scene.types);
  // Covers sides that its other neighbours select.
  const VoxelShape plate = VoxelShape::box({0, 0, 0}, {1, 16, 16});
  const VoxelShapes follower =
      *VoxelShapes::from_rules({.parts = {{.shape = plate, .when = {{.connected = {Direction::PosX}}}},
                                          {.shape = VoxelShape::box({7, 0, 7}, {9, 16, 9})}},
                                .neighbours = ShapeNeighbours::Connected});
  const VoxelType screen = *scene.types.add({.name = "screen", .shapes = follower});
  const std::vector<VoxelType> all = {kAir, types.stone, types.stone, types.slab, types.stairs, types.door, screen};
  const GridHandle handle = scene.add_grid({});
  scene.add_instance({.grid = handle});
  SceneFaces faces;
  for (int round = 0; round < 600; ++round) {
    const auto near_border = [&] { return kChunkEdge - 3 + static_cast<int>(random() % 6); };
    const IVec3 at{near_border(), near_border(), near_border()};
    Grid& grid = scene.edit(handle).grid;
    if (random() % 2 == 0) grid.set(at, all[random() % all.size()]);
    if (grid.get(at) != kAir) (void)grid.set_data(at, {.state = static_cast<std::uint32_t>(random() % 4)});
    if (round % 100 == 99) {
      VoxelProperties slab = scene.types[types.slab];
      slab.shapes = VoxelShape::box({0, 0, 0}, {16, 1 + round / 100, 16});
      slab.visibility = round % 200 == 99 ? Visibility::Transparent : Visibility::Opaque;
      scene.types.replace(types.slab, slab);
    }
    ASSERT_EQ(faces.update(scene), count_faces(scene)) << "seed " << kSeed << " " << round;
  }
}

TEST(SceneFaces, PrintThousandsSeparators) {
  EXPECT_EQ(to_string(FaceCounts{1'234, 5'000'676}), "Faces: 1,234 visible of 5,000,676 total");
}

}  // namespace
}  // namespace quoin
