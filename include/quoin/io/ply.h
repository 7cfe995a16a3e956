#pragma once

#include <cstdint>
#include <filesystem>

#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/io/scene_meshes.h>
#include <quoin/scene/scene.h>

namespace quoin {

/// Writes the blocky meshes of a scene as a PLY file, as `write_ply` in smooth_files.h does smooth ones: every vertex
/// with its face's normal and the colour of its voxel, times its occlusion where the meshes have it. Answers the size.
///
/// Lost:     transparency, metal and emission: PLY's vertices have colours and nothing else.
/// Requires: as write_glb.
/// Errors:   as write_glb, but that the limit is 2^31 - 1 vertices or triangles.
[[nodiscard]] Result<std::uint64_t> write_ply(const Scene& scene, const SceneMeshes& meshes,
                                              const std::filesystem::path& path, const Progress& progress = {});

}  // namespace quoin
