#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

#include <quoin/core/progress.h>
#include <quoin/core/result.h>

#include "io/block_writer.h"

namespace quoin {

/// What a glTF file holds, before it is one file or two.
struct GltfContent {
  /// The document, given the percent-encoded name of the buffer's file; empty for a GLB's own.
  std::function<Result<std::string>(std::string_view buffer_uri)> json;
  std::uint64_t buffer_bytes = 0;
  /// Writes the buffer. The writer stands at a multiple of four.
  std::function<void(BlockWriter&)> write_buffer;
};

/// Writes a GLB and answers its size. Errors: LimitExceeded beyond 4 GiB, CannotWrite, Cancelled; `path` is set.
[[nodiscard]] Result<std::uint64_t> write_glb_file(const GltfContent& content, const std::filesystem::path& path,
                                                   const Progress& progress);

/// Writes `path` and, unless the buffer is empty, the .bin beside it; answers the size of both. Errors: likewise, but
/// for the limit.
[[nodiscard]] Result<std::uint64_t> write_gltf_files(const GltfContent& content, const std::filesystem::path& path,
                                                     const Progress& progress);

/// The name of the buffer's file beside `path`.
[[nodiscard]] std::filesystem::path gltf_buffer_path(std::filesystem::path path);

/// A file name as a relative URI reference (RFC 3986): everything but unreserved characters percent-encoded.
[[nodiscard]] std::string percent_encoded(std::string_view name);

/// The size of a GLB with chunks of these sizes. Errors: LimitExceeded when it does not fit the header's 32 bits.
[[nodiscard]] Result<std::uint64_t> glb_file_bytes(std::uint64_t json_bytes, std::uint64_t buffer_bytes);

}  // namespace quoin
