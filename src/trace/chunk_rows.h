#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <vector>

#include <quoin/grid/chunk.h>
#include <quoin/grid/voxel_registry.h>

#include "trace/tree_view.h"

namespace quoin::trace {

/// Rows of a chunk as bits, by asking the palette which types count.
class ChunkRows {
 public:
  ChunkRows(const Chunk& chunk, const VoxelRegistry& types, Occupancy which);

  /// Whether no voxel counts, or all do.
  [[nodiscard]] bool none() const { return in_.empty(); }
  [[nodiscard]] bool all() const { return out_.empty(); }

  enum class Slab : std::uint8_t { Empty, Full, Mixed };
  using SlabRows = std::array<std::uint64_t, 16>;
  /// The 4x4 rows from (y, z) on, which are multiples of 4; they are set only where they are mixed.
  [[nodiscard]] Slab read(int y, int z, SlabRows& rows) const;

 private:
  [[nodiscard]] bool belongs(VoxelType type) const;

  const Chunk* chunk_;
  const VoxelRegistry* types_;
  Occupancy which_;
  std::vector<VoxelType> in_;
  std::vector<VoxelType> out_;
  std::vector<std::uint32_t> asked_;  // indices of the palette: whichever list is shorter
  std::uint64_t inverted_ = 0;        // all ones where that is of those which do not count
};

/// The box of the voxels that count, row by row.
class RowsBox {
 public:
  void add(int y, int z, std::uint64_t row) {
    x_ |= row;
    const std::uint64_t any = row != 0 ? 1 : 0;
    y_ |= any << y;
    z_ |= any << z;
  }
  /// 4x4 full rows.
  void add_slab(int y, int z) {
    x_ = ~std::uint64_t{0};
    y_ |= std::uint64_t{15} << y;
    z_ |= std::uint64_t{15} << z;
  }
  /// In chunk coordinates.
  [[nodiscard]] IBox box() const {
    if (x_ == 0) return {};
    return {{std::countr_zero(x_), std::countr_zero(y_), std::countr_zero(z_)},
            {64 - std::countl_zero(x_), 64 - std::countl_zero(y_), 64 - std::countl_zero(z_)}};
  }

 private:
  std::uint64_t x_ = 0;
  std::uint64_t y_ = 0;
  std::uint64_t z_ = 0;
};

/// Four bricks side by side along x, at (y, z) of a chunk, which are multiples of 16.
struct BrickRow {
  std::array<Node, 4> bricks{};
  /// Fills them in. False when all four are empty or all four are full, as `is_full` says; `bricks` is then not set.
  bool read(const ChunkRows& rows, int y, int z, RowsBox& box);
  bool is_full = false;
};

}  // namespace quoin::trace
