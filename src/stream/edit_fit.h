#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <unordered_map>
#include <vector>

#include <quoin/core/result.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/store/world_store.h>
#include <quoin/stream/world_edit.h>

// Checks edits from outside: edits that a world could not save are rejected.

namespace quoin::stream {

/// Checks an edit's types. Errors: InvalidArgument for types that the world does not have.
[[nodiscard]] Status check_types(const WorldEdit& edit, const VoxelRegistry& types);
/// Applies an edit as `apply_edit`, but drops data that a voxel's type cannot hold, equally on every machine.
std::int64_t apply_fitting(const WorldEdit& edit, Grid& grid, DensityGrid& field, const VoxelRegistry& types);

/// Edits that wait for chunks, in order.
using WaitingEdits = std::unordered_map<IVec3, std::vector<std::shared_ptr<const WorldEdit>>, CoordinateHash>;

/// Applies waiting edits to a chunk that was loaded. `band`: of the grid's field. Returns nullopt if none changed it.
[[nodiscard]] std::optional<StoredChunk> edited(const std::vector<std::shared_ptr<const WorldEdit>>& edits, IVec3 at,
                                                const StoredChunk& chunk, float band, const VoxelRegistry& types);

/// Keeps an edit for chunks that are not loaded; splits an edit of many voxels by chunk.
void keep_for(const WorldEdit& edit, const std::vector<IVec3>& chunks, WaitingEdits& waiting);

}  // namespace quoin::stream
