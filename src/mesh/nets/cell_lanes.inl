// Lanes of cells: additions to core/lanes that cell.h and both meshers need.

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include <immintrin.h>

#include "core/lanes/lanes.h"
#include "mesh/nets/cell.h"

#ifdef QUOIN_KERNEL_AVX512

namespace quoin::lanes_avx512 {
namespace {

// Returns the lanes with different signs.
inline Mask signs_differ(F a, F b) {
  return {_mm512_movepi32_mask(_mm512_castps_si512(_mm512_xor_ps(a.v, b.v)))};
}
inline F only(Mask m, F a) {
  return {_mm512_maskz_mov_ps(m.m, a.v)};
}

#else

namespace quoin::lanes_avx2 {
namespace {

// Returns the lanes with different signs.
inline Mask signs_differ(F a, F b) {
  return {_mm256_castsi256_ps(_mm256_srai_epi32(_mm256_castps_si256(_mm256_xor_ps(a.v, b.v)), 31))};
}
inline F only(Mask m, F a) {
  return {_mm256_and_ps(a.v, m.v)};
}

#endif

inline I look_up(const std::array<std::uint32_t, 256>& table, I index) {
  return gather(table.data(), index);
}
template <int kByte>
inline I byte_of(I a) {
  if constexpr (kByte == 0) return a & all(0xFF);
  if constexpr (kByte == 3) return shift_right<24>(a);
  return shift_right<8 * kByte>(a) & all(0xFF);
}
inline F guess_of_root(F x) {
  return as_float(all(0x5F3759DF) - shift_right<1>(as_int(x)));
}

}  // namespace
}  // namespace quoin::lanes

namespace quoin::smooth {

template <>
inline lanes::F all_of<lanes::F>(float value) {
  return lanes::all(value);
}

}  // namespace quoin::smooth
