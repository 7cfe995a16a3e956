#pragma once

#include <cstdint>

#include <quoin/core/parallel.h>
#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/core/vec.h>
#include <quoin/grid/density_chunk.h>
#include <quoin/grid/density_grid.h>
#include <quoin/terrain/terrain.h>

namespace quoin {

/// Which smooth world to make.
struct SmoothTerrainOptions {
  std::uint64_t seed = 42;
  /// In chunks of 64 samples: 1 to 512 along x and z, 1 to 16 upwards.
  IVec3 size{4, 2, 4};
  /// The lowest corner along x and z, in chunks, -2^19 to 2^19. The landscape has no end; a world is a piece of it.
  int first_x = 0;
  int first_z = 0;
  bool overhangs = true;
  bool caves = true;
};

/// Hills with ridges and valleys, cliffs that overhang, caves that open into the daylight and arches between them;
/// grass, earth and stone by slope and depth, sand in the valleys, snow on the heights. The forms grow with the world's
/// height, caves do not.
///
/// Space:    sample (0, 0, 0) is the lowest corner of chunk 0; the ground's height is that of `generate_terrain`, where
///           nothing overhangs.
/// Closed:   a block whose sides and floor are flat: its outermost samples on each side are air, half a sample from the
///           surface, and outside it is far air.
/// Density:  about the distance in samples, within a band of 8.
/// Bits:     the same on every machine, compiler and number of threads.
/// Cost:     about 15 ms a chunk that holds ground or caves, on each thread.
/// Errors:   InvalidArgument for sizes and places outside their ranges; Cancelled.
/// Requires: `types` was filled by `add_terrain_types`.
[[nodiscard]] Result<DensityGrid> generate_smooth_terrain(const SmoothTerrainOptions& options,
                                                          const TerrainTypes& types, Threads threads = {},
                                                          const Progress& progress = {});

/// One chunk of the same world, for those who need it piece by piece. All far air outside the world's box.
///
/// Requires: as `generate_smooth_terrain`, and sizes and places within their ranges.
[[nodiscard]] DensityChunk generate_smooth_terrain_chunk(const SmoothTerrainOptions& options, const TerrainTypes& types,
                                                         IVec3 chunk);

}  // namespace quoin
