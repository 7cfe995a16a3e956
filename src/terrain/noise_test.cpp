#include <quoin/terrain/noise.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "core/death_for_tests.h"

namespace quoin {
namespace {

std::uint64_t fold(std::uint64_t hash, double value) {
  return (hash ^ std::bit_cast<std::uint64_t>(value)) * 0x100'0000'01B3U;
}

TEST(Noise, IsReproducible) {
  std::uint64_t plane = 0;
  std::uint64_t space = 0;
  std::uint64_t sums = 0;
  for (int i = 0; i < 5'000; ++i) {
    const double x = 0.37 * (i % 71) - 13.1;
    const double y = 0.29 * (i / 71) - 9.7;
    plane = fold(plane, noise2(7, x, y));
    space = fold(space, noise3(7, x, y, 0.11 * i));
    sums = fold(fold(sums, fractal2(7, x, y, 4)), ridged2(7, x, y, 4));
  }
  EXPECT_EQ(plane, 12'642'551'811'680'820'458U);
  EXPECT_EQ(space, 422'205'454'774'744'868U);
  EXPECT_EQ(sums, 3'318'916'902'815'889'144U);
}

TEST(Noise, IsZeroAndContinuousOnLattice) {
  for (int i = -20; i < 20; ++i) {
    EXPECT_EQ(noise2(3, i, 5 - i), 0.0);
    const double y = 0.31 * i;
    EXPECT_NEAR(noise2(3, i - 1e-9, y), noise2(3, i + 1e-9, y), 1e-7);
    EXPECT_NEAR(noise3(3, i - 1e-9, y, 2.5), noise3(3, i + 1e-9, y, 2.5), 1e-7);
  }
}

TEST(Noise, KeepsBoundsAndMean) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> place(-1e5, 1e5);
  double sum2 = 0;
  double sum3 = 0;
  constexpr int kSamples = 200'000;
  for (int i = 0; i < kSamples; ++i) {
    const double x = place(random);
    const double y = place(random);
    const double plane = noise2(9, x, y);
    const double space = noise3(9, x, y, place(random));
    const double ridged = ridged2(9, x, y, 4);
    ASSERT_LE(std::abs(plane), 1.0);
    ASSERT_LE(std::abs(space), 1.1);
    ASSERT_TRUE(ridged >= 0.0 && ridged <= 1.0) << ridged;
    sum2 += plane;
    sum3 += space;
  }
  EXPECT_NEAR(sum2 / kSamples, 0.0, 0.01);
  EXPECT_NEAR(sum3 / kSamples, 0.0, 0.01);
}

// Slopes are equally likely in all directions of the plane.
TEST(Noise, PrefersNoDirection) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> place(-1e4, 1e4);
  double along[4] = {};
  constexpr double kRootHalf = 0.70710678118654752440;
  const double directions[4][2] = {{1, 0}, {0, 1}, {kRootHalf, kRootHalf}, {kRootHalf, -kRootHalf}};
  for (int i = 0; i < 100'000; ++i) {
    const double x = place(random);
    const double y = place(random);
    const double here = fractal2(5, x, y, 3);
    for (int d = 0; d < 4; ++d) {
      const double rise = fractal2(5, x + 1e-4 * directions[d][0], y + 1e-4 * directions[d][1], 3) - here;
      along[d] += rise * rise;
    }
  }
  const auto [least, greatest] = std::minmax_element(along, along + 4);
  EXPECT_LT(*greatest / *least, 1.05);
}

TEST(Noise, DiffersBetweenSeeds) {
  int equal = 0;
  for (int i = 0; i < 1'000; ++i) equal += noise2(1, 0.37 * i, 0.5) == noise2(2, 0.37 * i, 0.5);
  EXPECT_LT(equal, 150) << "16 gradients: a few agree by chance at a corner, hardly ever at four";
}

TEST(NoiseDeathTest, RejectsCoordinatesBeyondLattice) {
  QUOIN_EXPECT_MISTAKE((void)noise2(1, 1e10, 0.0), "2.30");
  QUOIN_EXPECT_MISTAKE((void)noise3(1, 0.0, 0.0, std::nan("")), "2.30");
  QUOIN_EXPECT_MISTAKE((void)fractal2(1, 0.0, 0.0, 30), "29 - octaves");
  QUOIN_EXPECT_MISTAKE((void)ridged2(1, 1e9, 0.0, 2), "29 - octaves");
}

}  // namespace
}  // namespace quoin
