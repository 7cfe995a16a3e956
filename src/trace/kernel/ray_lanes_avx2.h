// Sixteen lanes in pairs of AVX2 registers: one half computes while the other waits for results.
//
//   F, I, Mask   low  | 0 | 1 | 2 | 3 | 4 | 5 | 6 | 7 |     half::F, half::I, half::Mask
//                high | 8 | 9 |10 |11 |12 |13 |14 |15 |

#pragma once

#include <bit>

#include <immintrin.h>

#include "core/lanes/lanes_avx2.h"
#include "trace/tree_view.h"

namespace quoin::trace {
namespace {

// Eight lanes: additions for tracing to core/lanes_avx2.h.
namespace half {

using namespace lanes_avx2;

constexpr std::size_t kDoubles = 4;

inline F narrow(const double* from) {
  return {_mm256_set_m128(_mm256_cvtpd_ps(_mm256_loadu_pd(from + 4)), _mm256_cvtpd_ps(_mm256_loadu_pd(from)))};
}

// Splits positions relative to a corner into multiples of 64 and a remainder, and rounds the remainder down to `whole`.
inline void split(const double* from, double corner, I& base, F& rest, F& whole) {
  __m128i b[2];
  __m128 r[2];
  __m128 w[2];
  for (int half = 0; half < 2; ++half) {
    const __m256d x = _mm256_sub_pd(_mm256_loadu_pd(from + 4 * half), _mm256_set1_pd(corner));
    const __m256d v = _mm256_floor_pd(x);
    const __m256d start =
        _mm256_mul_pd(_mm256_floor_pd(_mm256_mul_pd(x, _mm256_set1_pd(0.015625))), _mm256_set1_pd(64.0));
    b[half] = _mm256_cvttpd_epi32(start);
    r[half] = _mm256_cvtpd_ps(_mm256_sub_pd(x, start));
    w[half] = _mm256_cvtpd_ps(_mm256_sub_pd(v, start));
  }
  base.v = _mm256_set_m128i(b[1], b[0]);
  rest.v = _mm256_set_m128(r[1], r[0]);
  whole.v = _mm256_set_m128(w[1], w[0]);
}

// Adds signed bytes with saturation.
inline I add_saturated_bytes(I a, I b) {
  return {_mm256_adds_epi8(a.v, b.v)};
}

inline F just_below(F a) {
  const __m256 less = _mm256_castsi256_ps(_mm256_sub_epi32(_mm256_castps_si256(a.v), _mm256_set1_epi32(1)));
  const __m256 is_positive = _mm256_cmp_ps(a.v, _mm256_setzero_ps(), _CMP_GT_OQ);
  return {_mm256_blendv_ps(_mm256_set1_ps(-1e-30F), less, is_positive)};
}

// The numbers of the lanes of a mask, without gaps; then 0.
inline __m256i lane_numbers(std::uint32_t mask) {
  const std::uint64_t bytes = _pdep_u64(mask, 0x0101'0101'0101'0101U) * 0xFFU;
  const std::uint64_t numbers = _pext_u64(0x0706'0504'0302'0100U, bytes);
  return _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(static_cast<std::int64_t>(numbers)));
}

// The codes of 4^3 bricks; bricks outside the table are empty.
class BrickWindow {
 public:
  BrickWindow(const TreeView& tree, const IVec3& origin) {
    const IVec3 first = origin >> 4;
    const std::uint32_t* corner =
        tree.bricks + first.x + first.y * tree.brick_strides.y + first.z * tree.brick_strides.z;
    const __m128i columns = _mm_add_epi32(_mm_set1_epi32(first.x), _mm_setr_epi32(0, 1, 2, 3));
    const __m128i is_in = _mm_and_si128(_mm_cmpgt_epi32(columns, _mm_set1_epi32(-1)),
                                        _mm_cmpgt_epi32(_mm_set1_epi32(tree.brick_sizes.x), columns));
    const auto is_below = [](int at, int size) { return static_cast<unsigned>(at) < static_cast<unsigned>(size); };
    for (int row = 0; row < 16; ++row) {
      const int y = row & 3, z = row >> 2;
      const bool has_row = is_below(first.y + y, tree.brick_sizes.y) && is_below(first.z + z, tree.brick_sizes.z);
      const std::uint32_t* from = corner + y * tree.brick_strides.y + z * tree.brick_strides.z;
      _mm_store_si128(reinterpret_cast<__m128i*>(bricks_ + 4 * row),
                      has_row ? _mm_maskload_epi32(reinterpret_cast<const int*>(from), is_in) : _mm_setzero_si128());
    }
  }
  // Returns the codes of bricks by x + 4 y + 16 z; further bits are ignored.
  [[nodiscard]] I brick(I place) const { return gather(bricks_, place & all(63)); }

 private:
  alignas(32) std::uint32_t bricks_[64];
};

}  // namespace half

using half::kDoubles;

constexpr int kWidth = 2 * half::kWidth;

template <class T>
struct Pair {
  T low, high;
};
using Mask = Pair<half::Mask>;
using F = Pair<half::F>;
using I = Pair<half::I>;

template <class T>
inline Pair<T> operator+(Pair<T> a, Pair<T> b) {
  return {a.low + b.low, a.high + b.high};
}
template <class T>
inline Pair<T> operator-(Pair<T> a, Pair<T> b) {
  return {a.low - b.low, a.high - b.high};
}
template <class T>
inline Pair<T> operator*(Pair<T> a, Pair<T> b) {
  return {a.low * b.low, a.high * b.high};
}
inline F operator/(F a, F b) {
  return {a.low / b.low, a.high / b.high};
}
template <class T>
inline Pair<T> operator&(Pair<T> a, Pair<T> b) {
  return {a.low & b.low, a.high & b.high};
}
template <class T>
inline Pair<T> operator|(Pair<T> a, Pair<T> b) {
  return {a.low | b.low, a.high | b.high};
}
inline Mask operator~(Mask a) {
  return {~a.low, ~a.high};
}
template <class T>
inline Mask operator<(Pair<T> a, Pair<T> b) {
  return {a.low < b.low, a.high < b.high};
}
inline Mask operator<=(F a, F b) {
  return {a.low <= b.low, a.high <= b.high};
}
inline Mask operator==(F a, F b) {
  return {a.low == b.low, a.high == b.high};
}
inline std::uint32_t bits(Mask a) {
  return half::bits(a.low) | half::bits(a.high) << half::kWidth;
}
inline bool any(Mask a) {
  return half::any(a.low | a.high);
}
inline Mask mask_of(std::uint32_t b) {
  return {half::mask_of(b & 0xFFU), half::mask_of(b >> half::kWidth)};
}
inline F all(float x) {
  return {half::all(x), half::all(x)};
}
inline I all(int x) {
  return {half::all(x), half::all(x)};
}
inline F min(F a, F b) {
  return {half::min(a.low, b.low), half::min(a.high, b.high)};
}
inline F max(F a, F b) {
  return {half::max(a.low, b.low), half::max(a.high, b.high)};
}
inline F abs(F a) {
  return {half::abs(a.low), half::abs(a.high)};
}
inline F floor(F a) {
  return {half::floor(a.low), half::floor(a.high)};
}
inline F just_below(F a) {
  return {half::just_below(a.low), half::just_below(a.high)};
}
template <class T>
inline Pair<T> select(Mask m, Pair<T> a, Pair<T> b) {
  return {half::select(m.low, a.low, b.low), half::select(m.high, a.high, b.high)};
}
template <class T>
inline Pair<T> add_if(Mask m, Pair<T> a, Pair<T> b) {
  return {half::add_if(m.low, a.low, b.low), half::add_if(m.high, a.high, b.high)};
}
inline Mask equals(I a, int b) {
  return {half::equals(a.low, b), half::equals(a.high, b)};
}
template <int kBits>
inline I shift_left(I a) {
  return {half::shift_left<kBits>(a.low), half::shift_left<kBits>(a.high)};
}
template <int kBits>
inline I shift_right(I a) {
  return {half::shift_right<kBits>(a.low), half::shift_right<kBits>(a.high)};
}
template <int kBits>
inline I shift_right_signed(I a) {
  return {half::shift_right_signed<kBits>(a.low), half::shift_right_signed<kBits>(a.high)};
}
inline I min_unsigned(I a, I b) {
  return {half::min_unsigned(a.low, b.low), half::min_unsigned(a.high, b.high)};
}
inline Mask test(I a, I b) {
  return {half::test(a.low, b.low), half::test(a.high, b.high)};
}
inline Mask test_bit(I a, I at) {
  return {half::test_bit(a.low, at.low), half::test_bit(a.high, at.high)};
}
inline I merge(I which, I a, I b) {
  return {half::merge(which.low, a.low, b.low), half::merge(which.high, a.high, b.high)};
}
inline I add_saturated_bytes(I a, I b) {
  return {half::add_saturated_bytes(a.low, b.low), half::add_saturated_bytes(a.high, b.high)};
}
inline I gather(const std::uint32_t* base, I at) {
  return {half::gather(base, at.low), half::gather(base, at.high)};
}
// Gathers words of 64 bits, as two halves.
inline void gather_words(const std::uint32_t* base, I at, I& low, I& high) {
  low = gather(base, at);
  high = gather(base, at + all(1));
}
inline I as_int(F a) {
  return {half::as_int(a.low), half::as_int(a.high)};
}
inline I to_int(F a) {
  return {half::to_int(a.low), half::to_int(a.high)};
}
inline F as_float(I a) {
  return {half::as_float(a.low), half::as_float(a.high)};
}
inline F to_float(I a) {
  return {half::to_float(a.low), half::to_float(a.high)};
}
template <class T, class V>
inline void store(T* to, Pair<V> a) {
  half::store(to, a.low);
  half::store(to + half::kWidth, a.high);
}
inline I load(const std::int32_t* from) {
  return {half::load(from), half::load(from + half::kWidth)};
}
inline F narrow(const double* from) {
  return {half::narrow(from), half::narrow(from + half::kWidth)};
}
inline void split(const double* from, double corner, I& base, F& rest, F& whole) {
  half::split(from, corner, base.low, rest.low, whole.low);
  half::split(from + half::kWidth, corner, base.high, rest.high, whole.high);
}
// Packing takes longer than a branch around it.
constexpr bool kPacksFast = false;
// Selects lanes that store_packed writes without gaps.
struct Packing {
  __m256i low, high;  // the source lane of each number written
  int low_count;
};
inline Packing packing_of(Mask which) {
  const std::uint32_t low = half::bits(which.low);
  return {half::lane_numbers(low), half::lane_numbers(half::bits(which.high)), std::popcount(low)};
}
// Writes the selected lanes without gaps. The numbers after them, up to sixteen in all, are unspecified.
inline void store_packed(std::int32_t* to, const Packing& packing, I a) {
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(to), _mm256_permutevar8x32_epi32(a.low.v, packing.low));
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(to + packing.low_count),
                      _mm256_permutevar8x32_epi32(a.high.v, packing.high));
}

// Looks up entry `at % 16` of a table.
inline I from_16(I table, I at) {
  const auto look_up = [&](half::I place) {
    const half::I low = {_mm256_permutevar8x32_epi32(table.low.v, place.v)};
    const half::I high = {_mm256_permutevar8x32_epi32(table.high.v, place.v)};
    return half::select(half::test(place, half::all(half::kWidth)), high, low);
  };
  return {look_up(at.low), look_up(at.high)};
}

inline float least_of(F a) {
  return half::least_of(half::min(a.low, a.high));
}

class BrickWindow {
 public:
  BrickWindow(const TreeView& tree, const IVec3& origin) : window_(tree, origin) {}
  [[nodiscard]] I brick(I place) const { return {window_.brick(place.low), window_.brick(place.high)}; }

 private:
  half::BrickWindow window_;
};

}  // namespace
}  // namespace quoin::trace
