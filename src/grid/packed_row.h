#pragma once

#include <cstdint>

namespace quoin::packed_row {

// A row is 64 voxels of `bits` bits each (1, 2, 4, 8 or 16), in `bits` words, lowest bits first. Everything here works
// on whole words.

/// Every second bit of `w`, packed: bit i is bit 2i of `w`.
constexpr std::uint64_t gather_even_bits(std::uint64_t w) {
  w &= 0x5555'5555'5555'5555U;
  w = (w | (w >> 1)) & 0x3333'3333'3333'3333U;
  w = (w | (w >> 2)) & 0x0F0F'0F0F'0F0F'0F0FU;
  w = (w | (w >> 4)) & 0x00FF'00FF'00FF'00FFU;
  w = (w | (w >> 8)) & 0x0000'FFFF'0000'FFFFU;
  return (w | (w >> 16)) & 0x0000'0000'FFFF'FFFFU;
}

/// The lowest bit of each of the 16 nibbles of `w`, packed.
constexpr std::uint64_t gather_nibble_bits(std::uint64_t w) {
  w &= 0x1111'1111'1111'1111U;
  w = (w | (w >> 3)) & 0x0303'0303'0303'0303U;
  w = (w | (w >> 6)) & 0x000F'000F'000F'000FU;
  w = (w | (w >> 12)) & 0x0000'00FF'0000'00FFU;
  return (w | (w >> 24)) & 0xFFFFU;
}

/// The lowest bit of each of the 8 bytes of `w`, packed.
constexpr std::uint64_t gather_byte_bits(std::uint64_t w) {
  return ((w & 0x0101'0101'0101'0101U) * 0x0102'0408'1020'4080U) >> 56;
}

/// The lowest bit of each of the 4 halfwords of `w`, packed.
constexpr std::uint64_t gather_half_bits(std::uint64_t w) {
  return ((w & 0x0001'0001'0001'0001U) * 0x0001'0002'0004'0008U) >> 48;
}

/// `index` repeated over a word.
constexpr std::uint64_t repeat(int bits, std::uint32_t index) {
  switch (bits) {
    case 1:
      return index * ~std::uint64_t{0};
    case 2:
      return index * 0x5555'5555'5555'5555U;
    case 4:
      return index * 0x1111'1111'1111'1111U;
    case 8:
      return index * 0x0101'0101'0101'0101U;
    default:
      return index * 0x0001'0001'0001'0001U;
  }
}

/// Which voxels of the row hold `index`: bit x for voxel x.
inline std::uint64_t equal_mask(const std::uint64_t* row, int bits, std::uint32_t index) {
  const std::uint64_t pattern = repeat(bits, index);
  std::uint64_t mask = 0;
  switch (bits) {
    case 1:
      return ~(row[0] ^ pattern);
    case 2:
      for (int i = 0; i < 2; ++i) {
        const std::uint64_t x = row[i] ^ pattern;
        mask |= gather_even_bits(~(x | (x >> 1))) << (32 * i);
      }
      return mask;
    case 4:
      for (int i = 0; i < 4; ++i) {
        const std::uint64_t x = row[i] ^ pattern;
        mask |= gather_nibble_bits(~(x | (x >> 1) | (x >> 2) | (x >> 3))) << (16 * i);
      }
      return mask;
    case 8: {
      constexpr std::uint64_t kLow = 0x7F7F'7F7F'7F7F'7F7FU;
      for (int i = 0; i < 8; ++i) {
        const std::uint64_t x = row[i] ^ pattern;
        const std::uint64_t zero_bytes = ~(((x & kLow) + kLow) | x | kLow);
        mask |= gather_byte_bits(zero_bytes >> 7) << (8 * i);
      }
      return mask;
    }
    default: {
      constexpr std::uint64_t kLow = 0x7FFF'7FFF'7FFF'7FFFU;
      for (int i = 0; i < 16; ++i) {
        const std::uint64_t x = row[i] ^ pattern;
        const std::uint64_t zero_halves = ~(((x & kLow) + kLow) | x | kLow);
        mask |= gather_half_bits(zero_halves >> 15) << (4 * i);
      }
      return mask;
    }
  }
}

inline std::uint32_t read(const std::uint64_t* row, int bits, int x) {
  const auto bit = static_cast<unsigned>(x * bits);
  return static_cast<std::uint32_t>(row[bit >> 6] >> (bit & 63U)) & ((1U << bits) - 1U);
}

inline void write(std::uint64_t* row, int bits, int x, std::uint32_t index) {
  const auto bit = static_cast<unsigned>(x * bits);
  const std::uint64_t field = ((std::uint64_t{1} << bits) - 1) << (bit & 63U);
  std::uint64_t& word = row[bit >> 6];
  word = (word & ~field) | ((std::uint64_t{index} << (bit & 63U)) & field);
}

/// Writes `index` where `mask` has a bit.
inline void write_masked(std::uint64_t* row, int bits, std::uint64_t mask, std::uint32_t index) {
  if (mask == ~std::uint64_t{0}) {
    const std::uint64_t pattern = repeat(bits, index);
    for (int i = 0; i < bits; ++i) row[i] = pattern;
    return;
  }
  if (bits == 1) {
    row[0] = (row[0] & ~mask) | (repeat(1, index) & mask);
    return;
  }
  for (; mask != 0; mask &= mask - 1) write(row, bits, __builtin_ctzll(mask), index);
}

}  // namespace quoin::packed_row
