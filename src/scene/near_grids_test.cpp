#include <quoin/scene/scene_meshes.h>

#include <algorithm>
#include <set>
#include <tuple>

#include <gtest/gtest.h>

#include <quoin/io/mesh_file.h>

namespace quoin {
namespace {

using WorldVoxels = std::set<std::tuple<double, double, double>>;

/// Returns the least corners of all voxels in the world.
WorldVoxels world_voxels(const Scene& scene) {
  WorldVoxels voxels;
  for (const InstanceHandle handle : scene.instances().handles()) {
    const Instance& instance = scene.instances()[handle];
    const SceneGrid& grid = scene.grids()[instance.grid];
    grid.grid.for_each([&](IVec3 voxel, VoxelType) {
      const DVec3 at = instance.position + (DVec3(voxel) - grid.pivot) * instance.voxel_size;
      voxels.emplace(at.x, at.y, at.z);
    });
  }
  return voxels;
}

Scene scene_of(const std::vector<IVec3>& voxels) {
  Scene scene;
  VoxelProperties red;
  red.colour = {255, 0, 0, 255};
  const auto type = scene.types.find_or_add(red);
  SceneGrid grid;
  grid.name = "dots";
  grid.pivot = {1.0, 2.0, 3.0};
  for (const IVec3 voxel : voxels) grid.grid.set(voxel, *type);
  Instance instance;
  instance.name = "placed";
  instance.position = {10.0, 0.0, -5.0};
  instance.grid = scene.add_grid(std::move(grid));
  scene.add_instance(instance);
  return scene;
}

TEST(NearGrids, LeaveNearGridsUnchanged) {
  const Scene scene = scene_of({{0, 0, 0}, {60'000, -3, -60'000}});
  const Scene near = near_grids(scene);
  EXPECT_EQ(near.grids().size(), 1U);
  EXPECT_EQ(world_voxels(near), world_voxels(scene));
  EXPECT_EQ(near.grids()[near.grids().handles().front()].pivot, DVec3(1.0, 2.0, 3.0));
}

TEST(NearGrids, MoveFarVoxelsToTheirOrigin) {
  const Scene scene = scene_of({{20'000'001, 64, -30'000'000}, {20'000'003, 65, -30'000'001}});
  const Scene near = near_grids(scene);
  ASSERT_EQ(near.grids().size(), 1U);
  EXPECT_EQ(near.grids().handles(), scene.grids().handles());
  EXPECT_EQ(near.instances().handles(), scene.instances().handles());
  const IBox bounds = near.grids()[near.grids().handles().front()].bounds();
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_GE(bounds.min[axis], 0);
    EXPECT_LE(bounds.max[axis], 2 * kChunkEdge);
  }
  EXPECT_EQ(world_voxels(near), world_voxels(scene));
}

TEST(NearGrids, SplitGridsWithDistantPieces) {
  const Scene scene = scene_of({{5, 5, 5}, {-20'000'001, 0, 0}, {20'000'001, 0, 0}, {20'000'001, 300'000, 0}});
  const Scene near = near_grids(scene);
  EXPECT_EQ(near.grids().size(), 4U);
  EXPECT_EQ(near.instances().size(), 4U);
  EXPECT_EQ(world_voxels(near), world_voxels(scene));
  for (const GridHandle grid : near.grids().handles()) {
    EXPECT_LE(std::abs(near.grids()[grid].bounds().max.x), kNearVoxels);
    EXPECT_EQ(near.grids()[grid].name, "dots");
  }
}

TEST(NearGrids, KeepTouchingVoxelsTogether) {
  // Across the border of two cells of kNearVoxels.
  const int edge = 300 * kNearVoxels;
  const Scene near = near_grids(scene_of({{edge - 1, 0, 0}, {edge, 0, 0}, {edge + 2 * kChunkEdge, 0, 0}}));
  ASSERT_EQ(near.grids().size(), 1U);
  const auto meshes = mesh_scene(near);
  ASSERT_TRUE(meshes);
  EXPECT_EQ(meshes->stats.faces_visible, 10 + 6) << "no face between neighbours";
}

/// Returns the triangles of a written mesh file, in Quoin's axes.
TriangleMesh written_and_read(const SceneMeshes& meshes, FileFormat format) {
  const auto bytes = write_mesh(meshes, format);
  EXPECT_TRUE(bytes) << (bytes ? "" : to_string(bytes.error()));
  const auto read = bytes ? read_mesh(*bytes, UpAxis::Y) : Result<LoadedMesh>(bytes.error());
  EXPECT_TRUE(read) << (read ? "" : to_string(read.error()));
  TriangleMesh mesh = read ? read->mesh : TriangleMesh();
  for (DVec3& position : mesh.positions) position += mesh_file_offset(meshes, format);
  return mesh;
}

std::size_t count_degenerate(const TriangleMesh& mesh) {
  return static_cast<std::size_t>(std::ranges::count_if(mesh.triangles, [&](const auto& t) {
    const DVec3 a = mesh.positions[t[0]];
    return glm::length(glm::cross(mesh.positions[t[1]] - a, mesh.positions[t[2]] - a)) < 1e-9;
  }));
}

TEST(NearGrids, KeepShapesOfMeshes) {
  std::vector<IVec3> voxels;
  for (int i = 0; i < 125; ++i)
    voxels.emplace_back(20'000'001 + 2 * (i % 5), 2 * (i / 5 % 5), -20'000'001 + i / 25 * 2);
  const Scene near = near_grids(scene_of(voxels));
  const DVec3 first = DVec3(voxels.front()) - DVec3(1.0, 2.0, 3.0) + DVec3(10.0, 0.0, -5.0);
  for (const bool is_smooth : {false, true}) {
    const auto meshes = is_smooth ? mesh_scene_smoothly(near) : mesh_scene(near);
    ASSERT_TRUE(meshes);
    for (const FileFormat format : {FileFormat::Glb, FileFormat::Ply, FileFormat::Stl}) {
      if (!can(format, FormatCapability::Read)) continue;
      const TriangleMesh mesh = written_and_read(*meshes, format);
      EXPECT_EQ(mesh.triangles.size(), static_cast<std::size_t>(meshes->stats.triangles));
      EXPECT_EQ(count_degenerate(mesh), 0U) << format.name() << is_smooth;
      const DVec3 off = mesh.bounds().min - first;
      const double most = is_smooth ? 0.5 : 1e-9;
      EXPECT_LE(std::max({std::abs(off.x), std::abs(off.y), std::abs(off.z)}), most) << format.name();
    }
  }
}

}  // namespace
}  // namespace quoin
