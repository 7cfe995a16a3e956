#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/vec.h>
#include <quoin/grid/chunk.h>
#include <quoin/terrain/terrain.h>

#include "terrain/landform.h"

// The steps of generate_terrain_chunk: caves, ground with its cover, and plants.

namespace quoin::terrain {

/// The voxels of a chunk that tunnels pass through, as rows along x.
struct CaveMasks {
  std::array<std::uint64_t, kChunkEdge * kChunkEdge> rows{};  ///< [z][y]

  [[nodiscard]] std::uint64_t row(int y, int z) const {
    QUOIN_ASSERT((y | z) >= 0 && (y | z) < kChunkEdge, "0 <= y, z < 64");
    return rows[static_cast<std::size_t>(z * kChunkEdge + y)];
  }
};

/// Finds the tunnel voxels: tunnels run where two noises are both near zero. The noises are sampled at every fourth
/// voxel and interpolated.
///
/// `height`: number of the chunk's layers to search.
void find_caves(std::uint32_t seed, IVec3 chunk, int height, CaveMasks& out);

/// Makes one chunk of stone, soil, cover and water, with optional caves.
///
/// `columns`: the chunk's 64x64, x fastest. `part`: the part of the chunk within the world, in chunk coordinates.
[[nodiscard]] Chunk make_ground(const Landform& land, const std::vector<Column>& columns, const TerrainTypes& types,
                                IVec3 chunk, const IBox& part, bool has_caves);

enum class Growth : std::uint8_t { Rock, Bush, Broadleaf, Conifer };

/// A tree, a bush or a rock that stands on the ground.
struct Plant {
  IVec3 foot{0};  ///< the voxel of ground under its middle
  Growth growth = Growth::Rock;
  int height = 0;           ///< voxels above the ground
  std::uint32_t shape = 0;  ///< random bits for its appearance
};

/// Maximum horizontal reach of a plant from its foot.
inline constexpr int kPlantReach = 4;

/// Returns the plants that can reach into the square of columns, sorted by z, then x, of their sites. Only plants that
/// lie within `world` are included.
[[nodiscard]] std::vector<Plant> plants_near(const Landform& land, const TerrainOptions& options, const IBox& world,
                                             int first_x, int first_z, int edge);

/// Draws the parts of plants that lie in a chunk: rocks first, then leaves, which only replace air, then trunks. The
/// result does not depend on the chunk's borders.
void draw_plants(const std::vector<Plant>& plants, const TerrainTypes& types, IVec3 chunk, Chunk& out);

}  // namespace quoin::terrain
