#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <quoin/core/half.h>
#include <quoin/core/result.h>
#include <quoin/grid/chunk.h>
#include <quoin/grid/density_chunk.h>

#include "store/chunk/content.h"
#include "store/chunk/voxel_runs.h"

// The densities of a chunk's samples, and their materials. 256 slabs of 64 x 4 x 4 samples, by z / 4, then y / 4.
//
//   materials            as the types of voxels: voxel_runs.h
//   uint8 form           0: all of one density, 1: several
//   form 0:
//     uint16 density     as a half
//   form 1:
//     uint16 largest     no density is farther from 0; as a half
//     uint8 mixed[32]    a bit for each slab, from the lowest up: whether it holds several densities
//     uint16 density[]   of all samples of a slab, as a half; for each that is not mixed
//     uint8 low[]        of each row of the mixed slabs, by z, then y: the lower bytes of 64 numbers
//     uint8 high[]       likewise the upper bytes
//
// A number is what a sample is beyond what its neighbours let expect, less the same of the sample before it in the row
// (0 for the first), modulo 2^16, as (2 n) for n >= 0 and (-2 n - 1) for n < 0. "Is" counts halves: a half's 15 lower
// bits, negative where its sign is set. Expected is, with the neighbours at y - 1, at z - 1, and at both (single
// precision, each sum rounded),
//
//     (at y - 1) + (at z - 1) - (at both)
//
// or the one neighbour that the chunk has, or 0 in its first row. Rounded to a half: the 15 bits are those of a float
// from the 13th bit up, after adding 2^12 to these bits, less 112 of the exponent, at least 0, at most `largest`.

namespace quoin::store {

/// The most bytes that densities can take, with their materials.
inline constexpr std::size_t kMaxDensitySection = kMaxVoxelSection + 3 + 32 + 512 + kChunkVoxels * sizeof(Half);

/// Writes the densities of one chunk after the other. One thread at a time.
class DensityWriter {
 public:
  /// Appends densities and materials. Materials' data is left out: a field's has none.
  void write(const DensityChunk& chunk, VoxelRunWriter& materials, std::vector<std::byte>& out);

 private:
  void put_rows(const DensityChunk& chunk, std::vector<std::byte>& out);

  std::array<bool, 256> is_mixed_{};
  std::vector<std::byte> high_;
};

/// Reads them. One thread at a time.
class DensityReader {
 public:
  /// Errors: BadFormat, with the offset in the content; also for densities that `stored_density` never gives in that
  /// band.
  [[nodiscard]] Result<DensityChunk> read(ContentReader& reader, VoxelRunReader& materials, std::size_t type_count,
                                          float band);
};

}  // namespace quoin::store
