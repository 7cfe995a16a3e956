#pragma once

#include <quoin/grid/density_chunk.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/mesh/smooth.h>

namespace quoin::smooth {

/// How the vertices of a field of voxels are moved within their cells.
struct Shape {
  float smoothness = 1.0F;  ///< 0 to 1
  bool keep_thin = false;
  /// Where the field is one body of several: the densities of all bodies together, whose materials say which is which.
  /// The vertices of cells with several bodies are the same for each of them then. Null: there is one body.
  const DensityNeighbourhood* whole = nullptr;
  const VoxelRegistry* types = nullptr;  ///< not null with `whole`

  [[nodiscard]] bool moves() const { return smoothness < 1.0F || keep_thin || whole != nullptr; }
};

/// Moves the vertices of a chunk's mesh, those of cells before the chunk too, to the same bits as in the chunk before.
///
/// Smoothness: the share of the way from the middle of the cell to the vertex that is left; where a cell has several
///             sheets 1/256 at least, so that these do not meet.
/// Thin:       a sample is thin along an axis when both neighbours there are of the other sign, and it does not go
///             on at a slant on either side; so that a wall at 45 degrees, which is smooth and thick enough, is not.
///             Vertices of level-0 cells with a corner that is thin along an axis keep a third of that way along it.
/// Bodies:     in a cell of level 0 that samples of several bodies and one sheet share, the vertex is the mean of the
///             crossings of all edges between different bodies or air, in the middle where both ends are solid, and is
///             kept as if thin; the normal is that of the whole, if that is crossed. Quads with such a vertex are split
///             anew, so that two bodies do it alike.
/// Cost:       of thin features up to 0.5 ms a chunk.
void shape_vertices(const DensityNeighbourhood& chunks, const SmoothOptions& options, const Shape& shape,
                    SmoothChunkMesh& mesh);

}  // namespace quoin::smooth
