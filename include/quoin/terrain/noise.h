#pragma once

#include <cstdint>

#include <quoin/core/hash.h>

namespace quoin {

/// A hash of whole coordinates: the same on every machine.
[[nodiscard]] constexpr std::uint32_t hash_of(std::uint32_t seed, std::int32_t x, std::int32_t y, std::int32_t z = 0) {
  const std::uint32_t lattice = static_cast<std::uint32_t>(x) * 0x9E37'79B1U +
                                static_cast<std::uint32_t>(y) * 0x85EB'CA77U +
                                static_cast<std::uint32_t>(z) * 0xC2B2'AE3DU;
  return mix_bits(mix_bits(lattice) ^ seed);
}

/// Smooth noise of the plane: about -0.8 to 0.8, 0 on average, features about one unit wide.
///
/// Bits:     equal on every machine and compiler that keeps IEEE 754: additions and products of doubles and whole
///           numbers only, never contracted.
/// Requires: |x|, |y| < 2^30.
/// Source:   K. Perlin, "Improving noise" (2002), with 16 gradients of unit length in the plane.
[[nodiscard]] double noise2(std::uint32_t seed, double x, double y);

/// The same in space, |z| < 2^30 too. The lattice is turned so that none of its planes is parallel to an axis' own.
[[nodiscard]] double noise3(std::uint32_t seed, double x, double y, double z);

/// A sum of octaves of `noise2`, each of twice the frequency and half the amplitude, turned against the one before so
/// that their lattices do not meet. About -1 to 1. Requires: 0 <= octaves <= 29, |x|, |y| < 2^(29 - octaves).
[[nodiscard]] double fractal2(std::uint32_t seed, double x, double y, int octaves);

/// Mountain crests: octaves of 1 - |noise|, squared, where each is weighted by the one before. 0 to 1, crests near 1.
///
/// Requires: 0 <= octaves <= 29, |x|, |y| < 2^(29 - octaves).
/// Source: F. K. Musgrave, in "Texturing and Modeling: A Procedural Approach" (1998), the ridged multifractal.
[[nodiscard]] double ridged2(std::uint32_t seed, double x, double y, int octaves);

}  // namespace quoin
