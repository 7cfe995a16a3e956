#pragma once

#include <cstdint>

#include <quoin/core/parallel.h>
#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/core/vec.h>
#include <quoin/grid/density_chunk.h>
#include <quoin/grid/density_grid.h>
#include <quoin/grid/grid.h>
#include <quoin/grid/voxel_registry.h>

namespace quoin {

/// Voxels along the edge of the unit in which the size of generated worlds is counted.
inline constexpr int kTerrainUnit = 32;

/// Which world to make.
struct TerrainOptions {
  std::uint64_t seed = 42;
  /// In units of 32 voxels: 1 to 1,024 along x and z, 1 to 32 upwards.
  IVec3 size{4, 2, 4};
  /// The lowest corner along x and z, in units, -2^20 to 2^20. The landscape has no end; a world is a piece cut out of
  /// it, and pieces of equal height cut side by side fit together.
  int first_x = 0;
  int first_z = 0;
  bool caves = true;
  bool water = true;  ///< lakes and rivers; without, their beds lie dry
  bool plants = true;
  bool rocks = true;
};

/// What the landscape is made of, in the order in which `add_terrain_types` adds it: into an empty registry grass,
/// earth and stone become 1, 2 and 3.
struct TerrainTypes {
  VoxelType grass = 0, earth = 0, stone = 0, sand = 0, snow = 0, water = 0, meadow = 0, gravel = 0, trunk = 0,
            leaves = 0, young_leaves = 0, needles = 0, rock = 0, dark_stone = 0;
};

/// Adds the landscape's materials, or finds them where they are already there.
///
/// Colours: grass, earth and stone are sRGB (0.3, 0.7, 0.2), (0.5, 0.3, 0.1) and (0.5, 0.5, 0.5), rounded to 8 bits.
/// Water is transparent.
/// Errors:  LimitExceeded when the registry is full.
[[nodiscard]] Result<TerrainTypes> add_terrain_types(VoxelRegistry& types);

/// Hills with ridges, river valleys and lakes; grass, earth and stone in layers; beaches, screes, snow; caves, trees
/// and rocks. The forms grow with the world's height, trees do not.
///
/// Space:    voxel (0, 0, 0) is the lowest corner of unit 0; y = 0 is stone, without caves; everything lies below
///           size.y * 32.
/// Bits:     the same voxels, and the same storage, on every machine, compiler and number of threads.
/// Water:    no air lies beside or below it.
/// Cost:     about a microsecond a column of 128 voxels, on each thread.
/// Errors:   InvalidArgument for sizes and places outside their ranges; Cancelled.
/// Requires: `types` was filled by `add_terrain_types`.
[[nodiscard]] Result<Grid> generate_terrain(const TerrainOptions& options, const TerrainTypes& types,
                                            Threads threads = {}, const Progress& progress = {});

/// One chunk of the same world, for those who need it piece by piece. All air outside the world's box.
///
/// Requires: as `generate_terrain`, and sizes and places within their ranges.
[[nodiscard]] Chunk generate_terrain_chunk(const TerrainOptions& options, const TerrainTypes& types, IVec3 chunk);

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
