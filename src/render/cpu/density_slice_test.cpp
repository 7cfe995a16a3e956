#include <quoin/render/cpu_renderer.h>

#include <array>

#include <gtest/gtest.h>

namespace quoin {
namespace {

using Rgb = std::array<int, 3>;

Rgb slice_pixel(const Image& image, int x, int y) {
  const std::uint8_t* at = image.rgb.data() + 3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) +
                                                   static_cast<std::size_t>(x));
  return {at[0], at[1], at[2]};
}

/// Solid is red, air is blue.
bool is_solid(const Rgb& pixel) {
  return pixel[0] > pixel[2];
}

/// A ball of radius 20 about the origin, or half of it.
Scene ball(double cut_above_y = 100.0) {
  Scene scene;
  SceneGrid grid;
  grid.field.add_sphere(DVec3(0.0), 20.0, kAir);
  grid.field.remove_box({-30, cut_above_y, -30}, {30, cut_above_y + 60, 30});
  Instance instance;
  instance.grid = scene.add_grid(std::move(grid));
  scene.add_instance(instance);
  return scene;
}

TEST(DensitySlice, ShowsBallAsDiscInEveryDirection) {
  const Scene scene = ball();
  DensitySliceOptions options;
  options.width = 200;
  options.height = 120;
  for (options.axis = 0; options.axis < 3; ++options.axis) {
    const auto slice = draw_density_slice(scene, options);
    ASSERT_TRUE(slice) << to_string(slice.error());
    EXPECT_NEAR(slice->position, 0.0, 0.5);
    EXPECT_TRUE(is_solid(slice_pixel(slice->colour, 100, 60)));
    EXPECT_FALSE(is_solid(slice_pixel(slice->colour, 5, 60)));
    // 40 samples fill 96 % of 120 pixels.
    const double radius = 20.0 * 0.96 * 120 / 40.0;
    EXPECT_NEAR(static_cast<double>(slice->pixels_solid), 3.14159 * radius * radius, 0.06 * 3.14 * radius * radius);
  }
}

TEST(DensitySlice, IsUprightSeenFromPositiveEnd) {
  const Scene scene = ball(0.0);  // the lower half
  DensitySliceOptions options;
  options.width = 100;
  options.height = 100;
  for (const int axis : {0, 2}) {
    options.axis = axis;
    const auto slice = draw_density_slice(scene, options);
    ASSERT_TRUE(slice);
    EXPECT_FALSE(is_solid(slice_pixel(slice->colour, 50, 20))) << "above the bounds";
    EXPECT_TRUE(is_solid(slice_pixel(slice->colour, 50, 50)));
    // The lower half is wider at its top.
    EXPECT_TRUE(is_solid(slice_pixel(slice->colour, 12, 35)));
    EXPECT_FALSE(is_solid(slice_pixel(slice->colour, 12, 68)));
  }
}

TEST(DensitySlice, MovesAlongAxisAndIgnoresThreadCount) {
  const Scene scene = ball();
  DensitySliceOptions options;
  options.at = 0.9;
  const auto top = draw_density_slice(scene, options, {1});
  const auto again = draw_density_slice(scene, options, {3});
  options.at = 0.5;
  const auto middle = draw_density_slice(scene, options);
  ASSERT_TRUE(top && again && middle);
  EXPECT_EQ(top->colour.rgb, again->colour.rgb);
  EXPECT_LT(top->pixels_solid, middle->pixels_solid / 2);
  EXPECT_GT(top->position, 10.0);
}

TEST(DensitySlice, RejectsInvalidInput) {
  const Scene scene = ball();
  DensitySliceOptions options;
  EXPECT_FALSE(draw_density_slice(Scene()));
  options.axis = 3;
  EXPECT_FALSE(draw_density_slice(scene, options));
  options = {};
  options.at = 1.5;
  EXPECT_FALSE(draw_density_slice(scene, options));
  options = {};
  options.width = 0;
  EXPECT_FALSE(draw_density_slice(scene, options));
}

}  // namespace
}  // namespace quoin
