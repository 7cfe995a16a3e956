#pragma once

// The order and the diagonal of quads, for all code except the fast kernels.

#include <algorithm>
#include <array>
#include <cstdint>

#include <quoin/core/assert.h>
#include <quoin/core/buffer.h>
#include <quoin/core/vec.h>
#include <quoin/grid/chunk.h>
#include <quoin/mesh/smooth.h>

namespace quoin::smooth {

inline IVec3 unit_axis(int axis) {
  QUOIN_ASSERT(axis >= 0 && axis < 3, "0 <= axis < 3");
  IVec3 unit{0};
  unit[axis] = 1;
  return unit;
}

/// Returns the offset of a cell's corner from its first corner, in cells; corners are numbered by x + 2 y + 4 z.
inline IVec3 corner_place(int corner) {
  QUOIN_ASSERT(corner >= 0 && corner < 8, "0 <= corner < 8");
  return {corner & 1, corner >> 1 & 1, corner >> 2};
}

/// Returns the name of a cell of a chunk at `offset` (0 or -1 on each axis) from the mesh's chunk.
inline SmoothCell cell_name(IVec3 cell, IVec3 offset) {
  QUOIN_ASSERT((cell.x | cell.y | cell.z) >= 0 && (cell.x | cell.y | cell.z) < kChunkEdge, "a cell of the chunk");
  QUOIN_ASSERT((IBox{IVec3(-1), IVec3(1)}.contains(offset)), "0 or -1 on each axis");
  std::uint32_t bits = 0;
  for (int axis = 0; axis < 3; ++axis) {
    bits |= static_cast<std::uint32_t>(cell[axis]) << (kChunkShift * axis);
    bits |= static_cast<std::uint32_t>(offset[axis] != 0) << (SmoothCell::kPreviousShift + axis);
  }
  return {bits};
}

/// A corner of a quad. Corners are compared in units of 1/64 cell, so that length comparisons are exact.
struct QuadCorner {
  std::uint32_t vertex;
  int level;    ///< level of its cell
  IVec3 place;  ///< in 1/64 of a sample
};

/// Returns a vertex in the cell that starts at the sample `first` and has width 2^level.
inline QuadCorner quad_corner(std::uint32_t vertex, Vec3 position, IVec3 first, int level) {
  QUOIN_ASSERT(level >= 0 && level <= kMaxSmoothLevel, "a level of detail");
  const auto size = static_cast<float>(1 << level);
  QuadCorner corner{vertex, level, first * 64};
  for (int axis = 0; axis < 3; ++axis) {
    const float fraction = (position[axis] - static_cast<float>(first[axis])) / size;
    corner.place[axis] += std::min(static_cast<int>(fraction * 64.0F), 63) * (1 << level);
  }
  return corner;
}

inline bool quad_is_split_at_first(const std::array<QuadCorner, 4>& q) {
  const auto is_finest = [&](std::size_t i) {
    return q[i].level <= q[0].level && q[i].level <= q[1].level && q[i].level <= q[2].level && q[i].level <= q[3].level;
  };
  // A triangle without a cell of the finest level might exist twice: again around the next part of a long edge.
  const bool first_allowed = is_finest(0) || is_finest(2);
  const bool second_allowed = is_finest(1) || is_finest(3);
  if (first_allowed != second_allowed) return first_allowed;
  const auto squared_length = [](IVec3 v) { return v.x * v.x + v.y * v.y + v.z * v.z; };
  return squared_length(q[0].place - q[2].place) <= squared_length(q[1].place - q[3].place);
}

/// Returns two triangles along the shorter diagonal with an end at the finest level; of equal ones, the diagonal from
/// corner 0.
inline std::array<std::uint32_t, 6> triangles_of(const std::array<QuadCorner, 4>& q) {
  const auto v = [&](std::size_t i) { return q[i].vertex; };
  if (quad_is_split_at_first(q)) return {v(0), v(1), v(2), v(0), v(2), v(3)};
  return {v(1), v(2), v(3), v(1), v(3), v(0)};
}

/// Returns the cells around an edge along `axis` that starts at `p`, counter-clockwise as seen from +axis.
inline std::array<IVec3, 4> cells_around(IVec3 p, int axis) {
  const IVec3 u = unit_axis((axis + 1) % 3);
  const IVec3 v = unit_axis((axis + 2) % 3);
  return {p - u - v, p - v, p, p - u};
}

}  // namespace quoin::smooth
