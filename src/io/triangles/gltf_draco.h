#pragma once

#include <quoin/core/result.h>

namespace tinygltf {
class Model;
}

// KHR_draco_mesh_compression: primitives whose arrays are coded together in one buffer view.
//
// Source: Khronos, "KHR_draco_mesh_compression"; Google's Draco implements the codec.

namespace quoin::triangles {

/// Returns true if this build decodes Draco.
[[nodiscard]] bool has_draco();

/// Decodes all coded primitives; their accessors then refer to new buffers. A file without such primitives is
/// unchanged.
///
/// Memory: the decoded arrays, which must have the length in their accessors.
/// Errors: BadFormat with the numbers of mesh and primitive; Unsupported for such primitives without Draco.
[[nodiscard]] Status decode_draco(tinygltf::Model& model);

}  // namespace quoin::triangles
