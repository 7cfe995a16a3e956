// Whole numbers below, where instructions round downwards. Included within a namespace and a target region.

inline F4 floor_of(F4 a) {
  return reinterpret_cast<F4>(_mm_floor_ps(reinterpret_cast<__m128>(a)));
}
inline D4 floor_of(D4 a) {
  return reinterpret_cast<D4>(_mm256_floor_pd(reinterpret_cast<__m256d>(a)));
}
