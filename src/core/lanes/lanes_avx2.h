// Eight lanes in AVX2 registers.
//
//   F, I, Mask   | 0 | 1 | 2 | 3 | 4 | 5 | 6 | 7 |    32 bits each; in a mask all or none are set

#pragma once

#include <array>
#include <cstdint>

#include <immintrin.h>

namespace quoin::lanes_avx2 {
namespace {

constexpr int kWidth = 8;

struct Mask {
  __m256 v;
};
struct F {
  __m256 v;
};
struct I {
  __m256i v;
};

inline Mask operator&(Mask a, Mask b) {
  return {_mm256_and_ps(a.v, b.v)};
}
inline Mask operator|(Mask a, Mask b) {
  return {_mm256_or_ps(a.v, b.v)};
}
inline Mask operator~(Mask a) {
  return {_mm256_xor_ps(a.v, _mm256_castsi256_ps(_mm256_set1_epi32(-1)))};
}
inline std::uint32_t bits(Mask a) {
  return static_cast<std::uint32_t>(_mm256_movemask_ps(a.v));
}
inline bool any(Mask a) {
  return _mm256_movemask_ps(a.v) != 0;
}
inline Mask mask_of(std::uint32_t b) {
  const __m256i each = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
  const __m256i on = _mm256_and_si256(_mm256_set1_epi32(static_cast<int>(b)), each);
  return {_mm256_castsi256_ps(_mm256_cmpeq_epi32(on, each))};
}

inline F all(float x) {
  return {_mm256_set1_ps(x)};
}
inline I all(int x) {
  return {_mm256_set1_epi32(x)};
}
inline F operator+(F a, F b) {
  return {_mm256_add_ps(a.v, b.v)};
}
inline F operator-(F a, F b) {
  return {_mm256_sub_ps(a.v, b.v)};
}
inline F operator*(F a, F b) {
  return {_mm256_mul_ps(a.v, b.v)};
}
inline F operator/(F a, F b) {
  return {_mm256_div_ps(a.v, b.v)};
}
inline F min(F a, F b) {
  return {_mm256_min_ps(a.v, b.v)};
}
inline F max(F a, F b) {
  return {_mm256_max_ps(a.v, b.v)};
}
inline F abs(F a) {
  return {_mm256_andnot_ps(_mm256_set1_ps(-0.0F), a.v)};
}
inline F floor(F a) {
  return {_mm256_floor_ps(a.v)};
}
inline Mask operator<(F a, F b) {
  return {_mm256_cmp_ps(a.v, b.v, _CMP_LT_OQ)};
}
inline Mask operator<=(F a, F b) {
  return {_mm256_cmp_ps(a.v, b.v, _CMP_LE_OQ)};
}
inline Mask operator==(F a, F b) {
  return {_mm256_cmp_ps(a.v, b.v, _CMP_EQ_OQ)};
}
inline F select(Mask m, F a, F b) {
  return {_mm256_blendv_ps(b.v, a.v, m.v)};
}
inline F add_if(Mask m, F a, F b) {
  return {_mm256_add_ps(a.v, _mm256_and_ps(m.v, b.v))};
}

inline I operator+(I a, I b) {
  return {_mm256_add_epi32(a.v, b.v)};
}
inline I operator-(I a, I b) {
  return {_mm256_sub_epi32(a.v, b.v)};
}
inline Mask equals(I a, int b) {
  return {_mm256_castsi256_ps(_mm256_cmpeq_epi32(a.v, _mm256_set1_epi32(b)))};
}
inline I operator*(I a, I b) {
  return {_mm256_mullo_epi32(a.v, b.v)};
}
inline I operator&(I a, I b) {
  return {_mm256_and_si256(a.v, b.v)};
}
template <int kBits>
inline I shift_left(I a) {
  return {_mm256_slli_epi32(a.v, kBits)};
}
template <int kBits>
inline I shift_right(I a) {
  return {_mm256_srli_epi32(a.v, kBits)};
}
template <int kBits>
inline I shift_right_signed(I a) {
  return {_mm256_srai_epi32(a.v, kBits)};
}
inline I min_unsigned(I a, I b) {
  return {_mm256_min_epu32(a.v, b.v)};
}
inline I select(Mask m, I a, I b) {
  return {_mm256_blendv_epi8(b.v, a.v, _mm256_castps_si256(m.v))};
}
inline I add_if(Mask m, I a, I b) {
  return {_mm256_add_epi32(a.v, _mm256_and_si256(_mm256_castps_si256(m.v), b.v))};
}
// Tests if any of the bits of `b` is set in `a`.
inline Mask test(I a, I b) {
  const __m256i none = _mm256_cmpeq_epi32(_mm256_and_si256(a.v, b.v), _mm256_setzero_si256());
  return {_mm256_castsi256_ps(_mm256_xor_si256(none, _mm256_set1_epi32(-1)))};
}
// Tests bit `at % 32` of each lane by moving it to the sign.
inline Mask test_bit(I a, I at) {
  const __m256i up = _mm256_sub_epi32(_mm256_set1_epi32(31), _mm256_and_si256(at.v, _mm256_set1_epi32(31)));
  return {_mm256_castsi256_ps(_mm256_srai_epi32(_mm256_sllv_epi32(a.v, up), 31))};
}
inline I gather(const std::int32_t* base, I at) {
  return {_mm256_i32gather_epi32(base, at.v, 4)};
}
inline I gather(const std::uint32_t* base, I at) {
  return gather(reinterpret_cast<const std::int32_t*>(base), at);
}
inline F gather(const float* base, I at) {
  return {_mm256_i32gather_ps(base, at.v, 4)};
}
// Looks up entries of a table.
inline F look_up(const float (&table)[32], I index) {
  return gather(table, index);
}
inline I look_up(const std::int32_t (&table)[32], I index) {
  return gather(table, index);
}
inline F look_up(const std::array<float, 16>& table, I index) {
  return gather(table.data(), index);
}
inline I as_int(F a) {
  return {_mm256_castps_si256(a.v)};
}
inline F as_float(I a) {
  return {_mm256_castsi256_ps(a.v)};
}
inline I to_int(F a) {
  return {_mm256_cvttps_epi32(a.v)};
}
inline F to_float(I a) {
  return {_mm256_cvtepi32_ps(a.v)};
}
inline void store(std::int32_t* to, I a) {
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(to), a.v);
}
inline void store(std::uint32_t* to, I a) {
  store(reinterpret_cast<std::int32_t*>(to), a);
}
inline I load(const std::uint16_t* from) {
  return {_mm256_cvtepu16_epi32(_mm_loadu_si128(reinterpret_cast<const __m128i*>(from)))};
}
inline I load(const std::int32_t* from) {
  return {_mm256_loadu_si256(reinterpret_cast<const __m256i*>(from))};
}
inline F load(const float* from) {
  return {_mm256_loadu_ps(from)};
}
inline void store(float* to, F a) {
  _mm256_storeu_ps(to, a.v);
}

inline I operator|(I a, I b) {
  return {_mm256_or_si256(a.v, b.v)};
}
inline I operator^(I a, I b) {
  return {_mm256_xor_si256(a.v, b.v)};
}
inline F sqrt(F a) {
  return {_mm256_sqrt_ps(a.v)};
}
// Loads four numbers per lane from `base + at[lane]`.
inline void load_four(const float* base, const std::int32_t (&at)[kWidth], F& a, F& b, F& c, F& d) {
  // Each 128-bit part of a register holds the values of four neighbouring lanes.
  const auto rows = [&](int i) {
    return _mm256_insertf128_ps(_mm256_castps128_ps256(_mm_loadu_ps(base + at[i])), _mm_loadu_ps(base + at[i + 4]), 1);
  };
  const __m256 r0 = rows(0);
  const __m256 r1 = rows(1);
  const __m256 r2 = rows(2);
  const __m256 r3 = rows(3);
  const __m256d low01 = _mm256_castps_pd(_mm256_unpacklo_ps(r0, r1));
  const __m256d low23 = _mm256_castps_pd(_mm256_unpacklo_ps(r2, r3));
  const __m256d high01 = _mm256_castps_pd(_mm256_unpackhi_ps(r0, r1));
  const __m256d high23 = _mm256_castps_pd(_mm256_unpackhi_ps(r2, r3));
  a.v = _mm256_castpd_ps(_mm256_unpacklo_pd(low01, low23));
  b.v = _mm256_castpd_ps(_mm256_unpackhi_pd(low01, low23));
  c.v = _mm256_castpd_ps(_mm256_unpacklo_pd(high01, high23));
  d.v = _mm256_castpd_ps(_mm256_unpackhi_pd(high01, high23));
}
// Selects `a` where `which` has bits, otherwise `b`.
inline I merge(I which, I a, I b) {
  return {_mm256_or_si256(_mm256_and_si256(which.v, a.v), _mm256_andnot_si256(which.v, b.v))};
}
inline Mask operator<(I a, I b) {
  return {_mm256_castsi256_ps(_mm256_cmpgt_epi32(b.v, a.v))};
}
inline float least_of(F a) {
  __m128 least = _mm_min_ps(_mm256_castps256_ps128(a.v), _mm256_extractf128_ps(a.v, 1));
  least = _mm_min_ps(least, _mm_movehl_ps(least, least));
  return _mm_cvtss_f32(_mm_min_ss(least, _mm_movehdup_ps(least)));
}
inline float greatest_of(F a) {
  __m128 most = _mm_max_ps(_mm256_castps256_ps128(a.v), _mm256_extractf128_ps(a.v, 1));
  most = _mm_max_ps(most, _mm_movehl_ps(most, most));
  return _mm_cvtss_f32(_mm_max_ss(most, _mm_movehdup_ps(most)));
}

}  // namespace
}  // namespace quoin::lanes_avx2
