#pragma once

#include <quoin/core/result.h>

namespace tinygltf {
class Model;
}

// KHR_draco_mesh_compression: primitives whose arrays are encoded together in one buffer view.
//
// Source: Khronos, "KHR_draco_mesh_compression"; Google's Draco implements the codec.

namespace quoin::triangles {

/// Returns true if this build decodes Draco.
[[nodiscard]] bool has_draco();

/// Decodes all compressed primitives; their accessors then refer to new buffers. Files without such primitives are
/// unchanged.
///
/// Memory: the decoded arrays, whose length must match their accessors.
/// Errors: BadFormat with the numbers of mesh and primitive; Unsupported for such primitives without Draco.
[[nodiscard]] Status decode_draco(tinygltf::Model& model);

}  // namespace quoin::triangles
