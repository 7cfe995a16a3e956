#include <quoin/mesh/blocky.h>

#include <gtest/gtest.h>

#include "mesh/blocky/watertight_for_tests.h"
#include "mesh/mesh_oracle.h"

namespace quoin {
namespace {

class WatertightWorld : public testing::TestWithParam<unsigned> {};

TEST_P(WatertightWorld, HasNoOpenEdgesOrTJunctions) {
  VoxelRegistry types = oracle::mixed_types();
  VoxelProperties lamp = types[3];
  lamp.emission = 1.0F;
  types.replace(3, lamp);
  BlockyMeshOptions options;
  options.watertight = true;
  for (const int type_count : {3, 5}) {
    const Grid grid = oracle::random_world(GetParam(), {IVec3{-20}, IVec3{25}}, type_count, GetParam() % 3 * 0.04);
    for (const bool occlusion : {true, false}) {
      options.bake_occlusion = occlusion;
      const auto mesh = build_blocky_mesh(grid, types, options, {1});
      ASSERT_TRUE(mesh.has_value());
      EXPECT_EQ(oracle::watertight_fault(*mesh), "");
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, WatertightWorld, testing::Range(1U, 13U));

TEST(BlockyMesh, PlainGreedyQuadsAreNotWatertight) {
  Grid grid;
  grid.fill_box({{0, 0, 0}, {10, 1, 10}}, 1);
  grid.set({4, 1, 4}, 1);
  BlockyMeshOptions options;
  EXPECT_NE(oracle::watertight_fault(*build_blocky_mesh(grid, oracle::mixed_types(), options)), "");
  options.watertight = true;
  EXPECT_EQ(oracle::watertight_fault(*build_blocky_mesh(grid, oracle::mixed_types(), options)), "");
}

TEST(BlockyMesh, IsWatertightForVoxelsTouchingAtEdge) {
  Grid grid;
  grid.set({0, 0, 0}, 1);
  grid.set({1, 1, 0}, 1);
  grid.set({-1, 0, -1}, 1);
  BlockyMeshOptions options;
  options.watertight = true;
  EXPECT_EQ(oracle::watertight_fault(*build_blocky_mesh(grid, oracle::mixed_types(), options)), "");
}

TEST(BlockyMesh, IsTheSameAtAnyThreadCount) {
  const VoxelRegistry types = oracle::mixed_types();
  const Grid grid = oracle::random_world(5, {IVec3{-100, -10, -100}, IVec3{100, 30, 100}}, 5, 0.01);
  const auto one = build_blocky_mesh(grid, types, {}, {1});
  const auto four = build_blocky_mesh(grid, types, {}, {4});
  for (std::size_t i = 0; i < kSurfaceClasses; ++i) {
    EXPECT_EQ(one->surfaces[i].positions, four->surfaces[i].positions);
    EXPECT_EQ(one->surfaces[i].indices, four->surfaces[i].indices);
    EXPECT_EQ(one->surfaces[i].occlusion, four->surfaces[i].occlusion);
  }
}

TEST(BlockyMesh, SortsTrianglesBySurfaceClass) {
  VoxelRegistry types;
  for (int i = 0; i < 4; ++i) {
    VoxelProperties p;
    p.visibility = (i & 1) != 0 ? Visibility::Transparent : Visibility::Opaque;
    p.emission = (i & 2) != 0 ? 2.0F : 0.0F;
    ASSERT_TRUE(types.find_or_add(p).has_value());
  }
  Grid grid;
  for (int i = 0; i < 4; ++i) grid.set({3 * i, 0, 0}, static_cast<VoxelType>(i + 1));
  const auto mesh = build_blocky_mesh(grid, types, {});
  for (std::size_t i = 0; i < kSurfaceClasses; ++i) {
    ASSERT_EQ(mesh->surfaces[i].positions.size(), 24U);
    EXPECT_EQ(mesh->surfaces[i].types[0], i + 1);
  }
  EXPECT_EQ(mesh->faces_visible, 24);
  EXPECT_EQ(mesh->faces_total, 24);
  EXPECT_EQ(mesh->triangle_count(), 48);
}

Grid ten_chunks() {
  Grid grid;
  for (int i = 0; i < 10; ++i) grid.set({i * 64, 0, 0}, 1);
  return grid;
}

TEST(BlockyMesh, AppendsChunksInParts) {
  const VoxelRegistry types = oracle::mixed_types();
  const Grid grid = oracle::random_world(7, {IVec3{-20}, IVec3{25}}, 5, 0.04);
  const std::vector<IVec3> chunks = grid.chunks();
  BlockyMesher mesher;
  std::vector<QuadBuffer> quads(chunks.size());
  for (std::size_t i = 0; i < chunks.size(); ++i) mesher.mesh(grid.neighbourhood(chunks[i]), types, {}, quads[i]);
  for (const bool watertight : {false, true}) {
    const auto whole = build_blocky_mesh(grid, types, {.watertight = watertight}, {1});
    ASSERT_TRUE(whole.has_value());
    BlockyMesh parts;
    const std::span<const QuadBuffer> all(quads);
    const std::span<const IVec3> places(chunks);
    ASSERT_TRUE(append_triangles(all.first(3), places.first(3), types, watertight, parts));
    ASSERT_TRUE(append_triangles(all.subspan(3), places.subspan(3), types, watertight, parts));
    EXPECT_EQ(parts.quads, whole->quads);
    EXPECT_EQ(parts.faces_visible, whole->faces_visible);
    for (std::size_t i = 0; i < kSurfaceClasses; ++i) {
      EXPECT_EQ(parts.surfaces[i].positions, whole->surfaces[i].positions);
      EXPECT_EQ(parts.surfaces[i].indices, whole->surfaces[i].indices);
      EXPECT_EQ(parts.surfaces[i].types, whole->surfaces[i].types);
    }
  }
}

TEST(BlockyMesh, StopsWhenCancelled) {
  // The first ten calls occur while faces are found, the others during the conversion to triangles.
  for (const int last : {1, 3, 10, 11, 15, 20}) {
    int calls = 0;
    const auto go_on = [&](double) { return ++calls < last; };
    const auto mesh = build_blocky_mesh(ten_chunks(), oracle::mixed_types(), {}, {1}, go_on);
    ASSERT_FALSE(mesh.has_value()) << last;
    EXPECT_EQ(mesh.error().code, ErrorCode::Cancelled);
    EXPECT_EQ(calls, last) << "no calls after the callback returns false";
  }
}

TEST(BlockyMesh, ReportsRisingProgressUpToOne) {
  std::vector<double> reported;
  const auto listen = [&](double fraction) {
    reported.push_back(fraction);
    return true;
  };
  ASSERT_TRUE(build_blocky_mesh(ten_chunks(), oracle::mixed_types(), {}, {4}, listen).has_value());
  ASSERT_EQ(reported.size(), 20U);
  for (std::size_t i = 0; i < reported.size(); ++i) EXPECT_DOUBLE_EQ(reported[i], static_cast<double>(i + 1) / 20.0);
}

}  // namespace
}  // namespace quoin
