#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <numbers>
#include <string>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <quoin/scene/environment.h>
#include <quoin/scene/scene.h>

#include "core/not_finite_for_tests.h"

namespace quoin {
namespace {

double elevation(const SunTime& time) {
  const auto sun = sun_direction(time);
  EXPECT_TRUE(sun.has_value());
  return sun ? std::asin(sun->y) * 180.0 / std::numbers::pi : 0.0;
}

TEST(SunDirection, ElevationFollowsSeason) {
  EXPECT_NEAR(elevation({6, 21, 12.0, 52.0}), 90.0 - 52.0 + 23.44, 0.3);
  EXPECT_NEAR(elevation({12, 21, 12.0, 52.0}), 90.0 - 52.0 - 23.44, 0.3);
  EXPECT_NEAR(elevation({3, 21, 12.12, 0.0}), 90.0, 1.0);  // noon is seven minutes late on that day
  EXPECT_NEAR(elevation({6, 21, 0.0, 52.0}), -(90.0 - 52.0 - 23.44), 0.3);
  EXPECT_GT(elevation({6, 21, 0.0, 80.0}), 0.0);  // the sun does not set
  EXPECT_NEAR(elevation({12, 21, 12.0, -52.0}), 90.0 - 52.0 + 23.44, 0.3);
}

TEST(SunDirection, RisesInEastAndIsSouthAtNoon) {
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

TEST(Environment, PlacesNaturalSunNextToIsoCamera) {
  const Environment environment = Environment::natural();
  EXPECT_LT(environment.sun.direction.x, 0.0) << "one of the three sides in the view is in shade";
  EXPECT_GT(environment.sun.direction.z, 0.0);
  EXPECT_EQ(environment.sky.model, SkyModel::Gradient);
  EXPECT_EQ(environment, Environment{});
  EXPECT_EQ(Environment::reference().sky.model, SkyModel::Fixed);
}

TEST(Environment, DefaultsToReference) {
  Scene scene;
  EXPECT_EQ(environment_of(scene), Environment::reference());
  scene.environment = Environment::natural();
  EXPECT_EQ(environment_of(scene), Environment::natural());
  EXPECT_EQ(environment_of(scene.snapshot()), Environment::natural());
}

TEST(Environment, DetectsSettingsBeyondSunDirection) {
  EXPECT_TRUE(is_only_sun(Environment::natural({3.0, -1.0, 0.5})));
  Environment environment;
  environment.sun.brightness = 2.0;
  EXPECT_FALSE(is_only_sun(environment));
  EXPECT_FALSE(is_only_sun(Environment::reference()));
}

TEST(Environment, NormalizesSunDirectionOfAnyLength) {
  for (const double length : {1e-300, 1e-20, 1.0, 1e20, 1e300}) {
    EXPECT_NEAR(glm::length(Sun{.direction = DVec3(1.0, 2.0, -3.0) * length}.unit_direction()), 1.0, 1e-12);
  }
}

TEST(Environment, ChoosesExposureAndToneBySky) {
  Environment environment;
  const double gradient = develop_options(environment).exposure;
  environment.sky.model = SkyModel::Physical;
  EXPECT_GT(develop_options(environment).exposure, gradient);
  EXPECT_EQ(develop_options(environment).tone, ToneCurve::Neutral);
  environment.sky.model = SkyModel::Uniform;
  EXPECT_EQ(develop_options(environment).tone, ToneCurve::Clamp);
  environment.sky.model = SkyModel::Image;
  EXPECT_EQ(develop_options(environment), DevelopOptions{});
  environment.exposure = 3.0;
  environment.tone = ToneCurve::Aces;
  environment.vignette = 0.5;
  environment.gamma = 2.0;
  environment.bloom.mix = 0.1;
  EXPECT_EQ(develop_options(environment), (DevelopOptions{3.0, ToneCurve::Aces, 0.5, 2.0, {.mix = 0.1}}));
}

TEST(Environment, LacksImageOnlyForModelImage) {
  Sky sky{.model = SkyModel::Image};
  EXPECT_TRUE(lacks_image(sky));
  sky.model = SkyModel::Physical;
  EXPECT_FALSE(lacks_image(sky));
  sky.model = SkyModel::Image;
  sky.image = std::make_shared<const RadianceImage>(RadianceImage{2, 1, {1.0F, 1.0F, 1.0F}});
  EXPECT_TRUE(lacks_image(sky)) << "2 pixels with the values of 1";
  sky.image = std::make_shared<const RadianceImage>(RadianceImage{1, 1, {1.0F, 1.0F, 1.0F}});
  EXPECT_FALSE(lacks_image(sky));
}

TEST(Environment, DevelopsNightBrighter) {
  const auto exposure = [](double degrees, SkyModel sky = SkyModel::Gradient) {
    const double radians = degrees * std::numbers::pi / 180.0;
    Environment environment = Environment::natural({2.0 * std::cos(radians), 2.0 * std::sin(radians), 0.0});
    environment.sky.model = sky;
    return develop_options(environment).exposure;
  };
  const double day = develop_options(Environment::natural()).exposure;
  for (const double degrees : {90.0, 30.0, 0.0, -3.9}) EXPECT_EQ(exposure(degrees), day) << degrees;
  for (double degrees = 0.0; degrees > -90.0; degrees -= 0.5) {
    EXPECT_GE(exposure(degrees - 0.5), exposure(degrees)) << degrees;
    EXPECT_LT(exposure(degrees - 0.5), 1.15 * exposure(degrees)) << degrees << ": dusk is no step";
  }
  EXPECT_DOUBLE_EQ(exposure(-20.0), 4.0 * day);
  EXPECT_EQ(exposure(-60.0), exposure(-20.0));
  EXPECT_EQ(exposure(-60.0, SkyModel::Uniform), exposure(60.0, SkyModel::Uniform)) << "its light does not change";
  EXPECT_EQ(exposure(-60.0, SkyModel::Fixed), day) << "always day";
}

TEST(Environment, FitsGroundAndFogToScene) {
  Environment environment;
  fit_environment({{-1.0, -2.0, -3.0}, {4.0, 5.0, 6.0}}, environment);
  EXPECT_EQ(environment, Environment{});
  environment.ground.emplace();
  environment.fog.emplace();
  fit_environment({{-1.0, -2.0, -3.0}, {4.0, 5.0, 6.0}}, environment);
  EXPECT_EQ(environment.ground->height, -2.0);
  EXPECT_EQ(environment.fog->top, 5.0);
  fit_environment(DBox{}, environment);
  EXPECT_EQ(environment.ground->height, 0.0);
}

TEST(Environment, RejectsInvalidSettingsByName) {
  EXPECT_TRUE(check(Environment{}));
  EXPECT_TRUE(check(Environment::reference()));
  const auto expect_rejected = [](const std::string& name, const std::function<void(Environment&)>& change) {
    Environment environment;
    change(environment);
    const Status status = check(environment);
    ASSERT_FALSE(status.has_value()) << name;
    EXPECT_EQ(status.error().code, ErrorCode::InvalidArgument);
    EXPECT_EQ(status.error().message.rfind(name, 0), 0U) << status.error().message;
  };
  expect_rejected("sun.direction", [](Environment& e) { e.sun.direction = DVec3(0.0); });
  expect_rejected("sun.direction", [](Environment& e) { e.sun.direction.y = kNan; });
  expect_rejected("sun.direction", [](Environment& e) { e.sun.direction.z = kInfinity; });
  expect_rejected("sun.angle_radians", [](Environment& e) { e.sun.angle_radians = -0.1; });
  expect_rejected("sun.brightness", [](Environment& e) { e.sun.brightness = kNan; });
  expect_rejected("sun.colour", [](Environment& e) { e.sun.colour.x = -1.0F; });
  expect_rejected("sky.brightness", [](Environment& e) { e.sky.brightness = 1e10; });
  expect_rejected("sky.colour", [](Environment& e) { e.sky.colour.y = -1.0F; });
  expect_rejected("sky.background", [](Environment& e) { e.sky.background = Vec3(-1.0F); });
  expect_rejected("sky.image_turn_radians", [](Environment& e) { e.sky.image_turn_radians = kInfinity; });
  expect_rejected("sky.air", [](Environment& e) { e.sky.air.mie = kNan; });
  expect_rejected("sky.air", [](Environment& e) { e.sky.air.mie_anisotropy = 1.0; });
  expect_rejected("sky.air", [](Environment& e) { e.sky.air.ozone_colour = Vec3(101.0F); });
  expect_rejected("ground", [](Environment& e) { e.ground.emplace().height = kNan; });
  expect_rejected("ground", [](Environment& e) { e.ground.emplace().colour = Vec3(2.0F); });
  expect_rejected("ground", [](Environment& e) { e.ground.emplace().fade = 1.5; });
  expect_rejected("fog", [](Environment& e) { e.fog.emplace().density = -1.0; });
  expect_rejected("fog", [](Environment& e) { e.fog.emplace().top = kInfinity; });
  expect_rejected("lamp_brightness", [](Environment& e) { e.lamp_brightness = -1.0; });
  expect_rejected("exposure", [](Environment& e) { e.exposure = -0.5; });
  expect_rejected("exposure", [](Environment& e) { e.exposure = kNan; });
  expect_rejected("vignette", [](Environment& e) { e.vignette = 2.0; });
  expect_rejected("gamma", [](Environment& e) { e.gamma = 0.0; });
  expect_rejected("bloom", [](Environment& e) { e.bloom.mix = 2.0; });
}

}  // namespace
}  // namespace quoin
