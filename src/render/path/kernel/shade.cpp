// The kernel of shade.h for registers of any width.
//
//   ShadeBlock   | point 0 | point 1 | ... | point 15 |     a register's width of them at a time
//     numbers -> sun, lamp, next direction

#include <cstddef>
#include <cstdint>
#include <limits>

#include <quoin/core/assert.h>

#include "core/lanes/lanes.h"
#include "render/path/kernel/shade.h"

namespace quoin::path {
namespace {

// ---- numbers: path_math.h lane by lane, the same operations in the same order

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

// ---- lamps -------------------------------------------------------------------------------------------------------

struct Measures {
  Vector middle;
  F power;
  Vector half;
  F squared;
  Vector axis;
  F beyond;
};

inline Measures measures_at(const float* from, const std::int32_t (&at)[kWidth]) {
  Measures m;
  load_four(from, at, m.middle.x, m.middle.y, m.middle.z, m.power);
  load_four(from + 4, at, m.half.x, m.half.y, m.half.z, m.squared);
  load_four(from + 8, at, m.axis.x, m.axis.y, m.axis.z, m.beyond);
  return m;
}

// As LightTree::importance.
inline F importance_lanes(const Measures& of, const Vector& point, const Vector& normal, const Vector& normal_size,
                          Mask in_air) {
  const F none = all(0.0F);
  const Vector way = of.middle - point;
  const F distance2 = max(dot(way, way), of.squared);
  const F distance = sqrt(distance2);
  const F before = select(in_air, distance, dot(way, normal) + dot(of.half, normal_size));
  const F shone = of.beyond - dot(way, of.axis);
  const F light = of.power * min(before, distance) * min(shone, distance) / (distance2 * distance2);
  return select((none < before) & (none < shone), light, none);
}

inline F share_at(const float* shares, I at) {
  return as_float(gather(reinterpret_cast<const std::uint32_t*>(shares), at));
}

struct Chosen {
  I lamp;
  F probability;
};

inline Chosen choose_lanes(const LampBranch* branches, const float* shares, I table, const Vector& point,
                           const Vector& normal, F u, Mask active) {
  constexpr float kBelowOne = 0x1.fffffep-1F;
  static_assert(sizeof(LampBranch) == 128 && sizeof(LampMeasures) == 48);
  const Vector size{abs(normal.x), abs(normal.y), abs(normal.z)};
  const Mask in_air = ~(all(0.0F) < max(max(size.x, size.y), size.z));
  Chosen chosen{all(-1), all(0.0F)};
  F probability = all(1.0F);
  alignas(64) std::int32_t at[kWidth] = {};
  I node = all(0);
  const auto* base = reinterpret_cast<const float*>(branches);
  while (any(active)) {
    store(at, shift_left<5>(node));
    F next[4];
    load_four(base + 24, at, next[0], next[1], next[2], next[3]);
    const F of_first = importance_lanes(measures_at(base, at), point, normal, size, in_air) *
                       share_at(shares, table + as_int(next[2]));
    const F of_second = importance_lanes(measures_at(base + 12, at), point, normal, size, in_air) *
                        share_at(shares, table + as_int(next[3]));
    const F both = of_first + of_second;
    active = active & (all(0.0F) < both);
    const F share = of_first / both;
    const Mask is_first = u < share;
    const F rest = all(1.0F) - share;
    u = min(select(is_first, u, u - share) / select(is_first, share, rest), all(kBelowOne));
    probability = probability * select(is_first, share, rest);
    node = select(is_first, as_int(next[0]), as_int(next[1]));
    const Mask is_lamp = node < all(0);
    const Mask ends = active & is_lamp;
    chosen.lamp = select(ends, node ^ all(-1), chosen.lamp);
    chosen.probability = select(ends, probability, chosen.probability);
    active = active & ~is_lamp;
    node = select(active, node, all(0));
  }
  return chosen;
}

inline void choose(const LampBranch* branches, const float* shares, LampBlock& block, std::size_t at,
                   const Vector& normal, F u) {
  const Chosen chosen = choose_lanes(branches, shares, lanes::load(block.table + at), load(block.point, at), normal, u,
                                     mask_of(block.active >> at));
  lanes::store(block.lamp + at, chosen.lamp);
  lanes::store(block.probability + at, chosen.probability);
}

void choose_lamps(const LampBranch* branches, const float* shares, LampBlock& block) {
  QUOIN_ASSERT(branches != nullptr && shares != nullptr, "a tree with a table of shares");
  for (std::size_t at = 0; at < kBlockPoints; at += kWidth) {
    choose(branches, shares, block, at, load(block.normal, at), lanes::load(block.u + at));
  }
}

// ---- matte surfaces ----------------------------------------------------------------------------------------------

// Turns a smooth normal that points away from the viewer.
inline Vector facing(const Vector& normal, const Vector& direction) {
  const F towards = negative(dot(normal, direction));
  const F least = all(1e-3F);
  return select(towards < least, unit(normal - direction * (least - towards)), normal);
}

inline Vector sample_sun_lanes(const ShadeLight& light, Two u) {
  if (!(light.one_less_cos > 0.0F)) return all_of(light.to_sun);
  const F down = u.x * all(light.one_less_cos);
  const F across = sqrt(down * (all(2.0F) - down));
  const Turn turn = of_turns_lanes(u.y);
  const Axes axes(all_of(light.sun_frame[0]), all_of(light.sun_frame[1]), all_of(light.sun_frame[2]));
  return unit(axes.to_world({across * turn.cosine, across * turn.sine, all(1.0F) - down}));
}

inline void shade_sun(const ShadeLight& light, ShadeBlock& block, std::size_t at, const Numbers& numbers, I dimension,
                      const Vector& normal, const Vector& throughput, const Vector& colour) {
  const Vector sun = sample_sun_lanes(light, numbers.pair(dimension + word(dimension::kSun)));
  store(block.sun, at, sun);
  const F cosine = sun.x * normal.x + sun.y * normal.y + sun.z * normal.z;
  const F value = cosine / all(kPiLanes);
  Vector lit = throughput * (colour * value);
  if (light.one_less_cos > 0.0F) {
    const F density = all(light.sun_density);
    const F share = density / (density + value);
    const auto part = [&](float radiance) { return all(radiance) / density * share; };
    lit = lit * Vector{part(light.sun_radiance[0]), part(light.sun_radiance[1]), part(light.sun_radiance[2])};
  } else {
    lit = lit * all_of(light.sun_radiance);
  }
  const F none = all(0.0F);
  store(block.sun_light, at, select(none < cosine, lit, Vector{none, none, none}));
}

inline void shade_next(ShadeBlock& block, std::size_t at, const Numbers& numbers, I dimension, const Vector& normal) {
  const Two u = numbers.pair(dimension + word(dimension::kDirection));
  lanes::store(block.pair[0] + at, u.x);
  lanes::store(block.pair[1] + at, u.y);
  const Vector local = cosine_weighted_lanes(u);
  const Vector next = unit(Axes(normal).to_world(local));
  store(block.next, at, next);
  lanes::store(block.next_density + at, local.z / all(kPiLanes));
  lanes::store(block.next_bin + at, bin_lanes(next));
}

inline void shade_lamps(const ShadeLight& light, ShadeBlock& block, std::size_t at, const Numbers& numbers, I dimension,
                        const Vector& normal) {
  const Two u = numbers.pair(dimension + word(dimension::kLampPoint));
  lanes::store(block.lamp_pair[0] + at, u.x);
  lanes::store(block.lamp_pair[1] + at, u.y);
  const Mask in_air = mask_of(block.in_air >> at);
  const F none = all(0.0F);
  choose(light.lamps, light.shares, block.lamps, at, select(in_air, Vector{none, none, none}, normal),
         numbers.one(dimension + word(dimension::kLampChoice)));
}

void shade(const ShadeLight& light, ShadeBlock& block) {
  QUOIN_ASSERT(light.lamps == nullptr || light.shares != nullptr, "lamps with a table of shares");
  for (std::size_t at = 0; at < kBlockPoints; at += kWidth) {
    const Numbers numbers{load(block.pixel + at), reversed_lanes(load(block.sample + at))};
    const I dimension = load(block.dimension + at);
    const Vector normal = facing(load(block.normal, at), load(block.direction, at));
    store(block.normal, at, normal);
    if (light.has_sun) {
      shade_sun(light, block, at, numbers, dimension, normal, load(block.throughput, at), load(block.colour, at));
    }
    if (light.lamps != nullptr) {
      const Numbers of_lamps{numbers.pixel ^ word(light.lamp_numbers), numbers.sample};
      shade_lamps(light, block, at, of_lamps, dimension, normal);
    }
    shade_next(block, at, numbers, dimension, normal);
  }
}

void pairs(const BlockLanes<std::uint32_t>& pixel, std::uint32_t sample, std::uint32_t dimension, BlockLanes<float>& x,
           BlockLanes<float>& y) {
  for (std::size_t at = 0; at < kBlockPoints; at += kWidth) {
    const Numbers numbers{load(pixel + at), reversed_lanes(word(sample))};
    const Two u = numbers.pair(word(dimension));
    lanes::store(x + at, u.x);
    lanes::store(y + at, u.y);
  }
}

}  // namespace

constinit const Kernel QUOIN_KERNEL(Kernel) = {&shade, &choose_lamps, &pairs};

#ifndef QUOIN_KERNEL_AVX2
constinit const KernelTable<Kernel> kKernels = QUOIN_KERNEL_TABLE(Kernel, Avx512);
#endif

}  // namespace quoin::path
