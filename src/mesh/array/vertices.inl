// The vertices of cells with eight densities each, one register of lanes at a time.

#pragma once

#include <cstddef>

#include "mesh/array/array_kernel.h"
#include "mesh/array/array_kernel.inl"
#include "mesh/array/array_vertex.h"
#include "mesh/nets/lanes.inl"

namespace quoin::array {
namespace {

using namespace lanes;

// Returns the solid corners as bits. 0 has no sign here.
inline I solid_corners(const F* d) {
  I solid = shift_right<31>(as_int(d[7]));
  for (int i = 7; i-- > 0;) solid = shift_left<1>(solid) | shift_right<31>(as_int(d[i]));
  return solid;
}

void vertices(const CornerBatch& corners, std::size_t count, const Placement& placement, VertexBatch& batch,
              Vec3* positions, Vec3* normals) {
  const ArrayField field{placement.gradient_scale};
  for (std::size_t first = 0; first < count; first += kWidth) {
    F d[8];
    for (int i = 0; i < 8; ++i) d[i] = load(corners.densities[i] + first);
    make_finite(d);
    const auto [fraction, at, normal] = smooth::cell_vertex(field, d, solid_corners(d));
    const F parts[6] = {at.x, at.y, at.z, normal.x, normal.y, normal.z};
    for (int i = 0; i < 3; ++i) {
      store(batch.fractions[i] + first, parts[i]);
      store(batch.normals[i] + first, parts[3 + i]);
    }
  }
  place_vertices(batch, count, placement, positions);
  interleave(batch.normals, placement.view_axis, count, normals);
}

}  // namespace
}  // namespace quoin::array
