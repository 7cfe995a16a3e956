// Converts vertices from cell fractions to space.

#pragma once

#include <cstddef>

#include <quoin/core/assert.h>

#include "mesh/array/kernel.h"

namespace quoin::array {
namespace {

// Interleaves arrays of coordinates to vectors, with the axes in the view's order.
inline void interleave(const float (&parts)[3][kBatch], const int (&view_axis)[3], std::size_t count, Vec3* out) {
  const float* in_order[3];
  for (int axis = 0; axis < 3; ++axis) in_order[view_axis[axis]] = parts[axis];
  float* to = &out->x;
  for (std::size_t i = 0; i < count; ++i, to += 3) {
    to[0] = in_order[0][i];
    to[1] = in_order[1][i];
    to[2] = in_order[2][i];
  }
}

void place_vertices(const VertexBatch& batch, std::size_t count, const Placement& placement, Vec3* positions) {
  QUOIN_ASSERT(count <= kBatch, "vertices of one batch");
  alignas(64) float places[3][kBatch];
  for (int axis = 0; axis < 3; ++axis) {
    for (std::size_t i = 0; i < kBatch; ++i) {
      places[axis][i] = in_space(placement, axis, batch.cells[axis][i], batch.fractions[axis][i]);
    }
  }
  interleave(places, placement.view_axis, count, positions);
}

}  // namespace
}  // namespace quoin::array
