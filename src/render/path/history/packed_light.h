#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

#include <quoin/core/assert.h>
#include <quoin/core/vec.h>

namespace quoin::path {

/// Light in 32 bits: three parts of 9 bits with a shared 5-bit exponent. The relative error of the largest part is at
/// most 1/512. Values are clamped to [0, `kMaxPackedLight`].
///
///   bit 31     27 26      18 17       9 8        0
///       | exponent | blue    | green   | red     |
///
/// Source: OpenGL, EXT_texture_shared_exponent (2004), its format RGB9_E5.
inline constexpr float kMaxPackedLight = 65'408.0F;

[[nodiscard]] inline std::uint32_t pack_light(Vec3 light) {
  constexpr int kBias = 15;
  constexpr int kBits = 9;
  // NaN becomes 0: std::max returns its first argument if the comparison fails.
  const auto bounded = [](float x) { return std::min(std::max(0.0F, x), kMaxPackedLight); };
  const Vec3 kept(bounded(light.x), bounded(light.y), bounded(light.z));
  const float most = std::max({kept.x, kept.y, kept.z});
  const int of_float = static_cast<int>(std::bit_cast<std::uint32_t>(most) >> 23) - 127;
  int exponent = std::max(-kBias - 1, of_float) + 1 + kBias;
  const auto scale_of = [](int e) {
    return std::bit_cast<float>(static_cast<std::uint32_t>(127 + kBits + kBias - e) << 23);
  };
  if (most * scale_of(exponent) + 0.5F >= 512.0F) ++exponent;
  const float scale = scale_of(exponent);
  QUOIN_ASSERT(exponent >= 0 && exponent < 32, "an exponent of 5 bits");
  const auto part = [scale](float x) { return static_cast<std::uint32_t>(std::lrint(x * scale)); };
  return static_cast<std::uint32_t>(exponent) << 27 | part(kept.z) << 18 | part(kept.y) << 9 | part(kept.x);
}

[[nodiscard]] inline Vec3 unpack_light(std::uint32_t packed) {
  const float scale = std::bit_cast<float>(((packed >> 27) + 127U - 9U - 15U) << 23);
  const auto part = [packed](int shift) { return static_cast<float>((packed >> shift) & 511U); };
  return Vec3(part(0), part(9), part(18)) * scale;
}

}  // namespace quoin::path
