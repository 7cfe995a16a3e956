// The kernel of array_kernel.h.

#include "mesh/array/array_kernel.h"

#include <array>
#include <cstddef>
#include <cstdint>

#include <quoin/core/assert.h>

#include "mesh/array/array_vertex.h"
#include "mesh/array/bit_rows.inl"
#include "mesh/array/quads.inl"
#include "mesh/array/relax.inl"
#ifdef QUOIN_KERNEL_AVX2
#include "mesh/nets/cell_lanes.inl"
#endif

namespace quoin::array {
namespace {

#ifdef QUOIN_KERNEL_AVX2
using namespace lanes;

// Returns the solid corners as bits. 0 has no sign here.
inline I solid_corners(const std::array<F, 8>& d) {
  I solid = shift_right<31>(as_int(d[7]));
  for (std::size_t i = 7; i-- > 0;) solid = shift_left<1>(solid) | shift_right<31>(as_int(d[i]));
  return solid;
}
#else
using smooth::solid_corners;

// A register of one lane.
using F = float;
constexpr int kWidth = 1;

inline F load(const float* from) {
  return *from;
}
inline void store(float* to, F a) {
  *to = a;
}
#endif

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

// Computes the vertices of cells with eight densities each, one register of lanes at a time.
void vertices(const CornerBatch& corners, std::size_t count, const Placement& placement, VertexBatch& batch,
              Vec3* positions, Vec3* normals) {
  const ArrayField field{placement.gradient_scale};
  for (std::size_t first = 0; first < count; first += kWidth) {
    std::array<F, 8> d;
    for (std::size_t i = 0; i < 8; ++i) d[i] = load(corners.densities[i] + first);
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

template <class T>
constexpr void set_solid(Kernel& kernel, ScalarType type) {
  kernel.solid_row[static_cast<std::size_t>(type)][0] = solid_row<T, false>;
  kernel.solid_row[static_cast<std::size_t>(type)][1] = solid_row<T, true>;
}

template <class T>
constexpr void set_labels(Kernel& kernel, std::size_t size) {
  kernel.differing[size] = differing<T>;
  kernel.count_interfaces[size] = count_interfaces<T>;
  kernel.label_quads[size] = label_quads<T>;
}

constexpr Kernel make_kernel() {
  Kernel kernel{};
  set_solid<std::uint8_t>(kernel, ScalarType::UInt8);
  set_solid<std::int8_t>(kernel, ScalarType::Int8);
  set_solid<std::uint16_t>(kernel, ScalarType::UInt16);
  set_solid<std::int16_t>(kernel, ScalarType::Int16);
  set_solid<std::uint32_t>(kernel, ScalarType::UInt32);
  set_solid<std::int32_t>(kernel, ScalarType::Int32);
  set_solid<std::uint64_t>(kernel, ScalarType::UInt64);
  set_solid<std::int64_t>(kernel, ScalarType::Int64);
  set_solid<float>(kernel, ScalarType::Float32);
  set_solid<double>(kernel, ScalarType::Float64);
  set_labels<std::uint8_t>(kernel, 0);
  set_labels<std::uint16_t>(kernel, 1);
  set_labels<std::uint32_t>(kernel, 2);
  set_labels<std::uint64_t>(kernel, 3);
  kernel.differences = differences;
  kernel.differences_along = differences_along;
  kernel.find_active = find_active;
  kernel.count_bits = count_bits;
  kernel.vertices = vertices;
  kernel.place = place_vertices;
  kernel.quads = quads;
  kernel.label_vertices = label_vertices;
  kernel.relax = relax;
  return kernel;
}

}  // namespace

constinit const Kernel QUOIN_KERNEL(Kernel) = make_kernel();

#ifndef QUOIN_KERNEL_AVX2
constinit const KernelTable<Kernel> kKernels = QUOIN_KERNEL_TABLE(Kernel, Avx2);
#endif

}  // namespace quoin::array
