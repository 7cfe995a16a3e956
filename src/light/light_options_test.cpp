#include <quoin/light/light_options.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <string>

#include <gtest/gtest.h>

#include "core/not_finite_for_tests.h"

namespace quoin {
namespace {

TEST(LightOptions, DefaultsAndLimitsAreAccepted) {
  EXPECT_TRUE(check(LightOptions{}).has_value());
  EXPECT_TRUE(check(natural_light()).has_value());
  LightOptions options;
  options.sun = {0, -1e-300, 0};
  options.occlusion_rays = 4096;
  options.occlusion_distance_voxels = options.shadow_distance_voxels = options.exposure = 0.0;
  EXPECT_TRUE(check(options).has_value());
}

TEST(LightOptions, NaturalLightStandsBesideTheIsoCamera) {
  const LightOptions options = natural_light();
  EXPECT_LT(options.sun.x, 0.0) << "of the three sides that the view shows one lies in the shade";
  EXPECT_GT(options.sun.z, 0.0);
  EXPECT_TRUE(options.sky_follows_sun);
  EXPECT_TRUE(options.glass_surfaces);
  EXPECT_FALSE(LightOptions{}.sky_follows_sun) << "the reference stays";
  EXPECT_FALSE(LightOptions{}.glass_surfaces);
}

TEST(LightOptions, NaturalLookIsBrightUnderEverySky) {
  EXPECT_EQ(natural_look().look.sky, SkyModel::Gradient);
  EXPECT_EQ(natural_look().look.sun, natural_light().sun);
  EXPECT_GT(natural_look(SkyModel::Physical).develop.exposure, natural_look().develop.exposure);
  EXPECT_EQ(natural_look(SkyModel::Uniform).develop.tone, ToneCurve::Clamp);
  EXPECT_EQ(natural_look(SkyModel::Uniform).ground_colour, Vec3(1.0F));
  EXPECT_EQ(natural_look(SkyModel::Environment).develop, DevelopOptions{});
  EXPECT_EQ(Look{}.sky, SkyModel::Physical) << "the library's default stays";
}

TEST(LightOptions, NaturalLookBrightensTheNight) {
  const auto exposure = [](double degrees, SkyModel sky = SkyModel::Gradient) {
    const double radians = degrees * std::numbers::pi / 180.0;
    return natural_look(sky, {2.0 * std::cos(radians), 2.0 * std::sin(radians), 0.0}).develop.exposure;
  };
  const double day = natural_look().develop.exposure;
  for (const double degrees : {90.0, 30.0, 0.0, -3.9}) EXPECT_EQ(exposure(degrees), day) << degrees;
  for (double degrees = 0.0; degrees > -90.0; degrees -= 0.5) {
    EXPECT_GE(exposure(degrees - 0.5), exposure(degrees)) << degrees;
    EXPECT_LT(exposure(degrees - 0.5), 1.15 * exposure(degrees)) << degrees << ": dusk is no step";
  }
  EXPECT_DOUBLE_EQ(exposure(-20.0), 4.0 * day);
  EXPECT_EQ(exposure(-60.0), exposure(-20.0));
  EXPECT_EQ(exposure(-60.0, SkyModel::Uniform), exposure(60.0, SkyModel::Uniform)) << "its light does not change";
}

TEST(LightOptions, FieldsHaveLongerOcclusionRaysInNaturalLightAlone) {
  EXPECT_EQ(LightOptions{}.field_occlusion_reach, 1.0);
  EXPECT_EQ(natural_light().field_occlusion_reach, 3.0);
}

TEST(LightOptions, ImpossibleOnesAreRefusedByName) {
  const auto expect_refused = [](const std::string& name, const std::function<void(LightOptions&)>& change) {
    LightOptions options;
    change(options);
    const Status status = check(options);
    ASSERT_FALSE(status.has_value()) << name;
    EXPECT_EQ(status.error().code, ErrorCode::InvalidArgument);
    EXPECT_EQ(status.error().message.rfind(name, 0), 0U) << status.error().message;
  };
  expect_refused("sun", [](LightOptions& o) { o.sun = DVec3(0.0); });
  expect_refused("sun", [](LightOptions& o) { o.sun.y = kNan; });
  expect_refused("sun", [](LightOptions& o) { o.sun.z = kInfinity; });
  expect_refused("occlusion rays", [](LightOptions& o) { o.occlusion_rays = 0; });
  expect_refused("occlusion rays", [](LightOptions& o) { o.occlusion_rays = 4097; });
  expect_refused("occlusion distance", [](LightOptions& o) { o.occlusion_distance_voxels = -1; });
  expect_refused("occlusion distance", [](LightOptions& o) { o.occlusion_distance_voxels = kInfinity; });
  expect_refused("shadow distance", [](LightOptions& o) { o.shadow_distance_voxels = kNan; });
  expect_refused("shadow distance", [](LightOptions& o) { o.shadow_distance_voxels = -1; });
  expect_refused("exposure", [](LightOptions& o) { o.exposure = -0.5; });
  expect_refused("exposure", [](LightOptions& o) { o.exposure = kNan; });
}

}  // namespace
}  // namespace quoin
