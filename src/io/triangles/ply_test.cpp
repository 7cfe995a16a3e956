#include <array>

#include "io/gltf/gltf_for_tests.h"
#include "io/mesh_file_for_tests.h"

namespace quoin {

namespace {

TEST(BlockyPly, WritesColouredFacesInWorldSpace) {
  Scene scene;
  const GridHandle grid = add_asymmetric_grid(scene, "L");
  const InstanceHandle mirrored = place(scene, grid, {10, 20, 30});
  scene.edit(mirrored).mirrored = true;
  scene.edit(mirrored).voxel_size = 2.0;
  scene.edit(mirrored).rotation = DQuat(0.5, 0.5, 0.5, 0.5);
  place(scene, grid, {-40, 0, 0});
  scene.edit(place(scene, grid, {90, 0, 0})).visible = false;
  const auto meshes = mesh_scene(scene, {.mesh = {.merge = false}});
  ASSERT_TRUE(meshes);
  const TestFolder folder("blocky_ply");
  const auto bytes = write_mesh(*meshes, folder.file("out.ply"));
  ASSERT_TRUE(bytes) << to_string(bytes.error());
  EXPECT_EQ(std::filesystem::file_size(folder.file("out.ply")), *bytes);
  const WorldMesh world = world_of_ply(read_file(folder.file("out.ply")).value());
  EXPECT_EQ(world.positions.size(), 2U * static_cast<std::size_t>(meshes->stats.vertices));
  EXPECT_NEAR(world.volume(), 10.0 * (1.0 + 8.0), 1e-3) << "ten voxels, eightfold once";
  EXPECT_EQ(world.inward_normals(), 0U);
  DBox box;
  for (const DVec3& p : world.positions) box.extend(p);
  const DBox expected = scene.bounds();
  EXPECT_LT(glm::length(box.min - expected.min) + glm::length(box.max - expected.max), 1e-4);
  std::size_t red = 0;
  std::size_t darkened = 0;
  for (const auto& colour : world.colours) {
    red += colour == std::array{200 / 255.0, 10 / 255.0, 20 / 255.0} ? 1 : 0;
    darkened += colour[0] < 119 / 255.0 ? 1 : 0;
  }
  EXPECT_GT(red, 0U) << "the bytes of the palette where nothing is near";
  EXPECT_GT(darkened, 0U);
}

}  // namespace

}  // namespace quoin
