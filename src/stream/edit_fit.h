#pragma once

#include <cstdint>

#include <quoin/core/result.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/stream/world_edit.h>

// Edits come from elsewhere: what a world could not save is not done.

namespace quoin::stream {

/// Errors: InvalidArgument for types that the world does not have.
[[nodiscard]] Status check_types(const WorldEdit& edit, const VoxelRegistry& types);
/// As `apply_edit`; data that a voxel's type has no room for is left out, on every machine alike.
std::int64_t apply_fitting(const WorldEdit& edit, Grid& grid, DensityGrid& field, const VoxelRegistry& types);

}  // namespace quoin::stream
