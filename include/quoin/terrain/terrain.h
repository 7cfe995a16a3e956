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

namespace [[gnu::visibility("default")]] quoin {

/// Voxels per unit of the size of generated worlds.
inline constexpr int kTerrainUnit = 32;

/// Options of a generated world.
struct TerrainOptions {
  std::uint64_t seed = 42;
  /// In units of 32 voxels: 1 to 1,024 along x and z, 1 to 32 upwards.
  IVec3 size{4, 2, 4};
  /// The minimum corner along x and z, in units, -2^20 to 2^20. The landscape is endless; a world is a piece of it.
  /// Adjacent pieces of equal height fit together.
  int first_x = 0;
  int first_z = 0;
  bool caves = true;
  bool water = true;  ///< lakes and rivers; if false, their beds are dry
  bool plants = true;
  bool rocks = true;
};

/// The landscape's types, in the order in which `add_terrain_types` adds them. In an empty registry, grass, earth and
/// stone become 1, 2 and 3.
struct TerrainTypes {
  VoxelType grass = 0, earth = 0, stone = 0, sand = 0, snow = 0, water = 0, meadow = 0, gravel = 0, trunk = 0,
            leaves = 0, young_leaves = 0, needles = 0, rock = 0, dark_stone = 0;
};

/// Adds the landscape's types, or finds the existing ones.
///
/// Colours: grass, earth and stone are sRGB (0.3, 0.7, 0.2), (0.5, 0.3, 0.1) and (0.5, 0.5, 0.5), rounded to 8 bits.
///          Water is transparent.
/// Errors:  LimitExceeded if the registry is full.
[[nodiscard]] Result<TerrainTypes> add_terrain_types(VoxelRegistry& types);

/// Generates hills with ridges, river valleys and lakes; layers of grass, earth and stone; beaches, screes, snow;
/// caves, trees and rocks. Landforms scale with the world's height, trees do not.
///
/// Space:    voxel (0, 0, 0) is the minimum corner of unit 0. y = 0 is stone without caves. All voxels are below size.y
///           * 32.
/// Bits:     the same voxels, and the same storage, on every machine, compiler and number of threads.
/// Water:    has no air next to it or below it.
/// Cost:     about 1 microsecond per column of 128 voxels and thread.
/// Errors:   InvalidArgument for sizes and positions out of range; Cancelled.
/// Requires: `types` was filled by `add_terrain_types`.
[[nodiscard]] Result<Grid> generate_terrain(const TerrainOptions& options, const TerrainTypes& types,
                                            Threads threads = {}, const Progress& progress = {});

/// Generates one chunk of that world, for use piece by piece. Returns air outside the world's box.
///
/// Requires: as `generate_terrain`; sizes and positions are in range.
[[nodiscard]] Chunk generate_terrain_chunk(const TerrainOptions& options, const TerrainTypes& types, IVec3 chunk);

/// Options of a generated smooth world.
struct SmoothTerrainOptions {
  std::uint64_t seed = 42;
  /// In chunks of 64 samples: 1 to 512 along x and z, 1 to 16 upwards.
  IVec3 size{4, 2, 4};
  /// The minimum corner along x and z, in chunks, -2^19 to 2^19. The landscape is endless; a world is a piece of it.
  int first_x = 0;
  int first_z = 0;
  bool overhangs = true;
  bool caves = true;
};

/// Generates hills with ridges and valleys, overhanging cliffs, caves that open to the surface, and arches. Grass,
/// earth and stone depend on slope and depth; there is sand in valleys and snow on heights. Landforms scale with the
/// world's height, caves do not.
///
/// Space:    sample (0, 0, 0) is the minimum corner of chunk 0. Without overhangs, the ground height equals that of
///           `generate_terrain`.
/// Closed:   the world is a block with flat sides and floor. Its outermost samples on each side are air, half a sample
///           from the surface; outside, everything is far air.
/// Density:  approximately the distance in samples, within a band of 8.
/// Bits:     the same on every machine, compiler and number of threads.
/// Cost:     about 15 ms per chunk with ground or caves and per thread.
/// Errors:   InvalidArgument for sizes and positions out of range; Cancelled.
/// Requires: `types` was filled by `add_terrain_types`.
[[nodiscard]] Result<DensityGrid> generate_smooth_terrain(const SmoothTerrainOptions& options,
                                                          const TerrainTypes& types, Threads threads = {},
                                                          const Progress& progress = {});

/// Generates one chunk of that world, for use piece by piece. Returns far air outside the world's box.
///
/// Requires: as `generate_smooth_terrain`; sizes and positions are in range.
[[nodiscard]] DensityChunk generate_smooth_terrain_chunk(const SmoothTerrainOptions& options, const TerrainTypes& types,
                                                         IVec3 chunk);

}  // namespace quoin
