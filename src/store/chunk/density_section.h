#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <quoin/core/half.h>
#include <quoin/core/memory.h>
#include <quoin/core/result.h>
#include <quoin/grid/chunk.h>
#include <quoin/grid/density_chunk.h>

#include "store/chunk/content.h"
#include "store/chunk/voxel_sections.h"

// The densities of a chunk's samples, and their materials. 256 slabs of 64 x 4 x 4 samples, by z / 4, then y / 4.
//
//   materials            like voxel types: voxel_sections.h
//   uint8 form           0: one density for all samples, 1: several
//   form 0:
//     uint16 density     as a half
//   form 1:
//     uint16 largest     the largest absolute density; as a half
//     uint8 mixed[32]    one bit per slab, from the lowest up: 1 if it holds several densities
//     uint16 density[]   of all samples of a slab, as a half; for each slab that is not mixed
//     uint8 low[]        for each row of the mixed slabs, by z, then y: the lower bytes of 64 numbers
//     uint8 high[]       the upper bytes, in the same order
//
// The residual of a sample is its rank minus the predicted rank. A number is the residual minus the residual of the
// previous sample in the row (0 for the first), modulo 2^16, stored as (2 n) for n >= 0 and (-2 n - 1) for n < 0. The
// rank of a half is its 15 lower bits, negative if its sign is set. The prediction uses the neighbours at y - 1, at z -
// 1, and at both (single precision, each sum rounded),
//
//     (at y - 1) + (at z - 1) - (at both)
//
// or the only neighbour within the chunk, or 0 in its first row. It is rounded to a half: the 15 bits are the float's
// bits from the 13th up, after adding 2^12 to them, with 112 subtracted from the exponent, clamped to [0, `largest`].

namespace quoin::store {

/// Maximum size of densities with their materials.
inline constexpr std::size_t kMaxDensitySection = kMaxVoxelSection + 3 + 32 + 512 + kChunkVoxels * sizeof(Half);

/// Writes the densities of chunks. One thread at a time.
class DensityWriter {
 public:
  /// Appends densities and materials. Omits materials' data, since fields have none.
  void write(const DensityChunk& chunk, VoxelRunWriter& materials, BlockVector<std::byte>& out);

 private:
  void put_rows(const DensityChunk& chunk, BlockVector<std::byte>& out);

  std::array<bool, 256> is_mixed_{};
  BlockVector<std::byte> high_;
};

/// Returns true if every density is a `stored_density` of the band. Requires: 0 < band.
[[nodiscard]] bool has_stored_densities(const DensityChunk& chunk, float band);

/// Reads the densities of chunks. One thread at a time.
class DensityReader {
 public:
  /// Errors: BadFormat, with the offset in the content; also for densities that `stored_density` never returns in that
  /// band.
  [[nodiscard]] Result<DensityChunk> read(ContentReader& reader, VoxelRunReader& materials, std::size_t type_count,
                                          float band);
};

}  // namespace quoin::store
