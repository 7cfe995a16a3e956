#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/io/scene_meshes.h>
#include <quoin/scene/scene.h>

namespace quoin {

/// Writes a scene as Wavefront OBJ with its materials (MTL) and palette (PNG) beside it; answers the size of all.
///
/// Files:     for NAME.obj also NAME.mtl, NAME_palette.png and, where a voxel emits light, NAME_emissive.png, beside
///            it. They replace what is there.
/// Space:     world units, baked: an object per drawn instance, since OBJ knows neither transforms nor sharing.
///            Coordinates are rounded to a millionth of a unit.
/// Occlusion: where the meshes have it, as grey after the coordinates of a vertex ("v x y z r g b"), an extension that
///            many programs read and the others skip.
/// Requires:  as write_glb.
/// Errors:    as write_gltf.
[[nodiscard]] Result<std::uint64_t> write_obj(const Scene& scene, const SceneMeshes& meshes,
                                              const std::filesystem::path& path, const Progress& progress = {});

/// The files that write_obj writes or replaces, `path` first.
[[nodiscard]] std::vector<std::filesystem::path> obj_files(const SceneMeshes& meshes,
                                                           const std::filesystem::path& path);

}  // namespace quoin
