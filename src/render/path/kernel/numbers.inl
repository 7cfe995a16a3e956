// path_random.h and path_math.h, lane by lane: the same operations in the same order.

#pragma once

#include <cstdint>

#include "core/lanes/lanes.h"
#include "render/path/kernel/kernel.h"

namespace quoin::path {
namespace {

using namespace lanes;

constexpr float kPiLanes = 3.14159265358979323846F;

struct Vector {
  F x, y, z;
};
struct Two {
  F x, y;
};

inline I word(std::uint32_t bits) {
  return all(static_cast<int>(bits));
}
inline I load(const std::uint32_t* from) {
  return lanes::load(reinterpret_cast<const std::int32_t*>(from));
}
inline F negative(F a) {
  return as_float(as_int(a) ^ word(0x8000'0000U));
}
template <std::size_t kOf>
inline Vector load(const float (&from)[3][kOf], std::size_t at) {
  return {lanes::load(from[0] + at), lanes::load(from[1] + at), lanes::load(from[2] + at)};
}
template <std::size_t kOf>
inline void store(float (&to)[3][kOf], std::size_t at, const Vector& v) {
  lanes::store(to[0] + at, v.x);
  lanes::store(to[1] + at, v.y);
  lanes::store(to[2] + at, v.z);
}
inline Vector all_of(const float (&v)[3]) {
  return {all(v[0]), all(v[1]), all(v[2])};
}
inline Vector operator+(const Vector& a, const Vector& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
inline Vector operator-(const Vector& a, const Vector& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
inline Vector operator*(const Vector& a, const Vector& b) {
  return {a.x * b.x, a.y * b.y, a.z * b.z};
}
inline Vector operator*(const Vector& a, F b) {
  return {a.x * b, a.y * b, a.z * b};
}
inline Vector select(Mask m, const Vector& a, const Vector& b) {
  return {select(m, a.x, b.x), select(m, a.y, b.y), select(m, a.z, b.z)};
}
inline F dot(const Vector& a, const Vector& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
inline Vector unit(const Vector& v) {
  return v * (all(1.0F) / sqrt(dot(v, v)));
}

// ---- random numbers ----------------------------------------------------------------------------------------------

inline I mix_lanes(I x) {
  x = (x ^ shift_right<16>(x)) * word(0x7FEB'352DU);
  x = (x ^ shift_right<15>(x)) * word(0x846C'A68BU);
  return x ^ shift_right<16>(x);
}
template <int kBits>
inline I swapped(I x, std::uint32_t mask) {
  return (shift_right<kBits>(x) & word(mask)) | shift_left<kBits>(x & word(mask));
}
inline I reversed_lanes(I x) {
  x = swapped<1>(x, 0x5555'5555U);
  x = swapped<2>(x, 0x3333'3333U);
  x = swapped<4>(x, 0x0F0F'0F0FU);
  x = swapped<8>(x, 0x00FF'00FFU);
  return shift_right<16>(x) | shift_left<16>(x);
}
inline I pascal_lanes(I x) {
  x = x ^ (shift_right<1>(x) & word(0x5555'5555U));
  x = x ^ (shift_right<2>(x) & word(0x3333'3333U));
  x = x ^ (shift_right<4>(x) & word(0x0F0F'0F0FU));
  x = x ^ (shift_right<8>(x) & word(0x00FF'00FFU));
  return x ^ (shift_right<16>(x) & word(0x0000'FFFFU));
}
inline I scrambled_lanes(I x, I seed) {
  x = x ^ x * word(0x3D20'ADEAU);
  x = x + seed;
  x = x * (shift_right<16>(seed) | word(1U));
  x = x ^ x * word(0x0552'6C56U);
  return x ^ x * word(0x53A2'2864U);
}
inline F unit_lanes(I bits) {
  return to_float(shift_right<8>(bits)) * all(0x1p-24F);
}

// Random.
struct Numbers {
  I pixel;
  I sample;  // its bits in reverse order

  [[nodiscard]] Two pair(I dimension) const {
    const I seed = seed_of(dimension);
    const I index = reversed_lanes(scrambled_lanes(sample, seed));
    const I other = seed * word(0x85EB'CA6BU) ^ shift_right<13>(seed);
    const I first = scrambled_lanes(index, other * word(0xC2B2'AE35U) + word(1U));
    const I second = scrambled_lanes(pascal_lanes(index), other * word(0x27D4'EB2FU) + word(0x1656'67B1U));
    return {unit_lanes(reversed_lanes(first)), unit_lanes(reversed_lanes(second))};
  }
  [[nodiscard]] F one(I dimension) const {
    const I seed = seed_of(dimension);
    const I index = reversed_lanes(scrambled_lanes(sample, seed));
    return unit_lanes(reversed_lanes(scrambled_lanes(index, seed * word(0x85EB'CA6BU) + word(1U))));
  }

 private:
  [[nodiscard]] I seed_of(I dimension) const { return mix_lanes(pixel ^ dimension * word(0x9E37'79B9U)); }
};

// ---- angles and directions ---------------------------------------------------------------------------------------

struct Turn {
  F sine, cosine;
};

inline Turn of_turns_lanes(F turns) {
  const F quarters = turns * all(4.0F);
  const I nearest = shift_right<1>(to_int(turns * all(8.0F) + all(1.0F)));
  const F x = (quarters - to_float(nearest)) * all(kPiLanes / 2.0F);
  const F xx = x * x;
  const F one = all(1.0F);
  const F sine = x * (one + xx * (all(-1.0F / 6.0F) + xx * (all(1.0F / 120.0F) +
                                                            xx * (all(-1.0F / 5040.0F) + xx * all(1.0F / 362880.0F)))));
  const F cosine =
      one + xx * (all(-0.5F) + xx * (all(1.0F / 24.0F) +
                                     xx * (all(-1.0F / 720.0F) + xx * (all(1.0F / 40320.0F) - xx / all(3628800.0F)))));
  const Mask is_odd = test(nearest, word(1U));
  const Mask is_low = test(nearest, word(2U));              // the sine's sign
  const Mask is_back = test(nearest + word(1U), word(2U));  // the cosine's
  const F s = select(is_odd, cosine, sine);
  const F c = select(is_odd, sine, cosine);
  return {select(is_low, negative(s), s), select(is_back, negative(c), c)};
}

inline Two on_disc_lanes(Two u) {
  const F a = all(2.0F) * u.x - all(1.0F);
  const F b = all(2.0F) * u.y - all(1.0F);
  const Mask is_wide = abs(b) < abs(a);
  const F radius = select(is_wide, a, b);
  const Mask is_middle = radius == all(0.0F);
  const F ratio = select(is_wide, b, a) / select(is_middle, all(1.0F), radius);
  F turns = ratio * all(0.125F);
  turns = select(is_wide, turns, all(0.25F) - turns);
  turns = select(turns < all(0.0F), turns + all(1.0F), turns);
  const Turn angle = of_turns_lanes(turns);
  return {radius * angle.cosine, radius * angle.sine};
}

inline Vector cosine_weighted_lanes(Two u) {
  const Two disc = on_disc_lanes(u);
  const F up = all(1.0F) - disc.x * disc.x - disc.y * disc.y;
  return {disc.x, disc.y, sqrt(max(all(0.0F), up))};
}

// Frame.
struct Axes {
  Vector x, y, z;

  explicit Axes(const Vector& normal) : z(normal) {
    const F one = all(1.0F);
    const F sign = as_float((as_int(normal.z) & word(0x8000'0000U)) | as_int(one));
    const F a = all(-1.0F) / (sign + normal.z);
    const F b = normal.x * normal.y * a;
    x = {one + sign * normal.x * normal.x * a, sign * b, negative(sign) * normal.x};
    y = {b, sign + normal.y * normal.y * a, negative(normal.y)};
  }
  Axes(const Vector& along_x, const Vector& along_y, const Vector& along_z) : x(along_x), y(along_y), z(along_z) {}
  [[nodiscard]] Vector to_world(const Vector& v) const { return x * v.x + y * v.y + z * v.z; }
};

inline I bin_lanes(const Vector& d) {
  const F x = abs(d.x);
  const F y = abs(d.y);
  const F z = abs(d.z);
  const Mask by_z = ((y <= x) & ~(z <= x)) | ~((y <= x) | (z <= y));
  const Mask by_y = ~(y <= x) & ~by_z;
  const F size = select(by_z, z, select(by_y, y, x));
  const F along = select(by_z, d.z, select(by_y, d.y, d.x));
  const F next = select(by_z, d.x, select(by_y, d.z, d.y));
  const F last = select(by_z, d.y, select(by_y, d.x, d.z));
  const F scale = all(2.0F) / max(size, all(1e-20F));
  const auto step = [&](F v) { return to_int(min(max(v * scale + all(2.0F), all(0.0F)), all(3.0F))); };
  const I axis = select(by_z, word(4U), select(by_y, word(2U), word(0U)));
  const I side = select(along < all(0.0F), word(1U), word(0U));
  return word(1U) + shift_left<4>(axis + side) + shift_left<2>(step(next)) + step(last);
}

}  // namespace
}  // namespace quoin::path
