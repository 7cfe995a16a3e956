#pragma once

#include <quoin/grid/chunk.h>

#include "grid/change_reach.h"

namespace quoin {

/// Where two states of a chunk differ; null is all air.
struct ChunkDifference {
  ChangeReach solid;  ///< voxels that are air in one of them only
  ChangeReach types;  ///< voxels of another type, those too
};

/// Cost: O(rows of 64 voxels); about 20 microseconds where the storage of both is alike, as after a few edits.
[[nodiscard]] ChunkDifference difference(const Chunk* before, const Chunk* after);

}  // namespace quoin
