#pragma once

#include <cstdint>

#include <quoin/core/hash.h>

namespace [[gnu::visibility("default")]] quoin {

/// Returns a hash of integer coordinates, equal on every machine.
[[nodiscard]] constexpr std::uint32_t hash_of(std::uint32_t seed, std::int32_t x, std::int32_t y, std::int32_t z = 0) {
  const std::uint32_t lattice = static_cast<std::uint32_t>(x) * 0x9E37'79B1U +
                                static_cast<std::uint32_t>(y) * 0x85EB'CA77U +
                                static_cast<std::uint32_t>(z) * 0xC2B2'AE3DU;
  return mix_bits(mix_bits(lattice) ^ seed);
}

/// Returns smooth 2D noise: about -0.8 to 0.8, mean 0, features about one unit wide.
///
/// Bits:     equal on every machine and compiler with IEEE 754: uses only additions and products of doubles and
///           integers, never contracted.
/// Requires: |x|, |y| < 2^30.
/// Source:   K. Perlin, "Improving noise" (2002), with 16 unit gradients in the plane.
[[nodiscard]] double noise2(std::uint32_t seed, double x, double y);

/// Returns smooth 3D noise with the same properties; also requires |z| < 2^30. The lattice is rotated so that none of
/// its planes is parallel to a coordinate plane.
[[nodiscard]] double noise3(std::uint32_t seed, double x, double y, double z);

/// Returns a sum of octaves of `noise2`. Each octave has twice the frequency and half the amplitude of the previous
/// one, and is rotated so that the lattices do not coincide. About -1 to 1. Requires: 0 <= octaves <= 29, |x|, |y| <
/// 2^(29 - octaves).
[[nodiscard]] double fractal2(std::uint32_t seed, double x, double y, int octaves);

/// Returns ridged noise for mountain crests: octaves of 1 - |noise|, squared, each weighted by the previous one. 0 to
/// 1, crests near 1.
///
/// Requires: 0 <= octaves <= 29, |x|, |y| < 2^(29 - octaves).
/// Source:   F. K. Musgrave, in "Texturing and Modeling: A Procedural Approach" (1998), the ridged multifractal.
[[nodiscard]] double ridged2(std::uint32_t seed, double x, double y, int octaves);

}  // namespace quoin
