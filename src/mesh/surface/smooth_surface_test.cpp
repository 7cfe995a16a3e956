// The content of a whole field's mesh, and the ways to build it.

#include <quoin/mesh/smooth_mesh.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <set>

#include <gtest/gtest.h>

#include "mesh/smooth/smooth_oracle.h"
#include "mesh/smooth/surface_check_for_tests.h"
#include "mesh/surface/face_materials.h"

namespace quoin {
namespace {

using oracle::grid_of;
using oracle::mesh_of;

using PositionBits = std::array<std::uint32_t, 3>;
using TriangleBits = std::array<PositionBits, 3>;

template <class Positions>
PositionBits bits_of(const Positions& positions, std::uint32_t vertex, Vec3 origin) {
  const Vec3 position = positions[vertex] + origin;
  PositionBits bits;
  std::memcpy(bits.data(), &position, sizeof bits);
  return bits;
}

// Returns triangles as sets of positions. Each begins with its least position, so that winding counts and the first
// corner does not.
template <class Positions, class Indices>
std::multiset<TriangleBits> triangles_of(const Positions& positions, const Indices& indices, Vec3 origin) {
  std::multiset<TriangleBits> triangles;
  for (std::size_t i = 0; i < indices.size(); i += 3) {
    TriangleBits triangle;
    for (std::size_t k = 0; k < 3; ++k) triangle[k] = bits_of(positions, indices[i + k], origin);
    std::rotate(triangle.begin(), std::min_element(triangle.begin(), triangle.end()), triangle.end());
    triangles.insert(triangle);
  }
  return triangles;
}

// Chunks and their borders leave no trace: the mesh equals a mesh made in one piece.
TEST(SmoothMesh, MatchesMeshMadeInOnePiece) {
  for (int level = 0; level <= kMaxSmoothLevel; ++level) {
    SCOPED_TRACE(testing::Message() << "level " << level);
    const IBox box{{50, -20, 40}, {90, 20, 80}};
    const DensityGrid grid = grid_of(box, oracle::waves(5, 12.0));
    SmoothMeshOptions options;
    options.split_sheets = false;
    options.level_of = [=](IVec3) { return level; };
    const SmoothMesh mesh = mesh_of(grid, options);
    const int size = 1 << level;
    const auto density = [&](IVec3 p) { return grid.density(p * size); };
    const IBox cells{(box.min - IVec3{16}) / size, (box.max + IVec3{16}) / size};
    SmoothChunkMesh whole;
    oracle::SmoothOracle(density, {cells, cells, level, options.occlusion}).mesh(whole);
    ASSERT_GT(whole.indices.size(), 0U);
    EXPECT_EQ(mesh.positions.size(), whole.positions.size());
    EXPECT_EQ(triangles_of(mesh.positions, mesh.indices, Vec3{0.0F}),
              triangles_of(whole.positions, whole.indices, Vec3{0.0F}));
    std::map<PositionBits, std::pair<Vec3, float>> known;
    for (std::uint32_t v = 0; v < whole.positions.size(); ++v) {
      known[bits_of(whole.positions, v, Vec3{0.0F})] = {whole.normals[v], whole.occlusion[v]};
    }
    for (std::uint32_t v = 0; v < mesh.positions.size(); ++v) {
      const auto& [normal, occlusion] = known.at(bits_of(mesh.positions, v, Vec3{0.0F}));
      ASSERT_EQ(mesh.normals[v], normal);
      ASSERT_EQ(mesh.occlusion[v], occlusion);
    }
  }
}

TEST(SmoothMesh, MaterialsClampLevelsLikeMesher) {
  const DensityGrid grid = grid_of({{0, 0, 0}, {64, 64, 64}}, oracle::waves(3, 25.0));
  const DensityNeighbourhood chunks = grid.neighbourhood({0, 0, 0});
  const SurfaceMaterials materials{VoxelRegistry()};
  SmoothOptions coarsest;
  coarsest.levels.fill(kMaxSmoothLevel);
  SmoothOptions high;
  high.levels.fill(200);
  SmoothChunkMesh mesh;
  SmoothMesher().mesh(chunks, high, mesh);
  ASSERT_FALSE(mesh.cells.empty());
  const auto of_coarsest = smooth::materials_of(chunks, coarsest, materials, mesh);
  const auto of_high = smooth::materials_of(chunks, high, materials, mesh);
  ASSERT_EQ(of_high.size(), of_coarsest.size());
  for (std::size_t i = 0; i < of_high.size(); ++i) {
    ASSERT_EQ(of_high[i].type, of_coarsest[i].type);
    ASSERT_EQ(of_high[i].albedo, of_coarsest[i].albedo);
  }
}

TEST(SmoothMesh, IsTheSameAtAnyThreadCount) {
  const DensityGrid grid = grid_of({{-70, 30, -70}, {70, 80, 70}}, oracle::waves(9, 25.0));
  SmoothMeshOptions options;
  options.level_of = [](IVec3 chunk) { return (chunk.x + chunk.y + chunk.z) & 1; };
  const auto one = build_smooth_mesh(grid, oracle::one_type(), options, {1});
  const auto four = build_smooth_mesh(grid, oracle::one_type(), options, {4});
  ASSERT_TRUE(one.has_value() && four.has_value());
  EXPECT_EQ(one->positions, four->positions);
  EXPECT_EQ(one->normals, four->normals);
  EXPECT_EQ(one->occlusion, four->occlusion);
  EXPECT_EQ(one->albedo, four->albedo);
  EXPECT_EQ(one->types, four->types);
  EXPECT_EQ(one->indices, four->indices);
}

TEST(SmoothMesh, LiesAtPositionOfField) {
  const DVec3 centre{100000.0, -70000.0, 2048.0};
  const DensityGrid grid = grid_of(oracle::box_around(centre, 9.0), oracle::sphere(centre, 9.0));
  for (const Vec3 p : mesh_of(grid, {}).positions) EXPECT_NEAR(glm::length(DVec3(p) - centre), 9.0, 0.15);
}

// Red rock under white sand: type 2 above y = 32.
DensityGrid two_layers() {
  DensityGrid grid;
  grid.edit({{20, 20, 20}, {110, 45, 40}}, [](IVec3 p, DensitySample) {
    return DensitySample{-2.0F, p.y >= 32 ? VoxelType{2} : VoxelType{1}};
  });
  return grid;
}

VoxelRegistry red_and_white() {
  VoxelRegistry types;
  for (const Rgba8 colour : {Rgba8{255, 0, 0, 255}, Rgba8{255, 255, 255, 255}}) {
    VoxelProperties properties;
    properties.colour = colour;
    EXPECT_TRUE(types.add(properties).has_value());
  }
  return types;
}

TEST(SmoothMesh, TakesMaterialsFromSolidSamples) {
  SmoothMeshOptions options;
  for (int level = 0; level <= kMaxSmoothLevel; ++level) {
    options.level_of = [=](IVec3 chunk) { return chunk.x == 0 ? level : 0; };
    const auto mesh = build_smooth_mesh(two_layers(), red_and_white(), options, {1});
    ASSERT_TRUE(mesh.has_value());
    int mixed = 0;
    for (std::size_t v = 0; v < mesh->positions.size(); ++v) {
      const LinearRgba16 albedo = mesh->albedo[v];
      EXPECT_EQ(albedo[0], 65'535);
      EXPECT_EQ(albedo[3], 65'535);
      EXPECT_EQ(albedo[1], albedo[2]);
      const float y = mesh->positions[v].y;
      if (y < 32.0F - 8.0F) {
        EXPECT_EQ(albedo[1], 0);
        EXPECT_EQ(mesh->types[v], 1);
      } else if (y > 32.0F + 8.0F) {
        EXPECT_EQ(albedo[1], 65'535);
        EXPECT_EQ(mesh->types[v], 2);
      } else if (albedo[1] != 0 && albedo[1] != 65'535) {
        ++mixed;
        // At equal counts, the lowest type wins.
        EXPECT_EQ(mesh->types[v], albedo[1] <= 32'768 ? 1 : 2);
      }
    }
    EXPECT_GT(mixed, 0);
  }
}

// Two samples of white sand cover red rock: at every level the view from above shows sand.
TEST(SmoothMesh, ShowsThinCoverAtEveryLevel) {
  DensityGrid grid;
  grid.edit({IVec3{0}, {128, 70, 128}}, [](IVec3 p, DensitySample) {
    const double height = 40.3 + 5.0 * std::sin(0.1 * p.x) + 4.0 * std::cos(0.07 * p.z);
    return DensitySample{static_cast<float>(p.y - height), p.y > height - 2.0 ? VoxelType{2} : VoxelType{1}};
  });
  for (int level = 0; level <= kMaxSmoothLevel; ++level) {
    SmoothMeshOptions options;
    options.level_of = [=](IVec3 chunk) { return chunk.z == 0 ? level : 0; };
    const auto mesh = build_smooth_mesh(grid, red_and_white(), options, {1});
    ASSERT_TRUE(mesh.has_value());
    int seen = 0;
    for (std::size_t v = 0; v < mesh->positions.size(); ++v) {
      const Vec3 p = mesh->positions[v];
      if (mesh->normals[v].y < 0.8F || p.x < 16 || p.z < 16 || p.x > 112 || p.z > 112) continue;
      ++seen;
      EXPECT_EQ(mesh->types[v], 2) << "level " << level;
      EXPECT_EQ(mesh->albedo[v][1], 65'535) << "level " << level;
    }
    EXPECT_GT(seen, 100);
  }
}

TEST(SmoothMesh, DecodesColoursFromSrgb) {
  const SmoothMesh mesh = mesh_of(grid_of({IVec3{0}, IVec3{5}}, [](DVec3) { return -1.0; }), {});
  for (const LinearRgba16 albedo : mesh.albedo) {
    EXPECT_NEAR(albedo[0] / 65'535.0, 0.215861, 1e-5);
    EXPECT_EQ(albedo[3], 65'535);
  }
}

TEST(SmoothMesh, UnknownMaterialsAreWhite) {
  DensityGrid grid;
  grid.set({3, 3, 3}, {-1.0F, kAir});
  grid.set({13, 3, 3}, {-1.0F, 77});
  const SmoothMesh mesh = mesh_of(grid, {});
  std::set<VoxelType> types(mesh.types.begin(), mesh.types.end());
  EXPECT_EQ(types, (std::set<VoxelType>{kAir, 77}));
  for (const LinearRgba16 albedo : mesh.albedo) EXPECT_EQ(albedo, (LinearRgba16{65'535, 65'535, 65'535, 65'535}));
}

TEST(SmoothMesh, HasNoOcclusionIfMethodIsNone) {
  const DensityGrid grid = grid_of({IVec3{0}, IVec3{9}}, oracle::sphere(DVec3{4.2}, 3.0));
  SmoothMeshOptions options;
  EXPECT_EQ(mesh_of(grid, options).occlusion.size(), mesh_of(grid, options).positions.size());
  options.occlusion.method = SmoothOcclusion::None;
  EXPECT_TRUE(mesh_of(grid, options).occlusion.empty());
}

TEST(SmoothMesh, RequestsEachLevelOnceAndRejectsInvalidLevels) {
  const DensityGrid grid = grid_of({IVec3{60}, IVec3{70}}, oracle::sphere(DVec3{65.0}, 3.0));
  std::map<std::tuple<int, int, int>, int> asked;
  SmoothMeshOptions options;
  options.level_of = [&](IVec3 chunk) {
    ++asked[{chunk.x, chunk.y, chunk.z}];
    return 0;
  };
  ASSERT_TRUE(build_smooth_mesh(grid, oracle::one_type(), options, {4}).has_value());
  EXPECT_GE(asked.size(), 27U);
  for (const auto& [chunk, times] : asked) EXPECT_EQ(times, 1);
  for (const int level : {-1, 4}) {
    options.level_of = [=](IVec3 chunk) { return chunk == IVec3{1, 0, 1} ? level : 1; };
    const auto mesh = build_smooth_mesh(grid, oracle::one_type(), options);
    ASSERT_FALSE(mesh.has_value());
    EXPECT_EQ(mesh.error().code, ErrorCode::InvalidArgument);
    EXPECT_EQ(mesh.error().message, "level of detail " + std::to_string(level) + " of chunk 1, 0, 1 is not 0 to 3");
  }
}

TEST(SmoothMesh, ReportsProgressAndCanBeCancelled) {
  const DensityGrid grid = grid_of({IVec3{-40}, IVec3{90}}, oracle::waves(2, 30.0));
  double last = 0.0;
  bool rising = true;
  const auto whole = build_smooth_mesh(grid, oracle::one_type(), {}, {2}, [&](double fraction) {
    rising = rising && fraction >= last;
    last = fraction;
    return true;
  });
  ASSERT_TRUE(whole.has_value());
  EXPECT_TRUE(rising);
  EXPECT_EQ(last, 1.0);
  for (const double stop : {0.0, 0.3, 0.8}) {
    int calls_after = 0;
    const auto stopped = build_smooth_mesh(grid, oracle::one_type(), {}, {2}, [&](double fraction) {
      if (fraction > stop) ++calls_after;
      return fraction <= stop;
    });
    ASSERT_FALSE(stopped.has_value());
    EXPECT_EQ(stopped.error().code, ErrorCode::Cancelled);
    EXPECT_EQ(calls_after, 1);
  }
}

}  // namespace
}  // namespace quoin
