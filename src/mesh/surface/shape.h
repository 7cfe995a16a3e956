#pragma once

#include <quoin/grid/density_chunk.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/mesh/smooth.h>

namespace quoin::smooth {

/// Options for moving the vertices of a voxel field within their cells.
struct Shape {
  float smoothness = 1.0F;  ///< 0 to 1
  bool keep_thin = false;
  /// If the field is one of several bodies: the densities of all bodies together, with the materials that distinguish
  /// them. The vertices of cells with several bodies are then equal in each body. Null: there is one body.
  const DensityNeighbourhood* whole = nullptr;
  const VoxelRegistry* types = nullptr;  ///< not null with `whole`

  [[nodiscard]] bool moves() const { return smoothness < 1.0F || keep_thin || whole != nullptr; }
};

/// Moves the vertices of a chunk's mesh. Vertices of cells before the chunk get the same bits as in the chunk before.
///
/// Smoothness: the remaining share of the way from the middle of the cell to the vertex. For a cell with several sheets
///             it is at least 1/256, so that the sheets do not meet.
/// Thin:       a sample is thin along an axis if both neighbours there have the other sign, and it does not continue
///             diagonally on either side. A wall at 45 degrees, smooth and thick enough, is therefore not thin.
///             Vertices of level-0 cells with a corner that is thin along an axis keep a third of that way along it.
/// Bodies:     in a level-0 cell with samples of several bodies and one sheet, the vertex is the mean of the
///             crossings of all edges between different bodies or air, in the middle if both ends are solid. It is kept
///             as if thin. The normal is the normal of the whole field, if that is crossed. Quads with such a vertex
///             are split again, so that two bodies choose the same diagonal.
/// Cost:       up to 0.5 ms per chunk for thin features.
void shape_vertices(const DensityNeighbourhood& chunks, const SmoothOptions& options, const Shape& shape,
                    SmoothChunkMesh& mesh);

}  // namespace quoin::smooth
