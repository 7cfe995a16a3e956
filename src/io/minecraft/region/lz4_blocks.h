#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <quoin/core/result.h>

namespace quoin::minecraft {

/// Expands a stream of blocks written by Java's LZ4BlockOutputStream: "LZ4Block", a byte (16: uncompressed, 32:
/// compressed; its lower bits are the level), three uint32 with the least significant byte first (compressed bytes,
/// bytes, checksum), the block. The last block is empty. Checksums are not verified.
///
/// Errors: BadFormat, with the offset; LimitExceeded beyond `max_bytes`; Unsupported in builds without LZ4.
[[nodiscard]] Result<std::vector<std::byte>> expand_lz4_blocks(std::span<const std::byte> bytes, std::size_t max_bytes);

}  // namespace quoin::minecraft
