#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <quoin/core/result.h>

namespace quoin::minecraft {

/// Expands a stream of blocks as Java's LZ4BlockOutputStream writes it: "LZ4Block", a byte (16: as it is, 32:
/// compressed; its lower bits are the level), three uint32 with the least significant byte first (compressed bytes,
/// bytes, checksum), the block; the last is empty. Checksums are not looked at.
///
/// Errors: BadFormat, with the offset; LimitExceeded beyond `max_bytes`; Unsupported in builds without LZ4.
[[nodiscard]] Result<std::vector<std::byte>> expand_lz4_blocks(std::span<const std::byte> bytes, std::size_t max_bytes);

}  // namespace quoin::minecraft
