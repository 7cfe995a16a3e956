#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>

#include <quoin/core/assert.h>
#include <quoin/core/half.h>

namespace quoin {

/// Returns the largest half float that is at most `band`; at least the smallest positive one.
inline Half largest_within(float band) {
  Half half = half_from_float(band);
  if (float_from_half(half) > band) --half;
  return std::max<Half>(half, 1);
}

/// The density of samples whose value equals iso, which is common in files of integers. With 0, all cells around such a
/// sample would have their vertices at one point, and triangles between them would have no area.
inline constexpr float kDensityAtSurface = 1.0F / 256.0F;

/// The smallest normal half, 2^-14: subnormal numbers are slow, or flushed to 0, on many processors.
inline constexpr Half kLeastStored = 0x0400;

/// `stored_density` for a band that is a half.
inline Half stored_within(float density, Half band) {
  QUOIN_ASSERT(band != 0 && band <= 0x7C00U, "a positive band");
  const auto bits = std::bit_cast<std::uint32_t>(density);
  if ((bits & 0x7FFF'FFFFU) > 0x7F80'0000U) return band;  // NaN
  if (density == 0.0F) return 0;
  const Half magnitude = std::clamp<Half>(half_from_float(density) & 0x7FFFU, std::min(kLeastStored, band), band);
  return static_cast<Half>(magnitude | (bits >> 16 & 0x8000U));
}

}  // namespace quoin
