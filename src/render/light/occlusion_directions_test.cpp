#include "render/light/occlusion_directions.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <set>
#include <utility>
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

TEST(OcclusionDirections, SixMatchReferenceDirections) {
  for (const Direction face : kDirections) {
    SCOPED_TRACE(static_cast<int>(face));
    const auto all = fixed_set(6, face);
    ASSERT_EQ(all.size(), 6U);
    const DVec3 n(normal_of(face));
    EXPECT_TRUE(holds(all, n));
    for (int axis = 0; axis < 3; ++axis) {
      DVec3 tangent(0.0);
      tangent[axis] = 1.0;
      if (n[axis] != 0.0) continue;
      EXPECT_TRUE(holds(all, n + tangent));
      EXPECT_TRUE(holds(all, n - tangent));
    }
  }
  // Only the sixth direction's component along the normal changes its sign.
  EXPECT_TRUE(holds(fixed_set(6, Direction::PosX), {1, 1, 1}));
  EXPECT_TRUE(holds(fixed_set(6, Direction::NegX), {-1, 1, 1}));
  EXPECT_TRUE(holds(fixed_set(6, Direction::PosY), {1, 1, 1}));
  EXPECT_TRUE(holds(fixed_set(6, Direction::NegY), {1, -1, 1}));
  EXPECT_TRUE(holds(fixed_set(6, Direction::PosZ), {1, 1, 1}));
  EXPECT_TRUE(holds(fixed_set(6, Direction::NegZ), {1, 1, -1}));
}

TEST(OcclusionDirections, TurnsNineAboutNormalPerSample) {
  const OcclusionDirections nine(9);
  std::set<double> angles;
  for (int sample = 0; sample < 64; ++sample) {
    const auto turn = OcclusionDirections::turn_of(sample, 9);
    const double angle = std::atan2(turn.about_normal.sine, turn.about_normal.cosine);
    EXPECT_TRUE(angle >= 0.0 && angle < std::numbers::pi / 2);
    angles.insert(angle);
    const auto turned = nine.turned(turn);
    for (const Direction face : kDirections) {
      const auto f = static_cast<std::size_t>(face);
      const DVec3 n(normal_of(face));
      for (int ray = 0; ray < 9; ++ray) {
        const DVec3 before = nine.fixed(f, ray);
        const DVec3 after = turned[f][static_cast<std::size_t>(ray)];
        if (ray > 0) {
          EXPECT_NEAR(glm::dot(before, n), glm::dot(after, n), 1e-12);
        }
        EXPECT_NEAR(glm::length(after), 1.0, 1e-12);
        if (sample == 0) {
          EXPECT_EQ(before, after) << "the first sample stays as it is";
        }
      }
    }
  }
  double last = 0.0;
  double gap = 0.0;
  for (const double angle : angles) gap = std::max(gap, angle - std::exchange(last, angle));
  EXPECT_EQ(angles.size(), 64U);
  EXPECT_LT(gap, 2.0 * std::numbers::pi / 2 / 64) << "spread evenly";
  EXPECT_EQ(OcclusionDirections::turn_of(7, 6).about_normal.sine, 0.0) << "the six are the reference's";
}

// Turned about itself, the upright direction would stay the same: its shadow would have a hard edge at any number of
// samples.
TEST(OcclusionDirections, TiltsUprightRayEvenlyPerSample) {
  const OcclusionDirections nine(9);
  for (const Direction face : kDirections) {
    const auto f = static_cast<std::size_t>(face);
    const DVec3 n(normal_of(face));
    constexpr int kSamples = 256;
    DVec3 mean(0.0);
    double area = 0.0;  // area of the disc of tilts, as a share
    for (int sample = 0; sample < kSamples; ++sample) {
      const DVec3 upright = nine.turned(OcclusionDirections::turn_of(sample, 9))[f][0];
      const double cosine = glm::dot(upright, n);
      EXPECT_GT(cosine, std::cos(std::numbers::pi / 8)) << "half the way to the tilted ones at most";
      mean += upright - n * cosine;
      const double slope = std::tan(std::acos(std::min(cosine, 1.0))) / std::tan(std::numbers::pi / 8);
      area += slope * slope;
    }
    EXPECT_LT(glm::length(mean) / kSamples, 0.01);
    EXPECT_NEAR(area / kSamples, 0.5, 0.01) << "spread evenly";
  }
  EXPECT_EQ(OcclusionDirections::turn_of(3, 6).upright, DVec3(0, 0, 1)) << "the six are the reference's";
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
    // Symmetric: only the component along the normal remains.
    EXPECT_NEAR(glm::length(sum - n * glm::dot(sum, n)), 0.0, 1e-12);
  }
}

TEST(OcclusionDirections, SpreadsOtherCountsByCosine) {
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

TEST(OcclusionDirections, TurnsSpreadPerPixel) {
  const OcclusionDirections directions(1);
  constexpr std::uint32_t kPixels = 4000;
  std::array<int, 4> quarters{};
  for (std::uint32_t pixel = 0; pixel < kPixels; ++pixel) {
    const DVec3 d = directions.spread(static_cast<std::size_t>(Direction::PosY), 0, hash_of(pixel, 3));
    ++quarters.at(static_cast<std::size_t>((d.x > 0.0 ? 1 : 0) + (d.z > 0.0 ? 2 : 0)));
  }
  for (const int count : quarters) EXPECT_NEAR(count, kPixels / 4, 120);
}

TEST(OcclusionDirections, HashesDifferBetweenPixels) {
  std::set<std::uint32_t> hashes;
  for (std::uint32_t y = 0; y < 64; ++y) {
    for (std::uint32_t x = 0; x < 64; ++x) hashes.insert(hash_of(x, y));
  }
  EXPECT_GT(hashes.size(), 4090U);
}

TEST(OcclusionDirectionsDeathTest, AssertsOnWrongKindOrRayIndex) {
  const OcclusionDirections fixed(6);
  const OcclusionDirections spread(4);
  QUOIN_EXPECT_MISTAKE((void)fixed.spread(0, 0, 1), "is_fixed_");
  QUOIN_EXPECT_MISTAKE((void)spread.fixed(0, 0), "is_fixed_");
  QUOIN_EXPECT_MISTAKE((void)fixed.fixed(0, 6), "ray < count_");
}

TEST(OcclusionDirectionsDeathTest, RejectsUnknownFacesAndCounts) {
  QUOIN_EXPECT_MISTAKE(OcclusionDirections(0), "at least one ray");
  QUOIN_EXPECT_MISTAKE((void)OcclusionDirections(6).fixed(6, 0), "one of the six faces");
  QUOIN_EXPECT_MISTAKE((void)OcclusionDirections(4).spread(6, 0, 1), "one of the six faces");
  QUOIN_EXPECT_MISTAKE((void)OcclusionDirections::turn_of(-1, 9), "a sample of a pixel");
}

}  // namespace
}  // namespace quoin
