#include <quoin/io/ply.h>

#include <array>
#include <functional>
#include <limits>
#include <map>

#include "io/gltf_fixture.h"
#include "io/smooth_files_fixture.h"

namespace quoin {

namespace {

TEST(BlockyPly, every_face_stands_in_the_world_with_its_colour) {
  Scene scene;
  const GridHandle grid = add_asymmetric_grid(scene, "L");
  const InstanceHandle mirrored = place(scene, grid, {10, 20, 30});
  scene.edit(mirrored).mirrored = true;
  scene.edit(mirrored).voxel_size = 2.0;
  scene.edit(mirrored).rotation = DQuat(0.5, 0.5, 0.5, 0.5);
  place(scene, grid, {-40, 0, 0});
  scene.edit(place(scene, grid, {90, 0, 0})).visible = false;
  const auto meshes = mesh_scene(scene, {.merge = false});
  ASSERT_TRUE(meshes);
  const TestFolder folder("blocky_ply");
  const auto bytes = write_ply(scene, *meshes, folder.file("out.ply"));
  ASSERT_TRUE(bytes) << to_string(bytes.error());
  EXPECT_EQ(std::filesystem::file_size(folder.file("out.ply")), *bytes);
  const WorldMesh world = world_of_ply(read_file(folder.file("out.ply")).value());
  EXPECT_EQ(world.positions.size(), 2U * static_cast<std::size_t>(meshes->vertices));
  EXPECT_NEAR(world.volume(), 10.0 * (1.0 + 8.0), 1e-3) << "ten voxels, eightfold once";
  EXPECT_EQ(world.inward_normals(), 0U);
  DBox box;
  for (const DVec3& p : world.positions) box.extend(p);
  const DBox expected = scene.bounds(false);
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

TEST(BlockyPly, failures_leave_no_file) {
  Scene scene;
  const InstanceHandle placed = place(scene, add_asymmetric_grid(scene, "L"), {});
  const TestFolder folder("blocky_ply_failures");
  const auto meshes = mesh_scene(scene, {});
  scene.edit(placed).voxel_size = -1.0;
  const auto refused = write_ply(scene, meshes.value(), folder.file("out.ply"));
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::InvalidArgument);
  EXPECT_EQ(refused.error().path, folder.file("out.ply").string());
  EXPECT_EQ(folder.count(), 0U);
}

TEST(BlockyPly, meshes_that_do_not_hang_together_are_refused) {
  Scene scene;
  place(scene, add_asymmetric_grid(scene, "L"), {});
  const TestFolder folder("blocky_ply_unsound");
  const auto sound = mesh_scene(scene, {});
  const auto refuses = [&](const std::function<void(BlockyTriangles&)>& spoil) {
    SceneMeshes meshes = *sound;
    for (BlockyTriangles& surface : meshes.grids[0].mesh.surfaces) {
      if (!surface.positions.empty()) spoil(surface);
    }
    const auto written = write_ply(scene, meshes, folder.file("out.ply"));
    return !written && written.error().code == ErrorCode::InvalidArgument && folder.count() == 0;
  };
  EXPECT_TRUE(refuses([](BlockyTriangles& t) { t.directions.pop_back(); }));
  EXPECT_TRUE(refuses([](BlockyTriangles& t) { t.types[0] = 60'000; }));
  EXPECT_TRUE(refuses([](BlockyTriangles& t) { t.levels[0] = 4; }));
  EXPECT_TRUE(refuses([](BlockyTriangles& t) { t.indices.pop_back(); }));
  EXPECT_TRUE(refuses([](BlockyTriangles& t) { t.indices[0] = static_cast<std::uint32_t>(t.positions.size()); }));
  EXPECT_TRUE(refuses([](BlockyTriangles& t) { t.positions[0].y = std::numeric_limits<float>::infinity(); }));
}

}  // namespace

}  // namespace quoin
