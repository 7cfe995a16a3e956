#pragma once

#include <cstdint>
#include <optional>

#include <quoin/core/vec.h>
#include <quoin/grid/chunk.h>
#include <quoin/grid/density_chunk.h>

namespace quoin {

/// The address of a chunk in a world.
struct ChunkAddress {
  std::uint32_t grid = 0;  ///< the grid's number in the world; never reused
  std::uint8_t level = 0;  ///< level of detail: voxels have edges of 2^level
  IVec3 chunk{0};          ///< chunk coordinates, as in Grid::find_chunk

  bool operator==(const ChunkAddress&) const = default;
};

/// The stored content of a chunk. A chunk stored as air was generated and is empty; a chunk that is not stored was
/// never generated.
struct StoredChunk {
  Chunk voxels{kAir};  ///< with per-voxel data
  std::optional<DensityChunk> densities = std::nullopt;

  bool operator==(const StoredChunk&) const = default;
};

}  // namespace quoin
