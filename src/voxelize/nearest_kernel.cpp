// The distances of a row of points to a triangle, a few at a time.

#include <quoin/core/assert.h>

#include "core/lanes/lanes.h"
#include "voxelize/nearest_kernel.h"

namespace quoin::voxelizing {
namespace {

using lanes::F;
using lanes::I;

// Larger than any squared distance; marks voxels outside the triangle's prism.
constexpr float kFar = 1e30F;

constexpr float kSteps[16] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};

inline F edge_squared(const EdgeInRow& edge, F x) {
  const F along = lanes::all(edge.along) + x * lanes::all(edge.edge_x);
  const F share = lanes::min(lanes::max(along * lanes::all(edge.per_square), lanes::all(0.0F)), lanes::all(1.0F));
  const F qx = lanes::all(edge.at_x) + x - share * lanes::all(edge.edge_x);
  const F qy = lanes::all(edge.at_y) - share * lanes::all(edge.edge_y);
  const F qz = lanes::all(edge.at_z) - share * lanes::all(edge.edge_z);
  return qx * qx + qy * qy + qz * qz;
}

inline F outside(const EdgeInRow& edge, F x) {
  return lanes::all(0.0F) - (lanes::all(edge.inwards) + x * lanes::all(edge.inwards_x));
}

void update_row(const TriangleInRow& triangle, int first, int end, float* squared, std::int32_t* nearest) {
  QUOIN_ASSERT(first >= 0 && first <= end && end <= 64, "points of the row");
  const auto& [a, b, c] = triangle.edges;
  const F steps = lanes::load(kSteps);
  const I number = lanes::all(triangle.number);
  for (int i = first & -lanes::kWidth; i < end; i += lanes::kWidth) {
    const F x = lanes::all(static_cast<float>(i)) + steps;
    const F to_edges = lanes::min(lanes::min(edge_squared(a, x), edge_squared(b, x)), edge_squared(c, x));
    // Voxels that do not project onto the face use the edge distances: the face is pushed far away there.
    const F out = lanes::max(lanes::max(outside(a, x), outside(b, x)), lanes::max(outside(c, x), lanes::all(0.0F)));
    const F plane = lanes::all(triangle.plane) + x * lanes::all(triangle.plane_x);
    const F to_face = plane * plane + (lanes::all(triangle.flat) + out) * lanes::all(kFar);
    const F now = lanes::min(to_face, to_edges);
    const F before = lanes::load(squared + i);
    const auto nearer = now < before;
    if (!lanes::any(nearer)) continue;
    lanes::store(squared + i, lanes::select(nearer, now, before));
    lanes::store(nearest + i, lanes::select(nearer, number, lanes::load(nearest + i)));
  }
}

}  // namespace

constinit const Kernel QUOIN_KERNEL(Kernel) = {&update_row};

#ifndef QUOIN_KERNEL_AVX2
constinit const KernelTable<Kernel> kKernels = QUOIN_KERNEL_TABLE(Kernel, Avx512);
#endif

}  // namespace quoin::voxelizing
