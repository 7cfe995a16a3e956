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
#include "trace/tree_view.h"

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

VoxelFaces faces_of(FaceAlpha alpha) {
  AlphaImage image{16, 16, {}};
  for (int i = 0; i < 256; ++i) {
    image.rgba.insert(image.rgba.end(), {90, 160, 60, static_cast<std::uint8_t>(i % 2 == 0 ? 255 : 0)});
  }
  return VoxelFaces(VoxelFace{.texture = Texture::from_image("leaves", image).value(), .alpha = alpha});
}

// Leaves around a stone, and glass that a pane of a neighbouring voxel touches.
struct LeavesAndGlass {
  VoxelRegistry types;
  Grid grid;
  VoxelType stone = kAir;
  VoxelType leaf = kAir;

  LeavesAndGlass() {
    stone = *types.add({.name = "stone"});
    leaf = *types.add({.name = "leaf", .visibility = Visibility::Transparent, .faces = faces_of(FaceAlpha::Cutout)});
    const VoxelType glass = *types.add({.name = "glass", .visibility = Visibility::Transparent});
    VoxelProperties of_pane{.name = "pane", .visibility = Visibility::Transparent};
    of_pane.shapes = *VoxelShape::from_elements({{.min = {-8, 4, 4}, .max = {8, 8, 8}}});
    grid.fill_box({{5, 5, 5}, {12, 12, 12}}, leaf);
    grid.set({7, 8, 8}, stone);
    grid.fill_box({{16, 16, 16}, {32, 32, 32}}, glass);
    grid.set({32, 20, 20}, *types.add(of_pane));
  }
};

TEST(TreeCache, SplitsTransparentVoxelsForImages) {
  LeavesAndGlass world;
  TreeCache trees(ShapedVoxels::ForSight);
  trees.update(world.grid, world.types);
  ASSERT_NE(trees.glass_voxels(), nullptr);
  ASSERT_NE(trees.face_cells(), nullptr);
  EXPECT_TRUE(trees.transparent()->is_occupied({8, 8, 8}));
  EXPECT_TRUE(trees.face_cells()->is_occupied({5, 8, 8}));
  EXPECT_FALSE(trees.face_cells()->is_occupied({9, 8, 8})) << "leaves on all sides";
  EXPECT_FALSE(trees.face_cells()->is_occupied({8, 8, 8})) << "leaves and a stone";
  EXPECT_FALSE(trees.glass_voxels()->is_occupied({5, 8, 8}));
  for (const IVec3 voxel : {IVec3{16, 16, 16}, IVec3{31, 20, 20}, IVec3{32, 20, 20}}) {
    EXPECT_TRUE(trees.glass_voxels()->is_occupied(voxel));
    EXPECT_FALSE(trees.face_cells()->is_occupied(voxel));
  }
  // The brick (1, 1, 1) is full of glass, but the pane touches the cell (3, 1, 1) of it.
  const trace::ChunkNode* const node = trace::TreeNodes(*trees.glass_voxels()).find_chunk({0, 0, 0});
  ASSERT_NE(node, nullptr);
  const trace::UniformBlocks& blocks = trace::TreeNodes::uniform_blocks(*node);
  EXPECT_EQ(~blocks.cells[21], std::uint64_t{1} << (3 + 4 + 16));
  EXPECT_EQ(blocks.bricks, 0U);

  world.grid.set({9, 8, 8}, kAir);
  EXPECT_TRUE(trees.update(world.grid, world.types));
  EXPECT_TRUE(trees.face_cells()->is_occupied({10, 8, 8}));
  world.grid.fill_box({{5, 5, 5}, {12, 12, 12}}, kAir);
  EXPECT_TRUE(trees.update(world.grid, world.types));
  EXPECT_EQ(trees.face_cells(), nullptr);
}

TEST(TreeCache, KnowsWhenTexturesChangeTheKindOfVoxels) {
  LeavesAndGlass world;
  TreeCache trees(ShapedVoxels::ForSight);
  trees.update(world.grid, world.types);
  EXPECT_FALSE(trees.has_other_cells(world.types, world.leaf));
  VoxelProperties leaf = world.types[world.leaf];
  leaf.faces = faces_of(FaceAlpha::Translucent);
  world.types.replace(world.leaf, leaf);
  EXPECT_TRUE(trees.has_other_cells(world.types, world.leaf));
  trees.forget();
  trees.update(world.grid, world.types);
  EXPECT_FALSE(trees.has_other_cells(world.types, world.leaf));
  EXPECT_EQ(trees.face_cells(), nullptr);
  EXPECT_TRUE(trees.glass_voxels()->is_occupied({8, 8, 8}));
}

// Worlds without shapes and cells of faces have no further trees.
TEST(TreeCache, SharesTheTreeOfPlainGlass) {
  VoxelRegistry types;
  const VoxelType glass = *types.add({.name = "glass", .visibility = Visibility::Transparent});
  Grid grid;
  grid.set({1, 2, 3}, glass);
  TreeCache trees(ShapedVoxels::ForSight);
  trees.update(grid, types);
  EXPECT_EQ(trees.glass_voxels(), trees.transparent());
  EXPECT_EQ(trees.face_cells(), nullptr);
}

// The first update only knows cubes, so it does not look at shapes.
TEST(TreeCache, AddsShapesNextToGlassThatItKnows) {
  VoxelRegistry types;
  const VoxelType glass = *types.add({.name = "glass", .visibility = Visibility::Transparent});
  VoxelProperties of_pane{.name = "pane", .visibility = Visibility::Transparent};
  of_pane.shapes = *VoxelShape::from_elements({{.min = {4, 4, 4}, .max = {8, 8, 8}}});
  const VoxelType pane = *types.add(of_pane);
  for (const ShapedVoxels shaped : {ShapedVoxels::AsCubes, ShapedVoxels::ByShape, ShapedVoxels::ForSight}) {
    Grid grid;
    grid.set({1, 2, 3}, glass);
    TreeCache trees(shaped);
    trees.update(grid, types);
    ASSERT_TRUE(trees.transparent()->is_occupied({1, 2, 3}));
    grid.set({5, 5, 5}, pane);
    EXPECT_TRUE(trees.update(grid, types));
    EXPECT_TRUE(trees.transparent()->is_occupied({1, 2, 3}));
    const bool is_cube = shaped == ShapedVoxels::AsCubes;
    EXPECT_EQ(trees.transparent()->is_occupied({5, 5, 5}), is_cube);
    EXPECT_EQ(trees.shapes() == nullptr, is_cube);
    if (shaped != ShapedVoxels::ForSight) continue;
    ASSERT_NE(trees.glass_voxels(), nullptr);
    EXPECT_TRUE(trees.glass_voxels()->is_occupied({1, 2, 3}));
    EXPECT_TRUE(trees.glass_voxels()->is_occupied({5, 5, 5}));
  }
}

TEST(TreeCache, RecoversFromFailedUpdatesOfTreesForImages) {
  int failures = 0;
  for (int n = 0; n == failures; ++n) {
    LeavesAndGlass world;
    TreeCache trees(ShapedVoxels::ForSight);
    trees.update(world.grid, world.types);
    world.grid.set({9, 8, 8}, kAir);
    world.grid.set({32, 20, 20}, kAir);
    fail_allocation(n);
    try {
      trees.update(world.grid, world.types);
    } catch (const std::bad_alloc&) {
      ++failures;
    }
    fail_allocation(-1);
    trees.update(world.grid, world.types);
    ASSERT_NE(trees.face_cells(), nullptr) << n;
    ASSERT_TRUE(trees.face_cells()->is_occupied({10, 8, 8})) << n;
    ASSERT_FALSE(trees.glass_voxels()->is_occupied({32, 20, 20})) << n;
    ASSERT_TRUE(trees.glass_voxels()->is_occupied({31, 20, 20})) << n;
  }
  EXPECT_GT(failures, 10);
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
