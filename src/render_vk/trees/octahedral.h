#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include <quoin/core/vec.h>

namespace quoin::vulkan {

/// Packs -1 to 1 in 16 bits.
[[nodiscard]] inline std::uint32_t signed_16(float value) {
  const float scaled = std::round(std::clamp(value, -1.0F, 1.0F) * 32767.0F);
  return static_cast<std::uint32_t>(static_cast<std::int32_t>(scaled)) & 0xFFFF;
}

/// Packs a unit vector into a word, with precision 1/20,000: the octahedron's faces folded into a square. `unit_vector`
/// in shaders/data.glsl reads it.
[[nodiscard]] inline std::uint32_t octahedral(Vec3 v) {
  const float size = std::abs(v.x) + std::abs(v.y) + std::abs(v.z);
  if (!(size > 0.0F)) return 0;
  v /= size;
  const auto fold = [](float a, float b) { return (1.0F - std::abs(b)) * (a >= 0.0F ? 1.0F : -1.0F); };
  const float x = v.z >= 0.0F ? v.x : fold(v.x, v.y);
  const float y = v.z >= 0.0F ? v.y : fold(v.y, v.x);
  return signed_16(x) | signed_16(y) << 16;
}

}  // namespace quoin::vulkan
