#pragma once

#include <string>
#include <string_view>

#include <quoin/core/result.h>
#include <quoin/scene/scene.h>

#include "io/gltf_layout.h"

namespace quoin {

/// The JSON of a glTF file: compact, in a fixed order, names made valid UTF-8.
///
/// `buffer_uri` names the file that holds the buffer, percent-encoded; empty for the GLB's own.
/// Errors: InvalidArgument when a drawn instance's transform is not finite or its voxel size not positive.
[[nodiscard]] Result<std::string> gltf_json(const Scene& scene, const SceneMeshes& meshes, const GltfLayout& layout,
                                            std::string_view buffer_uri);

}  // namespace quoin
