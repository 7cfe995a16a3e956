// Sixteen lanes in AVX-512 registers.
//
//   F, I   | 0 | 1 | 2 | ... |15 |    32 bits each
//   Mask   one bit per lane, in a mask register

#pragma once

#include <array>
#include <cstdint>

#include <immintrin.h>

namespace quoin::lanes_avx512 {
namespace {

constexpr int kWidth = 16;

struct Mask {
  __mmask16 m;
};
struct F {
  __m512 v;
};
struct I {
  __m512i v;
};

inline Mask operator&(Mask a, Mask b) {
  return {static_cast<__mmask16>(a.m & b.m)};
}
inline Mask operator|(Mask a, Mask b) {
  return {static_cast<__mmask16>(a.m | b.m)};
}
inline Mask operator~(Mask a) {
  return {static_cast<__mmask16>(~a.m)};
}
inline bool any(Mask a) {
  return a.m != 0;
}
inline std::uint32_t bits(Mask a) {
  return a.m;
}
inline Mask mask_of(std::uint32_t b) {
  return {static_cast<__mmask16>(b)};
}

inline F all(float x) {
  return {_mm512_set1_ps(x)};
}
inline I all(int x) {
  return {_mm512_set1_epi32(x)};
}
inline F operator+(F a, F b) {
  return {_mm512_add_ps(a.v, b.v)};
}
inline F operator-(F a, F b) {
  return {_mm512_sub_ps(a.v, b.v)};
}
inline F operator*(F a, F b) {
  return {_mm512_mul_ps(a.v, b.v)};
}
inline F operator/(F a, F b) {
  return {_mm512_div_ps(a.v, b.v)};
}
inline F min(F a, F b) {
  return {_mm512_min_ps(a.v, b.v)};
}
inline F max(F a, F b) {
  return {_mm512_max_ps(a.v, b.v)};
}
inline F abs(F a) {
  return {_mm512_abs_ps(a.v)};
}
inline F floor(F a) {
  return {_mm512_roundscale_ps(a.v, _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC)};
}
inline Mask operator<(F a, F b) {
  return {_mm512_cmp_ps_mask(a.v, b.v, _CMP_LT_OQ)};
}
inline Mask operator<=(F a, F b) {
  return {_mm512_cmp_ps_mask(a.v, b.v, _CMP_LE_OQ)};
}
inline Mask operator==(F a, F b) {
  return {_mm512_cmp_ps_mask(a.v, b.v, _CMP_EQ_OQ)};
}
inline F select(Mask m, F a, F b) {
  return {_mm512_mask_blend_ps(m.m, b.v, a.v)};
}
inline F add_if(Mask m, F a, F b) {
  return {_mm512_mask_add_ps(a.v, m.m, a.v, b.v)};
}

inline I operator+(I a, I b) {
  return {_mm512_add_epi32(a.v, b.v)};
}
inline I operator-(I a, I b) {
  return {_mm512_sub_epi32(a.v, b.v)};
}
inline Mask equals(I a, int b) {
  return {_mm512_cmpeq_epi32_mask(a.v, _mm512_set1_epi32(b))};
}
inline I operator*(I a, I b) {
  return {_mm512_mullo_epi32(a.v, b.v)};
}
inline I operator&(I a, I b) {
  return {_mm512_and_si512(a.v, b.v)};
}
template <int kBits>
inline I shift_left(I a) {
  return {_mm512_slli_epi32(a.v, kBits)};
}
template <int kBits>
inline I shift_right(I a) {
  return {_mm512_srli_epi32(a.v, kBits)};
}
template <int kBits>
inline I shift_right_signed(I a) {
  return {_mm512_srai_epi32(a.v, kBits)};
}
inline I min_unsigned(I a, I b) {
  return {_mm512_min_epu32(a.v, b.v)};
}
inline I select(Mask m, I a, I b) {
  return {_mm512_mask_blend_epi32(m.m, b.v, a.v)};
}
inline I add_if(Mask m, I a, I b) {
  return {_mm512_mask_add_epi32(a.v, m.m, a.v, b.v)};
}
// Tests if any of the bits of `b` is set in `a`.
inline Mask test(I a, I b) {
  return {_mm512_test_epi32_mask(a.v, b.v)};
}
// Tests bit `at % 32` of each lane.
inline Mask test_bit(I a, I at) {
  return test(I{_mm512_rorv_epi32(a.v, at.v)}, I{_mm512_set1_epi32(1)});
}
// Returns a mask of all lanes that compilers cannot recognise as full. With a known full mask they gather into an
// arbitrary register, and the processor waits for its content, often that of the last gather.
inline __mmask16 each_lane() {
  __mmask16 each = 0xFFFF;
  __asm__("" : "+Yk"(each));
  return each;
}
inline I gather(const std::int32_t* base, I at) {
  return {_mm512_mask_i32gather_epi32(_mm512_setzero_si512(), each_lane(), at.v, base, 4)};
}
inline I gather(const std::uint32_t* base, I at) {
  return gather(reinterpret_cast<const std::int32_t*>(base), at);
}
inline F gather(const float* base, I at) {
  return {_mm512_i32gather_ps(at.v, base, 4)};
}
// Looks up entries of a table in one or two registers. Requires: tables of 32 are aligned to 64 bytes.
inline F look_up(const float (&table)[32], I index) {
  return {_mm512_permutex2var_ps(_mm512_load_ps(table), index.v, _mm512_load_ps(table + 16))};
}
inline I look_up(const std::int32_t (&table)[32], I index) {
  return {_mm512_permutex2var_epi32(_mm512_load_si512(table), index.v, _mm512_load_si512(table + 16))};
}
inline F look_up(const std::array<float, 16>& table, I index) {
  return {_mm512_permutexvar_ps(index.v, _mm512_loadu_ps(table.data()))};
}
inline I as_int(F a) {
  return {_mm512_castps_si512(a.v)};
}
inline F as_float(I a) {
  return {_mm512_castsi512_ps(a.v)};
}
inline I to_int(F a) {
  return {_mm512_cvttps_epi32(a.v)};
}
inline F to_float(I a) {
  return {_mm512_cvtepi32_ps(a.v)};
}
inline void store(std::int32_t* to, I a) {
  _mm512_storeu_si512(to, a.v);
}
inline void store(std::uint32_t* to, I a) {
  _mm512_storeu_si512(to, a.v);
}
inline I load(const std::uint16_t* from) {
  return {_mm512_cvtepu16_epi32(_mm256_loadu_si256(reinterpret_cast<const __m256i*>(from)))};
}
inline I load(const std::int32_t* from) {
  return {_mm512_loadu_si512(from)};
}
inline F load(const float* from) {
  return {_mm512_loadu_ps(from)};
}
inline void store(float* to, F a) {
  _mm512_storeu_ps(to, a.v);
}

inline I operator|(I a, I b) {
  return {_mm512_or_si512(a.v, b.v)};
}
inline I operator^(I a, I b) {
  return {_mm512_xor_si512(a.v, b.v)};
}
inline F sqrt(F a) {
  return {_mm512_sqrt_ps(a.v)};
}
// Loads four numbers per lane from `base + at[lane]`.
inline void load_four(const float* base, const std::int32_t (&at)[kWidth], F& a, F& b, F& c, F& d) {
  // Each 128-bit part of a register holds the values of four neighbouring lanes.
  const auto rows = [&](int i) {
    __m512 four = _mm512_castps128_ps512(_mm_loadu_ps(base + at[i]));
    four = _mm512_insertf32x4(four, _mm_loadu_ps(base + at[i + 4]), 1);
    four = _mm512_insertf32x4(four, _mm_loadu_ps(base + at[i + 8]), 2);
    return _mm512_insertf32x4(four, _mm_loadu_ps(base + at[i + 12]), 3);
  };
  const __m512 r0 = rows(0);
  const __m512 r1 = rows(1);
  const __m512 r2 = rows(2);
  const __m512 r3 = rows(3);
  const __m512d low01 = _mm512_castps_pd(_mm512_unpacklo_ps(r0, r1));
  const __m512d low23 = _mm512_castps_pd(_mm512_unpacklo_ps(r2, r3));
  const __m512d high01 = _mm512_castps_pd(_mm512_unpackhi_ps(r0, r1));
  const __m512d high23 = _mm512_castps_pd(_mm512_unpackhi_ps(r2, r3));
  a.v = _mm512_castpd_ps(_mm512_unpacklo_pd(low01, low23));
  b.v = _mm512_castpd_ps(_mm512_unpackhi_pd(low01, low23));
  c.v = _mm512_castpd_ps(_mm512_unpacklo_pd(high01, high23));
  d.v = _mm512_castpd_ps(_mm512_unpackhi_pd(high01, high23));
}
// Selects `a` where `which` has bits, otherwise `b`.
inline I merge(I which, I a, I b) {
  return {_mm512_ternarylogic_epi32(which.v, a.v, b.v, 0xCA)};
}
inline Mask operator<(I a, I b) {
  return {_mm512_cmplt_epi32_mask(a.v, b.v)};
}
inline float least_of(F a) {
  return _mm512_reduce_min_ps(a.v);
}
inline float greatest_of(F a) {
  return _mm512_reduce_max_ps(a.v);
}

}  // namespace
}  // namespace quoin::lanes_avx512
