// The mesh of a field is a closed surface at any position of the chunk borders.

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include <quoin/mesh/smooth_mesh.h>

#include "core/work/nightly_for_tests.h"
#include "mesh/smooth/surface_check_for_tests.h"

namespace quoin {
namespace {

using oracle::box_around;
using oracle::count_surface;
using oracle::grid_of;
using oracle::mesh_of;
using oracle::SurfaceCount;

// In a chunk, across a face, an edge and a corner of chunks, far away, and on the negative side.
const std::vector<DVec3> kPlaces = {{31.3, 30.2, 33.1}, {64.0, 31.4, 30.0},        {0.3, -0.2, 32.5},
                                    {63.5, 63.9, 64.2}, {-64.1, -128.3, -0.4},     {0.0, 0.0, 0.0},
                                    {20.0, 62.9, -1.0}, {1000.2, -3000.6, 500.11}, {32.0, 63.0, 63.0}};

TEST(SmoothClosure, SphereIsClosedAcrossBorders) {
  for (const DVec3 centre : kPlaces) {
    for (const double radius : {1.2, 4.0, 13.7}) {
      SCOPED_TRACE(testing::Message() << "sphere at " << centre.x << " " << centre.y << " " << centre.z << ", "
                                      << radius);
      const DensityGrid grid = grid_of(box_around(centre, radius), oracle::sphere(centre, radius));
      for (const bool split : {false, true}) {
        SmoothMeshOptions options;
        options.split_sheets = split;
        const SmoothMesh mesh = mesh_of(grid, options);
        const SurfaceCount count = count_surface(mesh, true);
        oracle::expect_manifold(count);
        EXPECT_EQ(count.euler(), 2);
        const double volume = 4.0 / 3.0 * 3.14159265 * radius * radius * radius;
        EXPECT_NEAR(oracle::signed_volume(mesh), volume, volume * 0.8 / radius);
      }
    }
  }
}

TEST(SmoothClosure, BoxWithFacesOnLatticeIsClosed) {
  for (const IVec3 first : {IVec3{3, 4, 5}, IVec3{60, 60, 60}, IVec3{-5, 63, 0}, IVec3{0, 0, 0}, IVec3{64, -64, 64}}) {
    const IVec3 last = first + IVec3{5, 7, 3};
    // The density is 0 on the box's faces. These samples are air, since 0 is air.
    const DensityGrid grid = grid_of({first - 3, last + 4}, [&](DVec3 p) {
      const DVec3 away = glm::max(DVec3(first) - p, p - DVec3(last));
      return std::max({away.x, away.y, away.z});
    });
    ASSERT_EQ(grid.density(first), 0.0F);
    const SmoothMesh mesh = mesh_of(grid, {});
    const SurfaceCount count = count_surface(mesh, true);
    oracle::expect_manifold(count);
    EXPECT_EQ(count.euler(), 2);
    EXPECT_GT(oracle::signed_volume(mesh), 0.0);
    for (const Vec3 p : mesh.positions) {
      for (int axis = 0; axis < 3; ++axis) {
        EXPECT_GE(p[axis], static_cast<float>(first[axis]));
        EXPECT_LE(p[axis], static_cast<float>(last[axis]));
      }
    }
  }
}

TEST(SmoothClosure, RandomBlobsAreClosedAcrossBorders) {
  for (unsigned seed = 1; seed <= static_cast<unsigned>(cases(2, 4)); ++seed) {
    for (const double wavelength : {5.0, 12.0, 40.0}) {
      SCOPED_TRACE(testing::Message() << "seed " << seed << ", wavelength " << wavelength);
      const IBox box{IVec3{64 - 21}, IVec3{64 + 23}};
      const DensityGrid grid = grid_of(box, oracle::waves(seed, wavelength));
      SmoothMeshOptions options;
      options.split_sheets = false;
      oracle::expect_closed(count_surface(mesh_of(grid, options)));
      options.split_sheets = true;
      oracle::expect_manifold(count_surface(mesh_of(grid, options), true));
    }
  }
}

// Edges of solid blocks on a chunk's outermost samples start or end in chunks that do not exist.
TEST(SmoothClosure, SurfaceNextToMissingChunksIsClosed) {
  DensityGrid grid;
  grid.edit({IVec3{0}, IVec3{64}}, [](IVec3, DensitySample) { return DensitySample{-3.0F, 1}; });
  ASSERT_EQ(grid.chunk_count(), 1U);
  const SurfaceCount count = count_surface(mesh_of(grid, {}));
  oracle::expect_manifold(count);
  EXPECT_EQ(count.euler(), 2);
  DensityGrid corner;
  corner.set(IVec3{0}, {-0.5F, 1});
  EXPECT_EQ(count_surface(mesh_of(corner, {})).triangles, 12);
  oracle::expect_manifold(count_surface(mesh_of(corner, {}), true));
}

TEST(SmoothClosure, FieldsWithoutSurfaceHaveNoTriangles) {
  const IBox box{IVec3{-70}, IVec3{70}};
  EXPECT_TRUE(mesh_of(DensityGrid{}, {}).indices.empty());
  EXPECT_TRUE(mesh_of(grid_of(box, [](DVec3) { return 0.0; }), {}).indices.empty());
  EXPECT_TRUE(mesh_of(grid_of(box, [](DVec3) { return std::numeric_limits<double>::infinity(); }), {}).indices.empty());
  EXPECT_TRUE(mesh_of(grid_of(box, [](DVec3) { return std::nan(""); }), {}).indices.empty());
}

TEST(SmoothClosure, InfiniteDensitiesGiveFiniteVertices) {
  const double infinity = std::numeric_limits<double>::infinity();
  const DensityGrid grid = grid_of(box_around(DVec3{64.0}, 7.0),
                                   [&](DVec3 p) { return glm::length(p - 64.0) < 7.0 ? -infinity : infinity; });
  const SmoothMesh mesh = mesh_of(grid, {});
  oracle::expect_manifold(count_surface(mesh));
  for (const Vec3 p : mesh.positions) EXPECT_TRUE(is_finite(DVec3(p)));
  for (const Vec3 n : mesh.normals) EXPECT_NEAR(glm::length(n), 1.0F, 1e-5F);
  for (const float occlusion : mesh.occlusion) EXPECT_TRUE(occlusion >= 0.0F && occlusion <= 1.0F);
}

TEST(SmoothClosure, SphereNormalsFollowRadii) {
  for (const double radius : {8.0, 16.0, 30.0}) {
    const DVec3 centre{63.7, 0.4, -64.2};
    const SmoothMesh mesh = mesh_of(grid_of(box_around(centre, radius), oracle::sphere(centre, radius)), {});
    double worst = 0.0;
    double farthest = 0.0;
    for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
      const DVec3 away = DVec3(mesh.positions[i]) - centre;
      const double cosine = glm::dot(DVec3(mesh.normals[i]), glm::normalize(away));
      worst = std::max(worst, std::acos(std::clamp(cosine, -1.0, 1.0)));
      farthest = std::max(farthest, std::abs(glm::length(away) - radius));
    }
    RecordProperty("worst_degrees_at_" + std::to_string(static_cast<int>(radius)), std::to_string(worst * 57.29578));
    EXPECT_LT(worst * 57.29578, 42.0 / radius) << "radius " << radius;
    EXPECT_LT(farthest, 1.0 / radius) << "radius " << radius;
  }
}

TEST(SmoothClosure, TrianglesFaceAlongNormals) {
  const DVec3 centre{64.2, 64.3, 63.9};
  const SmoothMesh mesh = mesh_of(grid_of(box_around(centre, 12.0), oracle::sphere(centre, 12.0)), {});
  for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
    const Vec3 a = mesh.positions[mesh.indices[i]];
    const Vec3 face = glm::cross(mesh.positions[mesh.indices[i + 1]] - a, mesh.positions[mesh.indices[i + 2]] - a);
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_GT(glm::dot(glm::normalize(face), mesh.normals[mesh.indices[i + k]]), 0.8F);
    }
  }
}

}  // namespace
}  // namespace quoin
