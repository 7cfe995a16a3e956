#pragma once

#include <bit>
#include <cstdint>

namespace [[gnu::visibility("default")]] quoin {

/// The bits of an IEEE 754 half: 11 bits of precision, largest value 65,504, smallest positive value 2^-24.
using Half = std::uint16_t;

/// The largest finite half and the smallest positive half.
inline constexpr float kMaxHalf = 65504.0F;
inline constexpr float kMinHalf = 1.0F / 16777216.0F;

/// Converts a half to a float. Exact, also for infinities and NaN.
[[nodiscard]] constexpr float float_from_half(Half half) {
  // Moves the exponent into the float's exponent field, then corrects its bias with a multiplication. The
  // multiplication also normalises subnormals.
  constexpr float kScale = std::bit_cast<float>(std::uint32_t{(127 + 112) << 23});
  const std::uint32_t magnitude = std::uint32_t{half & 0x7FFFU} << 13;
  std::uint32_t bits = std::bit_cast<std::uint32_t>(std::bit_cast<float>(magnitude) * kScale);
  if ((half & 0x7C00U) == 0x7C00U) bits |= 0x7F80'0000U;
  return std::bit_cast<float>(bits | std::uint32_t{half & 0x8000U} << 16);
}

/// Rounds a float to the nearest half, ties to even, as F16C does. Values that round above kMaxHalf become infinity.
/// NaN stays NaN.
[[nodiscard]] constexpr Half half_from_float(float value) {
  const std::uint32_t bits = std::bit_cast<std::uint32_t>(value);
  const auto sign = static_cast<std::uint32_t>(bits >> 16 & 0x8000U);
  const std::uint32_t magnitude = bits & 0x7FFF'FFFFU;
  if (magnitude > 0x7F80'0000U) return static_cast<Half>(sign | 0x7E00U | (magnitude >> 13 & 0x1FFU));
  if (magnitude >= 0x4780'0000U) return static_cast<Half>(sign | 0x7C00U);  // 65,536 and more
  if (magnitude < 0x3880'0000U) {
    // Subnormal: adding 0.5 puts the rounded bits of the half into the lowest bits of the float.
    const float sum = std::bit_cast<float>(magnitude) + 0.5F;
    return static_cast<Half>(sign | (std::bit_cast<std::uint32_t>(sum) - std::bit_cast<std::uint32_t>(0.5F)));
  }
  const std::uint32_t odd = magnitude >> 13 & 1U;
  return static_cast<Half>(sign | ((magnitude + 0xC800'0FFFU + odd) >> 13));
}

}  // namespace quoin
