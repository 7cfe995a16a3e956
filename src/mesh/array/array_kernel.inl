// The function table of one instruction set, and the functions that convert vertices from cell fractions to space.

#pragma once

#include <cstddef>
#include <cstdint>

#include <quoin/core/assert.h>

#include "mesh/array/array_kernel.h"
#include "mesh/array/bit_rows.inl"
#include "mesh/array/quads.inl"
#include "mesh/array/relax.inl"

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

// Functions that each kernel defines.
void vertices(const CornerBatch& corners, std::size_t count, const Placement& placement, VertexBatch& batch,
              Vec3* positions, Vec3* normals);

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
}  // namespace quoin::array
