#pragma once

#include <cstdint>
#include <vector>

#include <quoin/store/world_store.h>
#include <quoin/terrain/terrain.h>

namespace quoin {

/// Mixed chunks of generated terrain, in their places, a fifth of them edited as players do; the same on every machine.
struct TerrainChunks {
  VoxelRegistry types;
  std::vector<ChunkAddress> places;
  std::vector<StoredChunk> chunks;

  /// `units`: of 32 voxels along x and z.
  explicit TerrainChunks(int units) {
    const auto terrain_types = add_terrain_types(types).value();
    const auto terrain = generate_terrain({.size = {units, 8, units}}, terrain_types);
    for (const IVec3 place : terrain->chunks()) {
      Chunk chunk = *terrain->find_chunk(place);
      if (chunk.uniform()) continue;
      if (chunks.size() % 5 == 0) edit(chunk, terrain_types.stone, static_cast<std::uint32_t>(chunks.size()));
      places.push_back({0, 0, place});
      chunks.push_back({chunk});
    }
  }

 private:
  // Removes and adds single voxels and small boxes.
  static void edit(Chunk& chunk, VoxelType added, std::uint32_t seed) {
    for (int i = 0; i < 40; ++i) {
      seed = seed * 1'664'525U + 1'013'904'223U;
      const IVec3 at{static_cast<int>(seed >> 8 & 63U), static_cast<int>(seed >> 14 & 63U),
                     static_cast<int>(seed >> 20 & 63U)};
      const int edge = i % 8 == 0 ? 5 : 1;
      chunk.fill_box({at, at + IVec3{edge}}, i % 2 == 0 ? kAir : added, [](int, int, std::uint64_t) {});
    }
  }
};

}  // namespace quoin
