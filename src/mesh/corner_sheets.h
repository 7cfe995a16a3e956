#pragma once

#include <array>

#include <quoin/core/assert.h>
#include <quoin/core/vec.h>

namespace quoin::print {

/// The number of faces that can meet in a corner: between its eight voxels.
inline constexpr unsigned kCornerFaces = 12;

/// Returns the face between a corner's voxel `cell` (bits x, y, z) and its neighbour along an axis.
inline constexpr unsigned corner_face(unsigned cell, unsigned axis) {
  QUOIN_ASSERT(cell < 8 && axis < 3, "one of eight voxels, and an axis");
  const unsigned low = cell & ((1U << axis) - 1U);
  return axis * 4 + (low | (cell >> (axis + 1) << axis));
}

/// The offsets of the vertices of a corner's faces from the corner, in voxels.
using CornerOffsets = std::array<Vec3, kCornerFaces>;

/// Returns the offsets by the set of solid voxels, of eight.
[[nodiscard]] const std::array<CornerOffsets, 256>& corner_offsets();

}  // namespace quoin::print
