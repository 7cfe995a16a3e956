#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include <quoin/grid/density_grid.h>

namespace quoin::trace {

/// Densities of a cell's corners, by x + 2 y + 4 z.
using CellCorners = std::array<float, 8>;

[[nodiscard]] inline CellCorners corners_of(const DensityGrid& field, IVec3 cell) {
  CellCorners out;
  for (int i = 0; i < 8; ++i) {
    out[static_cast<std::size_t>(i)] = field.density(cell + IVec3{i & 1, i >> 1 & 1, i >> 2});
  }
  return out;
}

/// The gradient of a cell's field, in densities a sample; `at` from its least corner.
[[nodiscard]] inline DVec3 gradient_of(const CellCorners& corners, const DVec3& at) {
  const auto d = [&](std::size_t i) { return static_cast<double>(corners[i]); };
  const auto mix = [](double a, double b, double t) { return a + t * (b - a); };
  const auto bilinear = [&](double v00, double v10, double v01, double v11, double u, double v) {
    return mix(mix(v00, v10, u), mix(v01, v11, u), v);
  };
  return {bilinear(d(1) - d(0), d(3) - d(2), d(5) - d(4), d(7) - d(6), at.y, at.z),
          bilinear(d(2) - d(0), d(3) - d(1), d(6) - d(4), d(7) - d(5), at.x, at.z),
          bilinear(d(4) - d(0), d(5) - d(1), d(6) - d(2), d(7) - d(3), at.x, at.y)};
}

}  // namespace quoin::trace
