#pragma once

#include <cstdint>
#include <optional>

#include <quoin/core/vec.h>
#include <quoin/grid/chunk.h>
#include <quoin/grid/density_chunk.h>

namespace quoin {

/// Which chunk of a world.
struct ChunkPlace {
  std::uint32_t grid = 0;  ///< the grid's number in the world, which no other grid ever has
  std::uint8_t level = 0;  ///< its voxels have edges of 2^level
  IVec3 chunk{0};          ///< as Grid::find_chunk

  bool operator==(const ChunkPlace&) const = default;
};

/// What a world holds of a chunk. Air counts: a chunk that is kept as air was made and is empty, one that is not kept
/// was never made.
struct StoredChunk {
  Chunk voxels{kAir};  ///< with the data at voxels
  std::optional<DensityChunk> densities = std::nullopt;

  bool operator==(const StoredChunk&) const = default;
};

}  // namespace quoin
