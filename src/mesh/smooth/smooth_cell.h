#pragma once

// The arithmetic of one cell of a density field and of its vertex' occlusion. Every kernel keeps this order of
// operations, without contraction, so all give the same bits.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include <quoin/core/vec.h>
#include <quoin/mesh/smooth.h>

#include "mesh/nets/cell.h"

namespace quoin::smooth {

/// The field of a chunk for cell_vertex: half floats. Their range allows a single division for four crossings.
struct HalfField {
  template <class D>
  [[nodiscard]] static NumberOf<D> sum_of_crossings(const D& d, int axis) {
    using F = NumberOf<D>;
    // The starts of the edges; the order decides how sums are rounded.
    constexpr int kStarts[3][4] = {{0, 2, 4, 6}, {0, 1, 4, 5}, {0, 1, 2, 3}};
    F n[4];
    F w[4];
    for (int i = 0; i < 4; ++i) {
      const F a = d[kStarts[axis][i]];
      const F b = d[kStarts[axis][i] + (1 << axis)];
      const auto is_crossed = signs_differ(a, b);
      n[i] = only(is_crossed, a);
      w[i] = select(is_crossed, a - b, all_of<F>(1.0F));
    }
    const F p = n[0] * w[1] + n[1] * w[0];
    const F q = w[0] * w[1];
    const F r = n[2] * w[3] + n[3] * w[2];
    const F s = w[2] * w[3];
    return (p * s + r * q) / (q * s);
  }
  template <class V>
  [[nodiscard]] static V normal_of(V gradient) {
    return unit_normal(gradient);
  }
};

inline CellVertex cell_vertex(const Corners& d) {
  return cell_vertex(HalfField{}, d, solid_corners(d));
}

/// Added and then subtracted to round numbers from -8 to 8 to multiples of 1/524,288.
inline constexpr float kSnapOffset = 24.0F;

/// The height of the lowest samples above a planar surface.
inline constexpr float kLift = 0.1F;
/// The published form treats depths below this as 0.
inline constexpr float kLeastDepth = 0.001F;

/// Returns the factor from samples of level 0 to cells of the level, for densities and spreads.
[[gnu::always_inline]] inline float depth_unit(int level) {
  return 1.0F / static_cast<float>(1 << level);
}

/// Returns the centre of a vertex' samples, relative to its cell's lowest corner. It is rounded, so that sums with
/// integers and spreads are exact, and the vertex' position and normal alone determine it, independent of the cell.
[[gnu::always_inline]] inline Vec3 occlusion_centre(Vec3 snapped, Vec3 n, float spread) {
  const float lift = spread * ((std::abs(n.x) + std::abs(n.y)) + std::abs(n.z)) + kLift;
  const auto at = [lift](float place, float along) { return place + ((along * lift + kSnapOffset) - kSnapOffset); };
  return {at(snapped.x, n.x), at(snapped.y, n.y), at(snapped.z, n.z)};
}

/// The lattice points below the three samples of one axis, and the fractions of the samples between lattice points.
struct SampleAxis {
  std::array<int, 3> base;
  std::array<float, 3> fraction;
};

[[gnu::always_inline]] inline SampleAxis sample_axis(float centre, float spread) {
  SampleAxis axis{};
  const float whole = std::floor(spread);
  for (int i = 0; i < 3; ++i) {
    // With an integer spread, all three samples have the same fraction, independent of the rounding of the sum.
    const float at = whole == spread ? centre : centre + static_cast<float>(i - 1) * spread;
    const float below = std::floor(at);
    axis.base[static_cast<std::size_t>(i)] =
        static_cast<int>(below) + (whole == spread ? (i - 1) * static_cast<int>(spread) : 0);
    axis.fraction[static_cast<std::size_t>(i)] = at - below;
  }
  return axis;
}

/// Returns the density at a position in a cell. Interpolates along z, y and x in turn.
template <class D, class Fraction>
NumberOf<D> interpolated(const D& corners, const Fraction& fraction) {
  using F = NumberOf<D>;
  const auto between = [](F a, F b, F f) { return a + f * (b - a); };
  F along_z[4];
  for (int i = 0; i < 4; ++i) along_z[i] = between(corners[i], corners[i + 4], fraction[2]);
  const F low = between(along_z[0], along_z[2], fraction[1]);
  return between(low, between(along_z[1], along_z[3], fraction[1]), fraction[0]);
}

/// Returns the solid share of 27 samples, given the number in air.
[[gnu::always_inline]] inline float solid_share(int in_air) {
  return 1.0F - static_cast<float>(in_air) * (1.0F / 27.0F);
}

/// Returns a depth in cells. Samples at least this deep always count as solid. A smaller depth would give spikes next
/// to corners with densities just below 0.
[[gnu::always_inline]] inline float whole_depth(float spread) {
  return spread * 0.125F;
}

/// Returns the solid share of a sample, 0 to 1. `solid` is interpolated like its density, but with 0 for the corners in
/// air.
[[gnu::always_inline]] inline float solidity(float density, float solid, float whole_depth) {
  return std::min(std::min(density, 0.0F) / std::min(solid, -whole_depth), 1.0F);
}

/// Returns the soft share from the sum of 27 samples' solidity.
[[gnu::always_inline]] inline float soft_share(float sum) {
  return std::min(sum * (1.0F / 27.0F), 1.0F);
}

/// Returns the occlusion of the weighted forms from the sum of the depths and the deepest (both at most 0).
[[gnu::always_inline]] inline float weighted_occlusion(float sum, float least, const SmoothOcclusionOptions& options) {
  float ratio = 0.0F;
  if (options.method == SmoothOcclusion::Weighted) {
    ratio = -sum / (27.0F * std::max(-least, options.spread));
  } else if (least <= -kLeastDepth) {
    ratio = sum / (27.0F * least);
  }
  const float base = ratio + options.offset;
  const bool squared = options.power == 2.0F;
  const float darkness = squared ? base * base : std::pow(base, options.power);
  // In the published form, open surfaces have the darkness of the offset.
  if (options.method == SmoothOcclusion::WeightedPublished) return std::clamp(darkness, 0.0F, 1.0F);
  const float open = squared ? options.offset * options.offset : std::pow(options.offset, options.power);
  return 1.0F - std::clamp((1.0F - darkness) / (1.0F - open), 0.0F, 1.0F);
}

/// Returns the occlusion from the samples' densities (for the soft share: from their solidity), ordered by z, then y,
/// then x.
[[gnu::always_inline]] inline float occlusion_of(const std::array<float, 27>& samples,
                                                 const SmoothOcclusionOptions& options) {
  const bool is_soft = options.method == SmoothOcclusion::SoftShare;
  if (options.method == SmoothOcclusion::SolidShare) {
    const auto open = std::count_if(samples.begin(), samples.end(), [](float v) { return v >= 0.0F; });
    return solid_share(static_cast<int>(open));
  }
  // Nine triples along x: even and odd ones are summed separately, as two halves of a register.
  std::array<std::array<float, 3>, 2> sums{};
  float least = 0.0F;
  for (std::size_t i = 0; i < 27; ++i) {
    const float v = is_soft ? samples[i] : std::min(samples[i], 0.0F);
    sums[i / 3 % 2][i % 3] += v;
    least = std::min(least, v);
  }
  const float sum = ((sums[0][0] + sums[1][0]) + (sums[0][1] + sums[1][1])) + (sums[0][2] + sums[1][2]);
  return is_soft ? soft_share(sum) : weighted_occlusion(sum, least, options);
}

/// Returns the occlusion of a vertex at a position in its cell. `density(x, y, z)` returns the lattice point at that
/// offset from the cell's lowest corner, in samples of the level.
template <class Density>
[[gnu::always_inline]] inline float occlusion_at_vertex(Vec3 snapped, Vec3 normal,
                                                        const SmoothOcclusionOptions& options, Density density) {
  const Vec3 centre = occlusion_centre(snapped, normal, options.spread);
  const std::array<SampleAxis, 3> axes = {sample_axis(centre.x, options.spread), sample_axis(centre.y, options.spread),
                                          sample_axis(centre.z, options.spread)};
  std::array<float, 27> samples{};
  for (std::size_t i = 0; i < 27; ++i) {
    const std::size_t ix = i % 3;
    const std::size_t iy = i / 3 % 3;
    const std::size_t iz = i / 9;
    const Vec3 fraction(axes[0].fraction[ix], axes[1].fraction[iy], axes[2].fraction[iz]);
    Corners corners;
    for (int c = 0; c < 8; ++c) {
      const IVec3 place = corner_place(c);
      corners[static_cast<std::size_t>(c)] =
          density(axes[0].base[ix] + place.x, axes[1].base[iy] + place.y, axes[2].base[iz] + place.z);
    }
    samples[i] = interpolated(corners, fraction);
    if (options.method != SmoothOcclusion::SoftShare) continue;
    if (samples[i] < 0.0F) {
      for (float& d : corners) d = std::min(d, 0.0F);
      samples[i] = solidity(samples[i], interpolated(corners, fraction), whole_depth(options.spread));
    } else {
      samples[i] = 0.0F;
    }
  }
  return occlusion_of(samples, options);
}

}  // namespace quoin::smooth
