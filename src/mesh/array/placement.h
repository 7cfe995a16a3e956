#pragma once

#include <algorithm>
#include <cmath>

#include "mesh/array/lattice.h"

namespace quoin::array {

// From the walked axes to the view's, in space.
struct Placement {
  double origin[3];  // by walked axis
  double spacing[3];
  int view_axis[3];
  float gradient_scale[3];  // what makes of a gradient over samples one in space, but for its length
};

[[nodiscard]] inline Placement placement_of(const Lattice& lattice) {
  Placement placement{};
  const DVec3 s = lattice.spacing;
  const double least = std::min({std::abs(s.x), std::abs(s.y), std::abs(s.z)});
  for (int i = 0; i < 3; ++i) {
    placement.origin[i] = lattice.origin[i];
    placement.spacing[i] = s[i];
    placement.view_axis[i] = lattice.view_axis[static_cast<std::size_t>(i)];
    placement.gradient_scale[i] = static_cast<float>(least / s[i]);
  }
  return placement;
}

}  // namespace quoin::array
