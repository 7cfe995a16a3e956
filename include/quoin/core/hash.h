#pragma once

#include <cstdint>

namespace [[gnu::visibility("default")]] quoin {

/// Mixes the bits of a word. Every input bit changes about half of the output bits.
///
/// Source: C. Wellons, "Prospecting for hash functions" (2018), the function called lowbias32.
[[nodiscard]] constexpr std::uint32_t mix_bits(std::uint32_t x) {
  x = (x ^ (x >> 16)) * 0x7FEB'352DU;
  x = (x ^ (x >> 15)) * 0x846C'A68BU;
  return x ^ (x >> 16);
}

}  // namespace quoin
