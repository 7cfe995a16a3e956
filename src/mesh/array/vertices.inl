// The vertices of cells with eight densities each, one register of lanes at a time. The arithmetic equals the plain
// kernel, step for step; smooth/smooth_cell.h has the shared part.
//
// Each crossing has its own division. The chunk kernels divide once for four crossings, which is safe for half
// densities. Here densities may have any size, and a product of four would overflow or underflow.

#pragma once

#include <cstddef>

#include "mesh/array/array_kernel.h"
#include "mesh/array/array_kernel.inl"
#include "mesh/smooth/smooth_lanes.inl"

namespace quoin::array {
namespace {

using namespace smooth;

// NaN counts as air, at the greatest distance from the surface of all corners.
inline void make_finite(F* d) {
  const F far = all(kFarthest);
  const F near = all(-kFarthest);
  F most = all(0.0F);
  for (int i = 0; i < 8; ++i) {
    d[i] = select(far < d[i], far, d[i]);
    d[i] = select(d[i] < near, near, d[i]);
    const F size = abs(d[i]);
    most = select(most < size, size, most);
  }
  for (int i = 0; i < 8; ++i) d[i] = select(d[i] == d[i], d[i], most);
}

// Returns the fraction where an edge is crossed, otherwise 0. `one` is 1 for crossed edges.
inline F crossing_of(F a, F b, F& one) {
  const Mask is_crossed = signs_differ(a, b);
  one = only(is_crossed, all(1.0F));
  const F t = select(a == all(0.0F), all(kLeastFraction), a / (a - b));
  return only(is_crossed, select(b == all(0.0F), all(1.0F - kLeastFraction), t));
}

// Returns the mean of a cell's crossings.
inline Lanes3 mean_crossing(const F* d) {
  F sum[3];
  F high[3][2];  // crossed edges along an axis: at the high end of the next axis, and of the one after
  F total = all(0.0F);
  for (int axis = 0; axis < 3; ++axis) {
    const int step = 1 << axis;
    const int u = 1 << (axis + 1) % 3;
    const int v = 1 << (axis + 2) % 3;
    F one[4];
    const F t0 = crossing_of(d[0], d[step], one[0]);
    const F t1 = crossing_of(d[u], d[u + step], one[1]);
    const F t2 = crossing_of(d[v], d[v + step], one[2]);
    const F t3 = crossing_of(d[u + v], d[u + v + step], one[3]);
    sum[axis] = (t0 + t1) + (t2 + t3);
    high[axis][0] = one[1] + one[3];
    high[axis][1] = one[2] + one[3];
    total = total + ((one[0] + one[1]) + (one[2] + one[3]));
  }
  const F inverse = all(1.0F) / total;
  return {(sum[0] + (high[1][1] + high[2][0])) * inverse, (sum[1] + (high[2][1] + high[0][0])) * inverse,
          (sum[2] + (high[0][1] + high[1][0])) * inverse};
}

// Scales the vector so that its square is a finite number, then normalizes it.
inline Lanes3 unit_of_any(Lanes3 g) {
  const F least = all(kLeastGradient);
  F most = abs(g.x);
  most = select(most < abs(g.y), abs(g.y), most);
  most = select(most < abs(g.z), abs(g.z), most);
  const F inverse = all(1.0F) / select(most < least, least, most);
  return unit_normals({g.x * inverse, g.y * inverse, g.z * inverse});
}

void vertices(const CornerBatch& corners, std::size_t count, const Placement& placement, VertexBatch& batch,
              Vec3* positions, Vec3* normals) {
  const float* const scale = placement.gradient_scale;
  for (std::size_t first = 0; first < count; first += kWidth) {
    F d[8];
    for (int i = 0; i < 8; ++i) d[i] = load(corners.densities[i] + first);
    make_finite(d);
    const Lanes3 at = mean_crossing(d);
    const Lanes3 g = gradient_at(d, at);
    const Lanes3 n = unit_of_any({g.x * all(scale[0]), g.y * all(scale[1]), g.z * all(scale[2])});
    const F parts[6] = {snapped(at.x), snapped(at.y), snapped(at.z), n.x, n.y, n.z};
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
