#pragma once

#include <vector>

#include <quoin/core/parallel.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/scene/scene.h>

#include "io/scene_file/json_reader.h"

namespace quoin::scene_json {

/// Reads the list "types" of a scene file, if present: type 1, 2 and so on.
[[nodiscard]] VoxelRegistry read_types(const Object& file);

/// Reads the list "grids" of a scene file of `file_bytes`, if present; its voxels use `types`.
[[nodiscard]] std::vector<SceneGrid> read_grids(const Object& file, const VoxelRegistry& types, std::size_t file_bytes,
                                                Threads threads);

}  // namespace quoin::scene_json
