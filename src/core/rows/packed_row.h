#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

#ifdef __SSE2__
#include <emmintrin.h>
#endif

#include <quoin/core/assert.h>

#include "core/bytes/bytes.h"

namespace quoin::packed_row {

// A row is 64 voxels of `bits` bits each (1, 2, 4, 8 or 16), in `bits` words, lowest bits first. Everything here works
// on whole words.

/// Returns the number of set bits, as std::popcount, which is a call on processors without such an instruction.
constexpr std::uint32_t count_bits(std::uint64_t w) {
  w -= w >> 1 & 0x5555'5555'5555'5555U;
  w = (w & 0x3333'3333'3333'3333U) + (w >> 2 & 0x3333'3333'3333'3333U);
  w = (w + (w >> 4)) & 0x0F0F'0F0F'0F0F'0F0FU;
  return static_cast<std::uint32_t>(w * 0x0101'0101'0101'0101U >> 56);
}

/// Returns every second bit of `w`, packed: bit i is bit 2i of `w`.
constexpr std::uint64_t gather_even_bits(std::uint64_t w) {
  w &= 0x5555'5555'5555'5555U;
  w = (w | (w >> 1)) & 0x3333'3333'3333'3333U;
  w = (w | (w >> 2)) & 0x0F0F'0F0F'0F0F'0F0FU;
  w = (w | (w >> 4)) & 0x00FF'00FF'00FF'00FFU;
  w = (w | (w >> 8)) & 0x0000'FFFF'0000'FFFFU;
  return (w | (w >> 16)) & 0x0000'0000'FFFF'FFFFU;
}

/// Returns the even bits of `w`, packed, in the lower half, and the odd bits in the upper half.
constexpr std::uint64_t split_pairs(std::uint64_t w) {
  const auto swap = [&w](int distance, std::uint64_t lower) {
    const std::uint64_t changed = (w ^ (w >> distance)) & lower;
    w ^= changed ^ (changed << distance);
  };
  swap(1, 0x2222'2222'2222'2222U);
  swap(2, 0x0C0C'0C0C'0C0C'0C0CU);
  swap(4, 0x00F0'00F0'00F0'00F0U);
  swap(8, 0x0000'FF00'0000'FF00U);
  swap(16, 0x0000'0000'FFFF'0000U);
  return w;
}

/// Returns the lowest bit of each of the 16 nibbles of `w`, packed.
constexpr std::uint64_t gather_nibble_bits(std::uint64_t w) {
  w &= 0x1111'1111'1111'1111U;
  w = (w | (w >> 3)) & 0x0303'0303'0303'0303U;
  w = (w | (w >> 6)) & 0x000F'000F'000F'000FU;
  w = (w | (w >> 12)) & 0x0000'00FF'0000'00FFU;
  return (w | (w >> 24)) & 0xFFFFU;
}

/// Returns the lowest bit of each of the 8 bytes of `w`, packed.
constexpr std::uint64_t gather_byte_bits(std::uint64_t w) {
  return ((w & 0x0101'0101'0101'0101U) * 0x0102'0408'1020'4080U) >> 56;
}

/// Returns the lowest bit of each of the 4 halfwords of `w`, packed.
constexpr std::uint64_t gather_half_bits(std::uint64_t w) {
  return ((w & 0x0001'0001'0001'0001U) * 0x0001'0002'0004'0008U) >> 48;
}

/// Copies bit i of the lowest 32 to bits 2i and 2i + 1.
constexpr std::uint64_t spread_to_pairs(std::uint64_t w) {
  w &= 0x0000'0000'FFFF'FFFFU;
  w = (w | (w << 16)) & 0x0000'FFFF'0000'FFFFU;
  w = (w | (w << 8)) & 0x00FF'00FF'00FF'00FFU;
  w = (w | (w << 4)) & 0x0F0F'0F0F'0F0F'0F0FU;
  w = (w | (w << 2)) & 0x3333'3333'3333'3333U;
  return ((w | (w << 1)) & 0x5555'5555'5555'5555U) * 3;
}

/// Copies bit i of the lowest 16 to all bits of nibble i.
constexpr std::uint64_t spread_to_nibbles(std::uint64_t w) {
  w &= 0xFFFFU;
  w = (w | (w << 24)) & 0x0000'00FF'0000'00FFU;
  w = (w | (w << 12)) & 0x000F'000F'000F'000FU;
  w = (w | (w << 6)) & 0x0303'0303'0303'0303U;
  return ((w | (w << 3)) & 0x1111'1111'1111'1111U) * 15;
}

/// Copies bit i of the lowest 8 to all bits of byte i.
constexpr std::uint64_t spread_to_bytes(std::uint64_t w) {
  w = ((w & 0xFFU) * 0x0101'0101'0101'0101U) & 0x8040'2010'0804'0201U;
  return (((w + 0x7F7F'7F7F'7F7F'7F7FU) | w) >> 7 & 0x0101'0101'0101'0101U) * 0xFF;
}

/// Copies bit i of the lowest 4 to all bits of halfword i.
constexpr std::uint64_t spread_to_halves(std::uint64_t w) {
  return ((w & 1U) | (w & 2U) << 15 | (w & 4U) << 30 | (w & 8U) << 45) * 0xFFFF;
}

/// Returns `index` repeated over a word.
constexpr std::uint64_t repeat(int bits, std::uint32_t index) {
  QUOIN_ASSERT(bits <= 16 && std::has_single_bit(static_cast<unsigned>(bits)), "1, 2, 4, 8 or 16 bits");
  QUOIN_ASSERT(index >> bits == 0, "an index of that many bits");
  constexpr std::uint64_t kOnes[] = {~std::uint64_t{0}, 0x5555'5555'5555'5555U, 0x1111'1111'1111'1111U,
                                     0x0101'0101'0101'0101U, 0x0001'0001'0001'0001U};
  return index * kOnes[std::countr_zero(static_cast<unsigned>(bits) | 16U)];
}

#ifdef __SSE2__
/// Returns the top bits of 16 bytes, packed.
inline std::uint64_t top_bits(__m128i bytes) {
  return static_cast<std::uint32_t>(_mm_movemask_epi8(bytes));
}

/// As equal_mask, for voxels of 4, 8 or 16 bits.
template <int kBits>
std::uint64_t equal_mask_by_bytes(const std::uint64_t* row, std::uint64_t pattern) {
  const __m128i wanted = _mm_set1_epi64x(static_cast<long long>(pattern));
  const auto part = [&](int i) { return _mm_loadu_si128(reinterpret_cast<const __m128i*>(row + 2 * i)); };
  std::uint64_t mask = 0;
  if constexpr (kBits == 4) {
    const __m128i low = _mm_set1_epi8(0x0F);
    for (int i = 0; i < 2; ++i) {
      const __m128i other = _mm_xor_si128(part(i), wanted);
      const __m128i even = _mm_cmpeq_epi8(_mm_and_si128(other, low), _mm_setzero_si128());
      const __m128i odd = _mm_cmpeq_epi8(_mm_andnot_si128(low, other), _mm_setzero_si128());
      mask |= (top_bits(_mm_unpacklo_epi8(even, odd)) | top_bits(_mm_unpackhi_epi8(even, odd)) << 16) << (32 * i);
    }
  } else if constexpr (kBits == 8) {
    for (int i = 0; i < 4; ++i) mask |= top_bits(_mm_cmpeq_epi8(part(i), wanted)) << (16 * i);
  } else {
    for (int i = 0; i < 4; ++i) {
      const __m128i first = _mm_cmpeq_epi16(part(2 * i), wanted);
      mask |= top_bits(_mm_packs_epi16(first, _mm_cmpeq_epi16(part(2 * i + 1), wanted))) << (16 * i);
    }
  }
  return mask;
}
#endif

/// Returns the voxels of the row that hold `index`: bit x for voxel x.
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
#ifdef __SSE2__
    case 4:
      return equal_mask_by_bytes<4>(row, pattern);
    case 8:
      return equal_mask_by_bytes<8>(row, pattern);
    default:
      return equal_mask_by_bytes<16>(row, pattern);
#else
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
#endif
  }
}

inline std::uint32_t read(const std::uint64_t* row, int bits, int x) {
  QUOIN_ASSERT(x >= 0 && x < 64, "0 <= x < 64");
  const auto bit = static_cast<unsigned>(x * bits);
  return static_cast<std::uint32_t>(row[bit >> 6] >> (bit & 63U)) & ((1U << bits) - 1U);
}

inline void write(std::uint64_t* row, int bits, int x, std::uint32_t index) {
  QUOIN_ASSERT(x >= 0 && x < 64 && index >> bits == 0, "0 <= x < 64, and an index of that many bits");
  const auto bit = static_cast<unsigned>(x * bits);
  const std::uint64_t field = ((std::uint64_t{1} << bits) - 1) << (bit & 63U);
  std::uint64_t& word = row[bit >> 6];
  word = (word & ~field) | ((std::uint64_t{index} << (bit & 63U)) & field);
}

/// Writes `index` where `mask` has a bit.
inline void write_masked(std::uint64_t* row, int bits, std::uint64_t mask, std::uint32_t index) {
  const std::uint64_t pattern = repeat(bits, index);
  if (mask == ~std::uint64_t{0}) {
    for (int i = 0; i < bits; ++i) row[i] = pattern;
    return;
  }
  const auto write_where = [&](int word, std::uint64_t field) { row[word] = (row[word] & ~field) | (pattern & field); };
  switch (bits) {
    case 1:
      return write_where(0, mask);
    case 2:
      for (int i = 0; i < 2; ++i) write_where(i, spread_to_pairs(mask >> (32 * i)));
      return;
    case 4:
      for (int i = 0; i < 4; ++i) write_where(i, spread_to_nibbles(mask >> (16 * i)));
      return;
    case 8:
      for (int i = 0; i < 8; ++i) write_where(i, spread_to_bytes(mask >> (8 * i)));
      return;
    default:
      for (int i = 0; i < 16; ++i) write_where(i, spread_to_halves(mask >> (4 * i)));
  }
}

/// Returns true if all voxels of `rows` consecutive rows hold `index`. Starts at the last row, because in rows that are
/// filled in order the last one is the one that differs.
inline bool all_equal(const std::uint64_t* row, int bits, int rows, std::uint32_t index) {
  const std::uint64_t pattern = repeat(bits, index);
  for (int i = rows * bits; i-- > 0;) {
    if (row[i] != pattern) return false;
  }
  return true;
}

/// Calls `value_of` for the 64 indices of a row.
template <int Bits, class Out, class ValueOf>
void unpack_as(const std::uint64_t* row, Out* out, ValueOf&& value_of) {
  constexpr int kPerWord = 64 / Bits;
  constexpr std::uint64_t kField = (std::uint64_t{1} << Bits) - 1;
  for (int i = 0; i < Bits; ++i) {
    const std::uint64_t word = row[i];
    for (int k = 0; k < kPerWord; ++k)
      out[i * kPerWord + k] = value_of(static_cast<std::uint32_t>(word >> (k * Bits) & kField));
  }
}

/// Selects between two values by the 64 bits of a word, in steps that compilers vectorise.
template <class Value>
void unpack_bits(std::uint64_t word, Value zero, Value one, Value* out) {
  const auto flip = static_cast<Value>(zero ^ one);
  for (int i = 0; i < 8; ++i) {
    const auto eight = static_cast<Value>(word >> (8 * i) & 0xFFU);
    for (int k = 0; k < 8; ++k) {
      const auto bit = static_cast<Value>(1U << k);
      const auto all_or_none = static_cast<Value>((eight & bit) == bit ? ~0U : 0U);
      out[8 * i + k] = static_cast<Value>(zero ^ (all_or_none & flip));
    }
  }
}

/// Looks up the 64 values of a row, `bits` wide, in a palette; at 16 bits the values are the indices themselves.
template <class Value>
void unpack(const std::uint64_t* row, int bits, const Value* palette, std::size_t palette_size, Value* out) {
  const auto type_of = [=](std::uint32_t index) {
    QUOIN_ASSERT(index < palette_size, "an index of the palette");
    return palette[index];
  };
  switch (bits) {
    case 1:
      return unpack_bits(row[0], palette[0], palette[palette_size > 1 ? 1 : 0], out);
    case 2:
      return unpack_as<2>(row, out, type_of);
    case 4:
      return unpack_as<4>(row, out, type_of);
    case 8:
      return unpack_as<8>(row, out, type_of);
    default:
      unpack_as<16>(row, out, [](std::uint32_t index) { return static_cast<Value>(index); });
  }
}

/// Returns a mask of the values that equal `wanted`.
template <class Value>
std::uint64_t where_equal(const Value* values, Value wanted) {
  std::uint8_t equal[64];
  for (int x = 0; x < 64; ++x) equal[x] = values[x] == wanted ? 1 : 0;
  std::uint64_t mask = 0;
  for (int i = 0; i < 8; ++i) {
    std::uint64_t eight = 0;
    std::memcpy(&eight, equal + 8 * i, sizeof eight);
    if constexpr (std::endian::native == std::endian::big) eight = __builtin_bswap64(eight);
    mask |= gather_byte_bits(eight) << (8 * i);
  }
  return mask;
}

}  // namespace quoin::packed_row

namespace quoin {

/// Multiplies and folds, as hash functions of the family of wyhash and xxHash do.
inline std::uint64_t mixed_with(std::uint64_t hash, std::uint64_t value) {
  hash = (hash ^ value) * 0x9E37'79B9'7F4A'7C15U;
  return hash ^ hash >> 29;
}

inline constexpr std::uint64_t kHashSeed = 0x2D35'8DCC'AA6C'78A5U;

/// Hashes bytes, after those in `hash`.
inline std::uint64_t hash_of_bytes(std::uint64_t hash, std::span<const std::byte> bytes) {
  for (; bytes.size() >= 8; bytes = bytes.subspan(8)) {
    hash = mixed_with(hash, load<std::uint64_t>(bytes.data(), std::endian::little));
  }
  for (const std::byte each : bytes) hash = mixed_with(hash, std::to_integer<std::uint64_t>(each));
  return hash;
}

/// Hashes a row of 64 types or half floats.
inline std::uint64_t hash_of_row(const std::array<std::uint16_t, 64>& row) {
  std::uint64_t hash = kHashSeed;
  for (std::size_t x = 0; x < row.size(); x += 4) {
    const std::uint64_t four = std::uint64_t{row[x]} | std::uint64_t{row[x + 1]} << 16 |
                               std::uint64_t{row[x + 2]} << 32 | std::uint64_t{row[x + 3]} << 48;
    hash = mixed_with(hash, four);
  }
  return hash;
}

}  // namespace quoin
