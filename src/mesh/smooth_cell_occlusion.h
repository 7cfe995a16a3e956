#pragma once

// The occlusion of one vertex, in the order of arithmetic that every kernel keeps. No contraction.

#include <algorithm>
#include <array>
#include <cmath>

#include <quoin/core/vec.h>
#include <quoin/mesh/smooth.h>

namespace quoin::smooth {

/// How far above the surface the lowest samples of a plane lie.
inline constexpr float kLift = 0.1F;
/// The published form counts depths below this as none.
inline constexpr float kLeastDepth = 0.001F;

/// What densities are multiplied by, so that depths count in samples of the level, as the spread does.
inline float depth_unit(int level) {
  return 1.0F / static_cast<float>(1 << level);
}

/// Where a vertex is sampled about, relative to its cell's lowest corner.
inline Vec3 occlusion_centre(Vec3 fraction, Vec3 n, float spread) {
  const float lift = spread * ((std::abs(n.x) + std::abs(n.y)) + std::abs(n.z)) + kLift;
  return {fraction.x + n.x * lift, fraction.y + n.y * lift, fraction.z + n.z * lift};
}

/// The lattice points around the three samples of one axis, and where between them they lie.
struct SampleAxis {
  std::array<int, 3> base;
  std::array<float, 3> fraction;
};

inline SampleAxis sample_axis(float centre, float spread) {
  SampleAxis axis{};
  const float whole = std::floor(spread);
  for (int i = 0; i < 3; ++i) {
    // With whole spreads all three have one fraction, whatever the rounding of the sum.
    const float at = whole == spread ? centre : centre + static_cast<float>(i - 1) * spread;
    const float below = std::floor(at);
    axis.base[static_cast<std::size_t>(i)] =
        static_cast<int>(below) + (whole == spread ? (i - 1) * static_cast<int>(spread) : 0);
    axis.fraction[static_cast<std::size_t>(i)] = at - below;
  }
  return axis;
}

/// What the weighted forms make of the sum of the depths and the deepest (both at most 0).
inline float weighted_openness(float sum, float least, const SmoothOcclusionOptions& options) {
  float ratio = 0.0F;
  if (options.form == SmoothOcclusion::Weighted) {
    ratio = -sum / (27.0F * std::max(-least, options.spread));
  } else if (least <= -kLeastDepth) {
    ratio = sum / (27.0F * least);
  }
  const float base = ratio + options.offset;
  const bool squared = options.power == 2.0F;
  const float darkness = squared ? base * base : std::pow(base, options.power);
  const float open = squared ? options.offset * options.offset : std::pow(options.offset, options.power);
  return std::clamp((1.0F - darkness) / (1.0F - open), 0.0F, 1.0F);
}

/// Occlusion from the samples' densities, which come by z, then y, then x.
inline float openness_of(const std::array<float, 27>& samples, const SmoothOcclusionOptions& options) {
  if (options.form == SmoothOcclusion::Openness) {
    const auto open = std::count_if(samples.begin(), samples.end(), [](float v) { return v >= 0.0F; });
    return static_cast<float>(open) * (1.0F / 27.0F);
  }
  // Nine triples along x: those of even and odd number are added up apart, as two halves of a register.
  std::array<std::array<float, 3>, 2> sums{};
  float least = 0.0F;
  for (std::size_t i = 0; i < 27; ++i) {
    const float v = std::min(samples[i], 0.0F);
    sums[i / 3 % 2][i % 3] += v;
    least = std::min(least, v);
  }
  const float sum = ((sums[0][0] + sums[1][0]) + (sums[0][1] + sums[1][1])) + (sums[0][2] + sums[1][2]);
  return weighted_openness(sum, least, options);
}

/// The occlusion of a vertex; `density(x, y, z)` is the lattice point at that offset from the cell's lowest corner, in
/// samples of the level.
template <class Density>
float vertex_openness(Vec3 fraction, Vec3 normal, const SmoothOcclusionOptions& options, Density density) {
  const Vec3 centre = occlusion_centre(fraction, normal, options.spread);
  const std::array<SampleAxis, 3> axes = {sample_axis(centre.x, options.spread), sample_axis(centre.y, options.spread),
                                          sample_axis(centre.z, options.spread)};
  std::array<float, 27> samples{};
  for (std::size_t i = 0; i < 27; ++i) {
    const std::size_t ix = i % 3;
    const std::size_t iy = i / 3 % 3;
    const std::size_t iz = i / 9;
    const int x = axes[0].base[ix];
    const int y = axes[1].base[iy];
    const int z = axes[2].base[iz];
    const auto along_z = [&](int dx, int dy) {
      const float low = density(x + dx, y + dy, z);
      return low + axes[2].fraction[iz] * (density(x + dx, y + dy, z + 1) - low);
    };
    const auto along_y = [&](int dx) {
      const float low = along_z(dx, 0);
      return low + axes[1].fraction[iy] * (along_z(dx, 1) - low);
    };
    const float low = along_y(0);
    samples[i] = low + axes[0].fraction[ix] * (along_y(1) - low);
  }
  return openness_of(samples, options);
}

}  // namespace quoin::smooth
