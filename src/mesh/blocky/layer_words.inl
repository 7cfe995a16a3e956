// Words in groups of four, or eight with AVX-512; and the layers in the layouts of the other views.
//
//   a word      the 64 voxels of a row                    | x 0 ... 63 |
//   Words       rows y, y + 1, ... of one plane           | y | y + 1 | y + 2 | y + 3 |
//   z view      planes z, rows y, bits x
//   y view      planes y, rows z, bits x                  words are swapped, kLanes x kLanes at a time
//   x view      planes x, rows y, bits z                  bits are transposed, kLanes rows y at a time

#pragma once

#include <cstdint>

#ifdef QUOIN_KERNEL_AVX2
#include <immintrin.h>
#endif

#include "core/lanes/words.h"
#include "mesh/blocky/blocky_mesher.h"

#define QUOIN_INLINE inline __attribute__((always_inline))
#define QUOIN_STAGE inline __attribute__((noinline))  // separate function in a profile

namespace quoin::blocky {
namespace {

#ifdef QUOIN_KERNEL_AVX512
inline constexpr int kLanes = 8;
#else
inline constexpr int kLanes = 4;
#endif

using Words = words::WordVector<kLanes>::Type;
using words::any;
using words::lanes_with_bits;
using words::load_as;
using words::store;

QUOIN_INLINE Words load(const std::uint64_t* p) {
  return load_as<Words>(p);
}

constexpr int rounded_down(int row) {
  return row & -kLanes;
}
constexpr int rounded_up(int row) {
  return (row + kLanes - 1) & -kLanes;
}

#ifdef QUOIN_KERNEL_AVX512

QUOIN_INLINE __m512i bits_of(Words v) {
  return reinterpret_cast<__m512i>(v);
}

// Computes any function of three bits: `kTable` has the result for (a, b, c) at bit 4a + 2b + c.
template <int kTable>
QUOIN_INLINE Words ternary(Words a, Words b, Words c) {
  return reinterpret_cast<Words>(_mm512_ternarylogic_epi64(bits_of(a), bits_of(b), bits_of(c), kTable));
}

QUOIN_INLINE Words or_difference(Words so_far, Words a, Words b) {
  return ternary<0xF6>(so_far, a, b);
}
QUOIN_INLINE Words and_not(Words a, Words but_not, Words b) {
  return ternary<0x20>(a, but_not, b);
}
QUOIN_INLINE Words choose(Words mask, Words where_set, Words where_not) {
  return ternary<0xCA>(mask, where_set, where_not);
}
QUOIN_INLINE Words and_same(Words so_far, Words a, Words b) {
  return ternary<0x90>(so_far, a, b);
}
QUOIN_INLINE Words occlusion_low(Words side1, Words side2, Words corner) {
  return ternary<0xD6>(side1, side2, corner);
}
QUOIN_INLINE Words occlusion_high(Words side1, Words side2, Words corner) {
  return ternary<0xE8>(side1, side2, corner);
}

#else

QUOIN_INLINE Words or_difference(Words so_far, Words a, Words b) {
  return so_far | (a ^ b);
}
QUOIN_INLINE Words and_not(Words a, Words but_not, Words b) {
  return a & ~but_not & b;
}
QUOIN_INLINE Words and_same(Words so_far, Words a, Words b) {
  return so_far & ~(a ^ b);
}
// The two bits of a corner's occlusion: the number of set bits of the three, but 3 if both sides are set.
QUOIN_INLINE Words occlusion_low(Words side1, Words side2, Words corner) {
  return (side1 ^ side2 ^ corner) | (side1 & side2);
}
QUOIN_INLINE Words occlusion_high(Words side1, Words side2, Words corner) {
  return (side1 & side2) | ((side1 ^ side2) & corner);
}

#endif

// Returns the position of the lowest set bit. Requires: w is not 0.
QUOIN_INLINE std::uint64_t lowest_bit(std::uint64_t w) {
#ifdef QUOIN_KERNEL_AVX2
  return _tzcnt_u64(w);
#else
  return static_cast<std::uint64_t>(__builtin_ctzll(w));
#endif
}

struct Range {
  int begin;
  int end;
};

#ifdef QUOIN_KERNEL_AVX512
QUOIN_INLINE Words first_pairs(Words a, Words b) {
  return __builtin_shufflevector(a, b, 0, 1, 4, 5, 8, 9, 12, 13);
}
QUOIN_INLINE Words second_pairs(Words a, Words b) {
  return __builtin_shufflevector(a, b, 2, 3, 6, 7, 10, 11, 14, 15);
}
#endif

// Transposes: word j of vector i becomes word i of vector j.
QUOIN_INLINE void transpose_words(const Words (&in)[kLanes], Words (&out)[kLanes]) {
#ifdef QUOIN_KERNEL_AVX512
  Words even[4];  // words 0, 2, 4, 6 of two vectors
  Words odd[4];
  for (int i = 0; i < 4; ++i) {
    even[i] = __builtin_shufflevector(in[2 * i], in[2 * i + 1], 0, 8, 2, 10, 4, 12, 6, 14);
    odd[i] = __builtin_shufflevector(in[2 * i], in[2 * i + 1], 1, 9, 3, 11, 5, 13, 7, 15);
  }
  const auto finish = [&](const Words(&half)[4], int column) {
    const Words a = first_pairs(half[0], half[1]);
    const Words b = first_pairs(half[2], half[3]);
    const Words c = second_pairs(half[0], half[1]);
    const Words d = second_pairs(half[2], half[3]);
    out[column] = first_pairs(a, b);
    out[column + 2] = first_pairs(c, d);
    out[column + 4] = second_pairs(a, b);
    out[column + 6] = second_pairs(c, d);
  };
  finish(even, 0);
  finish(odd, 1);
#else
  const Words a = __builtin_shufflevector(in[0], in[1], 0, 4, 2, 6);
  const Words b = __builtin_shufflevector(in[0], in[1], 1, 5, 3, 7);
  const Words c = __builtin_shufflevector(in[2], in[3], 0, 4, 2, 6);
  const Words d = __builtin_shufflevector(in[2], in[3], 1, 5, 3, 7);
  out[0] = __builtin_shufflevector(a, c, 0, 1, 4, 5);
  out[1] = __builtin_shufflevector(b, d, 0, 1, 4, 5);
  out[2] = __builtin_shufflevector(a, c, 2, 3, 6, 7);
  out[3] = __builtin_shufflevector(b, d, 2, 3, 6, 7);
#endif
}

// Copies rows [z][y] to rows [y][z]; whole words are moved.
void swap_planes_and_rows(const Layer& from, Layer& to, Range z_range, Range y_range) {
  for (int z = z_range.begin; z < z_range.end; z += kLanes) {
    for (int y = y_range.begin; y < y_range.end; y += kLanes) {
      Words in[kLanes];
      for (int i = 0; i < kLanes; ++i) in[i] = load(from.words + word_index(z + i, y));
      Words out[kLanes];
      transpose_words(in, out);
      for (int i = 0; i < kLanes; ++i) store(to.words + word_index(y + i, z), out[i]);
    }
  }
}

#ifdef QUOIN_KERNEL_AVX512

// Bytes of both words are exchanged in one instruction each, bits in four.
template <int kShift>
QUOIN_INLINE void exchange(Words& low, Words& high) {
  const __m512i a = bits_of(low);
  const __m512i b = bits_of(high);
  if constexpr (kShift == 32) {
    low = reinterpret_cast<Words>(_mm512_mask_shuffle_epi32(a, 0xAAAA, b, _MM_PERM_CCAA));
    high = reinterpret_cast<Words>(_mm512_mask_shuffle_epi32(b, 0x5555, a, _MM_PERM_DDBB));
  } else if constexpr (kShift >= 8) {
    constexpr __mmask64 kHigh = kShift == 16 ? 0xCCCC'CCCC'CCCC'CCCC : 0xAAAA'AAAA'AAAA'AAAA;
    const auto neighbours =
        _mm512_broadcast_i32x4(kShift == 16 ? _mm_set_epi64x(0x0D0C'0F0E'0908'0B0A, 0x0504'0706'0100'0302)
                                            : _mm_set_epi64x(0x0E0F'0C0D'0A0B'0809, 0x0607'0405'0203'0001));
    low = reinterpret_cast<Words>(_mm512_mask_shuffle_epi8(a, kHigh, b, neighbours));
    high = reinterpret_cast<Words>(_mm512_mask_shuffle_epi8(b, ~kHigh, a, neighbours));
  } else {
    const Words mask = Words{} + (kShift == 4   ? 0x0F0F'0F0F'0F0F'0F0FU
                                  : kShift == 2 ? 0x3333'3333'3333'3333U
                                                : 0x5555'5555'5555'5555U);
    const Words moved = choose(mask, low >> kShift, high);
    low = choose(mask, low, high << kShift);
    high = moved;
  }
}

// Stores only the selected lanes.
QUOIN_INLINE void store_lanes(std::uint64_t* p, unsigned lanes, Words v) {
  _mm512_mask_storeu_epi64(p, static_cast<__mmask8>(lanes), bits_of(v));
}

#else

template <int kShift>
QUOIN_INLINE void exchange(Words& low, Words& high) {
  constexpr std::uint64_t kMasks[] = {0x5555'5555'5555'5555U, 0x3333'3333'3333'3333U, 0x0F0F'0F0F'0F0F'0F0FU,
                                      0x00FF'00FF'00FF'00FFU, 0x0000'FFFF'0000'FFFFU, 0x0000'0000'FFFF'FFFFU};
  constexpr std::uint64_t kMask = kMasks[__builtin_ctz(kShift)];
  const Words t = ((low >> kShift) ^ high) & kMask;
  high ^= t;
  low ^= t << kShift;
}

QUOIN_INLINE void store_lanes(std::uint64_t* p, unsigned lanes, Words v) {
  for (int i = 0; i < kLanes; ++i) {
    if ((lanes >> i & 1U) != 0) p[i] = v[i];
  }
}

#endif

inline constexpr unsigned kAllLanes = (1U << kLanes) - 1;

// Three of the six steps of a transposition, for words at a distance of kFar / 4.
template <int kFar>
QUOIN_INLINE void exchange_eight(Words (&v)[8]) {
  for (int j = 0; j < 4; ++j) exchange<kFar>(v[j], v[j + 4]);
  for (int j = 0; j < 8; j += 4) {
    exchange<kFar / 2>(v[j], v[j + 2]);
    exchange<kFar / 2>(v[j + 1], v[j + 3]);
  }
  for (int j = 0; j < 8; j += 2) exchange<kFar / 4>(v[j], v[j + 1]);
}

// Transposes bits x of 64 rows z to bits z of 64 planes x, for as many adjacent rows y as there are lanes.
template <unsigned kStored>
void transpose_bits(const std::uint64_t* from, std::uint64_t* to) {
  const auto put = [&](int plane, Words v) {
    if constexpr (kStored == kAllLanes) {
      store(to + plane * kRowStride, v);
    } else {
      store_lanes(to + plane * kRowStride, kStored, v);
    }
  };
  Words all_or{};
  Words all_and = ~Words{};
  Words half[64];
  for (int i = 0; i < 64; ++i) {
    half[i] = load(from + i * kRowStride);
    all_or |= half[i];
    all_and &= half[i];
  }
  if (!any(all_or) || !any(~all_and)) {
    for (int i = 0; i < 64; ++i) put(i, all_or);
    return;
  }
  for (int i = 0; i < 8; ++i) {
    Words v[8];
    for (int j = 0; j < 8; ++j) v[j] = half[i + 8 * j];
    exchange_eight<32>(v);
    for (int j = 0; j < 8; ++j) half[i + 8 * j] = v[j];
  }
  for (int i = 0; i < 64; i += 8) {
    Words v[8];
    for (int j = 0; j < 8; ++j) v[j] = half[i + j];
    exchange_eight<4>(v);
    for (int j = 0; j < 8; ++j) put(i + j, v[j]);
  }
}

void turn_bits(const Layer& from, Layer& to, Range y_range) {
  for (int y = y_range.begin; y < y_range.end; y += kLanes) {
    transpose_bits<kAllLanes>(from.words + word_index(0, y), to.words + word_index(0, y));
  }
}

// Copies one row outside the chunk: -1 or 64.
template <int kRow>
void turn_border(const Layer& from, Layer& to) {
  std::uint64_t opaque = 0;
  for (int z = 0; z < 64; ++z) opaque |= from.words[word_index(z, kRow)];
  if (opaque == 0) {
    for (int x = 0; x < 64; ++x) to.words[word_index(x, kRow)] = 0;
    return;
  }
  constexpr int kFirst = kRow < 0 ? -kLanes : 64;
  constexpr unsigned kLane = kRow < 0 ? 1U << (kLanes - 1) : 1U;
  transpose_bits<kLane>(from.words + word_index(0, kFirst), to.words + word_index(0, kFirst));
}

// Calls `copy` with an index of every word in the rows -1 to 64 of plane 0, and a tag for one word or for kLanes words.
template <class Copy>
QUOIN_INLINE void for_rows_and_border(const Copy& copy) {
  copy(word_index(0, -1), std::uint64_t{});
  for (int y = 0; y < 64; y += kLanes) copy(word_index(0, y), Words{});
  copy(word_index(0, 64), std::uint64_t{});
}

// Copies the rows outside the chunk in the y and x views from the z view.
void copy_border(bool row_ends, Scratch& s) {
  for (int row = -1; row <= 64; ++row) {
    for (const int side : {-1, 64}) {
      s.y.opaque.words[word_index(side, row)] = s.z.opaque.words[word_index(row, side)];
      s.y.opaque.words[word_index(row, side)] = s.z.opaque.words[word_index(side, row)];
    }
  }
  for_rows_and_border([&](int at, auto like) {
    using T = decltype(like);
    T low{};
    T high{};
    for (int z = 0; z < 64 && row_ends; ++z) {
      const T ends = load_as<T>(s.z.ends.words + at + z * kRowStride);
      low |= (ends >> 63) << z;
      high |= (ends & 1) << z;
    }
    store(s.x.opaque.words + at - kRowStride, low);
    store(s.x.opaque.words + at + 64 * kRowStride, high);
  });
}

// Copies the voxels before and after the rows of the y and x views.
void copy_row_ends(Scratch& s) {
  swap_planes_and_rows(s.z.ends, s.y.ends, {0, 64}, {0, 64});
  for (int row = -1; row <= 64; ++row) {
    for (const int side : {-1, 64}) {
      s.y.ends.words[word_index(side, row)] = s.z.ends.words[word_index(row, side)];
      s.y.ends.words[word_index(row, side)] = s.z.ends.words[word_index(side, row)];
    }
  }
  // Rows of the x view are along z, its planes are bits of the z view.
  for_rows_and_border([&](int at, auto like) {
    using T = decltype(like);
    const auto before = [&](const Layer& layer) { return load_as<T>(layer.words + at - kRowStride); };
    const auto after = [&](const Layer& layer) { return load_as<T>(layer.words + at + 64 * kRowStride); };
    std::uint64_t* out = s.x.ends.words + at;
    const T first = before(s.z.opaque);
    const T last = after(s.z.opaque);
    for (int x = 0; x < 64; ++x) store(out + x * kRowStride, (first >> x) << 63 | (last >> x & 1));
    const T corner_before = before(s.z.ends);
    const T corner_after = after(s.z.ends);
    store(out - kRowStride, (corner_before >> 63) << 63 | corner_after >> 63);
    store(out + 64 * kRowStride, corner_before << 63 | (corner_after & 1));
  });
}

}  // namespace
}  // namespace quoin::blocky
