#pragma once

// The rules by which quads are ordered and split, for all that emits quads outside of the fast kernels.

#include <array>
#include <cmath>
#include <cstdint>

#include <quoin/core/buffer.h>
#include <quoin/core/vec.h>
#include <quoin/grid/chunk.h>
#include <quoin/mesh/smooth.h>

namespace quoin::smooth {

inline IVec3 unit_axis(int axis) {
  IVec3 unit{0};
  unit[axis] = 1;
  return unit;
}

/// The name of a cell of a chunk at `offset` (0 or -1 on each axis) from the mesh's.
inline SmoothCell cell_name(IVec3 cell, IVec3 offset) {
  std::uint32_t bits = 0;
  for (int axis = 0; axis < 3; ++axis) {
    bits |= static_cast<std::uint32_t>(cell[axis]) << (kChunkShift * axis);
    bits |= static_cast<std::uint32_t>(offset[axis] != 0) << (SmoothCell::kPreviousShift + axis);
  }
  return {bits};
}

/// Vertices are compared at places in 1/64 of their cell, so that positions are told apart by whole numbers. In 1/64 of
/// a sample: `position` is a mesh's, `level` that of the vertex's cell.
inline IVec3 place_of(Vec3 position, int level) {
  const float scale = std::ldexp(64.0F, -level);
  IVec3 place;
  for (int axis = 0; axis < 3; ++axis) {
    place[axis] = static_cast<int>(std::floor(position[axis] * scale)) * (1 << level);
  }
  return place;
}

struct QuadCorner {
  std::uint32_t vertex;
  int level;    ///< of its cell
  IVec3 place;  ///< as place_of gives it
};

inline bool quad_is_split_at_first(const std::array<QuadCorner, 4>& q) {
  const auto is_finest = [&](std::size_t i) {
    return q[i].level <= q[0].level && q[i].level <= q[1].level && q[i].level <= q[2].level && q[i].level <= q[3].level;
  };
  // A triangle without a cell of the finest level might be there a second time, around the next part of a long edge.
  const bool first_allowed = is_finest(0) || is_finest(2);
  const bool second_allowed = is_finest(1) || is_finest(3);
  if (first_allowed != second_allowed) return first_allowed;
  const auto squared_length = [](IVec3 v) { return v.x * v.x + v.y * v.y + v.z * v.z; };
  return squared_length(q[0].place - q[2].place) <= squared_length(q[1].place - q[3].place);
}

/// Two triangles on the shorter of the diagonals that have an end at the finest level; of equal ones, from corner 0.
inline std::array<std::uint32_t, 6> triangles_of(const std::array<QuadCorner, 4>& q) {
  const auto v = [&](std::size_t i) { return q[i].vertex; };
  if (quad_is_split_at_first(q)) return {v(0), v(1), v(2), v(0), v(2), v(3)};
  return {v(1), v(2), v(3), v(1), v(3), v(0)};
}

/// The cells around an edge along `axis` that starts at `p`, counter-clockwise seen from +axis.
inline std::array<IVec3, 4> cells_around(IVec3 p, int axis) {
  const IVec3 u = unit_axis((axis + 1) % 3);
  const IVec3 v = unit_axis((axis + 2) % 3);
  return {p - u - v, p - v, p, p - u};
}

}  // namespace quoin::smooth
