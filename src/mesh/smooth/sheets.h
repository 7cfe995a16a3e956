#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include <quoin/grid/density_chunk.h>
#include <quoin/mesh/smooth.h>

namespace quoin::smooth {

/// Value for no face; faces are 2 * axis + (1 for the upper side).
inline constexpr int kNoFace = 6;

/// The sheets of the surface in a cell: for each of the twelve edges, the sheet that crosses it.
struct Sheets {
  /// Indexed by 4 * axis + du + 2 dv of the edge's start, u and v the next two axes; kUncrossed for uncrossed edges.
  std::array<std::uint8_t, 12> of_edge{};
  int count = 0;
  static constexpr std::uint8_t kUncrossed = 15;
};

/// Returns the sheets of a cell with the solid corners `solid` (by x + 2 y + 4 z), numbered by their first edges. The
/// complement of `solid` gives the sheets that connect diagonal solid corners instead.
///
/// On a face with four crossings, each sheet pairs the two crossings that cut off a solid corner; on `flipped_face`,
/// the two that cut off an air corner.
Sheets sheets_of(std::uint32_t solid, int flipped_face = kNoFace);

/// Returns the face with four crossings that are all in one sheet, or kNoFace. No cell has two such faces. Requires:
/// solid < 256.
int joined_face(std::uint32_t solid);

/// Gives each cell of `out` that several sheets cross one vertex per sheet. The vertices of other cells stay unchanged.
/// Cells that touch a chunk of another level along a face or an edge keep one vertex. A sheet's vertex is the mean of
/// its crossings, its normal the gradient there.
///
/// Quads:    the first `quad_indices` of the indices, six per quad.
/// Bridges:  with `join_diagonals`, two cells that both have all crossings of their common face in one sheet get two
///           vertices on that face, one for each of its air corners, on the edge that joins the two cells. Each of the
///           edges then has two triangles instead of four. Quads along such an edge become polygons, which come last.
/// Order:    a cell's first sheet keeps the cell's vertex index; the other sheets are appended.
/// Proof:    docs/decisions/archive/021-two-sheets.md.
void split_sheets(const DensityNeighbourhood& chunks, const SmoothOptions& options, std::size_t quad_indices,
                  SmoothChunkMesh& out);

}  // namespace quoin::smooth
