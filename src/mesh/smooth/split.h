#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include <quoin/grid/density_chunk.h>
#include <quoin/mesh/smooth.h>

namespace quoin::smooth {

/// No face; faces are 2 * axis + (1 for the upper side).
inline constexpr int kNoFace = 6;

/// The sheets of the surface in a cell: which of them each of the twelve edges is crossed by.
struct Sheets {
  /// By 4 * axis + du + 2 dv of the edge's start, u and v the next two axes; kUncrossed for edges that are not crossed.
  std::array<std::uint8_t, 12> of_edge{};
  int count = 0;
  static constexpr std::uint8_t kUncrossed = 15;
};

/// The sheets of a cell whose solid corners are `solid` (by x + 2 y + 4 z), numbered by their first edges. Those of the
/// complement are the sheets where solid corners hold together instead.
///
/// On a face with four crossings the pairs that each cut off a solid corner belong together; on `flipped_face` those
/// that cut off an air corner.
Sheets sheets_of(std::uint32_t solid, int flipped_face = kNoFace);

/// The face with four crossings that are all of one sheet, or kNoFace. No cell has two. Requires: solid < 256.
int joined_face(std::uint32_t solid);

/// Gives each cell of `out` that several sheets cross a vertex for each; the vertices of other cells stay as they are.
/// Cells that touch a chunk of another level along a face or an edge keep one. A sheet's vertex is the mean of its
/// crossings, its normal the gradient there.
///
/// Quads:    the first `quad_indices` of the indices, six a quad.
/// Bridges:  with `join_diagonals`, two cells that both have all crossings of their common face in one sheet get two
///           vertices on that face, one for each of its air corners, on the edge that joins the two cells: each has two
///           triangles then instead of four. Quads that run along such an edge become polygons, which come last.
/// Order:    a cell's first sheet keeps the cell's place, the others come last.
/// Proof:    docs/decisions/archive/021-two-sheets.md.
void split_sheets(const DensityNeighbourhood& chunks, const SmoothOptions& options, std::size_t quad_indices,
                  SmoothChunkMesh& out);

}  // namespace quoin::smooth
