#pragma once

#include <cstddef>
#include <span>

#include <quoin/core/result.h>

namespace quoin::vdb {

/// Expands a frame of Blosc (version 1) into all of `out`: stored, or by LZ4 or zlib, its bytes shuffled or not.
///
/// Errors: BadFormat with the offset in the frame, also where it does not hold exactly as many bytes; Unsupported for
///         other compressors, and for LZ4 in builds without it.
[[nodiscard]] Status expand_blosc(std::span<const std::byte> frame, std::span<std::byte> out);

}  // namespace quoin::vdb
