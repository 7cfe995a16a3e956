#pragma once

#include <array>
#include <cstdint>

#include <quoin/grid/density_grid.h>

#include "trace/chunk_rows.h"

namespace quoin::trace {

/// Rows of 64^3 cells between samples as bits: those with a solid corner. Cell (x, y, z) of a chunk lies between its
/// sample (x, y, z) and the sample one further along each axis, which may be the next chunk's.
class CellRows {
 public:
  CellRows(const DensityGrid& field, IVec3 chunk);

  /// Whether no cell has a solid corner.
  [[nodiscard]] bool none() const { return is_air_; }

  /// As ChunkRows::read.
  [[nodiscard]] Slab read(int y, int z, SlabRows& rows) const;

 private:
  // The signs of a chunk's rows; those of one that is not there, or uniform, are all the same.
  struct Signs {
    const std::uint64_t* rows = nullptr;  // [z][y]; null where all are `all`
    std::uint64_t all = 0;
  };

  // Which cells along x have a solid sample at either end, of the samples' row (y, z), 0 to 64.
  [[nodiscard]] std::uint64_t either_end(int y, int z) const;

  std::array<Signs, 8> signs_;  // by the offset of the chunk, x + 2 y + 4 z
  bool is_air_ = true;
};

}  // namespace quoin::trace
