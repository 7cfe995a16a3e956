// The kernel of array_kernel.h. Without lanes, vertices are computed one by one.

#include "mesh/array/array_kernel.h"

#ifdef QUOIN_KERNEL_AVX2
#include "mesh/array/vertices.inl"
#else

#include <cstddef>

#include "mesh/array/array_kernel.inl"
#include "mesh/array/array_vertex.h"

namespace quoin::array {
namespace {

void vertices(const CornerBatch& corners, std::size_t count, const Placement& placement, VertexBatch& batch,
              Vec3* positions, Vec3* normals) {
  const float* const scale = placement.gradient_scale;
  for (std::size_t i = 0; i < count; ++i) {
    smooth::Corners d;
    for (std::size_t corner = 0; corner < 8; ++corner) d[corner] = corners.densities[corner][i];
    make_finite(d);
    const Vec3 at = mean_crossing(d);
    const Vec3 g = smooth::trilinear_gradient(d, at);
    const Vec3 n = unit_of_any({g.x * scale[0], g.y * scale[1], g.z * scale[2]});
    for (int axis = 0; axis < 3; ++axis) {
      batch.fractions[axis][i] = smooth::snap(at[axis]);
      batch.normals[axis][i] = n[axis];
    }
  }
  place_vertices(batch, count, placement, positions);
  interleave(batch.normals, placement.view_axis, count, normals);
}

}  // namespace
}  // namespace quoin::array

#endif

namespace quoin::array {

const Kernel QUOIN_KERNEL(Kernel) = make_kernel();

#ifndef QUOIN_KERNEL_AVX2
constinit const KernelTable<Kernel> kKernels = QUOIN_KERNEL_TABLE(Kernel, Avx2);
#endif

}  // namespace quoin::array
