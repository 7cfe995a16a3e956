#pragma once

#include <quoin/core/parallel.h>
#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/core/vec.h>
#include <quoin/grid/chunk.h>
#include <quoin/grid/density_chunk.h>
#include <quoin/grid/density_grid.h>
#include <quoin/grid/grid.h>

namespace quoin {

/// The density of a voxel model, rounded: what a smooth mesh of it is made from. Every voxel but air is solid.
///
/// Space:     sample (i, j, k) stands for the centre of voxel (i, j, k): point p of the field is point p + 0.5 of the
///            grid.
/// Shape:     the distance to the nearest voxel centre of the other kind, less one half, smoothed by a 1 4 6 4 1 kernel
///            along each axis; of its voxel's sign everywhere, at least 0.35 from 0 in solid voxels and 0.1 in air, so
///            that the surface runs between the voxels that it ran between before, and nothing thin is lost. Within a
///            band of 8 samples.
/// Materials: the voxels' types.
/// Order:     the same densities at any thread count.
/// Cost:      about 5 ms a chunk that the surface comes near, on each thread; little for the others.
/// Errors:    Cancelled.
[[nodiscard]] Result<DensityGrid> field_from_grid(const Grid& grid, Threads threads = {},
                                                  const Progress& progress = {});

/// The voxels of a field: one at each sample that is solid, of the sample's material.
///
/// Space:     voxel (i, j, k) has sample (i, j, k) at its centre: as field_from_grid, the other way round.
/// Materials: `unnamed` in place of those that are air.
/// Order:     the same voxels at any thread count.
/// Cost:      O(rows of 64 samples) of the field's chunks.
[[nodiscard]] Grid grid_from_field(const DensityGrid& field, VoxelType unnamed, Threads threads = {});

/// How far, in voxels, the density of a sample looks: an edit that is farther than this from a chunk leaves its
/// densities as they were.
inline constexpr int kVoxelFieldReach = 10;

/// One chunk of that field, of the centre's voxels and those around them: what `field_from_grid` puts there, all far
/// air included. Several threads may make chunks at once.
[[nodiscard]] DensityChunk density_of_voxels(const Neighbourhood& chunks);
/// Makes the densities of a chunk, as they were before an edit, those of its voxels as they are now, to the same bits.
/// `changed`: holds the voxels that came or went, in the chunk's coordinates; beyond the chunk where its neighbours
/// changed. Cost: of the rows along x that these reach, about 1 ms for one voxel.
void update_density_of_voxels(const Neighbourhood& chunks, const IBox& changed, DensityChunk& densities);

}  // namespace quoin
