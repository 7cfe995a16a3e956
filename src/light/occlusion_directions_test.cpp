#include "light/occlusion_directions.h"

#include <array>
#include <cmath>
#include <set>
#include <vector>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <quoin/core/direction.h>
#include "core/death_for_tests.h"

namespace quoin {
namespace {

bool holds(const std::vector<DVec3>& all, DVec3 wanted) {
  for (const DVec3& each : all) {
    if (glm::length(each - glm::normalize(wanted)) < 1e-12) return true;
  }
  return false;
}

std::vector<DVec3> fixed_set(int rays, Direction face) {
  const OcclusionDirections directions(rays);
  EXPECT_TRUE(directions.is_fixed());
  std::vector<DVec3> all;
  for (int ray = 0; ray < rays; ++ray) all.push_back(directions.fixed(static_cast<std::size_t>(face), ray));
  return all;
}

TEST(OcclusionDirections, SixAreTheLopsidedReference) {
  const auto up = fixed_set(6, Direction::PosY);
  ASSERT_EQ(up.size(), 6U);
  for (const DVec3 wanted :
       {DVec3(0, 1, 0), DVec3(1, 1, 0), DVec3(-1, 1, 0), DVec3(0, 1, 1), DVec3(0, 1, -1), DVec3(1, 1, 1)}) {
    EXPECT_TRUE(holds(up, wanted));
  }
  const auto left = fixed_set(6, Direction::NegX);
  for (const DVec3 wanted :
       {DVec3(-1, 0, 0), DVec3(-1, 1, 0), DVec3(-1, -1, 0), DVec3(-1, 0, 1), DVec3(-1, 0, -1), DVec3(-1, -1, -1)}) {
    EXPECT_TRUE(holds(left, wanted));
  }
}

TEST(OcclusionDirections, NineHaveAllFourDiagonals) {
  for (const Direction face : kDirections) {
    const auto all = fixed_set(9, face);
    const DVec3 n(normal_of(face));
    int tilted = 0;
    int diagonal = 0;
    DVec3 sum(0.0);
    for (const DVec3& d : all) {
      EXPECT_NEAR(glm::length(d), 1.0, 1e-12);
      tilted += std::abs(glm::dot(d, n) - std::sqrt(0.5)) < 1e-12;
      diagonal += std::abs(glm::dot(d, n) - std::sqrt(1.0 / 3.0)) < 1e-12;
      sum += d;
    }
    EXPECT_TRUE(holds(all, n));
    EXPECT_EQ(tilted, 4);
    EXPECT_EQ(diagonal, 4);
    // Symmetric: nothing is left but along the normal.
    EXPECT_NEAR(glm::length(sum - n * glm::dot(sum, n)), 0.0, 1e-12);
  }
}

TEST(OcclusionDirections, OtherNumbersAreSpreadByTheCosine) {
  constexpr int kRays = 64;
  const OcclusionDirections directions(kRays);
  ASSERT_FALSE(directions.is_fixed());
  for (const Direction face : kDirections) {
    const DVec3 n(normal_of(face));
    double cosines = 0.0;
    DVec3 mean(0.0);
    for (std::uint32_t pixel = 0; pixel < 50; ++pixel) {
      for (int ray = 0; ray < kRays; ++ray) {
        const DVec3 d = directions.spread(static_cast<std::size_t>(face), ray, hash_of(pixel, 7));
        ASSERT_NEAR(glm::length(d), 1.0, 1e-12);
        const double cosine = glm::dot(d, n);
        ASSERT_GT(cosine, 0.0);
        // Stratified: ray k lies in the k-th of as many rings of equal weight.
        ASSERT_EQ(static_cast<int>((1.0 - cosine * cosine) * kRays + 1e-9), ray);
        cosines += cosine;
        mean += d;
      }
    }
    EXPECT_NEAR(cosines / (50 * kRays), 2.0 / 3.0, 0.002);
    EXPECT_NEAR(glm::length(mean / (50.0 * kRays) - n * (2.0 / 3.0)), 0.0, 0.01);
  }
}

TEST(OcclusionDirections, TheWholeIsTurnedFromPixelToPixel) {
  const OcclusionDirections directions(1);
  constexpr std::uint32_t kPixels = 4000;
  std::array<int, 4> quarters{};
  for (std::uint32_t pixel = 0; pixel < kPixels; ++pixel) {
    const DVec3 d = directions.spread(static_cast<std::size_t>(Direction::PosY), 0, hash_of(pixel, 3));
    ++quarters.at(static_cast<std::size_t>((d.x > 0.0 ? 1 : 0) + (d.z > 0.0 ? 2 : 0)));
  }
  for (const int count : quarters) EXPECT_NEAR(count, kPixels / 4, 120);
}

TEST(OcclusionDirections, PixelsDiffer) {
  std::set<std::uint32_t> hashes;
  for (std::uint32_t y = 0; y < 64; ++y) {
    for (std::uint32_t x = 0; x < 64; ++x) hashes.insert(hash_of(x, y));
  }
  EXPECT_GT(hashes.size(), 4090U);
}

TEST(OcclusionDirectionsDeathTest, RaysOfTheOtherKindOrBeyondTheirNumberAreMistakes) {
  const OcclusionDirections fixed(6);
  const OcclusionDirections spread(4);
  QUOIN_EXPECT_MISTAKE((void)fixed.spread(0, 0, 1), "is_fixed_");
  QUOIN_EXPECT_MISTAKE((void)spread.fixed(0, 0), "is_fixed_");
  QUOIN_EXPECT_MISTAKE((void)fixed.fixed(0, 6), "ray < count_");
}

}  // namespace
}  // namespace quoin
