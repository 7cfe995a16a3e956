#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

#include <quoin/core/function_ref.h>
#include <quoin/core/vec.h>
#include <quoin/grid/chunk.h>

namespace quoin {

/// Visits the columns of chunks on top of each other from the top down, for ChunkSource::visit_columns.
class ColumnScan {
 public:
  /// `top`: the highest voxel to visit.
  explicit ColumnScan(int top) : top_(top) { open_.fill(~std::uint64_t{0}); }

  /// Returns true if no column goes on, so that chunks below need not be read.
  [[nodiscard]] bool is_done() const {
    return std::ranges::all_of(open_, [](std::uint64_t columns) { return columns == 0; });
  }

  /// Visits a chunk. Requires: below the chunks visited so far.
  void visit(IVec3 chunk, const Chunk& voxels, FunctionRef<bool(IVec3 voxel, VoxelType type)> visit) {
    const IVec3 corner = chunk * kChunkEdge;
    const IBox bounds = voxels.bounds();
    std::array<VoxelType, kChunkEdge> row{};
    const auto top = std::min<std::int64_t>(bounds.max.y - 1, std::int64_t{top_} - corner.y);
    for (auto y = static_cast<int>(std::max<std::int64_t>(top, -1)); y >= bounds.min.y; --y) {
      for (int z = bounds.min.z; z < bounds.max.z; ++z) {
        std::uint64_t& columns = open_[static_cast<std::size_t>(z)];
        if (columns == 0) continue;
        voxels.read_row(y, z, row);
        for (std::uint64_t rest = columns & ~voxels.row_mask(y, z, kAir); rest != 0; rest &= rest - 1) {
          const int x = std::countr_zero(rest);
          if (!visit(corner + IVec3(x, y, z), row[static_cast<std::size_t>(x)])) columns &= ~(std::uint64_t{1} << x);
        }
      }
    }
  }

 private:
  int top_;
  std::array<std::uint64_t, kChunkEdge> open_{};  // columns that go on, by z
};

}  // namespace quoin
