#include <array>
#include <cstddef>
#include <memory>
#include <new>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "core/work/nightly_for_tests.h"
#include "grid/change_follower_for_tests.h"
#include "live/allocations_for_tests.h"
#include "scene/tracer/changing_scene_for_tests.h"

namespace quoin {
namespace {

std::vector<SelectedInstance> random_details(const SceneTracer& tracer, ChangingScene& world) {
  std::vector<SelectedInstance> selected;
  for (const PlacedGrid& placed : placed_in(tracer)) {
    if (world.below(4) == 0) continue;
    selected.push_back({placed.instance, Detail::Mid, world.below(kMaxGridLevel + 1)});
  }
  return selected;
}

// Compares both tracers in the same random levels of detail.
void expect_same_details(const SceneTracer& tracer, const SceneTracer& fresh, ChangingScene& world,
                         TracerCounts& counts) {
  const auto selected = random_details(fresh, world);
  const SceneTracer detailed = tracer.with_detail(selected, {1});
  const SceneTracer fresh_detailed = fresh.with_detail(selected, {1});
  expect_same_placed(detailed, fresh_detailed, true, counts);
  expect_same_hits(detailed, fresh_detailed, world, counts);
}

TEST(SceneUpdate, UpdatedTracerMatchesNewTracer) {
  TracerCounts counts;
  for (unsigned seed = 0; seed < 60; ++seed) {
    SCOPED_TRACE(seed);
    ChangingScene world(seed);
    const InstanceFilter filter = seed % 3 == 0 ? InstanceFilter::All : InstanceFilter::Visible;
    SceneTracer tracer(world.scene, filter, {1});
    for (int round = 0; round < 12; ++round) {
      SCOPED_TRACE(round);
      for (int i = world.below(8); i >= 0; --i) world.change();
      tracer.update({1});
      const SceneTracer fresh(world.scene, filter, {1});
      expect_same_placed(tracer, fresh, false, counts);
      expect_same_hits(tracer, fresh, world, counts);
      if (round % 2 == 0) expect_same_details(tracer, fresh, world, counts);
      if (HasFatalFailure()) return;
    }
  }
  EXPECT_GT(counts.hits, 1000);
  EXPECT_GT(counts.transparent, 100);
  EXPECT_GT(counts.halved, 200);
}

// Two tracers take turns with snapshots. A snapshot ends when its tracer goes over to a later one.
TEST(SceneUpdate, TracerOfNextSnapshotMatchesNewTracer) {
  TracerCounts counts;
  for (unsigned seed = 0; seed < static_cast<unsigned>(cases(10, 40)); ++seed) {
    SCOPED_TRACE(seed);
    ChangingScene world(seed, true);
    std::array<std::unique_ptr<Scene>, 2> scenes;
    std::vector<SceneTracer> tracers;
    for (auto& scene : scenes) {
      scene = std::make_unique<Scene>(world.scene.snapshot());
      tracers.emplace_back(*scene, InstanceFilter::Visible, Threads{1});
    }
    for (std::size_t round = 0; round < 16; ++round) {
      SCOPED_TRACE(round);
      for (int i = world.below(8); i > 0; --i) world.change();
      auto now = std::make_unique<Scene>(world.scene.snapshot());
      SceneTracer& tracer = tracers[round % 2];
      tracer.update(*now, {1});
      scenes[round % 2] = std::move(now);
      const SceneTracer fresh(*scenes[round % 2], InstanceFilter::Visible, {1});
      EXPECT_EQ(&tracer.scene(), &fresh.scene());
      expect_same_placed(tracer, fresh, false, counts);
      expect_same_hits(tracer, fresh, world, counts);
      expect_same_details(tracer, fresh, world, counts);
      if (HasFatalFailure()) return;
    }
  }
  EXPECT_GT(counts.hits, 1000);
  EXPECT_GT(counts.transparent, 100);
  EXPECT_GT(counts.halved, 100);
}

struct TwoCubes {
  Scene scene;
  GridHandle grid;
  InstanceHandle near;
  TwoCubes() {
    EXPECT_TRUE(scene.types.add({}).has_value());
    grid = add_cube();
    near = scene.add_instance({"", grid});
    scene.add_instance({"", add_cube(), {30, 0, 0}});
  }
  GridHandle add_cube() {
    SceneGrid cube;
    cube.grid.fill_box({{0, 0, 0}, {100, 10, 10}}, 1);
    return scene.add_grid(std::move(cube));
  }
};

TEST(SceneUpdate, ShapesFollowEditsStatesAndTypes) {
  TracerCounts counts;
  for (unsigned seed = 0; seed < static_cast<unsigned>(cases(4, 40)); ++seed) {
    SCOPED_TRACE(seed);
    ChangingScene world(seed, false, true);
    SceneTracer tracer(world.scene, InstanceFilter::Visible, {1});
    auto copy = std::make_unique<Scene>(world.scene.snapshot());
    SceneTracer of_copies(*copy, InstanceFilter::Visible, {1});
    for (int round = 0; round < 12; ++round) {
      SCOPED_TRACE(round);
      for (int i = world.below(6); i >= 0; --i) world.change();
      tracer.update({1});
      auto now = std::make_unique<Scene>(world.scene.snapshot());
      of_copies.update(*now, {1});
      copy = std::move(now);
      const SceneTracer fresh(world.scene, InstanceFilter::Visible, {1});
      expect_same_placed(tracer, fresh, false, counts);
      const SceneTracer fresh_of_copy(*copy, InstanceFilter::Visible, {1});
      expect_same_placed(of_copies, fresh_of_copy, false, counts);
      expect_same_hits(tracer, fresh, world, counts);
      if (round % 3 == 0) expect_same_details(tracer, fresh, world, counts);
      if (HasFatalFailure()) return;
    }
  }
  EXPECT_GT(counts.hits, 100);
  EXPECT_GT(counts.shapes, 100);
}

// A wet slab shows a fluid that no voxel of its grid is of.
TEST(SceneUpdate, ContainedFluidsFollowTheirTypes) {
  Scene scene;
  const VoxelProperties of_sea{.name = "sea",
                               .visibility = Visibility::Transparent,
                               .state_bits = 4,
                               .shapes = *VoxelShapes::from_rules({.neighbours = ShapeNeighbours::Fluid, .groups = 2})};
  ShapeRules rules{.parts = {{.shape = VoxelShape::box({0, 0, 0}, {16, 8, 16})}}};
  rules.fluid = ContainedFluid{.groups = 2};
  const VoxelType slab = *scene.types.add({.name = "slab", .shapes = *VoxelShapes::from_rules(std::move(rules))});
  SceneGrid placed;
  placed.grid.set({0, 0, 0}, slab);
  const GridHandle handle = scene.add_grid(std::move(placed));
  scene.add_instance({.grid = handle});
  SceneTracer tracer(scene);
  TracerCounts counts;
  const auto shapes_at = [&](IVec3 voxel) {
    tracer.update();
    expect_same_placed(tracer, SceneTracer(scene), false, counts);
    return placed_in(tracer)[0].shapes->index.at(voxel).size();
  };
  EXPECT_EQ(shapes_at({0, 0, 0}), 1U) << "there is no fluid";
  const VoxelType sea = *scene.types.add(of_sea);
  EXPECT_EQ(shapes_at({0, 0, 0}), 2U) << "the first fluid of its groups came";
  scene.types.replace(sea, {.name = "ice"});
  EXPECT_EQ(shapes_at({0, 0, 0}), 1U) << "the fluid became another type";
  // Another chunk changes. Nothing remembers the models of the former type, which are gone.
  scene.edit(handle).grid.set({300, 0, 0}, slab);
  EXPECT_EQ(shapes_at({0, 0, 0}), 1U);
  EXPECT_EQ(shapes_at({300, 0, 0}), 1U);
  scene.types.replace(sea, of_sea);
  EXPECT_EQ(shapes_at({300, 0, 0}), 2U);
  EXPECT_GT(counts.shapes, 4);
}

TEST(SceneUpdate, OnlyGridsWithShapesHaveIndex) {
  TwoCubes world;
  SceneTracer tracer(world.scene);
  VoxelProperties slab{.name = "slab"};
  slab.shapes = VoxelShape::box({0, 0, 0}, {16, 8, 16});
  const VoxelType type = *world.scene.types.add(slab);
  tracer.update();
  EXPECT_EQ(placed_in(tracer)[0].shapes, nullptr);
  Grid& grid = world.scene.edit(world.grid).grid;
  grid.set({3, 10, 3}, type);
  const std::size_t bytes = tracer.bytes();
  EXPECT_TRUE(tracer.update());
  const TracedShapes* const shapes = placed_in(tracer)[0].shapes;
  ASSERT_NE(shapes, nullptr);
  EXPECT_GT(tracer.bytes(), bytes);
  EXPECT_EQ(placed_in(tracer)[0].transparent, nullptr) << "a shaped voxel is no cube";
  EXPECT_EQ(placed_in(tracer)[1].shapes, nullptr);
  EXPECT_TRUE(shapes->touched.is_occupied({3, 10, 3}));
  EXPECT_EQ(shapes->index.at({3, 10, 3}).size(), 1U);
  EXPECT_FALSE(shapes->touched.is_occupied({3, 9, 3}));
  slab.shapes = *VoxelShape::from_elements({{.min = {0, 0, 0}, .max = {16, 32, 16}}});
  world.scene.types.replace(type, slab);
  EXPECT_TRUE(tracer.update());
  EXPECT_TRUE(placed_in(tracer)[0].shapes->touched.is_occupied({3, 11, 3}));
  grid.set({3, 10, 3}, kAir);
  EXPECT_TRUE(tracer.update());
  EXPECT_EQ(placed_in(tracer)[0].shapes, nullptr);
}

TEST(SceneUpdate, TracesUnrelatedScene) {
  ChangingScene first(1, true);
  ChangingScene second(2, true);
  SceneTracer tracer(first.scene, InstanceFilter::Visible, {1});
  TracerCounts counts;
  for (ChangingScene* world : {&second, &first, &second}) {
    for (int i = 0; i < 4; ++i) world->change();
    tracer.update(world->scene, {1});
    const SceneTracer fresh(world->scene, InstanceFilter::Visible, {1});
    expect_same_placed(tracer, fresh, false, counts);
    expect_same_hits(tracer, fresh, *world, counts);
  }
  EXPECT_GT(counts.hits, 0);
}

TEST(SceneUpdate, KeepsTreesAndReportsChanges) {
  TwoCubes world;
  SceneTracer tracer(world.scene);
  const OccupancyTree* first = placed_in(tracer)[0].opaque;
  const OccupancyTree* second = placed_in(tracer)[1].opaque;
  EXPECT_FALSE(tracer.update());
  world.scene.edit(world.near).position = {1, 2, 3};
  EXPECT_FALSE(tracer.update());
  world.scene.edit(world.near).visible = false;
  EXPECT_FALSE(tracer.update());
  world.scene.edit(world.near).visible = true;
  EXPECT_FALSE(tracer.update()) << "trees outlive their instances";
  world.scene.edit(world.grid).grid.set({70, 20, 0}, 1);
  EXPECT_TRUE(tracer.update());
  EXPECT_EQ(placed_in(tracer)[0].opaque, first);
  EXPECT_EQ(placed_in(tracer)[1].opaque, second);
  EXPECT_TRUE(first->is_occupied({70, 20, 0}));
}

// An instance gets a grid without earlier instances while the bounds of another grid change.
TEST(SceneUpdate, BuildsTreesOfNewlyShownGrid) {
  TwoCubes world;
  const GridHandle hidden = world.add_cube();
  SceneTracer tracer(world.scene);
  world.scene.edit(world.near).grid = hidden;
  const GridHandle other = world.scene.instances()[world.scene.instances().handles()[1]].grid;
  world.scene.edit(other).grid.set({5, 40, 5}, 1);
  tracer.update();
  EXPECT_EQ(placed_in(tracer)[0].opaque->bounds(), world.scene.grids()[hidden].grid.bounds());
  EXPECT_EQ(placed_in(tracer)[1].opaque->bounds(), world.scene.grids()[other].grid.bounds());
}

TEST(SceneUpdate, OtherConsumersMissNoChanges) {
  TwoCubes world;
  SceneTracer tracer(world.scene);
  Grid& grid = world.scene.edit(world.grid).grid;
  ChangeFollower follower(grid);
  grid.set({5, 5, 5}, kAir);
  tracer.update();
  EXPECT_EQ(follower.take(grid), (std::vector<IVec3>{{0, 0, 0}}));
  grid.set({6, 5, 5}, kAir);
  (void)follower.take(grid);
  tracer.update();
  EXPECT_FALSE(placed_in(tracer)[0].opaque->is_occupied({6, 5, 5}));
}

// A state turns a beam away from a chunk that it touched before: no trees keep its old voxels, also if memory runs out.
TEST(TreeCache, RecoversFromFailedUpdatesOfShapes) {
  VoxelRegistry types;
  VoxelProperties of_beam{.name = "beam", .state_bits = 2};
  of_beam.orientations = StateOrientations::about_y();
  of_beam.shapes = *VoxelShape::from_elements({{.min = {0, 4, 4}, .max = {32, 8, 8}}});
  const VoxelType beam = *types.add(of_beam);
  Grid grid;
  grid.set({63, 5, 5}, beam);
  grid.set({200, 5, 5}, beam);
  int failures = 0;
  for (int n = 0; n == failures; ++n) {
    grid.set_data({63, 5, 5}, {.state = 0});
    TreeCache trees(ShapedVoxels::ByShape);
    trees.update(grid, types);
    ASSERT_TRUE(trees.shapes()->touched.is_occupied({64, 5, 5}));
    grid.set_data({63, 5, 5}, {.state = 2});
    fail_allocation(n);
    try {
      trees.update(grid, types);
    } catch (const std::bad_alloc&) {
      ++failures;
    }
    fail_allocation(-1);
    trees.update(grid, types);
    ASSERT_NE(trees.shapes(), nullptr) << n;
    for (const OccupancyTree* tree : {&trees.shapes()->touched, &trees.shapes()->solid}) {
      ASSERT_FALSE(tree->is_occupied({64, 5, 5})) << n;
      ASSERT_TRUE(tree->is_occupied({62, 5, 5})) << n;
      ASSERT_TRUE(tree->is_occupied({200, 5, 5})) << n;
    }
    ASSERT_FALSE(trees.update(grid, types)) << n;
  }
  EXPECT_GT(failures, 10);
}

}  // namespace
}  // namespace quoin
