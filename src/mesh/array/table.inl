// The function table of one instruction set, filled with the functions of the other files.

#pragma once

#include <cstddef>
#include <cstdint>

#include "mesh/array/kernel.h"
#include "mesh/array/place.inl"
#include "mesh/array/quads.inl"
#include "mesh/array/relax.inl"
#include "mesh/array/rows.inl"

namespace quoin::array {
namespace {

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
