#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include <quoin/core/assert.h>
#include <quoin/core/vec.h>

#include "mesh/nets/cell.h"

namespace quoin::smooth {

/// Value for no face; faces are 2 * axis + (1 for the upper side).
inline constexpr int kNoFace = 6;

/// The sheets of the surface in a cell: for each of the twelve edges, the sheet that crosses it.
struct Sheets {
  std::array<std::uint8_t, kEdges> of_edge{};  ///< kUncrossed for uncrossed edges
  int count = 0;
  static constexpr std::uint8_t kUncrossed = 15;
};

/// Returns the sheets of a cell with the solid corners `solid`, numbered by their first edges. The complement of
/// `solid` gives the sheets that connect diagonal solid corners instead.
///
/// On a face with four crossings, each sheet pairs the two crossings that cut off a solid corner; on `flipped_face`,
/// the two that cut off an air corner.
const Sheets& sheets_of(std::uint32_t solid, int flipped_face = kNoFace);

/// Returns the face with four crossings that are all in one sheet, or kNoFace. No cell has two such faces. Requires:
/// solid < 256.
int joined_face(std::uint32_t solid);

/// Returns the cells, by their solid corners, that have at most one sheet, independent of the neighbouring cells.
const std::array<bool, 256>& cells_with_one_sheet();

/// Returns the corners of a face, in order around it.
std::array<int, 4> face_corners(int face);

/// Returns the step from a cell to the cell on the other side of a face.
inline IVec3 step_across(int face) {
  return unit_axis(face / 2) * (face % 2 == 1 ? 1 : -1);
}

/// Returns the face of a cell that is joined in both of its cells, or kNoFace. `solid_beyond(face)` returns the solid
/// corners of the cell on the other side of a face, 0 if there is none.
template <class SolidBeyond>
int face_joined_in_both(std::uint32_t solid, const SolidBeyond& solid_beyond) {
  const int face = joined_face(solid);
  return face != kNoFace && joined_face(solid_beyond(face)) == (face ^ 1) ? face : kNoFace;
}

/// The sum and the number of the crossings of one sheet, in fractions of the cell.
struct SheetCrossings {
  Vec3 sum{0.0F};
  float count = 0.0F;
};

/// `crossing(a, b)` returns the fraction of an edge between densities of different signs where it is crossed.
template <class Crossing>
SheetCrossings crossings_of_sheet(const Corners& d, const Sheets& sheets, int sheet, const Crossing& crossing) {
  SheetCrossings found;
  for (std::size_t edge = 0; edge < kEdges; ++edge) {
    if (sheets.of_edge[edge] != sheet) continue;
    Vec3 at(corner_place(static_cast<int>(edge_start(edge))));
    at[static_cast<int>(edge / 4)] = crossing(d[edge_start(edge)], d[edge_end(edge)]);
    found.sum += at;
    found.count += 1.0F;
  }
  QUOIN_ASSERT(found.count > 0.0F, "a sheet of the cell");
  return found;
}

}  // namespace quoin::smooth

// Sheets of blocky surfaces: the voxels around a corner that a printable surface separates.
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
