#pragma once

// A scene dominated by glass, for tests that compare marched with rasterised images.

#include <utility>

#include "render/cpu/render_test_support.h"

namespace quoin::vulkan_test {

inline VoxelType add_glass(Scene& scene, Rgba8 colour, float ior) {
  VoxelProperties properties;
  properties.colour = colour;
  properties.visibility = Visibility::Transparent;
  properties.ior = ior;
  return scene.types.add(properties).value();
}

/// A stone floor with a pool from 2 to 8 voxels deep, a clear cube, a pane in front of a red block, two touching
/// glasses (one stands in water), and a lamp. `alpha`: of the clear glass.
inline Scene glass_yard(DVec3 at = DVec3(0.0), std::uint8_t alpha = 20) {
  Scene scene;
  const VoxelType stone = render_test::add_type(scene, {190, 180, 165});
  const VoxelType red = render_test::add_type(scene, {200, 40, 30});
  const VoxelType lamp = render_test::add_type(scene, {255, 200, 120}, Visibility::Opaque, 3.0F);
  const VoxelType water = add_glass(scene, {60, 130, 200, 45}, 1.33F);
  const VoxelType clear = add_glass(scene, {220, 240, 245, alpha}, 1.5F);
  const VoxelType green = add_glass(scene, {70, 190, 110, 70}, 1.5F);
  Grid grid;
  grid.fill_box({{0, 0, 0}, {64, 10, 64}}, stone);
  for (int step = 0; step < 4; ++step) grid.fill_box({{4, 8 - 2 * step, 4 + 6 * step}, {24, 10, 30}}, water);
  grid.fill_box({{4, 9, 4}, {24, 10, 30}}, kAir);
  grid.fill_box({{32, 10, 4}, {48, 26, 20}}, clear);
  grid.fill_box({{6, 10, 44}, {26, 26, 45}}, green);
  grid.fill_box({{10, 10, 36}, {20, 20, 41}}, red);
  grid.fill_box({{34, 10, 30}, {42, 20, 40}}, clear);
  grid.fill_box({{42, 10, 30}, {50, 20, 40}}, green);
  grid.fill_box({{18, 3, 24}, {22, 14, 28}}, clear);
  grid.fill_box({{52, 10, 50}, {55, 16, 53}}, lamp);
  render_test::place(scene, std::move(grid), at);
  return scene;
}

/// Over the yard, to where all of that is seen.
inline Camera over_glass_yard(DVec3 at = DVec3(0.0)) {
  return render_test::towards(at + DVec3(74, 46, 86), at + DVec3(28, 8, 26), 0.7);
}

inline RenderOptions glass_yard_options(int width, int height) {
  RenderOptions options = render_test::sized(width, height);
  options.light = natural_light();
  options.environment = Environment::natural();
  options.light.occlusion_mode = OcclusionMode::Vertex;
  return options;
}

}  // namespace quoin::vulkan_test
