#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <quoin/core/vec.h>
#include <quoin/grid/chunk.h>
#include <quoin/terrain/terrain.h>

#include "terrain/landform.h"

// What generate_terrain_chunk puts together: caves, the ground with what covers it, and what stands on that.

namespace quoin::terrain {

/// Which voxels of a chunk tunnels pass through, as rows along x.
struct CaveMasks {
  std::array<std::uint64_t, kChunkEdge * kChunkEdge> rows{};  ///< [z][y]

  [[nodiscard]] std::uint64_t row(int y, int z) const { return rows[static_cast<std::size_t>(z * kChunkEdge + y)]; }
};

/// Tunnels run where two noises are both near zero. The noises are taken at every fourth voxel and interpolated.
///
/// `height`: up to which layer of the chunk to look.
void find_caves(std::uint32_t seed, IVec3 chunk, int height, CaveMasks& out);

/// One chunk of stone, soil, cover and water, with caves where asked for.
///
/// `columns`: the chunk's 64x64, x fastest. `part`: what of the chunk lies in the world, in the chunk's coordinates.
[[nodiscard]] Chunk make_ground(const Landform& land, const std::vector<Column>& columns, const TerrainTypes& types,
                                IVec3 chunk, const IBox& part, bool has_caves);

enum class Growth : std::uint8_t { Rock, Bush, Broadleaf, Conifer };

/// A tree, a bush or a rock that stands on the ground.
struct Plant {
  IVec3 foot{0};  ///< the voxel of ground under its middle
  Growth growth = Growth::Rock;
  int height = 0;           ///< voxels above the ground
  std::uint32_t shape = 0;  ///< random bits for its looks
};

/// No plant reaches further than this from its foot, sideways.
inline constexpr int kPlantReach = 4;

/// What stands so that it can reach into the square of columns: sorted by z, then x, of the places where it could
/// stand. Only plants that lie within `world` are there.
[[nodiscard]] std::vector<Plant> plants_near(const Landform& land, const TerrainOptions& options, const IBox& world,
                                             int first_x, int first_z, int edge);

/// Draws the parts that lie in a chunk. Rocks first, then leaves, which only replace air, then trunks, so that the
/// outcome does not depend on the chunk's borders.
void draw_plants(const std::vector<Plant>& plants, const TerrainTypes& types, IVec3 chunk, Chunk& out);

}  // namespace quoin::terrain
