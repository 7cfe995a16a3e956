#include "settings.h"

#include <random>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

namespace quoin::viewer {
namespace {

TEST(Sun, ConvertsDirectionsToAnglesAndBack) {
  std::mt19937 random(1);
  std::normal_distribution<double> number;
  for (int i = 0; i < 200; ++i) {
    const DVec3 sun{number(random), number(random), number(random)};
    EXPECT_LT(glm::length(sun_direction(sun_angles(sun)) - glm::normalize(sun)), 1e-12);
  }
  EXPECT_NEAR(sun_angles({1.0, 0.0, 0.0}).azimuth, 90.0, 1e-9);
  EXPECT_NEAR(sun_angles({0.0, 3.0, 0.0}).elevation, 90.0, 1e-9);
}

TEST(Sun, DragKeepsSunAboveHorizon) {
  Environment environment = Environment::reference();
  environment.sun.direction = {0.3, 0.7, 0.2};
  std::mt19937 random(2);
  std::normal_distribution<double> pixels(0.0, 200.0);
  for (int i = 0; i < 500; ++i) {
    environment.sun.direction = drag_sun(environment, pixels(random), pixels(random));
    EXPECT_NEAR(glm::length(environment.sun.direction), 1.0, 1e-9);
    EXPECT_GT(environment.sun.direction.y, 0.0);
  }
  environment.sun.direction = {0.0, 0.5, 1.0};
  EXPECT_GT(drag_sun(environment, 0.0, -50.0).y, drag_sun(environment, 0.0, 0.0).y) << "up is up";
}

TEST(Sun, DragReachesNightWhenSkyFollowsSun) {
  Environment environment;
  for (int i = 0; i < 10; ++i) environment.sun.direction = drag_sun(environment, 0.0, 100.0);
  EXPECT_LT(sun_angles(environment.sun.direction).elevation, -18.0) << "down to night";
  EXPECT_NEAR(sun_angles(environment.sun.direction).elevation, lowest_sun(environment), 1e-9);
  EXPECT_NEAR(sun_angles(environment.sun.direction).azimuth, sun_angles(Sun{}.direction).azimuth, 1e-9);
}

}  // namespace
}  // namespace quoin::viewer
