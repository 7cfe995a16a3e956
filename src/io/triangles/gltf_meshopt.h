#pragma once

#include <cstddef>
#include <span>
#include <string_view>
#include <vector>

#include <quoin/core/result.h>

namespace tinygltf {
class Model;
}

// EXT_meshopt_compression: views whose bytes are coded, and lie in another buffer than the view says.
//
// Source: Khronos, "EXT_meshopt_compression"; the codecs are meshoptimizer's.

namespace quoin::triangles {

/// Returns true if this build can decode them.
[[nodiscard]] bool has_meshopt();

/// Returns the file as tinygltf reads it; empty if it does so already. Buffers that stand for decoded views alone,
/// which tinygltf would look for, become one byte. Indices that Draco codes, whose accessor tinygltf refuses since it
/// has no view, move into the primitive's extension. `json`: the file's, within it. JSON that cannot be parsed is left
/// to tinygltf.
[[nodiscard]] std::vector<std::byte> readable_by_tinygltf(std::span<const std::byte> file, std::string_view json);

/// Decodes all coded views into new buffers; the views then refer to these.
///
/// Memory: at most 256 times the file's buffers; larger results are rejected before allocation.
/// Errors: BadFormat with the view's number; Unsupported without meshoptimizer.
[[nodiscard]] Status decode_views(tinygltf::Model& model);

}  // namespace quoin::triangles
