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

/// Whether this build decodes them.
[[nodiscard]] bool has_meshopt();

/// The same file with a byte in place of each buffer that stands for decoded views alone, which tinygltf would look
/// for; empty where there is none. `json`: the file's, within it. What cannot be parsed is left to tinygltf.
[[nodiscard]] std::vector<std::byte> without_fallback_buffers(std::span<const std::byte> file, std::string_view json);

/// Decodes all coded views into buffers of their own, which the views are of afterwards.
///
/// Memory: at most 256 times the file's buffers: what is more is refused before it is made.
/// Errors: BadFormat with the view's number; Unsupported without meshoptimizer.
[[nodiscard]] Status decode_views(tinygltf::Model& model);

}  // namespace quoin::triangles
