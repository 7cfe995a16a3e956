// The mesh of a halved grid equals the grid's coarse mesh.

#include <gtest/gtest.h>

#include <quoin/grid/downsample.h>
#include <quoin/mesh/blocky.h>
#include <quoin/terrain/terrain.h>

namespace quoin {
namespace {

TEST(HalvedMesh, HasFewerFacesOfSimilarArea) {
  VoxelRegistry types;
  const auto materials = add_terrain_types(types);
  ASSERT_TRUE(materials);
  const TerrainOptions options{.size = {4, 2, 4}, .caves = false, .plants = false};
  const auto grid = generate_terrain(options, *materials);
  ASSERT_TRUE(grid);
  const Grid coarse = *downsample(*grid, types);
  const auto full_mesh = build_blocky_mesh(*grid, types, {});
  const auto coarse_mesh = build_blocky_mesh(coarse, types, {});
  ASSERT_TRUE(full_mesh && coarse_mesh);
  const auto area = static_cast<double>(full_mesh->faces_visible);
  EXPECT_NEAR(4.0 * static_cast<double>(coarse_mesh->faces_visible), area, 0.15 * area);
  EXPECT_LT(coarse_mesh->quads, full_mesh->quads / 2);
  const IBox box = grid->bounds();
  const IBox coarse_box = coarse.bounds();
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(2 * coarse_box.min[axis], box.min[axis], 2);
    EXPECT_NEAR(2 * coarse_box.max[axis], box.max[axis], 2);
  }
}

}  // namespace
}  // namespace quoin
