#include <quoin/grid/density_grid.h>

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "core/not_finite_for_tests.h"
#include "grid/density/density_storage.h"

namespace quoin {
namespace {

// Every value is an exact half.
double linear(DVec3 p) {
  return 0.25 * p.x - 0.5 * p.y + 0.125 * p.z + 0.75;
}

DensityGrid linear_field() {
  DensityGrid grid(kMaxHalf);
  grid.edit({IVec3(-8), IVec3(8)}, [](IVec3 p, DensitySample) {
    return DensitySample{static_cast<float>(linear(DVec3(p))), 1};
  });
  grid.edit({{60, -4, -68}, {68, 4, -60}}, [](IVec3 p, DensitySample) {
    return DensitySample{static_cast<float>(linear(DVec3(p))), 1};
  });
  return grid;
}

TEST(DensityAt, IsExactOnLinearFieldsAcrossChunkBorders) {
  const DensityGrid grid = linear_field();
  std::mt19937 random(31);
  const auto in = [&](double low, double high) { return low + (high - low) * (random() / 4294967296.0); };
  for (int round = 0; round < 2'000; ++round) {
    const DVec3 near{in(-8, 7), in(-8, 7), in(-8, 7)};
    const DVec3 far{in(60, 67), in(-4, 3), in(-68, -61)};
    for (const DVec3 p : {near, far}) {
      EXPECT_NEAR(grid.density_at(p), linear(p), 1e-6);
      const DVec3 gradient = grid.gradient_at(p);
      EXPECT_NEAR(gradient.x, 0.25, 1e-6);
      EXPECT_NEAR(gradient.y, -0.5, 1e-6);
      EXPECT_NEAR(gradient.z, 0.125, 1e-6);
    }
  }
}

TEST(DensityAt, EqualsSamplesAtTheirPositions) {
  DensityGrid grid;
  grid.add_sphere({0.3, -0.7, 63.1}, 6.0, 1);
  for (int z = 50; z < 75; ++z) {
    for (int y = -12; y < 10; ++y) {
      for (int x = -12; x < 10; ++x) EXPECT_EQ(grid.density_at({x, y, z}), grid.density({x, y, z}));
    }
  }
}

// In chunks with and without storage, at their faces, at whole numbers, at points whose sums round to the next cell,
// and at points without a cell.
TEST(DensityAt, DifferencesEqualSixDensities) {
  std::mt19937 random(41);
  std::uniform_real_distribution<float> rough(-3.0F, 3.0F);
  DensityGrid grid(4.0F);
  grid.edit({IVec3(-64), IVec3(64)}, [&](IVec3, DensitySample) { return DensitySample{rough(random), 1}; });
  grid.edit({{0, 20, -64}, {64, 24, 0}}, [](IVec3, DensitySample) { return DensitySample{-1.5F, 1}; });
  grid.edit({{-64, 0, 0}, {0, 64, 64}}, [](IVec3, DensitySample) { return DensitySample{2.0F, 1}; });
  const auto matches = [&](const DVec3& point) {
    const DVec3 differences = density_differences(grid, point);
    for (int axis = 0; axis < 3; ++axis) {
      DVec3 step(0.0);
      step[axis] = 1.0;
      EXPECT_EQ(differences[axis], double{grid.density_at(point + step)} - double{grid.density_at(point - step)})
          << point.x << ' ' << point.y << ' ' << point.z << " axis " << axis;
    }
  };
  std::uniform_real_distribution<double> any(-66.0, 66.0);
  for (int i = 0; i < 20'000; ++i) {
    DVec3 point{any(random), any(random), any(random)};
    if (i % 4 == 1) point = glm::round(point);
    if (i % 4 == 2) point.y = std::round(point.y) - 1e-17;
    if (i % 4 == 3) point[i % 3] = std::nextafter(std::round(point[i % 3]), -kInfinity);
    matches(point);
  }
  for (const double odd : {-1e-300, -1e-20, 1e-20}) matches({odd, 31.5 + odd, -31.5});
  for (const double odd : {1e30, -1e30, kInfinity, 2'147'483'647.5}) {
    EXPECT_EQ(density_differences(grid, {odd, 0.5, 0.5}), DVec3(0.0));
  }
}

TEST(DensityAt, MatchesSumOverCornersInRandomField) {
  constexpr unsigned kSeed = 37;
  SCOPED_TRACE(kSeed);
  std::mt19937 random(kSeed);
  DensityGrid grid;
  grid.edit({IVec3(-4), IVec3(4)}, [&](IVec3, DensitySample) {
    return DensitySample{static_cast<float>(random() % 1000) / 100.0F - 5.0F, 1};
  });
  const auto value = [&](DVec3 p) {
    double sum = 0.0;
    const DVec3 low = glm::floor(p);
    for (int i = 0; i < 8; ++i) {
      const DVec3 corner = low + DVec3(i & 1, i >> 1 & 1, i >> 2);
      const DVec3 weight = 1.0 - glm::abs(p - corner);
      sum += grid.density(IVec3(corner)) * weight.x * weight.y * weight.z;
    }
    return sum;
  };
  for (int round = 0; round < 2'000; ++round) {
    DVec3 p{0.0};
    for (int axis = 0; axis < 3; ++axis) p[axis] = -6.0 + 12.0 * (random() / 4294967296.0);
    EXPECT_NEAR(grid.density_at(p), value(p), 1e-5);
    for (int axis = 0; axis < 3; ++axis) {
      DVec3 before = p;
      before[axis] = std::floor(p[axis]);
      DVec3 after = before;
      after[axis] += 1.0;
      // The field is linear along an axis within a cell.
      const double at_end = value(after - DVec3(axis == 0, axis == 1, axis == 2) * 1e-9);
      EXPECT_NEAR(grid.gradient_at(p)[axis], at_end - value(before), 1e-5);
    }
  }
}

TEST(DensityAt, GradientOnFaceUsesCellAbove) {
  DensityGrid grid;
  grid.set({-1, 0, 0}, {-1.0F, 1});
  grid.set({0, 0, 0}, {1.0F, 1});
  grid.set({1, 0, 0}, {4.0F, 1});
  EXPECT_EQ(grid.gradient_at({0, 0, 0}).x, 3.0);
  EXPECT_EQ(grid.gradient_at({-0.25, 0, 0}).x, 2.0);
}

TEST(DensityAt, IsFarAirAtInvalidPositions) {
  DensityGrid grid;
  grid.add_sphere({0, 0, 0}, 5.0, 1);
  for (const double bad : {kNan, kInfinity, -kInfinity, 1e300, -1e300, 2147483647.0, 2147483648.0, -2147483649.0}) {
    for (int axis = 0; axis < 3; ++axis) {
      DVec3 p{0.0};
      p[axis] = bad;
      EXPECT_EQ(grid.density_at(p), 8.0F);
      EXPECT_EQ(grid.gradient_at(p), DVec3(0.0));
    }
  }
  EXPECT_EQ(grid.density_at({-2147483648.0, 2147483646.5, 0.0}), 8.0F);
}

}  // namespace
}  // namespace quoin
