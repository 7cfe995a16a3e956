#pragma once

#include <cstdint>
#include <vector>

#include <quoin/core/vec.h>
#include <quoin/grid/chunk.h>
#include <quoin/terrain/terrain.h>

#include "terrain/landform.h"

namespace quoin::terrain {

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
