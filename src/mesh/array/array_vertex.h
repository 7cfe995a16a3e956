#pragma once

// The arithmetic of one cell with densities of any size. The notes in vertices.inl apply here too.

#include <cmath>
#include <cstddef>

#include <quoin/core/vec.h>

#include "mesh/array/array_kernel.h"
#include "mesh/smooth/smooth_cell.h"

namespace quoin::array {

using smooth::Corners;

// NaN counts as air, at the greatest distance from the surface of all corners.
inline void make_finite(Corners& d) {
  float most = 0.0F;
  for (float& density : d) {
    density = kFarthest < density ? kFarthest : density;
    density = density < -kFarthest ? -kFarthest : density;
    most = most < std::fabs(density) ? std::fabs(density) : most;
  }
  for (float& density : d) density = std::isnan(density) ? most : density;
}

// Returns the crossing of an edge between densities of different signs, as a fraction of the edge.
inline float crossing_of(float a, float b) {
  const float t = a / (a - b);
  return a == 0.0F ? kLeastFraction : b == 0.0F ? 1.0F - kLeastFraction : t;
}

// Returns the mean of a cell's crossings.
inline Vec3 mean_crossing(const Corners& d) {
  float sum[3];
  float high[3][2];  // crossed edges along an axis: at the high end of the next axis, and of the one after
  float total = 0.0F;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t step = std::size_t{1} << axis;
    const std::size_t u = std::size_t{1} << (axis + 1) % 3;
    const std::size_t v = std::size_t{1} << (axis + 2) % 3;
    const std::size_t starts[4] = {0, u, v, u + v};
    float t[4];
    float one[4];
    for (int i = 0; i < 4; ++i) {
      const float a = d[starts[i]];
      const float b = d[starts[i] + step];
      const bool is_crossed = (a < 0.0F) != (b < 0.0F);
      t[i] = is_crossed ? crossing_of(a, b) : 0.0F;
      one[i] = is_crossed ? 1.0F : 0.0F;
    }
    sum[axis] = (t[0] + t[1]) + (t[2] + t[3]);
    high[axis][0] = one[1] + one[3];
    high[axis][1] = one[2] + one[3];
    total = total + ((one[0] + one[1]) + (one[2] + one[3]));
  }
  const float inverse = 1.0F / total;
  return {(sum[0] + (high[1][1] + high[2][0])) * inverse, (sum[1] + (high[2][1] + high[0][0])) * inverse,
          (sum[2] + (high[0][1] + high[1][0])) * inverse};
}

// Scales the vector so that its square is a finite number, then normalizes it.
inline Vec3 unit_of_any(Vec3 g) {
  float most = std::fabs(g.x);
  most = most < std::fabs(g.y) ? std::fabs(g.y) : most;
  most = most < std::fabs(g.z) ? std::fabs(g.z) : most;
  const float inverse = 1.0F / (most < kLeastGradient ? kLeastGradient : most);
  return smooth::unit_normal(g * inverse);
}

}  // namespace quoin::array
