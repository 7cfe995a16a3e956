#pragma once

#include <quoin/grid/chunk.h>
#include <quoin/grid/density_chunk.h>
#include <quoin/grid/voxel_registry.h>

namespace quoin {

/// One chunk of voxels as the field that rays are to meet: `density_of_voxels`, but that samples beside some faces
/// between voxels are half a voxel from the surface, so that it runs along these faces. Smooth meshes have the like by
/// moving vertices (mesh/surface/shape.h), and what blocks have they absorb light by.
///
/// Thin:   faces of what is one voxel thick along an axis, solid or a gap, unless it goes on at a slant.
/// Slabs:  faces in the midst of 3x3 such ones, of what is four voxels thick or less. The blur that rounds steps, which
///         looks two voxels far, would take up to a quarter of their thickness.
/// Edges:  two solid voxels that touch by an edge alone are joined there, as in meshes.
/// Bodies: faces between solid voxels of different bodies (mesh/surface/bodies.h): water and its bed.
///
/// Cost: that of `density_of_voxels`, and as much again.
[[nodiscard]] DensityChunk marched_density(const Neighbourhood& voxels, const VoxelRegistry& types);

}  // namespace quoin
