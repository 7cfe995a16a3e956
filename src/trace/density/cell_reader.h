#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include <quoin/grid/density_grid.h>

#include "grid/density/density_storage.h"
#include "trace/density/cell_root.h"
#include "trace/tree_view.h"

namespace quoin::trace {

/// Reads the corners of cells that lie near each other.
class CellReader {
 public:
  explicit CellReader(const DensityGrid& field) : field_(&field), far_(stored_density(field.band(), field.band())) {}

  [[nodiscard]] CellCorners corners(IVec3 cell) {
    const IVec3 p = local_of(cell);
    CellCorners out;
    for (int i = 0; i < 4; ++i) {
      const auto at = static_cast<std::size_t>(2 * i);
      // The two ends of an edge along x lie side by side unless the chunk ends between them.
      const IVec3 low = cell + IVec3{0, i & 1, i >> 1};
      const DensityChunk* const chunk = find(chunk_of(low));
      const IVec3 q = local_of(low);
      const Half* const row = chunk == nullptr ? nullptr : chunk->row(q.y, q.z);
      if (row != nullptr && p.x < kChunkEdge - 1) {
        out[at] = float_from_half(row[p.x]);
        out[at + 1] = float_from_half(row[p.x + 1]);
      } else {
        out[at] = float_from_half(chunk == nullptr ? far_ : chunk->get(q.x, q.y, q.z));
        out[at + 1] = float_from_half(get(low + IVec3{1, 0, 0}));
      }
    }
    return out;
  }

  [[nodiscard]] VoxelType material(IVec3 sample) const { return field_->material(sample); }

 private:
  [[nodiscard]] const DensityChunk* find(IVec3 chunk) {
    if (chunk != known_ || !knows_) {
      known_ = chunk;
      knows_ = true;
      found_ = field_->find_chunk(chunk);
    }
    return found_;
  }
  [[nodiscard]] Half get(IVec3 sample) {
    const DensityChunk* const chunk = find(chunk_of(sample));
    const IVec3 p = local_of(sample);
    return chunk == nullptr ? far_ : chunk->get(p.x, p.y, p.z);
  }

  const DensityGrid* field_;
  Half far_;
  IVec3 known_{0};
  bool knows_ = false;
  const DensityChunk* found_ = nullptr;
};

/// Asks a tree of cells that lie near each other.
class NearbyCells {
 public:
  explicit NearbyCells(const OccupancyTree& tree) : nodes_(tree) {}

  [[nodiscard]] bool is_occupied(IVec3 cell) {
    const IVec3 brick = cell >> 4;
    if (brick != brick_ || !knows_) {
      brick_ = brick;
      knows_ = true;
      const ChunkNode* const chunk = nodes_.find_chunk(cell >> kChunkShift);
      const auto index = static_cast<std::size_t>((brick.x & 3) + 4 * (brick.y & 3) + 16 * (brick.z & 3));
      words_ = chunk == nullptr ? nullptr : &nodes_.brick(chunk->bricks[index]);
    }
    if (words_ == nullptr) return false;
    const auto word = static_cast<std::size_t>((cell.x >> 2 & 3) + 4 * (cell.y >> 2 & 3) + 16 * (cell.z >> 2 & 3));
    return ((*words_)[word] >> ((cell.x & 3) + 4 * (cell.y & 3) + 16 * (cell.z & 3)) & 1U) != 0;
  }

 private:
  TreeNodes nodes_;
  IVec3 brick_{0};
  bool knows_ = false;
  const Node* words_ = nullptr;
};

}  // namespace quoin::trace
