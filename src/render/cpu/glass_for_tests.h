#pragma once

// A scene for glass of voxels and of fields, and its colours.

#include <cmath>
#include <cstddef>

#include <gtest/gtest.h>

#include "render/cpu/render_test_support.h"

namespace quoin::render_test {

inline constexpr Rgba8 kWhite{240, 240, 240, 255};
inline constexpr Rgba8 kRed{200, 30, 30, 255};
inline constexpr Rgba8 kGlass{90, 170, 230, 100};
inline constexpr float kAlpha = 100.0F / 255.0F;

struct GlassScene {
  Scene scene;
  VoxelType stone = add_type(scene, kWhite);
  VoxelType red = add_type(scene, kRed);
  VoxelType glass = add_type(scene, kGlass, Visibility::Transparent);
  VoxelType green = add_type(scene, {60, 220, 90, 100}, Visibility::Transparent);
};

inline Vec3 power(Vec3 base, float exponent) {
  return {std::pow(base.x, exponent), std::pow(base.y, exponent), std::pow(base.z, exponent)};
}

inline void expect_near(Pixel a, Pixel b, int tolerance) {
  for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(a[c], b[c], tolerance);
}

}  // namespace quoin::render_test
