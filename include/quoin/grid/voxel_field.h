#pragma once

#include <quoin/core/parallel.h>
#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/core/vec.h>
#include <quoin/grid/chunk.h>
#include <quoin/grid/density_chunk.h>
#include <quoin/grid/density_grid.h>
#include <quoin/grid/grid.h>

namespace [[gnu::visibility("default")]] quoin {

/// Converts a voxel model to a rounded density field, the input of a smooth mesher. All voxels except air are solid.
///
/// Space:     sample (i, j, k) is the centre of voxel (i, j, k): point p of the field is point p + 0.5 of the grid.
/// Shape:     the distance to the nearest voxel centre of the other kind (solid or air), minus one half, smoothed by a
///            1 4 6 4 1 kernel along each axis. Densities keep the sign of their voxel, with a magnitude of at least
///            0.35 in solid voxels and 0.1 in air. The surface therefore separates the same voxels as before, and thin
///            parts remain. Band: 8 samples.
/// Materials: the types of the voxels.
/// Order:     the densities are the same at any thread count.
/// Cost:      about 5 ms per chunk near the surface, on each thread; little for other chunks.
/// Errors:    Cancelled.
[[nodiscard]] Result<DensityGrid> field_from_grid(const Grid& grid, Threads threads = {},
                                                  const Progress& progress = {});

/// Converts a density field to voxels: each solid sample becomes a voxel with its material.
///
/// Space:     sample (i, j, k) is the centre of voxel (i, j, k), the inverse of field_from_grid.
/// Materials: solid samples without a material (kAir) become `unnamed`.
/// Order:     the voxels are the same at any thread count.
/// Cost:      O(rows of 64 samples) of the field's chunks.
[[nodiscard]] Grid grid_from_field(const DensityGrid& field, VoxelType unnamed, Threads threads = {});

/// Maximum distance, in voxels, between a voxel and a density that depends on it. An edit farther than this from a
/// chunk does not change its densities.
inline constexpr int kVoxelFieldReach = 10;

/// Computes one chunk of `field_from_grid` from the centre chunk and its neighbours, even if the result is all far air.
/// Several threads may compute chunks at once.
[[nodiscard]] DensityChunk density_of_voxels(const Neighbourhood& chunks);
/// Updates the densities of a chunk after an edit. The result is bit-identical to density_of_voxels. `densities` holds
/// the state before the edit. `changed` contains the voxels that were added or removed, in chunk coordinates; it
/// extends beyond the chunk if its neighbours changed.
/// Cost: proportional to the affected rows along x; about 1 ms for one voxel.
void update_density_of_voxels(const Neighbourhood& chunks, const IBox& changed, DensityChunk& densities);

}  // namespace quoin
