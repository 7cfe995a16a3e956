#include <quoin/mesh/blocky_mesh.h>

#include <map>
#include <tuple>

#include <gtest/gtest.h>

#include "mesh/mesh_oracle.h"

namespace quoin {
namespace {

using Point = std::tuple<int, int, int>;

Point point(Vec3 p) {
  return {static_cast<int>(p.x), static_cast<int>(p.y), static_cast<int>(p.z)};
}

// Checks the definition: every directed edge is met by as many opposite ones, none is longer than its neighbours allow
// (an edge with a vertex inside has no opposite of its own length), and no triangle is degenerate.
void expect_watertight(const BlockyTriangles& mesh) {
  std::map<std::pair<Point, Point>, int> edges;
  for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
    const Vec3 a = mesh.positions[mesh.indices[i]];
    const Vec3 b = mesh.positions[mesh.indices[i + 1]];
    const Vec3 c = mesh.positions[mesh.indices[i + 2]];
    const Vec3 normal = glm::cross(b - a, c - a);
    ASSERT_GT(glm::dot(normal, Vec3(normal_of(mesh.directions[mesh.indices[i]]))), 0.0F) << "inside out or degenerate";
    for (const auto& [from, to] : {std::pair{a, b}, std::pair{b, c}, std::pair{c, a}})
      ++edges[{point(from), point(to)}];
  }
  std::set<Point> vertices;
  for (const Vec3 p : mesh.positions) vertices.insert(point(p));
  for (const auto& [edge, count] : edges) {
    const auto opposite = edges.find({edge.second, edge.first});
    ASSERT_TRUE(opposite != edges.end() && opposite->second == count) << "an open edge";
    const auto [ax, ay, az] = edge.first;
    const auto [bx, by, bz] = edge.second;
    const IVec3 from{ax, ay, az};
    const IVec3 delta = IVec3{bx, by, bz} - from;
    if (((delta.x != 0) + (delta.y != 0) + (delta.z != 0)) != 1) continue;  // diagonals lie inside their quad
    const IVec3 step = glm::sign(delta);
    for (IVec3 p = from + step; p != from + delta; p += step) {
      ASSERT_EQ(vertices.count({p.x, p.y, p.z}), 0U) << "a vertex lies inside an edge";
    }
  }
}

class WatertightWorld : public testing::TestWithParam<unsigned> {};

TEST_P(WatertightWorld, HasNoOpenEdgeAndNoVertexInsideAnEdge) {
  const VoxelRegistry types = oracle::mixed_types();
  const Grid grid = oracle::random_world(GetParam(), {IVec3{-20}, IVec3{25}}, 3, GetParam() % 3 * 0.04);
  BlockyMeshOptions options;
  options.watertight = true;
  const auto mesh = build_blocky_mesh(grid, types, options, {1});
  ASSERT_TRUE(mesh.has_value());
  expect_watertight(mesh->surfaces[0]);
}

INSTANTIATE_TEST_SUITE_P(Seeds, WatertightWorld, testing::Range(1U, 13U));

TEST(BlockyMesh, PlainGreedyQuadsAreNotWatertight) {
  Grid grid;
  grid.fill_box({0, 0, 0}, {9, 0, 9}, 1);
  grid.set({4, 1, 4}, 1);
  const auto open_edges = [&](bool watertight) {
    BlockyMeshOptions options;
    options.watertight = watertight;
    const auto mesh = build_blocky_mesh(grid, oracle::mixed_types(), options, {1});
    std::map<std::pair<Point, Point>, int> edges;
    const BlockyTriangles& t = mesh->surfaces[0];
    for (std::size_t i = 0; i < t.indices.size(); ++i) {
      const std::size_t next = i % 3 == 2 ? i - 2 : i + 1;
      ++edges[{point(t.positions[t.indices[i]]), point(t.positions[t.indices[next]])}];
    }
    int open = 0;
    for (const auto& [edge, count] : edges) open += edges.count({edge.second, edge.first}) == 0;
    return open;
  };
  EXPECT_GT(open_edges(false), 0);
  EXPECT_EQ(open_edges(true), 0);
}

TEST(BlockyMesh, IsTheSameAtAnyThreadCount) {
  const VoxelRegistry types = oracle::mixed_types();
  const Grid grid = oracle::random_world(5, {IVec3{-100, -10, -100}, IVec3{100, 30, 100}}, 5, 0.01);
  const auto one = build_blocky_mesh(grid, types, {}, {1});
  const auto four = build_blocky_mesh(grid, types, {}, {4});
  for (std::size_t i = 0; i < kSurfaceClasses; ++i) {
    EXPECT_EQ(one->surfaces[i].positions, four->surfaces[i].positions);
    EXPECT_EQ(one->surfaces[i].indices, four->surfaces[i].indices);
    EXPECT_EQ(one->surfaces[i].levels, four->surfaces[i].levels);
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

TEST(BlockyMesh, StopsWhenProgressSaysSo) {
  Grid grid;
  for (int i = 0; i < 10; ++i) grid.set({i * 64, 0, 0}, 1);
  int calls = 0;
  const auto mesh = build_blocky_mesh(grid, oracle::mixed_types(), {}, {1}, [&](double) { return ++calls < 3; });
  ASSERT_FALSE(mesh.has_value());
  EXPECT_EQ(mesh.error().code, ErrorCode::Cancelled);
}

}  // namespace
}  // namespace quoin
