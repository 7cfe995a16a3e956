#pragma once

#include <cstddef>
#include <span>

#include <quoin/core/result.h>

namespace quoin::vdb {

/// Expands a Blosc frame (version 1) into all of `out`: stored, LZ4 or zlib, with or without byte shuffle.
///
/// Errors: BadFormat with the offset in the frame, also if its size differs from `out`; Unsupported for other
/// compressors, and for LZ4 in builds without it.
[[nodiscard]] Status expand_blosc(std::span<const std::byte> frame, std::span<std::byte> out);

}  // namespace quoin::vdb
