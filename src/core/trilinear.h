#pragma once

#include <array>

#include <quoin/core/vec.h>

namespace quoin {

/// Densities of a cell's corners, indexed by x + 2 y + 4 z.
using CellCorners = std::array<double, 8>;

[[nodiscard]] inline double between(double a, double b, double t) {
  return a + t * (b - a);
}

[[nodiscard]] inline double bilinear(double v00, double v10, double v01, double v11, double u, double v) {
  return between(between(v00, v10, u), between(v01, v11, u), v);
}

/// Returns the field in a cell. `f`: position from its lowest corner, 0 to 1 on each axis.
[[nodiscard]] inline double trilinear(const CellCorners& d, const DVec3& f) {
  const double low = bilinear(d[0], d[1], d[2], d[3], f.x, f.y);
  const double high = bilinear(d[4], d[5], d[6], d[7], f.x, f.y);
  return between(low, high, f.z);
}

/// Returns the gradient, in densities per sample.
[[nodiscard]] inline DVec3 trilinear_gradient(const CellCorners& d, const DVec3& f) {
  return {bilinear(d[1] - d[0], d[3] - d[2], d[5] - d[4], d[7] - d[6], f.y, f.z),
          bilinear(d[2] - d[0], d[3] - d[1], d[6] - d[4], d[7] - d[5], f.x, f.z),
          bilinear(d[4] - d[0], d[5] - d[1], d[6] - d[2], d[7] - d[3], f.x, f.y)};
}

}  // namespace quoin
