#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/grid/density_grid.h>
#include <quoin/grid/voxel_registry.h>

#include "trace/chunk_rows.h"

namespace quoin::trace {

/// Computes 4x4 rows of cells between samples; `join` combines their eight corners. `ends(y, z)` returns, for a row of
/// samples, the bits of the cells along x, each combined from the two ends of the cell; y and z are at most 64.
template <class Ends, class Join>
Slab join_corners(int y, int z, const Ends& ends, const Join& join, SlabRows& rows) {
  QUOIN_ASSERT(((y | z) & ~(kChunkEdge - 4)) == 0, "multiples of 4 within the chunk");
  // Along x, then along y, then along z.
  std::array<std::uint64_t, 4> before{};
  for (int dz = 0; dz <= 4; ++dz) {
    std::array<std::uint64_t, 5> along_x;
    for (int dy = 0; dy <= 4; ++dy) along_x[static_cast<std::size_t>(dy)] = ends(y + dy, z + dz);
    for (std::size_t dy = 0; dy < 4; ++dy) {
      const std::uint64_t both = join(along_x[dy], along_x[dy + 1]);
      if (dz > 0) rows[static_cast<std::size_t>(dz - 1) * 4 + dy] = join(before[dy], both);
      before[dy] = both;
    }
  }
  return slab_of(rows);
}

/// Rows of 64^3 cells between samples, as bits: set for cells with a solid corner. Cell (x, y, z) of a chunk lies
/// between its sample (x, y, z) and the next sample along each axis, which may belong to the next chunk.
class CellRows {
 public:
  CellRows(const DensityGrid& field, IVec3 chunk);

  /// Returns true if no cell has a solid corner.
  [[nodiscard]] bool none() const { return is_air_; }

  /// Reads 4x4 rows like ChunkRows::read.
  [[nodiscard]] Slab read(int y, int z, SlabRows& rows) const;

 private:
  // The signs of a chunk's rows; the rows of a missing or uniform chunk are all equal.
  struct Signs {
    const std::uint64_t* rows = nullptr;  // [z][y]; null where all are `all`
    std::uint64_t all = 0;
  };

  // Returns the cells along x with a solid sample at either end, for the samples' row (y, z), 0 to 64.
  [[nodiscard]] std::uint64_t either_end(int y, int z) const;

  std::array<Signs, 8> signs_;  // index: the chunk's offset, x + 2 y + 4 z
  bool is_air_ = true;
};

/// The samples of a field's chunk that are solid and of a counted material, one bit each, in rows along x. Includes the
/// first samples beyond the chunk along each axis.
class SolidRows {
 public:
  /// Counts all transparent materials.
  SolidRows(const DensityGrid& field, const VoxelRegistry& types, IVec3 chunk);
  /// Counts one material.
  SolidRows(const DensityGrid& field, VoxelType only, IVec3 chunk);

  [[nodiscard]] bool none() const { return rows_.empty(); }
  /// Returns sample i of a row as bit i, 0 <= y, z <= 64. `next` returns sample i + 1.
  [[nodiscard]] std::uint64_t at(int y, int z) const { return rows_[index(y, z)]; }
  [[nodiscard]] std::uint64_t next(int y, int z) const {
    return rows_[index(y, z)] >> 1 | std::uint64_t{last_[index(y, z)]} << 63;
  }

 private:
  static constexpr std::size_t kRows = kChunkEdge + 1;
  [[nodiscard]] std::size_t index(int y, int z) const {
    QUOIN_ASSERT((y | z) >= 0 && y <= kChunkEdge && z <= kChunkEdge && !none(), "0 <= y, z <= 64, with solid samples");
    return static_cast<std::size_t>(z) * kRows + static_cast<std::size_t>(y);
  }
  template <class RowsOf>
  void read(const DensityGrid& field, IVec3 chunk, const RowsOf& rows_of);
  void read_chunk(const DensityChunk& samples, const ChunkRows& materials, IVec3 offset);

  std::vector<std::uint64_t> rows_;  // empty if no sample counts
  std::vector<std::uint8_t> last_;   // sample 64 of each row
};

/// Returns true if a solid sample of a chunk has a transparent material. Cost: O(1) if the chunk has no such material,
/// otherwise up to 10 microseconds.
[[nodiscard]] bool has_glass(const DensityChunk& samples, const VoxelRegistry& types);

/// Rows of the cells between samples, like CellRows: set for cells with a solid corner of a transparent material.
class GlassRows {
 public:
  GlassRows(const DensityGrid& field, const VoxelRegistry& types, IVec3 chunk) : samples_(field, types, chunk) {}
  [[nodiscard]] bool none() const { return samples_.none(); }
  [[nodiscard]] Slab read(int y, int z, SlabRows& rows) const;

 private:
  SolidRows samples_;
};

/// Finds the blocks of a chunk's cells whose corners are all solid and of one transparent material.
[[nodiscard]] UniformBlocks uniform_glass(const DensityGrid& field, const VoxelRegistry& types, IVec3 chunk);

}  // namespace quoin::trace
