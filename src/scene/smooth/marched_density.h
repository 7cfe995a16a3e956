#pragma once

#include <quoin/grid/chunk.h>
#include <quoin/grid/density_chunk.h>
#include <quoin/grid/voxel_registry.h>

namespace quoin {

/// Computes the field that rays trace for one chunk of voxels. It is `density_of_voxels`, except that samples next to
/// some faces between voxels are half a voxel from the surface, so that the surface runs along these faces. Smooth
/// meshes achieve the same by moving vertices (mesh/surface/voxel_surface.h). Light is absorbed by the length in the
/// original blocks.
///
/// Thin:   faces of features one voxel thick along an axis, solid or gap, unless the feature continues at a slant.
/// Slabs:  faces in the middle of 3x3 such faces, of features at most four voxels thick. The blur that rounds steps
///         has a radius of two voxels and would take up to a quarter of their thickness.
/// Edges:  two solid voxels that touch only by an edge are joined there, as in meshes.
/// Bodies: faces between solid voxels of different bodies (mesh/surface/voxel_surface.h): water and its bed.
///
/// Cost: twice that of `density_of_voxels`.
[[nodiscard]] DensityChunk marched_density(const Neighbourhood& voxels, const VoxelRegistry& types);

}  // namespace quoin
