#pragma once

#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/grid/grid.h>
#include <quoin/mesh/blocky.h>

namespace quoin {

/// How far apart vertices are moved where the surface would touch itself, in voxels.
inline constexpr float kApart = 0.01F;

/// The surface of all voxels that are not air as printers want it: closed, without T-junctions, and manifold: whoever
/// joins vertices of equal positions finds each edge in two triangles, once in each direction, and one fan of triangles
/// around each vertex.
///
/// Space:    voxels. Vertices as in build_blocky_mesh: one a corner of a face, with its direction and type; no
///           occlusion. Faces are not merged: two triangles each.
/// Touching: where voxels meet by an edge alone, or by a corner, the surface is parted: each side of it has vertices of
///           its own, moved by kApart into its voxel (where two hollows meet, into these), and the edge gets one in its
///           middle for each side. The five to eight corners of such a face are joined to its middle.
/// Order:    as Grid::for_each, then by direction.
/// Cost:     about 0.2 microseconds a voxel of the surface, on one thread.
/// Errors:   LimitExceeded beyond 2^32 vertices, or where voxels lie beyond 65,536; Cancelled.
[[nodiscard]] Result<BlockyTriangles> closed_surface(const Grid& grid, const Progress& progress = {});

}  // namespace quoin
