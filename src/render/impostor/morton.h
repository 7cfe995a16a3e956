#pragma once

#include <cstddef>
#include <cstdint>

#include <quoin/core/assert.h>
#include <quoin/core/vec.h>

namespace quoin {

/// Returns the 21 low bits of a number, spread to every third bit.
[[nodiscard]] constexpr std::uint64_t spread_bits(std::uint64_t bits) {
  bits &= 0x1F'FFFF;
  bits = (bits | bits << 32) & 0x001F'0000'0000'FFFF;
  bits = (bits | bits << 16) & 0x001F'0000'FF00'00FF;
  bits = (bits | bits << 8) & 0x100F'00F0'0F00'F00F;
  bits = (bits | bits << 4) & 0x10C3'0C30'C30C'30C3;
  return (bits | bits << 2) & 0x1249'2492'4924'9249;
}

/// Reverses `spread_bits`; ignores the bits between.
[[nodiscard]] constexpr std::uint64_t gathered_bits(std::uint64_t bits) {
  bits &= 0x1249'2492'4924'9249;
  bits = (bits | bits >> 2) & 0x10C3'0C30'C30C'30C3;
  bits = (bits | bits >> 4) & 0x100F'00F0'0F00'F00F;
  bits = (bits | bits >> 8) & 0x001F'0000'FF00'00FF;
  bits = (bits | bits >> 16) & 0x001F'0000'0000'FFFF;
  return (bits | bits >> 32) & 0x1F'FFFF;
}

/// The position along a Morton curve, which keeps neighbours mostly together. Requires: coordinates of 0 to 2^21 - 1.
[[nodiscard]] constexpr std::uint64_t morton_code(IVec3 position) {
  QUOIN_ASSERT((static_cast<std::uint32_t>(position.x | position.y | position.z) >> 21) == 0, "coordinates of 21 bits");
  return spread_bits(static_cast<std::uint64_t>(position.x)) |
         spread_bits(static_cast<std::uint64_t>(position.y)) << 1 |
         spread_bits(static_cast<std::uint64_t>(position.z)) << 2;
}

[[nodiscard]] constexpr IVec3 morton_position(std::uint64_t code) {
  return {static_cast<int>(gathered_bits(code)), static_cast<int>(gathered_bits(code >> 1)),
          static_cast<int>(gathered_bits(code >> 2))};
}

struct MortonHash {
  std::size_t operator()(std::uint64_t code) const {
    const std::uint64_t hash = code * 0x9E37'79B9'7F4A'7C15U;
    return hash ^ hash >> 32;
  }
};

}  // namespace quoin
