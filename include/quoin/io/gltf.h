#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/io/scene_meshes.h>
#include <quoin/scene/scene.h>

namespace quoin {

/// Writes a scene as one binary glTF 2.0 file and answers its size in bytes.
///
/// Space:     Quoin's axes are glTF's (+Y up, the front towards +Z); one world unit is a metre. A node per drawn
///            instance carries translation, rotation and a positive uniform scale; vertices are relative to the grid's
///            pivot. Instances of one grid share its mesh; mirrored ones share a second, reflected mesh.
/// Colours:   a palette texture, 256 texels wide, with one texel a voxel type (nearest, clamped), and beside it one
///            with roughness (green) and metalness (blue). Occlusion, where the meshes have it, is grey in COLOR_0.
/// Materials: opaque, transparent (blended, alpha in the palette), and emissive ones. Emission is texture times
///            emissiveFactor times KHR_materials_emissive_strength; strengths within a factor of two share a material
///            and are scaled in the texture, so that its 8 bits cost them at most one more bit.
/// Order:     the same bytes on every run.
/// Requires:  `meshes` are what mesh_scene made of this scene, and its types and grids are still the same.
/// Errors:    CannotWrite; LimitExceeded beyond glTF's 4 GiB a file; InvalidArgument when an instance's transform is
///            not finite or its voxel size not positive; Cancelled. No file is left or replaced then.
/// Source:    Khronos glTF 2.0 specification, sections 3 and 4.4; KHR_materials_emissive_strength.
[[nodiscard]] Result<std::uint64_t> write_glb(const Scene& scene, const SceneMeshes& meshes,
                                              const std::filesystem::path& path, const Progress& progress = {});

/// The same content as text: `path` holds the JSON, and a file of the same name ending in ".bin" the buffer and images
/// (none when nothing is drawn). Both replace what is there.
///
/// Answers the size of both. Errors: as write_glb, without the limit of 4 GiB.
[[nodiscard]] Result<std::uint64_t> write_gltf(const Scene& scene, const SceneMeshes& meshes,
                                               const std::filesystem::path& path, const Progress& progress = {});

/// The files that write_gltf writes or replaces, `path` first.
[[nodiscard]] std::vector<std::filesystem::path> gltf_files(const SceneMeshes& meshes,
                                                            const std::filesystem::path& path);

}  // namespace quoin
