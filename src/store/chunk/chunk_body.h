#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <quoin/core/memory.h>
#include <quoin/core/result.h>
#include <quoin/core/vec.h>
#include <quoin/grid/chunk.h>
#include <quoin/grid/density_chunk.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/store/world_store.h>

#include "store/chunk/density_section.h"
#include "store/chunk/voxel_sections.h"

// The body of a chunk's row in a world. Numbers little-endian.
//
//   uint64 checksum      XXH3-64 of all bytes after it
//   uint8 magic[4]       "QCB1"
//   uint8 sections       1: voxel types, 2: voxel data, 4: densities; 128: the content is a zstd frame
//   uint8 level          of the address
//   uint16 0
//   uint32 grid          of the address
//   int32 x, y, z        of the address
//   uint64 revision      later saves have greater revisions
//   uint32 bytes         of the content
//   content              the present sections in order: voxel_sections.h, density_section.h
//
// Without the first section all voxels are air. A body contains its own address, so that a world with a lost index can
// be rebuilt from its bodies.

namespace quoin::store {

inline constexpr std::size_t kChunkBodyHeader = 44;
/// Maximum size of a chunk's content. Without voxel data it is below 2 MiB.
inline constexpr std::size_t kMaxChunkContent = kMaxVoxelSection + kMaxDataSection + kMaxDensitySection;

namespace chunk_sections {
inline constexpr std::uint8_t kVoxels = 1;
inline constexpr std::uint8_t kData = 2;
inline constexpr std::uint8_t kDensities = 4;
inline constexpr std::uint8_t kCompressed = 128;
}  // namespace chunk_sections

struct ChunkBodyHeader {
  ChunkAddress place;
  std::uint64_t revision = 0;
  std::uint8_t sections = 0;  ///< chunk_sections
  std::uint32_t content_bytes = 0;
};

/// The header of a body. Only the checksum and the header are verified, not the content.
/// Errors: BadFormat, with the offset in the body; Unsupported for a body of a later version.
/// Cost: about 10 bytes per nanosecond.
[[nodiscard]] Result<ChunkBodyHeader> read_header(std::span<const std::byte> body);

/// Writes the correct checksum to a body's first bytes. Requires: kChunkBodyHeader bytes.
void put_checksum(std::span<std::byte> body);

/// Encodes bodies and reuses its buffers. One thread at a time.
class ChunkEncoder {
 public:
  ChunkEncoder();
  ChunkEncoder(ChunkEncoder&&) noexcept;
  ChunkEncoder& operator=(ChunkEncoder&&) noexcept;
  ~ChunkEncoder();

  /// Replaces `out` by a chunk's body. Equal voxels, data and densities give equal bytes, independent of the chunk's
  /// storage (with one version of zstd). `densities` may be null. Data attached to density materials is omitted, since
  /// fields have none.
  /// Errors: LimitExceeded: data of more than kMaxChunkDataBytes; `out` is then empty.
  [[nodiscard]] Status encode(const ChunkAddress& place, std::uint64_t revision, const Chunk& voxels,
                              const DensityChunk* densities, BlockVector<std::byte>& out);

 private:
  struct Compressor;
  [[nodiscard]] bool compress(BlockVector<std::byte>& out);

  std::unique_ptr<Compressor> compressor_;
  VoxelRunWriter voxel_writer_;
  DensityWriter density_writer_;
  BlockVector<std::byte> content_;
};

/// The limits that chunks are checked against. Lifetime: refers to the types without owning them.
struct ChunkLimits {
  const VoxelRegistry* types = nullptr;  ///< not null
  float band = 8.0F;                     ///< of its densities
};

/// Decodes bodies and reuses its buffers. One thread at a time.
///
/// Hostile bytes give an error, and take at most the memory of kMaxChunkContent and the chunk decoded from it, or 5 MiB
/// if the header announces no voxel data.
class ChunkDecoder {
 public:
  ChunkDecoder();
  ChunkDecoder(ChunkDecoder&&) noexcept;
  ChunkDecoder& operator=(ChunkDecoder&&) noexcept;
  ~ChunkDecoder();

  /// Returns the chunk of a body, whose address must be the expected one.
  /// Errors: BadFormat, with the offset in the body (for a compressed content the message has the offset in the
  /// decompressed bytes); Unsupported for a body of a later version.
  [[nodiscard]] Result<StoredChunk> decode(const ChunkAddress& expected, std::span<const std::byte> body,
                                           const ChunkLimits& limits);

 private:
  struct Expander;
  [[nodiscard]] Result<std::span<const std::byte>> impl_of(const ChunkBodyHeader& header,
                                                           std::span<const std::byte> body);
  [[nodiscard]] Result<StoredChunk> read_sections(const ChunkBodyHeader& header, std::span<const std::byte> content,
                                                  const ChunkLimits& limits);

  std::unique_ptr<Expander> expander_;
  VoxelRunReader voxel_reader_;
  DensityReader density_reader_;
  BlockVector<std::byte> content_;
};

}  // namespace quoin::store
