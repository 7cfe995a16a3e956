#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <quoin/grid/density_grid.h>
#include <quoin/grid/voxel_registry.h>

#include "trace/chunk_rows.h"

namespace quoin::trace {

/// Which samples of a chunk of a field, and of the first of those beyond it along each axis, are solid and of materials
/// that count: a bit each, by rows along x.
class SolidRows {
 public:
  /// Of what is transparent.
  SolidRows(const DensityGrid& field, const VoxelRegistry& types, IVec3 chunk);
  /// Of one material.
  SolidRows(const DensityGrid& field, VoxelType only, IVec3 chunk);

  [[nodiscard]] bool none() const { return rows_.empty(); }
  /// Sample i of a row as bit i, 0 <= y, z <= 64; and sample i + 1.
  [[nodiscard]] std::uint64_t at(int y, int z) const { return rows_[index(y, z)]; }
  [[nodiscard]] std::uint64_t next(int y, int z) const {
    return rows_[index(y, z)] >> 1 | std::uint64_t{last_[index(y, z)]} << 63;
  }

 private:
  static constexpr std::size_t kRows = kChunkEdge + 1;
  static std::size_t index(int y, int z) { return static_cast<std::size_t>(z) * kRows + static_cast<std::size_t>(y); }
  template <class RowsOf>
  void read(const DensityGrid& field, IVec3 chunk, const RowsOf& rows_of);
  void read_chunk(const DensityChunk& samples, const ChunkRows& materials, IVec3 offset);

  std::vector<std::uint64_t> rows_;  // none where none counts
  std::vector<std::uint8_t> last_;   // sample 64 of each row
};

/// Whether any solid sample of a chunk is of a transparent material. Cost: O(1) where it has no such material, else up
/// to 10 microseconds.
[[nodiscard]] bool has_glass(const DensityChunk& samples, const VoxelRegistry& types);

/// Rows of the cells between samples, as CellRows: those with a solid corner of a transparent material.
class GlassRows {
 public:
  GlassRows(const DensityGrid& field, const VoxelRegistry& types, IVec3 chunk) : samples_(field, types, chunk) {}
  [[nodiscard]] bool none() const { return samples_.none(); }
  [[nodiscard]] Slab read(int y, int z, SlabRows& rows) const;

 private:
  SolidRows samples_;
};

/// Which blocks of a chunk's cells have all corners solid and of one transparent material.
[[nodiscard]] UniformBlocks uniform_glass(const DensityGrid& field, const VoxelRegistry& types, IVec3 chunk);

}  // namespace quoin::trace
