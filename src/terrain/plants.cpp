#include "terrain/terrain_parts.h"

#include <algorithm>
#include <optional>

#include <quoin/core/assert.h>
#include <quoin/terrain/noise.h>

namespace quoin::terrain {
namespace {

constexpr std::uint32_t kTreeStream = 0xC00;
constexpr std::uint32_t kRockStream = 0xD00;
constexpr int kTreeSpacing = 6;
constexpr int kRockSpacing = 13;

// Returns a number from 0 to `choices` - 1 from at least four bits of a hash.
int pick(std::uint32_t hash, int shift, int choices) {
  QUOIN_ASSERT(shift >= 0 && shift <= 28 && choices > 0 && choices <= 256, "at least four bits, and 1 to 256 choices");
  return static_cast<int>((hash >> shift & 0xFFU) * static_cast<std::uint32_t>(choices) >> 8);
}

bool fits(const Plant& plant, const IBox& world) {
  const IVec3 reach{kPlantReach, 0, kPlantReach};
  return world.contains(plant.foot - reach) && world.contains(plant.foot + reach + IVec3{0, plant.height, 0});
}

std::optional<Plant> tree_in_cell(const Landform& land, int cell_x, int cell_z) {
  const std::uint32_t hash = hash_of(land.seed() + kTreeStream, cell_x, cell_z);
  const int x = cell_x * kTreeSpacing + pick(hash, 0, kTreeSpacing - 2);
  const int z = cell_z * kTreeSpacing + pick(hash, 8, kTreeSpacing - 2);
  const double forest = land.forest(x, z);
  const auto chance = static_cast<double>(hash >> 16 & 0xFFU) * (1.0 / 256.0);
  if (chance > std::clamp(forest, 0.05, 0.85)) return std::nullopt;
  const Column column = land.column(x, z);
  const bool is_soil = column.surface == Surface::Grass || column.surface == Surface::Meadow;
  if (!is_soil || column.height <= land.sea() + 1 || column.height - column.lowest > 2) return std::nullopt;
  Plant plant;
  plant.shape = mix_bits(hash);
  plant.foot = {x, column.height, z};
  const int above_sea = column.height - land.sea();
  const bool is_high = above_sea > land.top() / 5 + pick(plant.shape, 0, 7) - 3;
  if (forest < 0.0 || pick(plant.shape, 8, 9) == 0) {
    plant.growth = Growth::Bush;
    plant.height = 2;
  } else if (is_high || pick(plant.shape, 12, 8) == 0) {
    plant.growth = Growth::Conifer;
    plant.height = 8 + pick(plant.shape, 16, 6);
  } else {
    plant.growth = Growth::Broadleaf;
    plant.height = 7 + pick(plant.shape, 16, 4);
  }
  return plant;
}

std::optional<Plant> rock_in_cell(const Landform& land, int cell_x, int cell_z) {
  const std::uint32_t hash = hash_of(land.seed() + kRockStream, cell_x, cell_z);
  if (pick(hash, 16, 100) >= 30) return std::nullopt;
  const int x = cell_x * kRockSpacing + pick(hash, 0, kRockSpacing);
  const int z = cell_z * kRockSpacing + pick(hash, 8, kRockSpacing);
  const Column column = land.column(x, z);
  if (column.is_steep || column.surface == Surface::Snow) return std::nullopt;
  return Plant{{x, column.height, z}, Growth::Rock, 3, mix_bits(hash)};
}

int cell_of(int voxel, int spacing) {
  QUOIN_ASSERT(spacing > 0, "a positive spacing");
  return voxel >= 0 ? voxel / spacing : -((spacing - 1 - voxel) / spacing);
}

template <class InCell>
void add_plants(int spacing, const IBox& world, IVec3 first, IVec3 last, InCell&& in_cell, std::vector<Plant>& out) {
  for (int z = cell_of(first.z, spacing); z <= cell_of(last.z, spacing); ++z) {
    for (int x = cell_of(first.x, spacing); x <= cell_of(last.x, spacing); ++x) {
      const std::optional<Plant> plant = in_cell(x, z);
      if (plant && fits(*plant, world)) out.push_back(*plant);
    }
  }
}

/// Writes single voxels; skips voxels outside the chunk.
class Painter {
 public:
  Painter(IVec3 chunk, Chunk& out) : origin_(chunk * kChunkEdge), chunk_(out) {}

  void put(IVec3 voxel, VoxelType type, bool only_in_air) {
    const IVec3 local = voxel - origin_;
    if (chunk_of(local) != IVec3{0}) return;
    if (only_in_air && chunk_.get(local) != kAir) return;
    chunk_.set(local, type);
  }

  /// Fills the voxels whose centre lies in an ellipsoid with a rough border, varied by `shape`.
  void put_ball(IVec3 middle, double across, double up, VoxelType type, std::uint32_t shape, bool only_in_air) {
    QUOIN_ASSERT(across > 0.0 && up > 0.0, "positive radii");
    const double per_across = 1.0 / (across * across);
    const double per_up = 1.0 / (up * up);
    for (int z = -kPlantReach; z <= kPlantReach; ++z) {
      for (int y = -kPlantReach; y <= kPlantReach; ++y) {
        for (int x = -kPlantReach; x <= kPlantReach; ++x) {
          const double fray = static_cast<double>(hash_of(shape, x, y, z) >> 24) * (0.45 / 256.0);
          if ((x * x + z * z) * per_across + y * y * per_up + fray > 1.15) continue;
          put(middle + IVec3{x, y, z}, type, only_in_air);
        }
      }
    }
  }

 private:
  IVec3 origin_;
  Chunk& chunk_;
};

void draw_conifer(Painter& painter, const Plant& plant, VoxelType needles) {
  for (int y = 2; y <= plant.height; ++y) {
    const int below_tip = plant.height - y;
    const double radius = 0.4 + 0.30 * below_tip - (below_tip % 2 == 0 ? 0.0 : 0.8) + 0.02 * (plant.shape & 15U);
    const double r = std::min(radius, 3.2);
    const int reach = 3;
    for (int z = -reach; z <= reach; ++z) {
      for (int x = -reach; x <= reach; ++x) {
        const bool is_stem = x == 0 && z == 0;
        if (is_stem || x * x + z * z <= r * r) painter.put(plant.foot + IVec3{x, y, z}, needles, true);
      }
    }
  }
}

void draw_leaves(Painter& painter, const Plant& plant, const TerrainTypes& types) {
  const VoxelType leaves = (plant.shape >> 28) < 5 ? types.young_leaves : types.leaves;
  const double size = 0.05 * (plant.shape >> 20 & 15U);
  if (plant.growth == Growth::Conifer) {
    draw_conifer(painter, plant, types.needles);
  } else if (plant.growth == Growth::Broadleaf) {
    painter.put_ball(plant.foot + IVec3{0, plant.height - 3, 0}, 2.6 + size, 2.5, leaves, plant.shape, true);
  } else if (plant.growth == Growth::Bush) {
    painter.put_ball(plant.foot + IVec3{0, 1, 0}, 1.2 + size, 1.2, leaves, plant.shape, true);
  }
}

}  // namespace

std::vector<Plant> plants_near(const Landform& land, const TerrainOptions& options, const IBox& world, int first_x,
                               int first_z, int edge) {
  const IVec3 first{first_x - kPlantReach, 0, first_z - kPlantReach};
  const IVec3 last{first_x + edge - 1 + kPlantReach, 0, first_z + edge - 1 + kPlantReach};
  std::vector<Plant> plants;
  if (options.rocks) {
    add_plants(
        kRockSpacing, world, first, last, [&](int x, int z) { return rock_in_cell(land, x, z); }, plants);
  }
  if (options.plants) {
    add_plants(
        kTreeSpacing, world, first, last, [&](int x, int z) { return tree_in_cell(land, x, z); }, plants);
  }
  return plants;
}

void draw_plants(const std::vector<Plant>& plants, const TerrainTypes& types, IVec3 chunk, Chunk& out) {
  Painter painter(chunk, out);
  for (const Plant& plant : plants) {
    if (plant.growth != Growth::Rock) continue;
    const double size = 1.3 + 0.09 * (plant.shape & 15U);
    painter.put_ball(plant.foot + IVec3{0, 1, 0}, size, 0.75 * size, types.rock, plant.shape, false);
  }
  for (const Plant& plant : plants) {
    if (plant.growth != Growth::Rock) draw_leaves(painter, plant, types);
  }
  for (const Plant& plant : plants) {
    if (plant.growth != Growth::Broadleaf && plant.growth != Growth::Conifer) continue;
    const int stem = plant.growth == Growth::Conifer ? plant.height - 6 : plant.height - 3;
    for (int y = 1; y <= stem; ++y) painter.put(plant.foot + IVec3{0, y, 0}, types.trunk, false);
  }
}

}  // namespace quoin::terrain
