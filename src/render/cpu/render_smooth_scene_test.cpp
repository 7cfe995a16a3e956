#include <gtest/gtest.h>

#include <quoin/scene/smooth_scene.h>

#include "render/cpu/render_test_support.h"

namespace quoin {
namespace {

using render_test::add_type;
using render_test::place;
using render_test::sized;
using render_test::towards;

VoxelType add_glass(Scene& scene, Rgba8 colour) {
  VoxelProperties properties;
  properties.colour = colour;
  properties.visibility = Visibility::Transparent;
  properties.ior = 1.4F;
  return scene.types.add(properties).value();
}

// On walls and water, away from edges, smooth glass matches blocks.
TEST(RenderSmoothScene, FlatGlassMatchesBlocksAtAnyThickness) {
  Scene scene;
  const VoxelType stone = add_type(scene, {190, 180, 165});
  const VoxelType green = add_glass(scene, {70, 190, 110, 70});
  const VoxelType water = add_glass(scene, {60, 130, 200, 45});
  Grid grid;
  grid.fill_box({{0, 0, 0}, {140, 12, 24}}, stone);
  for (int depth = 1; depth <= 7; ++depth) {
    const int x = 20 * depth - 18;
    grid.fill_box({{x, 12 - depth, 4}, {x + 16, 12, 20}}, water);
    grid.fill_box({{x, 14, 30}, {x + 16, 30, 30 + depth}}, green);
  }
  grid.fill_box({{0, 12, 44}, {140, 32, 52}}, stone);
  place(scene, std::move(grid));
  SmoothScene smooth;
  ASSERT_TRUE(smooth.update(scene));
  const CpuRenderer of_blocks(scene);
  const CpuRenderer of_fields(smooth.scene());
  RenderOptions options = sized(24, 16);
  options.light = natural_light();
  options.environment = Environment::natural();
  options.light.occlusion_mode = OcclusionMode::Off;
  for (int depth = 1; depth <= 7; ++depth) {
    const double x = 20 * depth - 10;
    for (const Camera& camera :
         {towards({x + 3, 60, 14}, {x, 12, 12}, 0.06), towards({x + 2, 26, -40}, {x, 22, 30}, 0.05)}) {
      const RenderedImage blocks = of_blocks.render(camera, options).value();
      const RenderedImage fields = of_fields.render(camera, options).value();
      EXPECT_EQ(render_test::count_different(blocks, fields, 4), 0) << "of thickness " << depth;
    }
  }
}

}  // namespace
}  // namespace quoin
