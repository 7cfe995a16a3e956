#include <quoin/grid/voxel_registry.h>

#include <limits>

#include <gtest/gtest.h>

namespace quoin {
namespace {

TEST(VoxelRegistry, FindsTypesByName) {
  VoxelRegistry types;
  EXPECT_FALSE(types.find("water"));
  const auto stone = types.add({.name = "stone"});
  const auto water = types.add({.name = "water", .visibility = Visibility::Transparent});
  ASSERT_TRUE(types.add({.name = "water"}) && stone && water);
  EXPECT_EQ(types.find("water"), *water) << "of several the first";
  EXPECT_EQ(types.find("stone"), *stone);
  EXPECT_FALSE(types.find("")) << "air is no type that was added";
}

TEST(VoxelRegistry, RoundTripsColours) {
  for (int i = 0; i < 256; ++i) {
    const auto byte = static_cast<std::uint8_t>(i);
    const Rgba8 colour{byte, static_cast<std::uint8_t>(255 - i), 7, 255};
    EXPECT_EQ(srgb_colour(linear_colour(colour)), colour) << i;
  }
  EXPECT_NEAR(linear_colour({188, 0, 255, 3}).x, 0.5028865F, 1e-6F);
  EXPECT_EQ(srgb_colour({-1.0F, 9.0F, std::numeric_limits<float>::quiet_NaN()}), (Rgba8{0, 255, 0, 255}));
}

}  // namespace
}  // namespace quoin
