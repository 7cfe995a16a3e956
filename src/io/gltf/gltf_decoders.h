#pragma once

#include <cstddef>
#include <span>
#include <string_view>
#include <vector>

#include <quoin/core/result.h>

namespace tinygltf {
class Model;
}

// EXT_meshopt_compression: views with encoded bytes, which are in another buffer than the view's own.
// KHR_draco_mesh_compression: primitives whose arrays are encoded together in one buffer view.
//
// Sources: Khronos, "EXT_meshopt_compression" and "KHR_draco_mesh_compression"; meshoptimizer and Google's Draco
// implement the codecs.

namespace quoin::triangles {

[[nodiscard]] bool is_glb(std::span<const std::byte> beginning);

/// Returns true if this build can decode meshopt compression.
[[nodiscard]] bool has_meshopt();

/// Returns the file in a form that tinygltf reads; empty if it already is. Buffers that only stand for decoded views,
/// searched by tinygltf, become one byte. Draco-coded indices, whose accessor tinygltf rejects since it has no
/// view, move into the primitive's extension. `json`: the file's JSON, within `file`. Invalid JSON is left to tinygltf.
[[nodiscard]] std::vector<std::byte> readable_by_tinygltf(std::span<const std::byte> file, std::string_view json);

/// Decodes all coded views into new buffers; the views then refer to these.
///
/// Memory: at most 256 times the file's buffers; larger results are rejected before allocation.
/// Errors: BadFormat with the view's number; Unsupported without meshoptimizer.
[[nodiscard]] Status decode_views(tinygltf::Model& model);

/// Returns true if this build decodes Draco.
[[nodiscard]] bool has_draco();

/// Decodes all compressed primitives; their accessors then refer to new buffers. Files without such primitives are
/// unchanged.
///
/// Memory: the decoded arrays, whose length must match their accessors.
/// Errors: BadFormat with the numbers of mesh and primitive; Unsupported for such primitives without Draco.
[[nodiscard]] Status decode_draco(tinygltf::Model& model);

}  // namespace quoin::triangles
