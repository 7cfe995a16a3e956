// Lanes of cells of a chunk: additions to mesh/nets/cell_lanes.inl. With AVX-512, they also require VBMI2.

#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>

#include <immintrin.h>

#include <quoin/core/half.h>
#include <quoin/core/vec.h>

#include "mesh/nets/cell_lanes.inl"

namespace quoin::smooth {
namespace {

using namespace lanes;

#ifdef QUOIN_KERNEL_AVX512

// Gathers the pair of halves at each place, as one number.
inline I gather_pairs(const Half* base, I place) {
  return {_mm512_i32gather_epi32(place.v, base, 2)};
}
// Stores the first `count` lanes at their places.
inline void scatter(std::uint32_t* base, I place, I value, std::size_t count) {
  const auto mask = static_cast<__mmask16>(count >= 16 ? 0xFFFF : (1U << count) - 1);
  _mm512_mask_i32scatter_epi32(base, mask, place.v, value.v, 4);
}
// Converts halves to floats.
inline F load_halves(const Half* from) {
  return {_mm512_cvtph_ps(_mm256_loadu_si256(reinterpret_cast<const __m256i*>(from)))};
}

struct Interleave {
  std::int32_t first[6][16];
  std::int32_t second[6][16];
  std::uint16_t is_second[6];
};

// Interleaves x y z of sixteen lanes: the first two registers, or the third.
constexpr Interleave interleave_3() {
  Interleave t{};
  for (int i = 0; i < 48; ++i) {
    const int lane = i / 3;
    t.first[i / 16][i % 16] = i % 3 == 1 ? 16 + lane : lane;
    t.second[i / 16][i % 16] = lane;
    if (i % 3 == 2) t.is_second[i / 16] = static_cast<std::uint16_t>(t.is_second[i / 16] | 1U << (i % 16));
  }
  return t;
}

// Interleaves a b c a c d of sixteen lanes: from a and b, or from c and d.
constexpr Interleave interleave_triangles() {
  constexpr int kFirst[6] = {0, 16, 0, 0, 0, 0};
  constexpr int kSecond[6] = {0, 0, 0, 0, 0, 16};
  Interleave t{};
  for (int i = 0; i < 96; ++i) {
    const int lane = i / 6;
    const int part = i % 6;
    t.first[i / 16][i % 16] = kFirst[part] + lane;
    t.second[i / 16][i % 16] = kSecond[part] + lane;
    const bool is_second = part == 2 || part == 4 || part == 5;
    if (is_second) t.is_second[i / 16] = static_cast<std::uint16_t>(t.is_second[i / 16] | 1U << (i % 16));
  }
  return t;
}

alignas(64) constexpr Interleave kInterleave3 = interleave_3();
alignas(64) constexpr Interleave kInterleaveTriangles = interleave_triangles();

inline void store_vectors(Vec3* to, F x, F y, F z) {
  for (int i = 0; i < 3; ++i) {
    const __m512 two = _mm512_permutex2var_ps(x.v, _mm512_load_si512(kInterleave3.first[i]), y.v);
    _mm512_storeu_ps(
        reinterpret_cast<float*>(to) + 16 * i,
        _mm512_mask_permutexvar_ps(two, kInterleave3.is_second[i], _mm512_load_si512(kInterleave3.second[i]), z.v));
  }
}

// Stores two triangles per lane: (a, b, c) and (a, c, d).
inline void store_triangles(std::uint32_t* to, I a, I b, I c, I d) {
  for (int i = 0; i < 6; ++i) {
    const __m512i ab = _mm512_permutex2var_epi32(a.v, _mm512_load_si512(kInterleaveTriangles.first[i]), b.v);
    const __m512i cd = _mm512_permutex2var_epi32(c.v, _mm512_load_si512(kInterleaveTriangles.second[i]), d.v);
    _mm512_storeu_si512(to + 16 * i, _mm512_mask_blend_epi32(kInterleaveTriangles.is_second[i], ab, cd));
  }
}

// Appends the places of a word's bits, where x starts at `first_place`.
inline std::uint16_t* append_compressed(std::uint64_t bits, __m512i low, __m512i high, std::uint16_t* end) {
  const auto low_bits = static_cast<std::uint32_t>(bits);
  const auto high_bits = static_cast<std::uint32_t>(bits >> 32);
  _mm512_storeu_si512(end, _mm512_maskz_compress_epi16(low_bits, low));
  end += std::popcount(low_bits);
  _mm512_storeu_si512(end, _mm512_maskz_compress_epi16(high_bits, high));
  return end + std::popcount(high_bits);
}

alignas(64) constexpr auto kColumns = [] {
  std::array<std::uint16_t, 64> columns{};
  for (std::size_t i = 0; i < 64; ++i) columns[i] = static_cast<std::uint16_t>(i);
  return columns;
}();

inline std::uint16_t* append_places(std::uint64_t bits, int first_place, std::uint16_t* end) {
  const __m512i first = _mm512_set1_epi16(static_cast<short>(first_place));
  return append_compressed(bits, _mm512_add_epi16(first, _mm512_load_si512(kColumns.data())),
                           _mm512_add_epi16(first, _mm512_load_si512(kColumns.data() + 32)), end);
}

inline std::uint16_t* append_edges(std::uint64_t bits, std::uint64_t solid, int first_place, std::uint16_t* end) {
  const __m512i first = _mm512_set1_epi16(static_cast<short>(first_place));
  const __m512i starts_solid = _mm512_set1_epi16(static_cast<short>(0x8000));
  const __m512i low = _mm512_add_epi16(first, _mm512_load_si512(kColumns.data()));
  const __m512i high = _mm512_add_epi16(first, _mm512_load_si512(kColumns.data() + 32));
  return append_compressed(bits, _mm512_mask_add_epi16(low, static_cast<std::uint32_t>(solid), low, starts_solid),
                           _mm512_mask_add_epi16(high, static_cast<std::uint32_t>(solid >> 32), high, starts_solid),
                           end);
}

// Occlusion processes two vertices at a time, in half a register each.
constexpr int kVerticesAtOnce = 2;

inline F load_rows(const float* const* from, std::ptrdiff_t offset) {
  return {_mm512_insertf32x8(_mm512_castps256_ps512(_mm256_loadu_ps(from[0] + offset)),
                             _mm256_loadu_ps(from[1] + offset), 1)};
}
// Repeats one value per vertex in all lanes of the vertex.
inline F spread_out(const float* from) {
  return {_mm512_insertf32x8(_mm512_castps256_ps512(_mm256_set1_ps(from[0])), _mm256_set1_ps(from[1]), 1)};
}
// In each vertex' eight lanes: selects the lanes of `a` at 0, step, 2 step, and then the same lanes of `b`, all offset
// by `by`.
class Thirds {
 public:
  Thirds(int step, int by) {
    alignas(64) std::int32_t lanes[16];
    for (int i = 0; i < 16; ++i) {
      const int part = i % 8;
      lanes[i] = part < 6 ? (part % 3) * step + by + (i / 8) * 8 + (part / 3) * 16 : 0;
    }
    lanes_ = _mm512_load_si512(lanes);
  }
  [[nodiscard]] F operator()(F a, F b) const { return {_mm512_permutex2var_ps(a.v, lanes_, b.v)}; }

 private:
  __m512i lanes_;
};

#else

// Gathers the pair of halves at each place, as one number.
inline I gather_pairs(const Half* base, I place) {
  return {_mm256_i32gather_epi32(reinterpret_cast<const int*>(base), place.v, 2)};
}
// Stores the first `count` lanes at their places.
inline void scatter(std::uint32_t* base, I place, I value, std::size_t count) {
  alignas(32) std::uint32_t places[8];
  alignas(32) std::uint32_t values[8];
  store(places, place);
  store(values, value);
  for (std::size_t i = 0; i < std::min<std::size_t>(count, 8); ++i) base[places[i]] = values[i];
}
// Converts halves to floats. None is infinite or NaN, so moving the bits and correcting the exponent is enough.
inline F load_halves(const Half* from) {
  const I halves = {_mm256_cvtepi16_epi32(_mm_loadu_si128(reinterpret_cast<const __m128i*>(from)))};
  return as_float(shift_left<13>(halves) & all(static_cast<int>(0x8FFFE000U))) * all(0x1p112F);
}

inline void store_vectors(Vec3* to, F x, F y, F z) {
  const __m256 xy[2] = {_mm256_unpacklo_ps(x.v, y.v), _mm256_unpackhi_ps(x.v, y.v)};
  const __m256 zz[2] = {_mm256_unpacklo_ps(z.v, z.v), _mm256_unpackhi_ps(z.v, z.v)};
  const __m256 lanes[4] = {_mm256_shuffle_ps(xy[0], zz[0], 0x44), _mm256_shuffle_ps(xy[0], zz[0], 0xEE),
                           _mm256_shuffle_ps(xy[1], zz[1], 0x44), _mm256_shuffle_ps(xy[1], zz[1], 0xEE)};
  // The next store overwrites the fourth number of each store.
  auto* const out = reinterpret_cast<float*>(to);
  for (int i = 0; i < 4; ++i) _mm_storeu_ps(out + 3 * i, _mm256_castps256_ps128(lanes[i]));
  for (int i = 0; i < 4; ++i) _mm_storeu_ps(out + 12 + 3 * i, _mm256_extractf128_ps(lanes[i], 1));
}

// Stores two triangles per lane: (a, b, c) and (a, c, d).
inline void store_triangles(std::uint32_t* to, I a, I b, I c, I d) {
  const __m256i ab[2] = {_mm256_unpacklo_epi32(a.v, b.v), _mm256_unpackhi_epi32(a.v, b.v)};
  const __m256i ca[2] = {_mm256_unpacklo_epi32(c.v, a.v), _mm256_unpackhi_epi32(c.v, a.v)};
  const __m256i cd[2] = {_mm256_unpacklo_epi32(c.v, d.v), _mm256_unpackhi_epi32(c.v, d.v)};
  const __m256i four[4] = {_mm256_unpacklo_epi64(ab[0], ca[0]), _mm256_unpackhi_epi64(ab[0], ca[0]),
                           _mm256_unpacklo_epi64(ab[1], ca[1]), _mm256_unpackhi_epi64(ab[1], ca[1])};
  alignas(32) std::uint64_t two[8];
  _mm256_store_si256(reinterpret_cast<__m256i*>(two), cd[0]);
  _mm256_store_si256(reinterpret_cast<__m256i*>(two + 4), cd[1]);
  constexpr int kTwo[8] = {0, 1, 4, 5, 2, 3, 6, 7};
  for (int i = 0; i < 8; ++i) {
    const __m128i abca = i < 4 ? _mm256_castsi256_si128(four[i]) : _mm256_extracti128_si256(four[i & 3], 1);
    _mm_storeu_si128(reinterpret_cast<__m128i*>(to + 6 * i), abca);
    std::memcpy(to + 6 * i + 4, &two[kTwo[i]], 8);
  }
}

// Occlusion processes one vertex at a time.
constexpr int kVerticesAtOnce = 1;

inline F load_rows(const float* const* from, std::ptrdiff_t offset) {
  return {_mm256_loadu_ps(from[0] + offset)};
}
// Repeats one value per vertex in all lanes of the vertex.
inline F spread_out(const float* from) {
  return {_mm256_set1_ps(from[0])};
}
// Selects the lanes of `a` at 0, step, 2 step, and then the same lanes of `b`, all offset by `by`, of eight lanes each.
class Thirds {
 public:
  Thirds(int step, int by) {
    alignas(32) std::int32_t lanes[8];
    for (int i = 0; i < 8; ++i) lanes[i] = i < 6 ? (i % 3) * step + by : 0;
    lanes_ = _mm256_load_si256(reinterpret_cast<const __m256i*>(lanes));
  }
  [[nodiscard]] F operator()(F a, F b) const {
    return {_mm256_blend_ps(_mm256_permutevar8x32_ps(a.v, lanes_), _mm256_permutevar8x32_ps(b.v, lanes_), 0x38)};
  }

 private:
  __m256i lanes_;
};

#endif

// Returns one bit per lane, set if it is at least 0.
inline std::uint32_t open_bits(F a) {
  return bits(all(0.0F) <= a);
}

}  // namespace
}  // namespace quoin::smooth
