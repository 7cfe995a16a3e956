// Tests the parts of the path tracer against analytic results.

#include <array>
#include <cmath>
#include <random>
#include <vector>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include "core/death_for_tests.h"
#include "render/path/light_tree.h"
#include "render/path/path_lamps.h"
#include "render/path/path_math.h"
#include "render/path/scatter.h"
#include "render/path/sky_light.h"

namespace quoin::path {
namespace {

TEST(PathMath, MatchesCLibrary) {
  for (int i = 0; i <= 4000; ++i) {
    const float turns = static_cast<float>(i) / 4000.0F;
    const double angle = 2.0 * std::numbers::pi * static_cast<double>(turns);
    EXPECT_NEAR(of_turns(turns).sine, std::sin(angle), 4e-7);
    EXPECT_NEAR(of_turns(turns).cosine, std::cos(angle), 4e-7);
    const double cosine = -1.0 + 2.0 * i / 4000.0;
    EXPECT_NEAR(arc_cosine(cosine), std::acos(cosine), 2e-7);
    const float x = -30.0F + 0.015F * static_cast<float>(i);
    EXPECT_NEAR(exponential(x) / std::exp(x), 1.0F, 4e-6F) << x;
    const float y = 1e-4F + 0.01F * static_cast<float>(i);
    EXPECT_NEAR(log_of_two(y), std::log2(y), 2e-6F) << y;
    EXPECT_NEAR(power(y, 2.2F) / std::pow(y, 2.2F), 1.0F, 1e-5F) << y;
  }
  for (const auto& [y, x] : {std::pair{1.0, 1.0}, {1.0, -1.0}, {-1.0, -1.0}, {-2.0, 0.5}, {0.0, -1.0}, {3.0, 0.0}}) {
    EXPECT_NEAR(arc_tangent(y, x), std::atan2(y, x), 1e-7);
  }
  EXPECT_EQ(arc_tangent(0.0, 0.0), 0.0);
  EXPECT_EQ(exponential(-1e9F), 0.0F);
  EXPECT_EQ(exponential(-std::numeric_limits<float>::infinity()), 0.0F);
  EXPECT_TRUE(std::isfinite(exponential(1e9F)));
}

// The first 4^n samples have one in each of the 2^n by 2^n rectangles of the square, and so on.
TEST(PathRandom, IsStratifiedInEveryPairOfDimensions) {
  constexpr int kSamples = 256;
  for (std::uint32_t dimension = 0; dimension < 20; ++dimension) {
    for (int across = 1; across <= kSamples; across *= 2) {
      std::vector<int> hits(kSamples);
      for (std::uint32_t i = 0; i < kSamples; ++i) {
        const Pair u = Random(12345U, i).pair(dimension);
        ASSERT_GE(u.x, 0.0F);
        ASSERT_LT(u.x, 1.0F);
        const int x = static_cast<int>(u.x * static_cast<float>(across));
        const int y = static_cast<int>(u.y * static_cast<float>(kSamples / across));
        ++hits[static_cast<std::size_t>(y * across + x)];
      }
      for (const int each : hits) ASSERT_EQ(each, 1) << dimension << " " << across;
    }
  }
}

TEST(PathRandom, DimensionsAreUncorrelated) {
  double products = 0.0;
  constexpr int kCount = 4096;
  for (std::uint32_t i = 0; i < kCount; ++i) {
    const Random random(mix_bits(i), 3);
    products += (static_cast<double>(random.one(0)) - 0.5) * (static_cast<double>(random.one(1)) - 0.5);
  }
  EXPECT_NEAR(products / kCount, 0.0, 0.005);
}

const std::vector<Material> kMaterials = {{{0.8F, 0.5F, 0.2F}, 1.0F, 0.0F},
                                          {{0.8F, 0.5F, 0.2F}, 0.5F, 0.0F},
                                          {{0.9F, 0.9F, 0.9F}, 0.3F, 1.0F},
                                          {{0.8F, 0.5F, 0.2F}, 0.2F, 0.5F},
                                          {{1.0F, 1.0F, 1.0F}, 0.8F, 1.0F}};

TEST(PathScatter, DensityMatchesSamples) {
  for (const Material& material : kMaterials) {
    const Vec3 out = glm::normalize(Vec3(0.6F, -0.2F, 0.5F));
    const Scatter scatter(material, out);
    // Samples must match the integral of the density over the hemisphere, and the integral of the value.
    constexpr std::uint32_t kSamples = 1U << 16;
    double density = 0.0;
    Vec3 value(0.0F);
    Vec3 by_samples(0.0F);
    double found = 0.0;
    for (std::uint32_t i = 0; i < kSamples; ++i) {
      const Random random(7, i);
      const Vec3 in = cosine_weighted(random.pair(0));
      if (in.z > 0.0F) {
        density += static_cast<double>(scatter.density(in) * kPi / in.z);
        value += scatter.value(in) * (kPi / in.z);
      }
      const Scattered sample = scatter.sample(random.pair(1), random.one(2));
      if (largest(sample.weight) <= 0.0F) continue;
      found += 1.0;
      by_samples += sample.weight;
      EXPECT_NEAR(scatter.density(sample.direction) / sample.density, 1.0F, 2e-3F);
    }
    EXPECT_NEAR(density / kSamples, found / kSamples, 0.03);
    for (int channel = 0; channel < 3; ++channel) {
      EXPECT_NEAR(value[channel] / kSamples, by_samples[channel] / kSamples, 0.02F);
    }
  }
}

// A white surface reflects all light at any gloss.
TEST(PathScatter, WhiteReflectsAllLight) {
  for (const float metal : {0.0F, 0.5F, 1.0F}) {
    for (const float rough : {0.0F, 0.1F, 0.25F, 0.5F, 0.75F, 0.99F, 1.0F}) {
      for (const float cosine : {0.05F, 0.3F, 0.7F, 1.0F}) {
        const Vec3 out{std::sqrt(1.0F - cosine * cosine), 0.0F, cosine};
        const Scatter scatter({Vec3(1.0F), rough, metal}, out);
        Vec3 sum(0.0F);
        constexpr std::uint32_t kSamples = 4096;
        for (std::uint32_t i = 0; i < kSamples; ++i) {
          const Random random(11, i);
          sum += scatter.sample(random.pair(0), random.one(1)).weight;
        }
        EXPECT_NEAR(sum.x / kSamples, 1.0F, 0.02F) << metal << " " << rough << " " << cosine;
      }
    }
  }
}

TEST(PathScatter, GlossIsReciprocal) {
  const Material metal{{0.9F, 0.6F, 0.3F}, 0.4F, 1.0F};
  const Vec3 a = glm::normalize(Vec3(0.4F, 0.1F, 0.8F));
  const Vec3 b = glm::normalize(Vec3(-0.5F, 0.3F, 0.6F));
  // Except for the compensated energy, which depends on the view direction.
  const Vec3 one = Scatter(metal, a).value(b) / b.z;
  const Vec3 other = Scatter(metal, b).value(a) / a.z;
  EXPECT_NEAR(one.x / other.x, 1.0F, 0.05F);
}

std::vector<LampBounds> random_lamps(std::mt19937& random, int count) {
  std::uniform_real_distribution<float> unit(-1.0F, 1.0F);
  std::vector<LampBounds> lamps;
  for (int i = 0; i < count; ++i) {
    LampBounds lamp;
    lamp.low = Vec3(unit(random), unit(random), unit(random)) * 20.0F;
    lamp.high = lamp.low + Vec3(1.0F, 0.0F, 1.0F) * (1.0F + unit(random));
    lamp.axis = glm::normalize(Vec3(unit(random), unit(random), unit(random)) + 0.001F);
    lamp.power = 1.0F + unit(random) + 0.01F;
    lamps.push_back(lamp);
  }
  return lamps;
}

TEST(PathLightTree, ChoosesLampsWithStatedProbability) {
  std::mt19937 random(5);
  for (const int count : {1, 2, 7, 60}) {
    const std::vector<LampBounds> lamps = random_lamps(random, count);
    const LightTree tree(lamps);
    const Vec3 point{0.5F, -3.0F, 2.0F};
    const Vec3 normal = glm::normalize(Vec3(0.3F, 0.8F, -0.1F));
    std::vector<int> found(lamps.size());
    int none = 0;
    constexpr int kSamples = 20000;
    for (int i = 0; i < kSamples; ++i) {
      const auto choice = tree.choose(point, normal, (static_cast<float>(i) + 0.5F) / kSamples);
      if (choice.lamp < 0) {
        ++none;
        continue;
      }
      ++found[static_cast<std::size_t>(choice.lamp)];
      EXPECT_FLOAT_EQ(choice.probability, tree.probability(static_cast<std::uint32_t>(choice.lamp), point, normal));
    }
    double sum = 0.0;
    for (std::size_t i = 0; i < lamps.size(); ++i) {
      const float expected = tree.probability(static_cast<std::uint32_t>(i), point, normal);
      sum += static_cast<double>(expected);
      EXPECT_NEAR(static_cast<float>(found[i]) / kSamples, expected, 0.002F);
    }
    EXPECT_NEAR(sum + static_cast<double>(none) / kSamples, 1.0, 0.01);
  }
}

// Every lamp whose light may reach a point can be chosen.
TEST(PathLightTree, CanChooseEveryLampThatReachesPoint) {
  std::mt19937 random(9);
  std::uniform_real_distribution<float> unit(-1.0F, 1.0F);
  const std::vector<LampBounds> lamps = random_lamps(random, 100);
  const LightTree tree(lamps);
  int lit = 0;
  for (int i = 0; i < 200; ++i) {
    const Vec3 point = Vec3(unit(random), unit(random), unit(random)) * 25.0F;
    const Vec3 normal = glm::normalize(Vec3(unit(random), unit(random), unit(random)) + 0.001F);
    for (std::size_t k = 0; k < lamps.size(); ++k) {
      for (const Vec3 of : {lamps[k].low, lamps[k].high, (lamps[k].low + lamps[k].high) * 0.5F}) {
        const Vec3 to = of - point;
        if (!(glm::dot(to, normal) > 1e-3F) || !(glm::dot(-to, lamps[k].axis) > 1e-3F)) continue;
        ++lit;
        EXPECT_GT(tree.probability(static_cast<std::uint32_t>(k), point, normal), 0.0F);
      }
    }
  }
  EXPECT_GT(lit, 1000);
}

PathLamp square_lamp(DVec3 corner, float size) {
  PathLamp lamp;
  lamp.corner = corner;
  lamp.u = {1.0F, 0.0F, 0.0F};
  lamp.v = {0.0F, 0.0F, 1.0F};
  lamp.normal = {0.0F, -1.0F, 0.0F};
  lamp.size_u = lamp.size_v = size;
  lamp.radiance = Vec3(2.0F);
  return lamp;
}

// Lambert's formula: the irradiance of a polygon is half the sum of its edges' angles times their planes' normals.
double irradiance_by_lambert(const PathLamp& lamp, DVec3 point, DVec3 normal) {
  std::array<DVec3, 4> corners;
  const DVec3 u = DVec3(lamp.u) * static_cast<double>(lamp.size_u);
  const DVec3 v = DVec3(lamp.v) * static_cast<double>(lamp.size_v);
  corners = {lamp.corner, lamp.corner + u, lamp.corner + u + v, lamp.corner + v};
  double sum = 0.0;
  for (std::size_t i = 0; i < 4; ++i) {
    const DVec3 a = glm::normalize(corners[i] - point);
    const DVec3 b = glm::normalize(corners[(i + 1) % 4] - point);
    sum += std::acos(glm::dot(a, b)) * glm::dot(glm::normalize(glm::cross(a, b)), normal);
  }
  return std::abs(sum) * 0.5 * static_cast<double>(lamp.radiance.x);
}

// Returns a row of lamps along x that shine down.
std::vector<LampBounds> row_of_lamps(int count) {
  std::vector<LampBounds> lamps(static_cast<std::size_t>(count));
  for (std::size_t i = 0; i < lamps.size(); ++i) {
    LampBounds& lamp = lamps[i];
    lamp.low = {static_cast<float>(i) - static_cast<float>(count) * 0.5F, 6.0F, 0.0F};
    lamp.high = lamp.low + Vec3(0.5F, 0.0F, 0.5F);
    lamp.axis = {0.0F, -1.0F, 0.0F};
    lamp.power = 1.0F;
  }
  return lamps;
}

TEST(PathLampMemory, LeadsAwayFromLampsBehindWalls) {
  const std::vector<LampBounds> lamps = row_of_lamps(16);
  const LightTree tree(lamps);
  const Vec3 point(0.0F);
  const Vec3 up(0.0F, 1.0F, 0.0F);
  LampMemory memory;
  const std::int32_t place = memory.place_of(0, {3, 0, -5}, Direction::PosY);
  ASSERT_GT(place, 0);
  EXPECT_EQ(memory.place_of(0, {7, 7, -8}, Direction::PosY), place);
  EXPECT_NE(memory.place_of(0, {8, 0, -5}, Direction::PosY), place);
  EXPECT_NE(memory.place_of(0, {3, 0, -5}, Direction::NegY), place);
  EXPECT_NE(memory.place_of(1, {3, 0, -5}, Direction::PosY), place);
  const auto chance = [&](std::size_t lamp) {
    return tree.probability(static_cast<std::uint32_t>(lamp), point, up, memory.table(place));
  };
  const float before = chance(0);
  EXPECT_EQ(before, tree.probability(0, point, up));
  // All lamps of the second half stand behind a wall.
  for (int sample = 0; sample < 400; ++sample) {
    const auto lamp = static_cast<std::int32_t>(static_cast<std::size_t>(sample) % lamps.size());
    memory.note(tree, place, lamp, 1.0F, 2 * static_cast<std::size_t>(lamp) >= lamps.size());
    EXPECT_EQ(chance(0), before) << "notes take effect later";
  }
  memory.learn();
  float seen = 0.0F;
  float hidden = 0.0F;
  for (std::size_t i = 0; i < lamps.size(); ++i) (2 * i < lamps.size() ? seen : hidden) += chance(i);
  EXPECT_NEAR(seen + hidden, 1.0F, 1e-4F);
  EXPECT_GT(hidden, 0.0F);
  EXPECT_LT(hidden, 0.25F);
  EXPECT_EQ(tree.probability(0, point, up, memory.table(0)), before) << "of other places nothing is known";
}

TEST(PathLampMemory, GivesNoPlaceWhenFull) {
  LampMemory memory;
  std::int32_t last = 0;
  for (int i = 0; i < 5000; ++i) last = memory.place_of(0, {8 * i, 0, 0}, Direction::PosX);
  EXPECT_EQ(last, 0);
  EXPECT_EQ(memory.place_of(0, {8, 0, 0}, Direction::PosX), 2);
  EXPECT_EQ(memory.table(last)[0], 1.0F);
}

TEST(PathLamps, MatchIrradianceByLambert) {
  for (const double height : {0.5, 3.0, 40.0}) {
    const PathLamp lamp = square_lamp({-1.0, height, -0.5}, 2.0F);
    const PathLamps lamps({lamp}, DVec3(0.0));
    const Vec3 up{0.0F, 1.0F, 0.0F};
    double sum = 0.0;
    constexpr std::uint32_t kSamples = 1U << 14;
    for (std::uint32_t i = 0; i < kSamples; ++i) {
      const Random random(3, i);
      const DVec3 point(0.2, 0.0, 0.1);
      const LightTree::Choice chosen = lamps.tree().choose(Vec3(point - lamps.origin()), up, 0.5F);
      const LampSample sample = lamps.sample(chosen, point, random.pair(0));
      sum += static_cast<double>(sample.radiance.x * sample.direction.y);
      EXPECT_NEAR(lamps.density(0, point, sample.direction, sample.distance) / sample.density, 1.0F, 1e-3F);
    }
    const double expected = irradiance_by_lambert(lamp, {0.2, 0.0, 0.1}, {0.0, 1.0, 0.0});
    EXPECT_NEAR(sum / kSamples / expected, 1.0, 2e-3) << height;
  }
}

TEST(PathEnvironment, ImportanceSamplingMatchesUniformSampling) {
  RadianceImage image{16, 8, std::vector<float>(3 * 16 * 8, 0.2F)};
  for (int channel = 0; channel < 3; ++channel)
    image.rgb[static_cast<std::size_t>(3 * (2 * 16 + 12) + channel)] = 50.0F;
  const EnvironmentLight light(image);
  double by_light = 0.0;
  double uniform = 0.0;
  constexpr std::uint32_t kSamples = 1U << 16;
  for (std::uint32_t i = 0; i < kSamples; ++i) {
    const Random random(3, i);
    const SkySample sample = light.sample(random.pair(0));
    by_light += static_cast<double>(sample.radiance.x / sample.density);
    // At the poles, where pixels are as narrow as rounding errors, a neighbouring pixel is possible.
    if (std::abs(sample.direction.y) < 0.999F) {
      EXPECT_NEAR(light.density(sample.direction) / sample.density, 1.0F, 0.01F);
    }
    const Pair u = random.pair(1);
    const float up = 1.0F - 2.0F * u.x;
    const SineCosine turn = of_turns(u.y);
    const float across = std::sqrt(1.0F - up * up);
    uniform += static_cast<double>(light.at({across * turn.cosine, up, across * turn.sine}).x) * 4.0 * std::numbers::pi;
  }
  EXPECT_NEAR(by_light / uniform, 1.0, 0.01);
}

TEST(PathEnvironment, MapsImageToDirections) {
  RadianceImage image{4, 2, std::vector<float>(3 * 4 * 2, 0.0F)};
  image.rgb[3 * 3] = 1.0F;  // the upper right pixel: between +x and +z
  const EnvironmentLight light(image);
  const Vec3 direction = glm::normalize(Vec3(1.0F, 1.0F, 1.0F));
  EXPECT_GT(light.at(direction).x, 0.5F);
  EXPECT_LT(light.at({-direction.x, direction.y, direction.z}).x, 0.1F);
  EXPECT_LT(light.at({direction.x, direction.y, -direction.z}).x, 0.1F);
}

Vec3 mean_of(const RadianceImage& image, int first_row, int rows) {
  Vec3 sum(0.0F);
  for (int i = first_row * image.width; i < (first_row + rows) * image.width; ++i) {
    const auto at = static_cast<std::size_t>(3 * i);
    sum += Vec3(image.rgb[at], image.rgb[at + 1], image.rgb[at + 2]);
  }
  return sum / static_cast<float>(rows * image.width);
}

TEST(PathAtmosphere, IsBlueByDayRedAtSunsetAndDarkAtNight) {
  const AtmosphericSky noon = atmospheric_sky({0.0, 1.0, 0.0}, kPi, {});
  const Vec3 zenith = mean_of(noon.radiance, 20, 20);
  EXPECT_GT(zenith.z, 2.0F * zenith.x);
  EXPECT_GT(noon.sunlight.x, 0.8F * kPi);
  const AtmosphericSky sunset = atmospheric_sky(glm::normalize(DVec3(1.0, 0.03, 0.0)), kPi, {});
  EXPECT_GT(sunset.sunlight.x, 3.0F * sunset.sunlight.z);
  EXPECT_LT(largest(mean_of(sunset.radiance, 20, 20)), largest(zenith));
  const AtmosphericSky night = atmospheric_sky(glm::normalize(DVec3(1.0, -0.5, 0.0)), kPi, {});
  EXPECT_EQ(largest(night.sunlight), 0.0F);
  EXPECT_LT(largest(mean_of(night.radiance, 0, 128)), 0.02F * largest(zenith));
  EXPECT_GT(mean_of(night.radiance, 0, 128).x, 0.0F);
}

TEST(PathAtmosphere, SkyIsBlackWithoutAir) {
  const AtmosphericSky space = atmospheric_sky({0.0, 1.0, 0.0}, kPi, {0.0, 0.0, 0.0});
  EXPECT_NEAR(space.sunlight.x, kPi, 1e-5F);
  EXPECT_LT(largest(mean_of(space.radiance, 10, 50)), 0.002F);
}

TEST(PathPartsDeathTest, RejectsAngleBeyondOneTurn) {
  QUOIN_EXPECT_MISTAKE(static_cast<void>(of_turns(1.5F)), "0 <= turns <= 1");
}

TEST(PathPartsDeathTest, RejectsUnknownPlace) {
  const LampMemory memory;
  QUOIN_EXPECT_MISTAKE(static_cast<void>(memory.table(99)), "a place that was returned");
}

}  // namespace
}  // namespace quoin::path
