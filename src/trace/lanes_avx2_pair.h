// Sixteen lanes in pairs of AVX2 registers: what one half waits for, the other works through. Included within a
// namespace and a target region, after <immintrin.h>.

namespace half {
#include "trace/lanes_avx2.h"
}  // namespace half

using half::kDoubles;
using half::mask3;

constexpr int kWidth = 2 * half::kWidth;

struct Mask {
  half::Mask low, high;
};
struct F {
  half::F low, high;
};
struct I {
  half::I low, high;
};

inline Mask operator&(Mask a, Mask b) {
  return {a.low & b.low, a.high & b.high};
}
inline Mask operator|(Mask a, Mask b) {
  return {a.low | b.low, a.high | b.high};
}
inline Mask operator~(Mask a) {
  return {~a.low, ~a.high};
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
inline F operator+(F a, F b) {
  return {a.low + b.low, a.high + b.high};
}
inline F operator-(F a, F b) {
  return {a.low - b.low, a.high - b.high};
}
inline F operator*(F a, F b) {
  return {a.low * b.low, a.high * b.high};
}
inline F operator/(F a, F b) {
  return {a.low / b.low, a.high / b.high};
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
inline Mask operator<(F a, F b) {
  return {a.low < b.low, a.high < b.high};
}
inline Mask operator<=(F a, F b) {
  return {a.low <= b.low, a.high <= b.high};
}
inline Mask operator==(F a, F b) {
  return {a.low == b.low, a.high == b.high};
}
inline F select(Mask m, F a, F b) {
  return {half::select(m.low, a.low, b.low), half::select(m.high, a.high, b.high)};
}
inline F add_if(Mask m, F a, F b) {
  return {half::add_if(m.low, a.low, b.low), half::add_if(m.high, a.high, b.high)};
}

inline I operator+(I a, I b) {
  return {a.low + b.low, a.high + b.high};
}
inline I operator-(I a, I b) {
  return {a.low - b.low, a.high - b.high};
}
inline I operator*(I a, I b) {
  return {a.low * b.low, a.high * b.high};
}
inline I operator&(I a, I b) {
  return {a.low & b.low, a.high & b.high};
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
inline I select(Mask m, I a, I b) {
  return {half::select(m.low, a.low, b.low), half::select(m.high, a.high, b.high)};
}
inline I add_if(Mask m, I a, I b) {
  return {half::add_if(m.low, a.low, b.low), half::add_if(m.high, a.high, b.high)};
}
inline Mask test(I a, I b) {
  return {half::test(a.low, b.low), half::test(a.high, b.high)};
}
inline Mask test_bit(I a, I at) {
  return {half::test_bit(a.low, at.low), half::test_bit(a.high, at.high)};
}
inline Mask operator<(I a, I b) {
  return {a.low < b.low, a.high < b.high};
}
inline I or_of(I a, I b) {
  return {half::or_of(a.low, b.low), half::or_of(a.high, b.high)};
}
inline I merge(I which, I a, I b) {
  return {half::merge(which.low, a.low, b.low), half::merge(which.high, a.high, b.high)};
}
inline I gather(const std::uint32_t* base, I at) {
  return {half::gather(base, at.low), half::gather(base, at.high)};
}
inline I to_int(F a) {
  return {half::to_int(a.low), half::to_int(a.high)};
}
inline F to_float(I a) {
  return {half::to_float(a.low), half::to_float(a.high)};
}
inline void store(std::int32_t* to, I a) {
  half::store(to, a.low);
  half::store(to + half::kWidth, a.high);
}
inline void store(float* to, F a) {
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

inline I as_bits(F a) {
  return {half::as_bits(a.low), half::as_bits(a.high)};
}
inline F just_below(F a) {
  return {half::just_below(a.low), half::just_below(a.high)};
}
inline float least_of(F a) {
  const __m256 v = _mm256_min_ps(a.low.v, a.high.v);
  __m128 least = _mm_min_ps(_mm256_castps256_ps128(v), _mm256_extractf128_ps(v, 1));
  least = _mm_min_ps(least, _mm_movehl_ps(least, least));
  return _mm_cvtss_f32(_mm_min_ss(least, _mm_movehdup_ps(least)));
}

class BrickWindow {
 public:
  BrickWindow(const TreeView& tree, const IVec3& origin) : window_(tree, origin) {}
  [[nodiscard]] I brick(I place) const { return {window_.brick(place.low), window_.brick(place.high)}; }

 private:
  half::BrickWindow window_;
};
