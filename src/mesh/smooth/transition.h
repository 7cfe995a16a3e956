#pragma once

#include <functional>

#include <quoin/grid/density_chunk.h>
#include <quoin/mesh/smooth.h>

namespace quoin::smooth {

/// Replaces its argument by the vertices of the centre chunk's own cells, 0 to n - 1 on each axis at its level, sorted
/// by name, and the quads around the edges that lie between four of them.
using MeshOwnCells = std::function<void(SmoothChunkMesh& out)>;

/// Replaces `out` by the surface of the centre chunk, where the chunk or a neighbour is of another level of detail.
///
/// Edges:    the shortest lattice edges at each place: on a face or a line between chunks, those of the finest chunk
///           that touches it. Each that is crossed gives a polygon of the vertices of the three or four cells around
///           it.
/// Vertices: a cell that touches no finer chunk along a face or an edge has the vertex of the fast kernels, bit for
///           bit. Any other has one if a shortest edge on its boundary is crossed: at the mean of their crossings,
///           weighted by length.
/// Order:    the fast kernel's vertices and quads, then the vertices it lacks, the quads, the triangles.
/// Requires: options.border is Shared.
/// Source:   T. Ju, F. Losasso, S. Schaefer, J. Warren, "Dual Contouring of Hermite Data" (2002): polygons of the
///           minimal edges of an octree; here of chunks of any levels. docs/decisions/020-smooth-levels-of-detail.md.
void mesh_with_transitions(const DensityNeighbourhood& chunks, const SmoothOptions& options,
                           const MeshOwnCells& mesh_own_cells, SmoothChunkMesh& out);

}  // namespace quoin::smooth
