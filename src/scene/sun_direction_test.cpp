#include <cmath>
#include <limits>
#include <numbers>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <quoin/scene/look.h>

namespace quoin {
namespace {

double elevation(const SunTime& time) {
  const auto sun = sun_direction(time);
  EXPECT_TRUE(sun.has_value());
  return sun ? std::asin(sun->y) * 180.0 / std::numbers::pi : 0.0;
}

TEST(SunDirection, StandsAsHighAsTheSeasonSays) {
  EXPECT_NEAR(elevation({6, 21, 12.0, 52.0}), 90.0 - 52.0 + 23.44, 0.3);
  EXPECT_NEAR(elevation({12, 21, 12.0, 52.0}), 90.0 - 52.0 - 23.44, 0.3);
  EXPECT_NEAR(elevation({3, 21, 12.12, 0.0}), 90.0, 1.0);  // noon is seven minutes late on that day
  EXPECT_NEAR(elevation({6, 21, 0.0, 52.0}), -(90.0 - 52.0 - 23.44), 0.3);
  EXPECT_GT(elevation({6, 21, 0.0, 80.0}), 0.0);  // the sun does not set
  EXPECT_NEAR(elevation({12, 21, 12.0, -52.0}), 90.0 - 52.0 + 23.44, 0.3);
}

TEST(SunDirection, RisesInTheEastAndStandsInTheSouthAtNoon) {
  const DVec3 morning = sun_direction({3, 21, 7.0, 45.0}).value();
  EXPECT_GT(morning.x, 0.9);
  EXPECT_GT(sun_direction({6, 21, 12.0, 45.0}).value().z, 0.3);
  EXPECT_LT(sun_direction({6, 21, 12.0, -45.0}).value().z, -0.3);
  EXPECT_LT(sun_direction({3, 21, 17.0, 45.0}).value().x, -0.9);
  EXPECT_NEAR(glm::length(morning), 1.0, 1e-12);
}

TEST(SunDirection, RejectsInvalidDirections) {
  EXPECT_FALSE(sun_direction({0, 1, 12.0, 0.0}).has_value());
  EXPECT_FALSE(sun_direction({13, 1, 12.0, 0.0}).has_value());
  EXPECT_FALSE(sun_direction({4, 31, 12.0, 0.0}).has_value());
  EXPECT_TRUE(sun_direction({2, 29, 12.0, 0.0}).has_value());
  EXPECT_FALSE(sun_direction({6, 1, 24.5, 0.0}).has_value());
  EXPECT_FALSE(sun_direction({6, 1, std::numeric_limits<double>::quiet_NaN(), 0.0}).has_value());
  EXPECT_FALSE(sun_direction({6, 1, 12.0, 91.0}).has_value());
}

}  // namespace
}  // namespace quoin
