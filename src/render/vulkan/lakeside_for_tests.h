#pragma once

// Fields with transparent parts, for tests that compare marched with rasterised images.

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>

#include "render/cpu/render_test_support.h"

namespace quoin::vulkan_test {

struct FieldTypes {
  VoxelType ground, stone, glow, glass;
};

inline FieldTypes add_field_types(Scene& scene) {
  FieldTypes types{};
  types.ground = render_test::add_type(scene, {90, 160, 70, 255});
  types.stone = render_test::add_type(scene, {150, 140, 130, 255});
  VoxelProperties glow;
  glow.colour = {255, 200, 120, 255};
  glow.emission = 3.0F;
  types.glow = scene.types.add(glow).value();
  VoxelProperties glass;
  glass.colour = {120, 170, 220, 90};
  glass.visibility = Visibility::Transparent;
  types.glass = scene.types.add(glass).value();
  return types;
}

// Hills with a lake, a ball of glass half in it, another next to a house with a window; in one field.
inline SceneGrid lakeside(const FieldTypes& types, VoxelType water) {
  SceneGrid grid;
  grid.field.edit({{-90, -60, -90}, {90, 40, 90}}, [&](IVec3 p, DensitySample) {
    const double hill = 12.0 * std::sin(0.05 * p.x) * std::cos(0.06 * p.z);
    const double ground = 0.8 * (p.y - hill);
    const double level = p.y + 2.3;
    const double ball = glm::distance(DVec3(p), DVec3{-32, 0, 20}) - 9.0;
    const double depth = std::min({std::abs(ground), std::abs(level), std::abs(ball)});
    if (ground < 0.0) return DensitySample{static_cast<float>(level < 0.0 ? -depth : ground), types.ground};
    if (ball < 0.0) return DensitySample{static_cast<float>(-depth), types.glass};
    return DensitySample{static_cast<float>(level < 0.0 ? -depth : std::min({ground, level, ball})), water};
  });
  grid.field.add_sphere({40, 14, 50}, 7.0, types.glass);
  grid.grid.fill_box({{30, -2, 30}, {44, 22, 44}}, types.stone);
  grid.grid.fill_box({{33, 4, 44}, {41, 14, 45}}, types.glass);
  grid.grid.fill_box({{-40, -8, -40}, {-36, 10, -20}}, types.stone);
  return grid;
}

inline VoxelType add_water(Scene& scene) {
  VoxelProperties water;
  water.colour = {60, 120, 160, 40};
  water.visibility = Visibility::Transparent;
  water.ior = 1.33F;
  return scene.types.add(water).value();
}

}  // namespace quoin::vulkan_test
