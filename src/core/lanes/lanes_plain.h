// Four lanes in plain C++; compilers map them to the instructions of the build's baseline. NaN behaves as in x86-64, in
// comparisons and in the operand that `min` and `max` choose.

#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>

namespace quoin::lanes_plain {
namespace {

constexpr int kWidth = 4;

struct Mask {
  std::uint32_t m;
};
struct F {
  float v[4];
};
struct I {
  std::int32_t v[4];
};

template <class Vector, class Of>
inline Vector each(Of of) {
  return {{of(0), of(1), of(2), of(3)}};
}
template <class Of>
inline Mask mask_where(Of of) {
  return {std::uint32_t{of(0)} | std::uint32_t{of(1)} << 1 | std::uint32_t{of(2)} << 2 | std::uint32_t{of(3)} << 3};
}

inline Mask operator&(Mask a, Mask b) {
  return {a.m & b.m};
}
inline Mask operator|(Mask a, Mask b) {
  return {a.m | b.m};
}
inline Mask operator~(Mask a) {
  return {~a.m & 0xFU};
}
inline bool any(Mask a) {
  return a.m != 0;
}
inline std::uint32_t bits(Mask a) {
  return a.m;
}
inline Mask mask_of(std::uint32_t b) {
  return {b & 0xFU};
}
inline F all(float x) {
  return {{x, x, x, x}};
}
inline I all(int x) {
  return {{x, x, x, x}};
}
inline F operator+(F a, F b) {
  return each<F>([&](int i) { return a.v[i] + b.v[i]; });
}
inline F operator-(F a, F b) {
  return each<F>([&](int i) { return a.v[i] - b.v[i]; });
}
inline F operator*(F a, F b) {
  return each<F>([&](int i) { return a.v[i] * b.v[i]; });
}
inline F operator/(F a, F b) {
  return each<F>([&](int i) { return a.v[i] / b.v[i]; });
}
inline F min(F a, F b) {
  return each<F>([&](int i) { return a.v[i] < b.v[i] ? a.v[i] : b.v[i]; });
}
inline F max(F a, F b) {
  return each<F>([&](int i) { return a.v[i] > b.v[i] ? a.v[i] : b.v[i]; });
}
inline F abs(F a) {
  return each<F>([&](int i) { return std::fabs(a.v[i]); });
}
inline F floor(F a) {
  return each<F>([&](int i) { return std::floor(a.v[i]); });
}
inline F sqrt(F a) {
  return each<F>([&](int i) { return std::sqrt(a.v[i]); });
}
// Integer arithmetic wraps around.
template <class Of>
inline I each_word(Of of) {
  return each<I>([&](int i) { return static_cast<std::int32_t>(of(i)); });
}
inline std::uint32_t word(I a, int i) {
  return static_cast<std::uint32_t>(a.v[i]);
}
inline I operator+(I a, I b) {
  return each_word([&](int i) { return word(a, i) + word(b, i); });
}
inline I operator-(I a, I b) {
  return each_word([&](int i) { return word(a, i) - word(b, i); });
}
inline I operator*(I a, I b) {
  return each_word([&](int i) { return word(a, i) * word(b, i); });
}
inline I operator&(I a, I b) {
  return each_word([&](int i) { return word(a, i) & word(b, i); });
}
inline I operator|(I a, I b) {
  return each_word([&](int i) { return word(a, i) | word(b, i); });
}
inline I operator^(I a, I b) {
  return each_word([&](int i) { return word(a, i) ^ word(b, i); });
}
template <int kBits>
inline I shift_left(I a) {
  return each_word([&](int i) { return word(a, i) << kBits; });
}
template <int kBits>
inline I shift_right(I a) {
  return each_word([&](int i) { return word(a, i) >> kBits; });
}
inline Mask equals(I a, int b) {
  return mask_where([&](int i) { return a.v[i] == b; });
}
inline F to_float(I a) {
  return each<F>([&](int i) { return static_cast<float>(a.v[i]); });
}
inline I as_int(F a) {
  I b;
  std::memcpy(b.v, a.v, sizeof(a.v));
  return b;
}
inline F as_float(I a) {
  F b;
  std::memcpy(b.v, a.v, sizeof(a.v));
  return b;
}
inline Mask operator<(F a, F b) {
  return mask_where([&](int i) { return a.v[i] < b.v[i]; });
}
inline Mask operator<=(F a, F b) {
  return mask_where([&](int i) { return a.v[i] <= b.v[i]; });
}
inline Mask operator==(F a, F b) {
  return mask_where([&](int i) { return a.v[i] == b.v[i]; });
}
inline Mask operator<(I a, I b) {
  return mask_where([&](int i) { return a.v[i] < b.v[i]; });
}
inline F select(Mask m, F a, F b) {
  return each<F>([&](int i) { return (m.m >> i & 1U) != 0 ? a.v[i] : b.v[i]; });
}
inline I select(Mask m, I a, I b) {
  return each<I>([&](int i) { return (m.m >> i & 1U) != 0 ? a.v[i] : b.v[i]; });
}
// Tests if any of the bits of `b` is set in `a`.
inline Mask test(I a, I b) {
  return mask_where([&](int i) { return (a.v[i] & b.v[i]) != 0; });
}
inline I to_int(F a) {
  return each<I>([&](int i) { return static_cast<std::int32_t>(a.v[i]); });
}
// Loads four numbers per lane from `base + at[lane]`.
inline void load_four(const float* base, const std::int32_t (&at)[kWidth], F& a, F& b, F& c, F& d) {
  for (int i = 0; i < kWidth; ++i) {
    a.v[i] = base[at[i]];
    b.v[i] = base[at[i] + 1];
    c.v[i] = base[at[i] + 2];
    d.v[i] = base[at[i] + 3];
  }
}
inline I gather(const std::uint32_t* base, I at) {
  return each_word([&](int i) { return base[at.v[i]]; });
}
inline F load(const float* from) {
  return each<F>([&](int i) { return from[i]; });
}
inline I load(const std::int32_t* from) {
  return each<I>([&](int i) { return from[i]; });
}
inline void store(float* to, F a) {
  std::memcpy(to, a.v, sizeof(a.v));
}
inline void store(std::int32_t* to, I a) {
  std::memcpy(to, a.v, sizeof(a.v));
}
inline float greatest_of(F a) {
  const float low = a.v[0] > a.v[1] ? a.v[0] : a.v[1];
  const float high = a.v[2] > a.v[3] ? a.v[2] : a.v[3];
  return low > high ? low : high;
}

}  // namespace
}  // namespace quoin::lanes_plain
