#include <quoin/render/light_options.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <string>

#include <gtest/gtest.h>

#include "core/not_finite_for_tests.h"
#include "render/light/light_model.h"

namespace quoin {
namespace {

TEST(LightOptions, AcceptsDefaultsAndLimits) {
  EXPECT_TRUE(check(LightOptions{}).has_value());
  EXPECT_TRUE(check(natural_light()).has_value());
  LightOptions options;
  options.occlusion_rays = 4096;
  options.occlusion_distance_voxels = options.shadow_distance_voxels = 0.0;
  EXPECT_TRUE(check(options).has_value());
}

TEST(LightOptions, NaturalLightHasLampsAndReflectingGlass) {
  EXPECT_TRUE(natural_light().glass_surfaces);
  EXPECT_GT(natural_light().max_lamps, 0);
  EXPECT_FALSE(LightOptions{}.glass_surfaces) << "the reference stays";
  EXPECT_EQ(LightOptions{}.max_lamps, 0);
}

TEST(LightOptions, LengthensFieldOcclusionOnlyInNaturalLight) {
  EXPECT_EQ(LightOptions{}.field_occlusion_reach, 1.0);
  EXPECT_EQ(natural_light().field_occlusion_reach, 3.0);
  EXPECT_EQ(field_openness_factor(LightOptions{}), 1.0F);
  EXPECT_FLOAT_EQ(field_openness_factor(natural_light()), 1.25F) << "a fifth of the rays may be blocked";
  LightOptions options;
  options.field_occlusion_reach = 0.0;
  EXPECT_EQ(field_openness_factor(options), 1.0F);
  options.field_occlusion_reach = 1024.0;
  EXPECT_LT(field_openness_factor(options), 1.5F);
}

TEST(LightOptions, RejectsInvalidValuesByName) {
  const auto expect_refused = [](const std::string& name, const std::function<void(LightOptions&)>& change) {
    LightOptions options;
    change(options);
    const Status status = check(options);
    ASSERT_FALSE(status.has_value()) << name;
    EXPECT_EQ(status.error().code, ErrorCode::InvalidArgument);
    EXPECT_EQ(status.error().message.rfind(name, 0), 0U) << status.error().message;
  };
  expect_refused("occlusion rays", [](LightOptions& o) { o.occlusion_rays = 0; });
  expect_refused("occlusion rays", [](LightOptions& o) { o.occlusion_rays = 4097; });
  expect_refused("occlusion distance", [](LightOptions& o) { o.occlusion_distance_voxels = -1; });
  expect_refused("occlusion distance", [](LightOptions& o) { o.occlusion_distance_voxels = kInfinity; });
  expect_refused("shadow distance", [](LightOptions& o) { o.shadow_distance_voxels = kNan; });
  expect_refused("shadow distance", [](LightOptions& o) { o.shadow_distance_voxels = -1; });
}

}  // namespace
}  // namespace quoin
