#pragma once

// Occlusion of one vertex, in scalar; the fast kernels keep the order of its arithmetic. No contraction.

#include <algorithm>
#include <array>
#include <cmath>

#include <quoin/core/vec.h>
#include <quoin/mesh/smooth.h>

namespace quoin::smooth {

/// Where the three samples along one axis lie: the lattice point below and the fraction beyond it.
struct AxisSamples {
  std::array<int, 3> base{};
  std::array<float, 3> fraction{};
};

/// `centre` in cells from the vertex's cell.
inline AxisSamples axis_samples(float centre, float spread) {
  AxisSamples samples;
  const bool whole = spread == std::floor(spread);
  for (std::size_t i = 0; i < 3; ++i) {
    const float offset = (static_cast<float>(i) - 1.0F) * spread;
    const float at = whole ? centre : centre + offset;
    const float below = std::floor(at);
    samples.base[i] = static_cast<int>(below) + (whole ? static_cast<int>(offset) : 0);
    samples.fraction[i] = at - below;
  }
  return samples;
}

/// The share of light by the ratio of a weighted form.
inline float weighted_openness(float ratio, const SmoothOcclusionOptions& options) {
  const auto raised = [&](float x) { return options.power == 2.0F ? x * x : std::pow(x, options.power); };
  const float open = (1.0F - raised(ratio + options.offset)) / (1.0F - raised(options.offset));
  return std::clamp(open, 0.0F, 1.0F);
}

/// What the 27 samples (by x + 3 y + 9 z) say. Requires: a form other than None.
inline float openness_of_samples(const std::array<float, 27>& samples, const SmoothOcclusionOptions& options) {
  if (options.form == SmoothOcclusion::Openness) {
    const auto in_air = std::count_if(samples.begin(), samples.end(), [](float d) { return d >= 0.0F; });
    return static_cast<float>(in_air) / 27.0F;
  }
  std::array<float, 3> sums{};
  float least = 0.0F;
  for (std::size_t i = 0; i < 27; ++i) {
    const float solid = std::min(samples[i], 0.0F);
    sums[i % 3] += solid;
    least = std::min(least, solid);
  }
  const float sum = (sums[0] + sums[1]) + sums[2];
  if (options.form == SmoothOcclusion::Weighted) {
    return weighted_openness(-sum / (27.0F * std::max(-least, options.spread)), options);
  }
  return weighted_openness(least > -0.001F ? 0.0F : sum / (27.0F * least), options);
}

/// The openness of a vertex at `fraction` of its cell. `density(p)` is the sample at a lattice point counted, in cells,
/// from the cell's first corner. Requires: a form other than None.
template <class Density>
float openness_at(const Density& density, Vec3 fraction, Vec3 normal, const SmoothOcclusionOptions& options) {
  const float spread = options.spread;
  const float shift = spread * ((std::abs(normal.x) + std::abs(normal.y)) + std::abs(normal.z)) + 0.1F;
  std::array<AxisSamples, 3> axes;
  for (int i = 0; i < 3; ++i) {
    axes[static_cast<std::size_t>(i)] = axis_samples(fraction[i] + normal[i] * shift, spread);
  }
  const auto lerp = [](float a, float b, float f) { return a + f * (b - a); };
  std::array<float, 27> samples;
  for (std::size_t i = 0; i < 27; ++i) {
    const std::size_t ix = i % 3;
    const std::size_t iy = i / 3 % 3;
    const std::size_t iz = i / 9;
    const IVec3 p{axes[0].base[ix], axes[1].base[iy], axes[2].base[iz]};
    const auto along_z = [&](int x, int y) {
      return lerp(density(p + IVec3{x, y, 0}), density(p + IVec3{x, y, 1}), axes[2].fraction[iz]);
    };
    const auto along_y = [&](int x) { return lerp(along_z(x, 0), along_z(x, 1), axes[1].fraction[iy]); };
    samples[i] = lerp(along_y(0), along_y(1), axes[0].fraction[ix]);
  }
  return openness_of_samples(samples, options);
}

}  // namespace quoin::smooth
