#include <quoin/scene/scene.h>

#include <gtest/gtest.h>

namespace quoin {
namespace {

const DQuat kQuarterTurnAboutY = glm::angleAxis(1.5707963267948966, DVec3(0, 1, 0));

SceneGrid box_grid(IVec3 first, IVec3 last) {
  SceneGrid grid;
  grid.grid.fill_box({first, last + 1}, 1);
  return grid;
}

TEST(Scene, WorldFromGridMirrorsThenTurnsAboutPivot) {
  SceneGrid grid;
  grid.pivot = {1, 2, 3};
  Instance instance;
  instance.position = {100, 200, 300};
  instance.rotation = kQuarterTurnAboutY;
  EXPECT_EQ(world_from_grid(instance, grid, {1, 2, 3}), DVec3(100, 200, 300));
  EXPECT_EQ(world_from_grid(instance, grid, {5, 2, 3}), DVec3(100, 200, 296));
  instance.mirrored = true;
  instance.voxel_size = 0.5;
  EXPECT_EQ(world_from_grid(instance, grid, {5, 2, 3}), DVec3(100, 200, 302));
}

TEST(Scene, BoundsSurroundPlacedInstances) {
  Scene scene;
  EXPECT_TRUE(scene.bounds(InstanceFilter::All).empty());
  const GridHandle grid = scene.add_grid(box_grid({0, 0, 0}, {3, 1, 0}));
  EXPECT_TRUE(scene.bounds(InstanceFilter::All).empty());
  scene.add_instance({"", grid, {10, 0, 0}, kQuarterTurnAboutY});
  const DBox shown = scene.bounds();
  EXPECT_EQ(shown.min, DVec3(10, 0, -4));
  EXPECT_EQ(shown.max, DVec3(11, 2, 0));
  scene.add_instance({"", grid, {0, 50, 0}, DQuat(1, 0, 0, 0), 1.0, false, false});
  EXPECT_EQ(scene.bounds().max, shown.max);
  EXPECT_EQ(scene.bounds(InstanceFilter::All).max.y, 52);
}

TEST(Scene, RemovesInstancesOfRemovedGrid) {
  Scene scene;
  const GridHandle a = scene.add_grid(box_grid({0, 0, 0}, {0, 0, 0}));
  const GridHandle b = scene.add_grid(box_grid({0, 0, 0}, {1, 1, 1}));
  scene.add_instance({"a", a});
  scene.add_instance({"b", b});
  scene.add_instance({"a too", a});
  EXPECT_EQ(scene.voxel_count(), 9);
  EXPECT_TRUE(scene.remove_grid(a));
  EXPECT_FALSE(scene.remove_grid(a));
  ASSERT_EQ(scene.instances().size(), 1U);
  EXPECT_EQ(scene.instances()[scene.instances().handles()[0]].name, "b");
  EXPECT_EQ(scene.voxel_count(), 8);
}

TEST(Scene, DeclaredBoxIncludesCanvasAndVoxels) {
  SceneGrid grid = box_grid({5, 5, 5}, {5, 5, 5});
  EXPECT_EQ(grid.declared_box(), (IBox{{5, 5, 5}, {6, 6, 6}}));
  grid.canvas = {{0, 0, 0}, {2, 2, 2}};
  EXPECT_EQ(grid.declared_box(), (IBox{{0, 0, 0}, {6, 6, 6}}));
}

}  // namespace
}  // namespace quoin
