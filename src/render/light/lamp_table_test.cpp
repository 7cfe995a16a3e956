#include "render/light/lamp_table.h"

#include <gtest/gtest.h>

namespace quoin {
namespace {

TEST(LampRay, GivesNoLightWithoutANormal) {
  Scene scene;
  scene.lamps.push_back({});
  const std::vector<PlacedLamp> lamps = placed_lamps(scene, 1.0);
  ASSERT_EQ(lamps.size(), 1U);
  const DVec3 to_lamp(0.0, 2.0, 0.0);
  EXPECT_GT(lamp_ray(lamps[0], to_lamp, {0.0, 1.0, 0.0}).light.x, 0.0F);
  EXPECT_EQ(lamp_ray(lamps[0], to_lamp, DVec3(0.0)).light, Vec3(0.0F));
}

}  // namespace
}  // namespace quoin
