// Additions for smooth meshing to core/lanes_avx2.h.

#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>

#include <immintrin.h>

#include <quoin/core/half.h>
#include <quoin/core/vec.h>

#include "core/lanes/lanes_avx2.h"

namespace quoin::smooth {
namespace {

using namespace lanes_avx2;

inline Mask equal(I a, I b) {
  return {_mm256_castsi256_ps(_mm256_cmpeq_epi32(a.v, b.v))};
}
// Returns the lanes with different signs.
inline Mask signs_differ(F a, F b) {
  return {_mm256_castsi256_ps(_mm256_srai_epi32(_mm256_castps_si256(_mm256_xor_ps(a.v, b.v)), 31))};
}
inline F only(Mask m, F a) {
  return {_mm256_and_ps(a.v, m.v)};
}
inline I min(I a, I b) {
  return {_mm256_min_epi32(a.v, b.v)};
}

inline I load_words(const std::uint16_t* from) {
  return {_mm256_cvtepu16_epi32(_mm_loadu_si128(reinterpret_cast<const __m128i*>(from)))};
}
inline void store(void* to, I a) {
  _mm256_storeu_si256(static_cast<__m256i*>(to), a.v);
}
// Gathers the pair of halves at each place, as one number.
inline I gather_pairs(const Half* base, I place) {
  return {_mm256_i32gather_epi32(reinterpret_cast<const int*>(base), place.v, 2)};
}
inline F gather(const float* base, I place) {
  return {_mm256_i32gather_ps(base, place.v, 4)};
}
inline F look_up(const std::array<float, 16>& table, I index) {
  return gather(table.data(), index);
}
inline F look_up(const float (&table)[32], I index) {
  return gather(table, index);
}
inline I gather(const std::int32_t* base, I at) {
  return {_mm256_i32gather_epi32(base, at.v, 4)};
}
inline I look_up(const std::int32_t (&table)[32], I index) {
  return gather(table, index);
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
// Returns one bit per lane, set if it is at least 0.
inline std::uint32_t open_bits(F a) {
  return static_cast<std::uint32_t>(_mm256_movemask_ps(_mm256_cmp_ps(a.v, _mm256_setzero_ps(), _CMP_GE_OQ)));
}

}  // namespace
}  // namespace quoin::smooth
