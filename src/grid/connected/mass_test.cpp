// Mass properties, compared with plain loops over voxels and parts of cells.

#include <quoin/grid/mass.h>

#include <array>
#include <cmath>
#include <random>
#include <utility>
#include <vector>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <quoin/grid/connected.h>

#include "core/death_for_tests.h"

namespace quoin {
namespace {

constexpr std::array<double, 10> kDensities = {0.25, 1.0, 2.5, 0.0, 3.0, 0.125, 7.0, 0.5, 1.5, 9.0};

double density_of(VoxelType type) {
  return kDensities.at(type);
}

struct Cube {
  DVec3 centre;
  double mass;
  double edge;
};

// The definition, cube by cube, about the centre of mass.
MassProperties plain(const std::vector<Cube>& cubes) {
  MassProperties all;
  for (const Cube& cube : cubes) {
    all.mass += cube.mass;
    all.centre += cube.mass * cube.centre;
  }
  if (all.mass == 0.0) return {};
  all.centre /= all.mass;
  for (const Cube& cube : cubes) {
    const DVec3 r = cube.centre - all.centre;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        const double own = i == j ? cube.edge * cube.edge / 6.0 : 0.0;
        all.inertia[i][j] += cube.mass * ((i == j ? glm::dot(r, r) : 0.0) - r[i] * r[j] + own);
      }
    }
  }
  return all;
}

MassProperties plain(const Grid& grid) {
  std::vector<Cube> cubes;
  grid.for_each([&](IVec3 voxel, VoxelType type) { cubes.push_back({DVec3(voxel) + 0.5, density_of(type), 1.0}); });
  return plain(cubes);
}

void expect_near(const MassProperties& found, const MassProperties& wanted, double share) {
  EXPECT_NEAR(found.mass, wanted.mass, share * wanted.mass);
  double scale = 0.0;
  for (int i = 0; i < 3; ++i) scale = std::max(scale, wanted.inertia[i][i]);
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(found.centre[i], wanted.centre[i], share * std::max(1.0, std::abs(wanted.centre[i]))) << i;
    for (int j = 0; j < 3; ++j) EXPECT_NEAR(found.inertia[i][j], wanted.inertia[i][j], share * scale) << i << j;
  }
}

TEST(Mass, BoxMatchesTextbooks) {
  Grid grid;
  grid.fill_box({{-10, 3, 60}, {20, 8, 72}}, 2);
  const MassProperties found = mass_properties(grid, density_of);
  const double mass = 2.5 * 30 * 5 * 12;
  EXPECT_EQ(found.mass, mass);
  EXPECT_EQ(found.centre, DVec3(5.0, 5.5, 66.0));
  EXPECT_NEAR(found.inertia[0][0], mass / 12 * (5 * 5 + 12 * 12), 1e-8);
  EXPECT_NEAR(found.inertia[1][1], mass / 12 * (30 * 30 + 12 * 12), 1e-8);
  EXPECT_NEAR(found.inertia[2][2], mass / 12 * (30 * 30 + 5 * 5), 1e-8);
  EXPECT_EQ(found.inertia[0][1], 0.0);
  // Voxels of half a unit: an eighth of the mass, a 32nd of the inertia.
  const MassProperties scaled = found.scaled(0.5);
  EXPECT_EQ(scaled.mass, mass / 8);
  EXPECT_EQ(scaled.centre, DVec3(2.5, 2.75, 33.0));
  EXPECT_EQ(scaled.inertia[1][1], found.inertia[1][1] / 32);
}

TEST(Mass, IsZeroWithoutVoxels) {
  Grid grid;
  EXPECT_EQ(mass_properties(grid, density_of).mass, 0.0);
  grid.fill_box({{0, 0, 0}, {4, 4, 4}}, 3);  // of density 0
  const MassProperties found = mass_properties(grid, density_of);
  EXPECT_EQ(found.mass, 0.0);
  EXPECT_EQ(found.centre, DVec3(0.0));
  EXPECT_EQ(mass_properties(DensityGrid(), density_of).mass, 0.0);
}

TEST(Mass, GridsAndPiecesMatchPlainLoops) {
  std::mt19937 random(5);
  for (int round = 0; round < 12; ++round) {
    Grid grid;
    const unsigned types = round < 6 ? 4 : 10;
    const IVec3 far = round % 3 == 0 ? IVec3(1'000'000, -2'000'000, 500'000) : IVec3(0);
    const auto corner = [&] {
      return far +
             IVec3(static_cast<int>(random() % 150), static_cast<int>(random() % 150),
                   static_cast<int>(random() % 150)) -
             75;
    };
    for (int i = 0; i < 12; ++i) {
      const IVec3 at = corner();
      const IVec3 size(static_cast<int>(random() % 40), static_cast<int>(random() % 40),
                       static_cast<int>(random() % 40));
      grid.fill_box({at, at + size}, static_cast<VoxelType>(random() % types));
    }
    for (int i = 0; i < 300; ++i) grid.set(corner(), static_cast<VoxelType>(random() % types));
    if (round == 1) grid.fill_box({IVec3(64), IVec3(128)}, 1);  // a uniform chunk
    expect_near(mass_properties(grid, density_of), plain(grid), 1e-9);
    ConnectedPieces pieces;
    pieces.update(grid);
    for (std::size_t i = 0; i < pieces.size(); i += 1 + pieces.size() / 25) {
      expect_near(mass_properties(pieces, i, density_of), plain(pieces.extract(i)), 1e-9);
    }
  }
}

TEST(Mass, AsksOncePerType) {
  Grid grid;
  for (int chunk = 0; chunk < 3; ++chunk) grid.fill_box({{64 * chunk, 0, 0}, {64 * chunk + 9, 7, 5}}, 2);
  int asked = 0;
  (void)mass_properties(grid, [&](VoxelType type) {
    ++asked;
    EXPECT_EQ(type, 2);
    return 1.0;
  });
  EXPECT_EQ(asked, 1);
}

// The documented rule, by functions that read single samples.
MassProperties plain(const DensityGrid& field, const IBox& cells) {
  std::vector<Cube> cubes;
  for (int z = cells.min.z; z < cells.max.z; ++z) {
    for (int y = cells.min.y; y < cells.max.y; ++y) {
      for (int x = cells.min.x; x < cells.max.x; ++x) {
        const IVec3 cell(x, y, z);
        double sum = 0.0;
        int solid = 0;
        for (int i = 0; i < 8; ++i) {
          const IVec3 sample = cell + IVec3{i & 1, i >> 1 & 1, i >> 2};
          if (!(field.density(sample) < 0.0F)) continue;
          ++solid;
          sum += density_of(field.material(sample));
        }
        if (solid == 0) continue;
        for (int i = 0; i < 64; ++i) {
          const DVec3 at = DVec3(cell) + 0.25 * (DVec3(i % 4, i / 4 % 4, i / 16) + 0.5);
          if (solid < 8 && !(field.density_at(at) < 0.0F)) continue;
          cubes.push_back({at, sum / solid / 64.0, 0.25});
        }
      }
    }
  }
  return plain(cubes);
}

TEST(Mass, FieldsFollowRule) {
  std::mt19937 random(9);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  for (int round = 0; round < 2; ++round) {
    DensityGrid field;
    const auto point = [&] { return 40.0 * DVec3(share(random), share(random), share(random)) + 44.0; };
    for (int i = 0; i < 6; ++i)
      field.add_sphere(point(), 2.0 + 6.0 * share(random), static_cast<VoxelType>(i % 3), 1.0);
    field.remove_sphere(point(), 6.0);
    expect_near(mass_properties(field, density_of), plain(field, {IVec3(34), IVec3(94)}), 2e-4);
  }
}

TEST(Mass, FieldBallIsNearlyExact) {
  DensityGrid field;
  field.add_sphere({62.3, 10.1, 0.4}, 12.0, 1, 0.0);
  const MassProperties found = mass_properties(field, density_of);
  const double mass = 4.0 / 3.0 * 3.14159265358979 * 12.0 * 12.0 * 12.0;
  EXPECT_NEAR(found.mass, mass, 0.01 * mass);
  EXPECT_NEAR(glm::length(found.centre - DVec3(62.3, 10.1, 0.4)), 0.0, 0.01);
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(found.inertia[i][i], 0.4 * mass * 144.0, 0.01 * 0.4 * mass * 144.0);
}

TEST(Mass, PartsFarApartAreRight) {
  constexpr int kFar = 1'200'000'000;
  Grid grid;
  grid.set({-kFar, 0, 0}, 1);
  grid.set({kFar, 0, 0}, 1);
  DensityGrid field;
  field.add_box(DVec3{-kFar - 4, -4, -4}, DVec3{-kFar + 4, 4, 4}, 1);
  field.add_box(DVec3{kFar - 4, -4, -4}, DVec3{kFar + 4, 4, 4}, 1);
  for (const MassProperties& found : {mass_properties(grid, density_of), mass_properties(field, density_of)}) {
    EXPECT_NEAR(found.centre.x, 0.0, 1.0);
    EXPECT_NEAR(found.inertia[1][1], found.mass * double{kFar} * double{kFar}, 1e-6 * found.inertia[1][1]);
  }
}

TEST(MassDeath, RejectsBadDensities) {
  Grid grid;
  grid.set({0, 0, 0}, 1);
  QUOIN_EXPECT_MISTAKE((void)mass_properties(grid, [](VoxelType) { return -1.0; }), "a finite density of at least 0");
}

}  // namespace
}  // namespace quoin
