#pragma once

#include <quoin/grid/chunk.h>

#include "grid/change_records.h"

namespace quoin {

/// The differences between two states of a chunk; null means all air.
struct ChunkDifference {
  ChangeReach solid;  ///< voxels that are air in only one state
  ChangeReach types;  ///< voxels of different types, including `solid`
};

/// Records in `edit` the voxels whose type changes. Ignores data.
void difference_of_types(const Chunk& before, const Chunk& after, VoxelEdit& edit);

/// Calls `visit` for the rows that differ between two states of a chunk, by z, then y; null means all air.
/// Requires: the states are equal outside of the box `within` and of `slabs`. `chunk`: the chunk's coordinates.
void visit_other_rows(const Chunk* before, const Chunk* after, IVec3 chunk, const IBox& within, const ChunkSlabs& slabs,
                      FunctionRef<void(const RowChange&)> visit);

/// Requires: the states are equal outside of the box. Cost: O(rows of 64 voxels of the box); about 20 microseconds for
/// a chunk if both share their storage layout, as after a few edits.
[[nodiscard]] ChunkDifference difference(const Chunk* before, const Chunk* after, const IBox& within = kWholeChunk);

}  // namespace quoin
