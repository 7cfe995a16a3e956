#pragma once

#include <cstdint>

#include <quoin/core/hash.h>

#include "render/path/numbers/path_math.h"

namespace quoin::path {

/// Returns the bits in reverse order.
[[nodiscard]] constexpr std::uint32_t reversed(std::uint32_t x) {
  x = (x >> 1 & 0x5555'5555U) | (x & 0x5555'5555U) << 1;
  x = (x >> 2 & 0x3333'3333U) | (x & 0x3333'3333U) << 2;
  x = (x >> 4 & 0x0F0F'0F0FU) | (x & 0x0F0F'0F0FU) << 4;
  x = (x >> 8 & 0x00FF'00FFU) | (x & 0x00FF'00FFU) << 8;
  return x >> 16 | x << 16;
}

/// Multiplies the bits of an index by Pascal's triangle modulo 2: bit i of the result is the sum of all bits j whose
/// binary digits include those of i. Reversed, it is the second coordinate of Sobol's sequence; the reversed index is
/// the first.
[[nodiscard]] constexpr std::uint32_t pascal(std::uint32_t x) {
  x ^= x >> 1 & 0x5555'5555U;
  x ^= x >> 2 & 0x3333'3333U;
  x ^= x >> 4 & 0x0F0F'0F0FU;
  x ^= x >> 8 & 0x00FF'00FFU;
  return x ^ (x >> 16 & 0x0000'FFFFU);
}

/// Owen scrambling of a number with bits in reverse order: each bit depends only on the bits below it.
///
/// Source: B. Burley, "Practical hash-based Owen scrambling" (2020), after S. Laine and T. Karras; constants of
/// N. Vegdahl, "Owen scrambling based dithered blue-noise sampling" (2021).
[[nodiscard]] constexpr std::uint32_t scrambled(std::uint32_t x, std::uint32_t seed) {
  x ^= x * 0x3D20'ADEAU;
  x += seed;
  x *= (seed >> 16) | 1U;
  x ^= x * 0x0552'6C56U;
  x ^= x * 0x53A2'2864U;
  return x;
}

[[nodiscard]] constexpr float unit_of(std::uint32_t bits) {
  return static_cast<float>(bits >> 8) * 0x1p-24F;
}

/// The random numbers of one path: a function of pixel, sample and dimension only.
///
/// Each pair of dimensions is a scrambled (0, 2)-sequence over the samples of a pixel, in its own order.
class Random {
 public:
  Random() = default;
  /// `pixel`: a hash of its position. `sample`: counts up from 0.
  Random(std::uint32_t pixel, std::uint32_t sample) : pixel_(pixel), sample_(sample) {}

  [[nodiscard]] std::uint32_t pixel() const { return pixel_; }
  [[nodiscard]] std::uint32_t sample() const { return sample_; }

  [[nodiscard]] Pair pair(std::uint32_t dimension) const {
    const std::uint32_t seed = mix_bits(pixel_ ^ dimension * 0x9E37'79B9U);
    const std::uint32_t index = reversed(scrambled(reversed(sample_), seed));
    const std::uint32_t other = seed * 0x85EB'CA6BU ^ seed >> 13;
    return {unit_of(reversed(scrambled(index, other * 0xC2B2'AE35U + 1U))),
            unit_of(reversed(scrambled(pascal(index), other * 0x27D4'EB2FU + 0x1656'67B1U)))};
  }
  [[nodiscard]] float one(std::uint32_t dimension) const {
    const std::uint32_t seed = mix_bits(pixel_ ^ dimension * 0x9E37'79B9U);
    const std::uint32_t index = reversed(scrambled(reversed(sample_), seed));
    return unit_of(reversed(scrambled(index, seed * 0x85EB'CA6BU + 1U)));
  }

 private:
  std::uint32_t pixel_ = 0;
  std::uint32_t sample_ = 0;
};

}  // namespace quoin::path
