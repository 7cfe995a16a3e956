#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <quoin/core/memory.h>
#include <quoin/core/result.h>
#include <quoin/grid/chunk.h>
#include <quoin/grid/voxel_registry.h>

#include "store/chunk/content.h"

// The types of a chunk's voxels, as runs of equal types across rows, or packed if that is smaller.
//
//   uint8 form           0: one type, 1: runs, 2: packed
//   uint16 n - 1         number of types; 1 in form 0, otherwise 2 to 65,536
//   uint16 types[n]      distinct, in the order of their first occurrence
//   runs: voxels x fastest, then z, then y
//     uint32 runs        n to 262,144
//     uint32 bytes       of the next line
//     uint8 lengths[]    each run's voxels - 1, seven bits per byte, lowest first, the top bit set except in the last
//     uint8 indices[]    each run's type; omitted if n is 2, as runs then alternate; one byte per run for up to 256
//                        types, otherwise the low bytes of all runs, then the high bytes
//   packed:
//     uint8 [32,768 * bits]  indices of `bits` bits, x fastest, then z, then y, from the lowest bit up; `bits` is the
//                            first of 1, 2, 4, 8 and 16 with 2^bits >= n
//
// Layers of equal height follow each other, since ground is uniform along them. Adjacent runs have different types. So
// equal voxels give equal bytes, independent of the edits that led to them.

namespace quoin::store {

/// Maximum size of a chunk's types.
inline constexpr std::size_t kMaxVoxelSection = 3 + 2 * (std::size_t{1} << 16) + kChunkVoxels * sizeof(VoxelType);

/// Writes the types of chunks. One thread at a time. Memory: 1.1 MiB after a noisy chunk.
class VoxelRunWriter {
 public:
  /// Appends the runs of a chunk, without its data. Cost: O(rows + runs).
  void write(const Chunk& chunk, BlockVector<std::byte>& out);

 private:
  struct Scan;
  void put_palette(BlockVector<std::byte>& out) const;
  void put_runs(const Scan& scan, BlockVector<std::byte>& out) const;
  void put_packed(const Chunk& chunk, BlockVector<std::byte>& out);

  BlockVector<VoxelType> palette_;
  BlockVector<std::uint32_t> new_index_;  // by the index that the chunk stores
  BlockVector<std::uint8_t> lengths_;
  BlockVector<std::uint16_t> indices_;
};

/// Reads the types of chunks directly into their storage. One thread at a time. Memory: 0.6 MiB after a noisy chunk.
class VoxelRunReader {
 public:
  /// Errors: BadFormat, with the offset in the content; also for types that are not below `type_count`.
  [[nodiscard]] Result<Chunk> read(ContentReader& reader, std::size_t type_count);

 private:
  struct Streams;
  template <int kBits>
  class Builder;
  [[nodiscard]] Status read_palette(ContentReader& reader, std::size_t count, std::size_t type_count);
  [[nodiscard]] Result<Chunk> read_runs(ContentReader& reader);
  [[nodiscard]] Result<Chunk> read_packed(ContentReader& reader);
  template <int kBits>
  [[nodiscard]] Result<Chunk> build(Streams streams);

  BlockVector<VoxelType> palette_;
  BlockVector<std::uint64_t> seen_;  // by type / 64: in the palette; 0 between calls
  BlockVector<std::uint32_t> counts_;
  BlockVector<std::uint64_t> changes_;  // of four layers: each voxel's index XOR the previous index
  BlockVector<std::uint64_t> words_;
};

// The data of a chunk's voxels in addition to their types.
//
//   uint32 n            voxels with data, 1 to 262,144
//   uint32 bytes[3]     of the next three lines
//   gaps[n]             number of voxels between this voxel with data and the previous one, or before the first
//   states[n]
//   lengths[n]          of their bytes, at most 65,536 each and 64 MiB in total
//   uint8 bytes[]       of all voxels, in order
//
// Voxels x fastest, then y, then z. Gaps, states and lengths use seven bits per byte, as do run lengths.

/// The largest total data of a chunk's voxels that a world can store.
inline constexpr std::size_t kMaxChunkDataBytes = std::size_t{64} << 20;
/// Maximum size of this section.
inline constexpr std::size_t kMaxDataSection = 16 + kChunkVoxels * (3 + 5 + 3) + kMaxChunkDataBytes;

/// Appends the data of a chunk's voxels. Errors: LimitExceeded; `out` is then unchanged. Requires: some voxel has data.
[[nodiscard]] Status write_placed_data(const Chunk& chunk, BlockVector<std::byte>& out);

/// Reads the data into a chunk. Errors: BadFormat, with the offset in the content; also for voxels of air and for
/// states of more bits than their type allows.
[[nodiscard]] Status read_placed_data(ContentReader& reader, const VoxelRegistry& types, Chunk& chunk);

}  // namespace quoin::store
