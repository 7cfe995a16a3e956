#include <quoin/voxelize/voxelize.h>

#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "core/death_for_tests.h"
#include "voxelize/crossings.h"
#include "voxelize/shapes_for_tests.h"
#include "voxelize/voxel_frame.h"

namespace quoin {
namespace {

using shapes::Voxels;

Voxels voxelized(const TriangleMesh& mesh, SurfaceVoxels surface, SolidVoxels solid) {
  VoxelRegistry types;
  VoxelizeOptions options;
  options.surface = surface;
  options.solid = solid;
  const auto made = voxelize(mesh, options, types);
  if (!made) {
    ADD_FAILURE() << to_string(made.error());
    return {};
  }
  return shapes::voxels_of(made->grid);
}

Voxels solid_of(const TriangleMesh& mesh, SolidVoxels rule = SolidVoxels::Winding) {
  return voxelized(mesh, SurfaceVoxels::None, rule);
}

// Numbers that put no plane, edge or corner on a voxel's sides or centre lines.
const DVec3 kOdd(0.137, 0.291, 0.173);

std::vector<TriangleMesh> closed_meshes() {
  return {shapes::box(kOdd, DVec3(9.0, 5.0, 7.0) + 1.3 * kOdd),
          shapes::rotated(shapes::box(kOdd - 6.0, DVec3(6.0, 4.0, 5.0) + kOdd), {1.0, 2.0, 3.0}, 0.7),
          shapes::sphere(kOdd, 8.3, 13, 9),
          shapes::rotated(shapes::sphere(DVec3(30.1, 64.2, -5.3), 6.1, 24, 14), {0.3, 1.0, 0.2}, 0.4,
                          DVec3(30.0, 64.0, -5.0)),
          shapes::rotated(shapes::torus(kOdd, 9.2, 3.4, 17, 9), {1.0, 0.4, 0.2}, 0.5)};
}

TEST(VoxelizeSolid, MatchesWindingNumberOfClosedMeshes) {
  for (const TriangleMesh& mesh : closed_meshes()) {
    const Voxels expected = shapes::solid_by_winding(mesh);
    EXPECT_GT(expected.size(), 100U);
    EXPECT_TRUE(solid_of(mesh) == expected) << expected.size();
    EXPECT_TRUE(solid_of(mesh, SolidVoxels::Parity) == expected) << expected.size();
  }
}

TEST(VoxelizeSolid, MatchesVoxelCountsOfKnownShapes) {
  EXPECT_EQ(solid_of(shapes::box(DVec3(-3.0, 0.0, 2.0), DVec3(7.0, 5.0, 4.0))).size(), 10U * 5U * 2U);
  // Centres lie on the sides of the box: those on lower sides count, those on upper sides do not.
  EXPECT_EQ(solid_of(shapes::box(DVec3(0.5), DVec3(4.5))).size(), 64U);
  // A ball so fine that no centre lies between it and its mesh: the counts of Gauss's circle problem in three
  // dimensions, about the centre of a voxel.
  const TriangleMesh ball = shapes::sphere(DVec3(0.5), 10.03, 300, 200);
  const Voxels expected =
      shapes::voxels_where(ball.bounds(), [](IVec3 v) { return v.x * v.x + v.y * v.y + v.z * v.z <= 100; });
  EXPECT_EQ(expected.size(), 4169U);
  EXPECT_TRUE(solid_of(ball) == expected);
}

TEST(VoxelizeSolid, DoesNotLeakIfEdgesCrossVoxelCentres) {
  // Corners, edges and faces on centres and sides of voxels. Voxels on the surface itself may be either.
  constexpr double kOn = 1e-6;
  for (const TriangleMesh& mesh :
       {shapes::box(DVec3(0.5), DVec3(8.5)), shapes::box(DVec3(20), DVec3(28)),
        shapes::rotated(shapes::box(DVec3(0), DVec3(8)), {0, 1, 0}, 0.25 * std::numbers::pi),
        shapes::torus(DVec3(0.5, 40.5, 0.5), 8.0, 4.0, 8, 4), shapes::torus(DVec3(64.0), 8.0, 4.0, 4, 4)}) {
    for (const SolidVoxels rule : {SolidVoxels::Winding, SolidVoxels::Parity}) {
      const Voxels solid = solid_of(mesh, rule);
      EXPECT_GT(solid.size(), 300U);
      (void)shapes::voxels_where(mesh.bounds(), [&](IVec3 v) {
        const DVec3 centre = DVec3(v) + 0.5;
        if (shapes::distance_to_mesh(mesh, centre) < kOn) return false;
        EXPECT_EQ(solid.contains({v.z, v.y, v.x}), shapes::winding_number(mesh, centre) > 0.5)
            << v.x << " " << v.y << " " << v.z;
        return false;
      });
    }
  }
}

TEST(VoxelizeSolid, MergesSelfIntersectingParts) {
  TriangleMesh mesh = shapes::sphere(kOdd, 7.1, 20, 12);
  shapes::append(mesh, shapes::box(DVec3(2.0) + kOdd, DVec3(9.0) + kOdd));
  Voxels both = solid_of(shapes::sphere(kOdd, 7.1, 20, 12));
  both.merge(solid_of(shapes::box(DVec3(2.0) + kOdd, DVec3(9.0) + kOdd)));
  EXPECT_TRUE(solid_of(mesh) == both);
  EXPECT_LT(solid_of(mesh, SolidVoxels::Parity).size(), both.size());
}

TEST(VoxelizeSolid, IgnoresOrientationOfParts) {
  for (TriangleMesh mesh : closed_meshes()) {
    const Voxels expected = solid_of(mesh);
    std::mt19937 random(7);
    TriangleMesh turned = mesh;
    for (auto& triangle : turned.triangles) std::swap(triangle[0], triangle[1]);
    EXPECT_TRUE(solid_of(turned) == expected);
    // By parity each triangle may face either way.
    for (auto& triangle : mesh.triangles) {
      if ((random() & 1U) != 0) std::swap(triangle[0], triangle[1]);
    }
    EXPECT_TRUE(solid_of(mesh, SolidVoxels::Parity) == expected);
  }
}

TEST(VoxelizeSolid, LeavesCavitiesOpen) {
  TriangleMesh mesh = shapes::box(DVec3(0.0), DVec3(10.0));
  TriangleMesh hole = shapes::box(DVec3(3.0), DVec3(6.0));
  for (auto& triangle : hole.triangles) std::swap(triangle[0], triangle[1]);
  shapes::append(mesh, hole);
  EXPECT_EQ(solid_of(mesh).size(), 1000U - 27U);
  EXPECT_EQ(solid_of(mesh, SolidVoxels::Parity).size(), 1000U - 27U);
}

TEST(VoxelizeSolid, BridgesHoles) {
  TriangleMesh mesh = shapes::sphere(kOdd, 12.0, 32, 24);
  const Voxels whole = solid_of(mesh);
  std::mt19937 random(11);
  // One triangle of twelve is missing.
  TriangleMesh torn = mesh;
  torn.triangles.clear();
  for (const auto& triangle : mesh.triangles) {
    if (random() % 12 != 0) torn.triangles.push_back(triangle);
  }
  const Voxels exact = shapes::solid_by_winding(torn);
  for (const SolidVoxels rule : {SolidVoxels::Winding, SolidVoxels::Parity}) {
    const Voxels found = solid_of(torn, rule);
    std::size_t differ = 0;
    for (const auto& voxel : whole) differ += found.contains(voxel) ? 0 : 1;
    for (const auto& voxel : found) differ += whole.contains(voxel) ? 0 : 1;
    EXPECT_LT(differ, whole.size() / 50) << whole.size();
  }
  EXPECT_NEAR(static_cast<double>(exact.size()), static_cast<double>(whole.size()),
              0.01 * static_cast<double>(whole.size()));
}

/// Returns the combined votes of six axis rays from a centre, with each triangle tested separately.
int votes_of(const TriangleMesh& mesh, SolidVoxels rule, DVec3 centre) {
  int votes = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3;
    const int v = (axis + 2) % 3;
    int ahead = 0, behind = 0, met_ahead = 0, met_behind = 0;
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
      auto [a, b, c] = shapes::corners(mesh, i);
      a -= centre, b -= centre, c -= centre;
      const double e0 = a[u] * b[v] - a[v] * b[u], e1 = b[u] * c[v] - b[v] * c[u], e2 = c[u] * a[v] - c[v] * a[u];
      const bool is_met = (e0 > 0.0 && e1 > 0.0 && e2 > 0.0) || (e0 < 0.0 && e1 < 0.0 && e2 < 0.0);
      if (!is_met) continue;
      const double area = e0 + e1 + e2;
      const bool is_ahead = (a[axis] * e1 + b[axis] * e2 + c[axis] * e0) / area > 0.0;
      (is_ahead ? ahead : behind) += (area > 0.0) == is_ahead ? 1 : -1;
      ++(is_ahead ? met_ahead : met_behind);
    }
    votes += rule == SolidVoxels::Parity ? (met_ahead & 1) + (met_behind & 1) : ahead + behind;
  }
  return votes;
}

// Random triangles, open on all sides, over several chunks: most chunks are decided without looking at voxels.
TEST(VoxelizeSolid, OpenTrianglesMatchVotesOfSixRays) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> place(0.0, 150.0);
  for (const int count : {1, 4, 13, 34}) {
    TriangleMesh mesh;
    for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(count); ++i) {
      for (int corner = 0; corner < 3; ++corner) {
        mesh.positions.emplace_back(place(random), place(random), place(random));
      }
      mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    }
    for (const SolidVoxels rule : {SolidVoxels::Winding, SolidVoxels::Parity}) {
      VoxelRegistry types;
      VoxelizeOptions options;
      options.surface = SurfaceVoxels::None;
      options.solid = rule;
      const auto made = voxelize(mesh, options, types);
      ASSERT_TRUE(made) << to_string(made.error());
      for (int i = 0; i < 2'000; ++i) {
        const IVec3 voxel(static_cast<int>(random() % 150), static_cast<int>(random() % 150),
                          static_cast<int>(random() % 150));
        const bool expected = std::abs(votes_of(mesh, rule, DVec3(voxel) + 0.5)) > 3;
        ASSERT_EQ(made->grid.get(voxel) != kAir, expected)
            << count << ": " << voxel.x << " " << voxel.y << " " << voxel.z;
      }
    }
  }
}

TEST(VoxelizeSurface, ThickCoversEveryIntersectedCube) {
  for (const TriangleMesh& mesh : closed_meshes()) {
    const Voxels expected = shapes::surface_by_boxes(mesh);
    EXPECT_TRUE(voxelized(mesh, SurfaceVoxels::Separating26, SolidVoxels::None) == expected) << expected.size();
  }
  // Surfaces between two voxels take both of them.
  const TriangleMesh box = shapes::box(DVec3(0.0), DVec3(4.0));
  EXPECT_EQ(voxelized(box, SurfaceVoxels::Separating26, SolidVoxels::None).size(), 6U * 6U * 6U - 2U * 2U * 2U);
  EXPECT_TRUE(voxelized(box, SurfaceVoxels::Separating26, SolidVoxels::None) == shapes::surface_by_boxes(box));
}

TEST(VoxelizeSurface, ThinCoversVoxelsWithIntersectedCentreLines) {
  for (const TriangleMesh& mesh : closed_meshes()) {
    const Voxels expected = shapes::surface_by_lines(mesh);
    EXPECT_TRUE(voxelized(mesh, SurfaceVoxels::Separating6, SolidVoxels::None) == expected) << expected.size();
  }
}

TEST(VoxelizeSurface, SideBetweenVoxelsCoversInnerVoxels) {
  TriangleMesh box = shapes::box(DVec3(0.0), DVec3(4.0));
  constexpr std::size_t kShell = 4U * 4U * 4U - 2U * 2U * 2U;
  EXPECT_EQ(voxelized(box, SurfaceVoxels::Separating6, SolidVoxels::None).size(), kShell);
  EXPECT_EQ(voxelized(box, SurfaceVoxels::Separating6, SolidVoxels::Winding).size(), 64U);
  for (auto& triangle : box.triangles) std::swap(triangle[0], triangle[1]);
  EXPECT_EQ(voxelized(box, SurfaceVoxels::Separating6, SolidVoxels::None).size(), kShell) << "turned inside out";
  std::mt19937 random(7);
  for (auto& triangle : box.triangles) {
    if ((random() & 1U) != 0) std::swap(triangle[0], triangle[1]);
  }
  EXPECT_EQ(voxelized(box, SurfaceVoxels::Separating6, SolidVoxels::Parity).size(), 64U) << "turned any way";
  // The walls around a cavity keep their full thickness.
  TriangleMesh hollow = shapes::box(DVec3(0.0), DVec3(10.0));
  TriangleMesh cavity = shapes::box(DVec3(3.0), DVec3(7.0));
  for (auto& triangle : cavity.triangles) std::swap(triangle[0], triangle[1]);
  shapes::append(hollow, cavity);
  EXPECT_EQ(voxelized(hollow, SurfaceVoxels::Separating6, SolidVoxels::Winding).size(), 1000U - 64U);
}

// A slanted side that ends between voxels has no inner side there.
TEST(VoxelizeSurface, KeepsTipsOnTheLatticeWithinBounds) {
  TriangleMesh tip;
  tip.positions = {{0, 0, 0}, {8, 0, 0}, {0, 8, 0}, {0, 0, 8}};
  tip.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  for (const SolidVoxels solid : {SolidVoxels::None, SolidVoxels::Winding}) {
    const Voxels voxels = voxelized(tip, SurfaceVoxels::Separating6, solid);
    EXPECT_GT(voxels.size(), 50U);
    for (const auto& [z, y, x] : voxels) {
      EXPECT_TRUE(std::min({x, y, z}) >= 0 && std::max({x, y, z}) < 8) << x << ' ' << y << ' ' << z;
    }
  }
}

TEST(VoxelizeSurface, SidesOnCentresCoverTheirVoxels) {
  const TriangleMesh box = shapes::box(DVec3(0.5), DVec3(3.5));
  EXPECT_EQ(voxelized(box, SurfaceVoxels::Separating6, SolidVoxels::Winding).size(), 64U);
  EXPECT_EQ(voxelized(box, SurfaceVoxels::Separating6, SolidVoxels::None).size(), 56U);
  // Across chunks, with one side between voxels.
  const TriangleMesh long_box = shapes::box(DVec3(0.5, 0.0, 60.5), DVec3(3.5, 4.0, 70.5));
  EXPECT_EQ(voxelized(long_box, SurfaceVoxels::Separating6, SolidVoxels::Winding).size(), 4U * 4U * 11U);
}

TEST(VoxelizeSurface, ToleratesRoundingAtSides) {
  for (const double size : {0.1, 0.02, 1.0 / 3.0, 0.7}) {
    const TriangleMesh box = shapes::box(DVec3(3.0 * size, -7.0 * size, 11.0 * size), DVec3(17.0 * size));
    VoxelRegistry types;
    VoxelizeOptions options;
    options.lattice = *lattice_of_voxel(box, size);
    const auto made = voxelize(box, options, types);
    ASSERT_TRUE(made);
    EXPECT_EQ(made->grid.voxel_count(), 14 * 24 * 6) << size;
  }
}

TEST(VoxelizeSurface, SlantedPlaneIsOneLayer) {
  // y = 0.3 x + 0.45 z + 10.1, over 40 x 40 columns.
  TriangleMesh mesh;
  const auto at = [](double x, double z) { return DVec3(x, 0.3 * x + 0.45 * z + 10.1, z); };
  mesh.positions = {at(0, 0), at(0, 40), at(40, 40), at(40, 0)};
  shapes::add_quad(mesh, 0, 1, 2, 3);
  const Voxels thin = voxelized(mesh, SurfaceVoxels::Separating6, SolidVoxels::None);
  const auto within = [](double x) { return x > 0.0 && x < 40.0; };
  const Voxels expected = shapes::voxels_where(mesh.bounds(), [&](IVec3 v) {
    const DVec3 c = DVec3(v) + 0.5;
    const double x = (c.y - 10.1 - 0.45 * c.z) / 0.3;
    const double z = (c.y - 10.1 - 0.3 * c.x) / 0.45;
    if (within(c.z) && within(x) && std::abs(x - c.x) <= 0.5) return true;
    if (within(c.x) && within(z) && std::abs(z - c.z) <= 0.5) return true;
    return within(c.x) && within(c.z) && std::abs(at(c.x, c.z).y - c.y) <= 0.5;
  });
  EXPECT_TRUE(thin == expected);
  EXPECT_GE(thin.size(), 40U * 40U);
  Voxels columns;
  for (const auto& [z, y, x] : thin) columns.insert({z, 0, x});
  EXPECT_EQ(columns.size(), 40U * 40U);
  EXPECT_TRUE(solid_of(mesh).empty());
}

/// Returns true if a walk from outside through non-surface voxels reaches a solid non-surface centre.
bool reaches_inside(const Voxels& surface, const Voxels& solid, const DBox& bounds, bool through_corners) {
  const IVec3 low = voxel_of(bounds.min) - 2;
  const IVec3 high = voxel_of(bounds.max) + 2;
  std::vector<IVec3> open = {low};
  Voxels seen = {{low.z, low.y, low.x}};
  while (!open.empty()) {
    const IVec3 at = open.back();
    open.pop_back();
    if (solid.contains({at.z, at.y, at.x})) return true;
    for (int i = 0; i < 27; ++i) {
      const IVec3 step(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1);
      if (!through_corners && std::abs(step.x) + std::abs(step.y) + std::abs(step.z) != 1) continue;
      const IVec3 next = at + step;
      if (glm::any(glm::lessThan(next, low)) || glm::any(glm::greaterThan(next, high))) continue;
      if (surface.contains({next.z, next.y, next.x}) || !seen.insert({next.z, next.y, next.x}).second) continue;
      open.push_back(next);
    }
  }
  return false;
}

TEST(VoxelizeSurface, SeparatesInsideFromOutside) {
  int thin_ones_with_gaps = 0;
  for (const TriangleMesh& mesh : closed_meshes()) {
    const Voxels solid = solid_of(mesh);
    const Voxels thin = voxelized(mesh, SurfaceVoxels::Separating6, SolidVoxels::None);
    const Voxels thick = voxelized(mesh, SurfaceVoxels::Separating26, SolidVoxels::None);
    EXPECT_FALSE(reaches_inside(thin, solid, mesh.bounds(), false));
    EXPECT_FALSE(reaches_inside(thick, solid, mesh.bounds(), true));
    thin_ones_with_gaps += reaches_inside(thin, solid, mesh.bounds(), true) ? 1 : 0;
    EXPECT_LT(thin.size(), thick.size());
    for (const auto& voxel : thin) EXPECT_TRUE(thick.contains(voxel));
  }
  EXPECT_GT(thin_ones_with_gaps, 0);
}

TEST(VoxelizeSurface, WarnsOfTipsThinnerThanVoxel) {
  // A spike of 20 voxels, 0.4 thick at its base, between the centre lines.
  TriangleMesh mesh;
  mesh.positions = {{0.05, 0, 0.05}, {0.45, 0, 0.05}, {0.05, 0, 0.45}, {0.1, 20, 0.1}};
  mesh.triangles = {{0, 1, 2}, {0, 3, 1}, {1, 3, 2}, {2, 3, 0}};
  TriangleMesh with_box = shapes::box(DVec3(-4.0, -4.0, -4.0), DVec3(4.0, 0.0, 4.0));
  shapes::append(with_box, mesh);
  VoxelizeOptions options;
  VoxelRegistry types;
  const auto thin = voxelize(with_box, options, types);
  ASSERT_TRUE(thin);
  ASSERT_EQ(thin->warnings.size(), 1U);
  EXPECT_NE(thin->warnings[0].find("1 mesh vertices"), std::string::npos) << thin->warnings[0];
  options.surface = SurfaceVoxels::Separating26;
  const auto thick = voxelize(with_box, options, types);
  ASSERT_TRUE(thick);
  EXPECT_TRUE(thick->warnings.empty());
  EXPECT_GE(thick->grid.bounds().max.y, 20);
}

TEST(VoxelizeField, HasDistancesOfMesh) {
  for (const TriangleMesh& mesh : closed_meshes()) {
    VoxelRegistry types;
    DistanceFieldOptions options;
    options.band = 4.0F;
    const auto made = distance_field(mesh, options, types);
    ASSERT_TRUE(made);
    const Voxels solid = shapes::solid_by_winding(mesh);
    const DBox bounds = mesh.bounds();
    (void)shapes::voxels_where({bounds.min - 4.0, bounds.max + 4.0}, [&](IVec3 v) {
      const bool is_solid = solid.contains({v.z, v.y, v.x});
      const double distance = std::min(shapes::distance_to_mesh(mesh, DVec3(v) + 0.5), 4.0);
      EXPECT_NEAR(made->field.density(v), is_solid ? -distance : distance, 2e-3) << v.x << " " << v.y << " " << v.z;
      EXPECT_EQ(made->field.density(v) < 0.0F, is_solid);
      return false;
    });
    EXPECT_EQ(made->field.solid_count(), static_cast<std::int64_t>(solid.size()));
  }
}

TEST(VoxelizeField, CrossesChunksAndReachesDeepInside) {
  const TriangleMesh mesh = shapes::box(DVec3(-70.0), DVec3(150.0, 60.0, 64.0));
  VoxelRegistry types;
  const auto made = distance_field(mesh, {}, types);
  ASSERT_TRUE(made);
  EXPECT_EQ(made->field.density({0, 0, 0}), -8.0F);
  EXPECT_EQ(made->field.density({0, 59, 0}), -0.5F);
  EXPECT_EQ(made->field.density({0, 63, 0}), 3.5F);
  EXPECT_EQ(made->field.density({149, 0, 63}), -0.5F);
  EXPECT_EQ(made->field.solid_count(), 220 * 130 * 134);
  EXPECT_EQ(made->field.material({0, 0, 0}), 1);
}

TEST(Voxelize, IsTheSameAtAnyThreadCount) {
  TriangleMesh mesh = shapes::sphere(DVec3(20.0), 90.0, 40, 30);
  for (const DVec3& p : mesh.positions) mesh.colours.emplace_back(glm::fract(glm::vec3(p * 0.37)), 1.0F);
  VoxelRegistry one_types;
  VoxelRegistry many_types;
  const auto one = voxelize(mesh, {}, one_types, {1});
  const auto many = voxelize(mesh, {}, many_types, {4});
  ASSERT_TRUE(one && many);
  EXPECT_GT(one_types.size(), 100U);
  EXPECT_EQ(one_types.size(), many_types.size());
  ASSERT_EQ(one->grid.chunks(), many->grid.chunks());
  for (const IVec3 chunk : one->grid.chunks())
    EXPECT_TRUE(*one->grid.find_chunk(chunk) == *many->grid.find_chunk(chunk));
}

TEST(Voxelize, RejectsInvalidMeshes) {
  VoxelRegistry types;
  TriangleMesh mesh = shapes::box(DVec3(0.0), DVec3(1.0));
  mesh.triangles[3][1] = 8;
  EXPECT_EQ(voxelize(mesh, {}, types).error().code, ErrorCode::InvalidArgument);
  mesh = shapes::box(DVec3(0.0), DVec3(1.0));
  mesh.positions[2].y = std::nan("");
  EXPECT_EQ(voxelize(mesh, {}, types).error().code, ErrorCode::InvalidArgument);
  mesh = shapes::box(DVec3(0.0), DVec3(1.0));
  mesh.material_of = {0, 1};
  EXPECT_EQ(voxelize(mesh, {}, types).error().code, ErrorCode::InvalidArgument);
  mesh = shapes::box(DVec3(0.0), DVec3(1e9));
  EXPECT_EQ(voxelize(mesh, {}, types).error().code, ErrorCode::LimitExceeded);
  EXPECT_EQ(lattice_of_size(mesh, 0).error().code, ErrorCode::InvalidArgument);
  EXPECT_EQ(lattice_of_voxel(mesh, 1.0).error().code, ErrorCode::LimitExceeded);
  EXPECT_EQ(lattice_of_size({}, 5).error().code, ErrorCode::InvalidArgument);
  const auto empty = voxelize({}, {}, types);
  ASSERT_TRUE(empty);
  EXPECT_EQ(empty->grid.voxel_count(), 0);
}

TEST(Voxelize, CanBeCancelled) {
  const TriangleMesh mesh = shapes::sphere(DVec3(0.0), 100.0, 40, 30);
  VoxelRegistry types;
  int calls = 0;
  const auto made = voxelize(mesh, {}, types, {1}, [&](double) { return ++calls < 30; });
  ASSERT_FALSE(made);
  EXPECT_EQ(made.error().code, ErrorCode::Cancelled);
  double last = 0.0;
  const auto whole = voxelize(mesh, {}, types, {2}, [&](double at) {
    EXPECT_GE(at, last);
    last = at;
    return true;
  });
  EXPECT_TRUE(whole);
  EXPECT_EQ(last, 1.0);
}

TEST(VoxelLattice, HasRequestedNumberOfVoxels) {
  const TriangleMesh mesh = shapes::box(DVec3(-1.0, 2.0, 5.0), DVec3(3.0, 3.0, 7.0));
  VoxelRegistry types;
  VoxelizeOptions options;
  options.lattice = *lattice_of_size(mesh, 64);
  for (const SurfaceVoxels surface : {SurfaceVoxels::None, SurfaceVoxels::Separating6, SurfaceVoxels::Separating26}) {
    options.surface = surface;
    const auto made = voxelize(mesh, options, types);
    ASSERT_TRUE(made);
    EXPECT_EQ(made->grid.bounds().min, IVec3(0));
    EXPECT_EQ(made->grid.bounds().max.x, 64);
    EXPECT_EQ(made->grid.voxel_count(),
              made->grid.bounds().size().x * made->grid.bounds().size().y * made->grid.bounds().size().z);
  }
  const auto by_size = lattice_of_voxel(mesh, 0.3);
  ASSERT_TRUE(by_size);
  EXPECT_EQ(by_size->voxel_size, 0.3);
  EXPECT_NEAR(by_size->origin.x, -1.2, 1e-12);
}

TEST(VoxelizeDeathTest, RejectsRowsAndBitsBeyondChunk) {
  QUOIN_EXPECT_MISTAKE((void)voxelizing::row_of(0, 64), "0 <= y, z < 64");
  QUOIN_EXPECT_MISTAKE((void)voxelizing::bits_between(3, 3), "0 <= first < end <= 64");
  QUOIN_EXPECT_MISTAKE((void)voxelizing::bits_between(0, 65), "0 <= first < end <= 64");
}

TEST(VoxelizeDeathTest, RejectsUnknownChunksAndTriangles) {
  const TriangleMesh mesh = shapes::box(kOdd, kOdd + 3.0);
  const auto frame = voxelizing::Frame::make(mesh, {}, 0.0);
  ASSERT_TRUE(frame.has_value());
  ASSERT_EQ(frame->chunk_count(), 1U);
  const voxelizing::ChunkTriangles triangles(*frame, 0.0);
  QUOIN_EXPECT_MISTAKE((void)frame->index_of(IVec3(0, -1, 0)), "a chunk of the frame");
  QUOIN_EXPECT_MISTAKE((void)frame->chunk_at(1), "a chunk of the frame");
  QUOIN_EXPECT_MISTAKE((void)frame->corners(mesh.triangles.size()), "a triangle of the mesh");
  QUOIN_EXPECT_MISTAKE((void)triangles.of(1), "a chunk of the frame");
}

TEST(VoxelizeDeathTest, RejectsSolidVoxelsWithoutRule) {
  const TriangleMesh mesh = shapes::box(kOdd, kOdd + 3.0);
  const auto frame = voxelizing::Frame::make(mesh, {}, 0.0);
  ASSERT_TRUE(frame.has_value());
  const auto crossings = voxelizing::Crossings::find(*frame, SolidVoxels::Winding, {1}, {});
  ASSERT_TRUE(crossings.has_value());
  QUOIN_EXPECT_MISTAKE((void)voxelizing::Inside(*crossings, SolidVoxels::None, {1}), "a rule for solid voxels");
  QUOIN_EXPECT_MISTAKE((void)crossings->columns(3), "0 <= axis < 3");
}

}  // namespace
}  // namespace quoin
