// The kernel of kernel.h for registers of any width.
//
//   ShadeBlock   | point 0 | point 1 | ... | point 15 |     a register's width of them at a time
//     numbers -> sun, lamp, next direction

#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>

#include <quoin/core/assert.h>

#include "render/path/kernel/numbers.inl"

namespace quoin::path {
namespace {

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
}  // namespace quoin::path
