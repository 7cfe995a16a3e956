// What tracing adds to core/lanes_avx2.h. Included within a namespace and a target region.

#include "core/lanes_avx2.h"

constexpr std::size_t kDoubles = 4;

inline F narrow(const double* from) {
  return {_mm256_set_m128(_mm256_cvtpd_ps(_mm256_loadu_pd(from + 4)), _mm256_cvtpd_ps(_mm256_loadu_pd(from)))};
}

// Positions, from a corner, as multiples of 64 and what is left of them, and the whole number below what is left.
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

inline I as_bits(F a) {
  return {_mm256_castps_si256(a.v)};
}
inline F just_below(F a) {
  const __m256 less = _mm256_castsi256_ps(_mm256_sub_epi32(_mm256_castps_si256(a.v), _mm256_set1_epi32(1)));
  const __m256 is_positive = _mm256_cmp_ps(a.v, _mm256_setzero_ps(), _CMP_GT_OQ);
  return {_mm256_blendv_ps(_mm256_set1_ps(-1e-30F), less, is_positive)};
}

// The indices of 4^3 bricks.
class BrickWindow {
 public:
  BrickWindow(const TreeView& tree, const IVec3& origin) {
    const std::uint32_t* corner =
        tree.bricks + (origin.x >> 4) + (origin.y >> 4) * tree.brick_strides.y + (origin.z >> 4) * tree.brick_strides.z;
    for (int row = 0; row < 16; ++row) {
      const std::uint32_t* from = corner + (row & 3) * tree.brick_strides.y + (row >> 2) * tree.brick_strides.z;
      _mm_store_si128(reinterpret_cast<__m128i*>(bricks_ + 4 * row),
                      _mm_loadu_si128(reinterpret_cast<const __m128i*>(from)));
    }
  }
  // By x + 4 y + 16 z; further bits do not count.
  [[nodiscard]] I brick(I place) const { return gather(bricks_, place & all(63)); }

 private:
  alignas(32) std::uint32_t bricks_[64];
};

// The sign bits of the first three.
template <class I4>
inline int mask3(I4 a) {
  return _mm_movemask_ps(_mm_castsi128_ps(reinterpret_cast<__m128i>(a))) & 7;
}
