#pragma once

#include <filesystem>
#include <memory>

#include <quoin/core/parallel.h>
#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/io/chunk_source.h>
#include <quoin/io/formats.h>
#include <quoin/store/world_store.h>

// Sources of maps for worlds that open_chunk_source does not read.

namespace quoin::map {

/// Returns the grid of a world on disk with the most chunks. Warns of other grids. Errors: those of WorldStore.
[[nodiscard]] Result<std::unique_ptr<ChunkSource>> source_of_world(WorldStore world);

/// Returns the voxels of a scene. Where instances overlap, the last one counts. Memory: the voxels of all instances.
/// Errors: Unsupported for density fields, rotations that are not multiples of 90 degrees, and voxels of different
/// sizes.
[[nodiscard]] Result<std::unique_ptr<ChunkSource>> source_of_scene(LoadedScene loaded,
                                                                   const std::filesystem::path& path);

}  // namespace quoin::map
