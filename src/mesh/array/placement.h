#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include <quoin/core/assert.h>

#include "mesh/array/lattice.h"

namespace quoin::array {

// Maps the axes of the access order to the view's axes, in space.
struct Placement {
  double origin[3];  // by walked axis
  double spacing[3];
  int view_axis[3];
  float gradient_scale[3];  // from a gradient per sample to a gradient in space, except for its length
};

[[nodiscard]] inline Placement placement_of(const Lattice& lattice) {
  Placement placement{};
  const DVec3 s = lattice.spacing;
  const double least = std::min({std::abs(s.x), std::abs(s.y), std::abs(s.z)});
  QUOIN_ASSERT(least > 0.0 && std::isfinite(least), "a spacing that is finite and not 0");
  for (int i = 0; i < 3; ++i) {
    placement.origin[i] = lattice.origin[i];
    placement.spacing[i] = s[i];
    placement.view_axis[i] = lattice.view_axis[static_cast<std::size_t>(i)];
    placement.gradient_scale[i] = static_cast<float>(least / s[i]);
  }
  return placement;
}

// Returns a coordinate of a vertex in space. Rounds once; intermediate values are double.
[[gnu::always_inline]] inline float in_space(const Placement& placement, int axis, std::int32_t cell, float fraction) {
  const double sample = (static_cast<double>(cell) - 1.0) + static_cast<double>(fraction);
  return static_cast<float>(placement.origin[axis] + placement.spacing[axis] * sample);
}

}  // namespace quoin::array
