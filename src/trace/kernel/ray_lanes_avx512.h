// Additions for tracing to the sixteen lanes of core/lanes_avx512.h.

#pragma once

#include <immintrin.h>

#include "core/lanes/lanes_avx512.h"
#include "trace/tree_view.h"

namespace quoin::trace {
namespace {

using namespace lanes_avx512;

constexpr std::size_t kDoubles = 8;

inline __m512 join(__m256 low, __m256 high) {
  return _mm512_insertf32x8(_mm512_castps256_ps512(low), high, 1);
}

inline F narrow(const double* from) {
  return {join(_mm512_cvtpd_ps(_mm512_loadu_pd(from)), _mm512_cvtpd_ps(_mm512_loadu_pd(from + 8)))};
}

// Splits positions relative to a corner into multiples of 64 and a remainder, and rounds the remainder down to `whole`.
inline void split(const double* from, double corner, I& base, F& rest, F& whole) {
  constexpr int kDown = _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC;
  const __m512d low = _mm512_sub_pd(_mm512_loadu_pd(from), _mm512_set1_pd(corner));
  const __m512d high = _mm512_sub_pd(_mm512_loadu_pd(from + 8), _mm512_set1_pd(corner));
  const __m512i floor = _mm512_inserti64x4(_mm512_castsi256_si512(_mm512_cvt_roundpd_epi32(low, kDown)),
                                           _mm512_cvt_roundpd_epi32(high, kDown), 1);
  base.v = _mm512_and_si512(floor, _mm512_set1_epi32(~63));
  const __m512d low_base = _mm512_cvtepi32_pd(_mm512_castsi512_si256(base.v));
  const __m512d high_base = _mm512_cvtepi32_pd(_mm512_extracti64x4_epi64(base.v, 1));
  rest.v = join(_mm512_cvtpd_ps(_mm512_sub_pd(low, low_base)), _mm512_cvtpd_ps(_mm512_sub_pd(high, high_base)));
  whole.v = _mm512_cvtepi32_ps(_mm512_and_si512(floor, _mm512_set1_epi32(63)));
}

// Returns a number below a non-negative number: at least as large as all numbers that are smaller by 1e-30 or more.
inline F just_below(F a) {
  const __mmask16 is_positive = _mm512_cmp_ps_mask(a.v, _mm512_setzero_ps(), _CMP_GT_OQ);
  const __m512i less = _mm512_mask_sub_epi32(_mm512_castps_si512(_mm512_set1_ps(-1e-30F)), is_positive,
                                             _mm512_castps_si512(a.v), _mm512_set1_epi32(1));
  return {_mm512_castsi512_ps(less)};
}

// Adds signed bytes with saturation.
inline I add_saturated_bytes(I a, I b) {
  return {_mm512_adds_epi8(a.v, b.v)};
}

// Gathers words of 64 bits, as two halves: two gathers of eight take half the time of two of sixteen.
inline void gather_words(const std::uint32_t* base, I at, I& low, I& high) {
  const auto each = static_cast<__mmask8>(each_lane());
  const auto eight = [&](__m256i half) {
    return _mm512_mask_i32gather_epi64(_mm512_setzero_si512(), each, half, base, sizeof *base);
  };
  const __m512i a = eight(_mm512_castsi512_si256(at.v));
  const __m512i b = eight(_mm512_extracti64x4_epi64(at.v, 1));
  const __m512i even = _mm512_setr_epi32(0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30);
  low.v = _mm512_permutex2var_epi32(a, even, b);
  high.v = _mm512_permutex2var_epi32(a, _mm512_or_si512(even, _mm512_set1_epi32(1)), b);
}

// A mispredicted branch takes longer than packing.
constexpr bool kPacksFast = true;
// Selects lanes that store_packed writes without gaps.
using Packing = Mask;
inline Packing packing_of(Mask which) {
  return which;
}
// Writes the selected lanes without gaps. The numbers after them, up to sixteen in all, are 0.
inline void store_packed(std::int32_t* to, Packing packing, I a) {
  _mm512_storeu_si512(to, _mm512_maskz_compress_epi32(packing.m, a.v));
}

// Looks up entry `at % 16`, or `at % 32`, of a table.
inline I from_16(I table, I at) {
  return {_mm512_permutexvar_epi32(at.v, table.v)};
}
inline I from_32(const std::int32_t* table, I at) {
  return {_mm512_permutex2var_epi32(load(table).v, at.v, load(table + 16).v)};
}
// The codes of 4^3 bricks; bricks outside the table are empty.
class BrickWindow {
 public:
  BrickWindow(const TreeView& tree, const IVec3& origin) {
    const IVec3 first = origin >> 4;
    const std::uint32_t* corner =
        tree.bricks + first.x + first.y * tree.brick_strides.y + first.z * tree.brick_strides.z;
    const __m128i columns = _mm_add_epi32(_mm_set1_epi32(first.x), _mm_setr_epi32(0, 1, 2, 3));
    const __mmask8 is_in = _mm_cmplt_epu32_mask(columns, _mm_set1_epi32(tree.brick_sizes.x));
    const auto is_below = [](int at, int size) { return static_cast<unsigned>(at) < static_cast<unsigned>(size); };
    for (int z = 0; z < 4; ++z) {
      const bool has_layer = is_below(first.z + z, tree.brick_sizes.z);
      const auto row = [&](int y) {
        const bool has_row = has_layer && is_below(first.y + y, tree.brick_sizes.y);
        const auto columns_in = static_cast<__mmask8>(is_in & -static_cast<int>(has_row));
        return _mm_maskz_loadu_epi32(columns_in, corner + y * tree.brick_strides.y + z * tree.brick_strides.z);
      };
      const __m256i low = _mm256_inserti128_si256(_mm256_castsi128_si256(row(0)), row(1), 1);
      const __m256i high = _mm256_inserti128_si256(_mm256_castsi128_si256(row(2)), row(3), 1);
      layers_[z] = _mm512_inserti64x4(_mm512_castsi256_si512(low), high, 1);
    }
  }
  // Returns the codes of bricks by x + 4 y + 16 z.
  [[nodiscard]] I brick(I place) const {
    const __m512i low = _mm512_permutex2var_epi32(layers_[0], place.v, layers_[1]);
    const __m512i high = _mm512_permutex2var_epi32(layers_[2], place.v, layers_[3]);
    return select(test(place, all(32)), I{high}, I{low});
  }

 private:
  __m512i layers_[4];
};

}  // namespace
}  // namespace quoin::trace
