#pragma once

#include <cstddef>
#include <vector>

#include <quoin/core/result.h>
#include <quoin/grid/chunk.h>
#include <quoin/grid/voxel_registry.h>

#include "store/chunk/content.h"

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

namespace quoin::store {

/// The largest total data of a chunk's voxels that a world can store.
inline constexpr std::size_t kMaxChunkDataBytes = std::size_t{64} << 20;
/// Maximum size of this section.
inline constexpr std::size_t kMaxDataSection = 16 + kChunkVoxels * (3 + 5 + 3) + kMaxChunkDataBytes;

/// Appends the data of a chunk's voxels. Errors: LimitExceeded; `out` is then unchanged. Requires: some voxel has data.
[[nodiscard]] Status write_placed_data(const Chunk& chunk, std::vector<std::byte>& out);

/// Reads the data into a chunk. Errors: BadFormat, with the offset in the content; also for voxels of air and for
/// states of more bits than their type allows.
[[nodiscard]] Status read_placed_data(ContentReader& reader, const VoxelRegistry& types, Chunk& chunk);

}  // namespace quoin::store
