#include "grid/copy/turned_block.h"

#include <algorithm>
#include <array>
#include <cstddef>

#include <quoin/core/assert.h>

namespace quoin {

void TurnedBlock::begin(AxisOrientation orientation, const IBox& part) {
  QUOIN_ASSERT(!part.empty() && intersect(part, kWholeChunk) == part, "a part of the chunk");
  orientation_ = orientation;
  part_ = part;
  first_ = 0;
  int stride = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const bool is_negated = orientation.is_negated(axis);
    strides_[orientation.source_axis(axis)] = is_negated ? -stride : stride;
    first_ += (is_negated ? part.max[axis] - 1 : part.min[axis]) * stride;
    stride *= kChunkEdge;
  }
}

void TurnedBlock::clear() {
  std::fill_n(types_.get(), kChunkVoxels, kAir);
}

VoxelType* TurnedBlock::place(IVec3 in_box) const {
  const int index = first_ + in_box.x * strides_.x + in_box.y * strides_.y + in_box.z * strides_.z;
  QUOIN_ASSERT(index >= 0 && index < static_cast<int>(kChunkVoxels), "a voxel of the chunk");
  return types_.get() + index;
}

void TurnedBlock::put(const Chunk* chunk, const IBox& part, IVec3 offset) {
  QUOIN_ASSERT(!part.empty() && intersect(part, kWholeChunk) == part, "a part of the chunk");
  if (chunk == nullptr) return fill(kAir, offset, part.size());
  if (const auto type = chunk->uniform()) return fill(*type, offset, part.size());
  if (orientation_.source_axis(0) == 0) return put_rows(*chunk, part, offset);
  put_columns(*chunk, part, offset);
}

void TurnedBlock::fill(VoxelType type, IVec3 offset, IVec3 size) {
  const int along = orientation_.source_axis(0);
  const int second = orientation_.source_axis(1);
  const int third = orientation_.source_axis(2);
  for (int k = 0; k < size[third]; ++k) {
    for (int j = 0; j < size[second]; ++j) {
      VoxelType* row = place(offset) + j * strides_[second] + k * strides_[third];
      if (strides_[along] < 0) row -= size[along] - 1;
      std::fill_n(row, size[along], type);
    }
  }
}

void TurnedBlock::put_rows(const Chunk& chunk, const IBox& part, IVec3 offset) {
  std::array<VoxelType, kChunkEdge> row{};
  const VoxelType* first = row.data() + part.min.x;
  const int count = part.max.x - part.min.x;
  for (int z = part.min.z; z < part.max.z; ++z) {
    for (int y = part.min.y; y < part.max.y; ++y) {
      chunk.read_row(y, z, row);
      VoxelType* out = place(offset + IVec3(0, y - part.min.y, z - part.min.z));
      if (strides_.x > 0) {
        std::copy_n(first, count, out);
      } else {
        std::reverse_copy(first, first + count, out - (count - 1));
      }
    }
  }
}

void TurnedBlock::put_columns(const Chunk& chunk, const IBox& part, IVec3 offset) {
  // The block's rows lie along this axis of the chunk, the planes across the other.
  const int along = orientation_.source_axis(0);
  const int across = 3 - along;
  const IVec3 size = part.size();
  alignas(64) std::array<VoxelType, std::size_t{kChunkEdge} * kChunkEdge> plane;
  for (int i = 0; i < size[across]; ++i) {
    for (int k = 0; k < size[along]; ++k) {
      IVec3 at = part.min;
      at[across] += i;
      at[along] += k;
      // Reversed here, so that columns need no reversal.
      const int line = strides_[along] > 0 ? k : size[along] - 1 - k;
      chunk.read_row(at.y, at.z,
                     std::span<VoxelType, kChunkEdge>(plane.data() + std::ptrdiff_t{line} * kChunkEdge, kChunkEdge));
    }
    IVec3 start = offset;
    start[across] += i;
    VoxelType* out = place(start);
    if (strides_[along] < 0) out -= size[along] - 1;
    for (int x = 0; x < size.x; ++x, out += strides_.x) {
      const VoxelType* column = plane.data() + part.min.x + x;
      for (int k = 0; k < size[along]; ++k) out[k] = column[std::ptrdiff_t{k} * kChunkEdge];
    }
  }
}

}  // namespace quoin
