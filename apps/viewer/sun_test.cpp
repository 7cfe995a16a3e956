#include "sun.h"

#include <random>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

namespace quoin::viewer {
namespace {

TEST(Sun, AnglesAndDirectionsAgree) {
  std::mt19937 random(1);
  std::normal_distribution<double> number;
  for (int i = 0; i < 200; ++i) {
    const DVec3 sun{number(random), number(random), number(random)};
    EXPECT_LT(glm::length(sun_direction(sun_angles(sun)) - glm::normalize(sun)), 1e-12);
  }
  EXPECT_NEAR(sun_angles({1.0, 0.0, 0.0}).azimuth, 90.0, 1e-9);
  EXPECT_NEAR(sun_angles({0.0, 3.0, 0.0}).elevation, 90.0, 1e-9);
}

TEST(Sun, DraggingKeepsItInTheSky) {
  LightOptions light;
  light.sun = {0.3, 0.7, 0.2};
  std::mt19937 random(2);
  std::normal_distribution<double> pixels(0.0, 200.0);
  for (int i = 0; i < 500; ++i) {
    light.sun = drag_sun(light, pixels(random), pixels(random));
    EXPECT_NEAR(glm::length(light.sun), 1.0, 1e-9);
    EXPECT_GT(light.sun.y, 0.0);
  }
  light.sun = {0.0, 0.5, 1.0};
  EXPECT_GT(drag_sun(light, 0.0, -50.0).y, drag_sun(light, 0.0, 0.0).y) << "up is up";
}

TEST(Sun, ItGoesDownWhereTheSkyFollowsIt) {
  LightOptions light = natural_light();
  for (int i = 0; i < 10; ++i) light.sun = drag_sun(light, 0.0, 100.0);
  EXPECT_LT(sun_angles(light.sun).elevation, -18.0) << "down to night";
  EXPECT_NEAR(sun_angles(light.sun).elevation, lowest_sun(light), 1e-9);
  EXPECT_NEAR(sun_angles(light.sun).azimuth, sun_angles(natural_light().sun).azimuth, 1e-9);
}

}  // namespace
}  // namespace quoin::viewer
