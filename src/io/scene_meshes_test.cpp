#include <quoin/io/scene_meshes.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <string>
#include <vector>

namespace quoin {

namespace {

GridHandle add_grid(Scene& scene, int length) {
  SceneGrid grid;
  VoxelProperties stone;
  stone.name = "stone";
  grid.grid.fill_box({0, 0, 0}, {length - 1, 0, 0}, *scene.types.find_or_add(stone));
  return scene.add_grid(std::move(grid));
}

void place(Scene& scene, GridHandle grid, bool visible = true) {
  Instance instance;
  instance.grid = grid;
  instance.visible = visible;
  scene.add_instance(instance);
}

TEST(SceneMeshes, only_grids_of_drawn_instances_are_meshed_and_each_once) {
  Scene scene;
  const GridHandle twice = add_grid(scene, 3);
  const GridHandle hidden = add_grid(scene, 4);
  const GridHandle unused = add_grid(scene, 5);
  place(scene, twice);
  place(scene, twice);
  place(scene, hidden, false);
  const auto meshes = mesh_scene(scene, {});
  ASSERT_TRUE(meshes);
  EXPECT_EQ(meshes->grids.size(), 1U);
  EXPECT_NE(meshes->find(twice), nullptr);
  EXPECT_EQ(meshes->find(hidden), nullptr);
  EXPECT_EQ(meshes->faces_total, 18);
  EXPECT_EQ(meshes->faces_visible, 14);
  EXPECT_EQ(meshes->quads, 6);
  EXPECT_EQ(meshes->triangles, 12);
  EXPECT_EQ(meshes->vertices, 24);
  const auto all = mesh_scene(scene, {}, true);
  ASSERT_TRUE(all);
  EXPECT_EQ(all->faces_total, 18 + 24);
  EXPECT_EQ(all->find(unused), nullptr);
}

TEST(SceneMeshes, instances_of_grids_that_are_gone_are_passed_over) {
  Scene scene;
  Instance lost;
  lost.grid = GridHandle{7, 0};
  scene.add_instance(lost);
  const auto meshes = mesh_scene(scene, {});
  ASSERT_TRUE(meshes);
  EXPECT_TRUE(meshes->grids.empty());
}

TEST(SceneMeshes, types_that_are_not_registered_are_refused) {
  for (const VoxelType type : std::array<VoxelType, 5>{2, 255, 256, 300, 65535}) {
    for (const bool watertight : {false, true}) {
      Scene scene;
      const GridHandle grid = add_grid(scene, 1);
      place(scene, grid);
      scene.edit(grid).grid.set({1, 0, 0}, type);
      const auto meshes = mesh_scene(scene, {.merge = true, .occlusion = true, .watertight = watertight});
      ASSERT_FALSE(meshes) << type;
      EXPECT_EQ(meshes.error().code, ErrorCode::InvalidArgument);
    }
  }
}

TEST(SceneMeshes, types_that_are_not_registered_do_no_harm_where_no_face_shows_them) {
  Scene scene;
  const GridHandle grid = add_grid(scene, 3);
  place(scene, grid);
  Grid& voxels = scene.edit(grid).grid;
  voxels.fill_box({0, 0, 0}, {2, 2, 2}, 1);
  voxels.set({1, 1, 1}, 65535);
  EXPECT_TRUE(mesh_scene(scene, {}));
}

TEST(SceneMeshes, progress_never_falls_and_ends_at_one) {
  Scene scene;
  for (const int length : {3, 700, 30, 1000}) place(scene, add_grid(scene, length));
  std::vector<double> told;
  const auto meshes = mesh_scene(scene, {}, false, Threads{4}, [&](double fraction) {
    told.push_back(fraction);
    return true;
  });
  ASSERT_TRUE(meshes);
  ASSERT_FALSE(told.empty());
  EXPECT_TRUE(std::is_sorted(told.begin(), told.end()));
  EXPECT_NEAR(told.back(), 1.0, 1e-9);
}

TEST(SceneMeshes, a_listener_can_stop_the_work) {
  Scene scene;
  for (const int length : {3, 700}) place(scene, add_grid(scene, length));
  const auto meshes = mesh_scene(scene, {}, false, {}, [](double) { return false; });
  ASSERT_FALSE(meshes);
  EXPECT_EQ(meshes.error().code, ErrorCode::Cancelled);
}

}  // namespace

}  // namespace quoin
