#include "render/light/light_model.h"

#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

namespace quoin {
namespace {

Environment with_sun(double elevation, double azimuth = 0.7) {
  const double radians = elevation * std::numbers::pi / 180.0;
  return Environment::natural(
      3.0 * DVec3(std::cos(radians) * std::sin(azimuth), std::sin(radians), std::cos(radians) * std::cos(azimuth)));
}

Daylight at(double elevation) {
  return daylight_of(with_sun(elevation));
}

std::array<Vec3, 5> parts(const Daylight& light) {
  return {light.sky.zenith, light.sky.horizon, light.sky.ground, light.ambient, light.sun};
}

TEST(Daylight, FixedSkyMatchesReferenceAtAnyHour) {
  for (const double elevation : {60.0, 5.0, -30.0}) {
    Environment environment = with_sun(elevation);
    environment.sky.model = SkyModel::Fixed;
    environment.sun.brightness = 0.3;
    const Daylight light = daylight_of(environment);
    EXPECT_EQ(light.sky.zenith, sky::kZenith);
    EXPECT_EQ(light.sky.horizon, sky::kHorizon);
    EXPECT_EQ(light.sky.ground, sky::kGround);
    EXPECT_EQ(light.ambient, Vec3(1.0F));
    EXPECT_EQ(light.sun, Vec3(1.0F));
    EXPECT_EQ(light.sun_brightness, 0.3);
  }
}

TEST(Daylight, HighSunMatchesReferenceSky) {
  for (double elevation = 31.0; elevation <= 90.0; elevation += 1.0) {
    const Daylight light = at(elevation);
    EXPECT_EQ(light.sky.zenith, sky::kZenith);
    EXPECT_EQ(light.sky.horizon, sky::kHorizon);
    EXPECT_EQ(light.sky.ground, sky::kGround);
    EXPECT_EQ(light.ambient, Vec3(1.0F));
    EXPECT_GT(light.sun.z, 0.8F);
    EXPECT_LE(light.sun.x, 1.0F);
  }
  EXPECT_GT(at(90.0).sun.z, 0.999F);
}

TEST(Daylight, ChangesSmoothlyAndIsNeverBlack) {
  for (double elevation = -90.0; elevation < 90.0; elevation += 0.02) {
    const auto now = parts(at(elevation));
    const auto next = parts(at(elevation + 0.02));
    for (std::size_t part = 0; part < now.size(); ++part) {
      ASSERT_LT(glm::length(next.at(part) - now.at(part)), 0.011F) << elevation << " part " << part;
    }
    for (std::size_t part = 0; part < 4; ++part) {
      const Vec3 colour = now.at(part);
      ASSERT_GE(std::min({colour.x, colour.y, colour.z}), 0.004F) << elevation << " part " << part;
      ASSERT_LE(std::max({colour.x, colour.y, colour.z}), 1.0F) << elevation << " part " << part;
    }
    for (int channel = 0; channel < 3; ++channel) {
      ASSERT_GE(next[3][channel], now[3][channel]) << "ambient light grows with the sun";
      ASSERT_GE(next[4][channel], now[4][channel]);
    }
  }
}

TEST(Daylight, WarmsAtGoldenHourAndCoolsAtNight) {
  const auto warmth = [](Vec3 colour) { return colour.x / colour.z; };
  EXPECT_GT(warmth(at(4.0).sun), 3.0F * warmth(at(60.0).sun));
  EXPECT_GT(warmth(at(1.0).sky.horizon), 2.0F);
  EXPECT_LT(warmth(at(1.0).sky.zenith), 0.5F) << "above it is blue all the same";
  EXPECT_LT(warmth(at(-20.0).ambient), 0.5F);
  EXPECT_LT(at(-20.0).ambient.y, 0.25F * at(40.0).ambient.y);
}

TEST(Daylight, SunBelowHorizonGivesNoLight) {
  for (const double elevation : {-1.001, -2.0, -40.0, -90.0}) {
    EXPECT_EQ(at(elevation).sun, Vec3(0.0F));
    EXPECT_EQ(at(elevation).sun_brightness, 0.0);
  }
  EXPECT_GT(at(0.5).sun.x, 0.0F);
  EXPECT_EQ(at(0.5).sun_brightness, 1.0);
}

TEST(Daylight, MultipliesByTheSunsColour) {
  Environment environment = with_sun(60.0);
  const Vec3 white = daylight_of(environment).sun;
  environment.sun.colour = {0.5F, 2.0F, 0.0F};
  EXPECT_EQ(daylight_of(environment).sun, white * environment.sun.colour);
  environment.sun.colour = Vec3(0.0F);
  EXPECT_EQ(daylight_of(environment).sun_brightness, 0.0);
}

TEST(Daylight, IsIndependentOfTheSunsAzimuth) {
  for (const double elevation : {-6.0, 2.0, 20.0}) {
    const auto one = parts(daylight_of(with_sun(elevation, 0.1)));
    const auto other = parts(daylight_of(with_sun(elevation, 4.0)));
    for (std::size_t part = 0; part < one.size(); ++part) {
      EXPECT_LT(glm::length(one.at(part) - other.at(part)), 1e-5F);
    }
  }
}

}  // namespace
}  // namespace quoin
