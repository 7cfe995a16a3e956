#pragma once

#include <quoin/core/result.h>

namespace tinygltf {
class Model;
}

// KHR_draco_mesh_compression: primitives whose arrays are coded together in one buffer view.
//
// Source: Khronos, "KHR_draco_mesh_compression"; the codec is Google's Draco.

namespace quoin::triangles {

/// Returns true if this build decodes Draco.
[[nodiscard]] bool has_draco();

/// Decodes all coded primitives: their accessors point into buffers of their own afterwards. A file without any stays
/// as it is.
///
/// Memory: the decoded arrays, which must be as long as the accessors say.
/// Errors: BadFormat with the numbers of mesh and primitive; Unsupported for such primitives without Draco.
[[nodiscard]] Status decode_draco(tinygltf::Model& model);

}  // namespace quoin::triangles
