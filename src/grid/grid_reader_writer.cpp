#include <quoin/grid/grid.h>

#include <quoin/core/assert.h>

#include "core/rows/packed_row.h"
#include "grid/chunk/chunk_storage.h"

namespace quoin {

VoxelType GridReader::get_elsewhere(int x, int y, int z) {
  const auto other_yz = static_cast<std::uint32_t>((y ^ last_y_) | (z ^ last_z_));
  const std::uint32_t other = other_yz | static_cast<std::uint32_t>(x ^ last_x_) | unknown_;
  if (other >= kChunkEdge) return get_in_other_chunk(x, y, z);
  if (other_yz != 0) {
    if (goes_on(x)) return get_in_new_row(x, y, z);
    last_y_ = y;
    last_z_ = z;
    reads_of_row_ = 0;
  } else if (++reads_of_row_ == kReadsAlongX) {
    return get_in_new_row(x, y, z);
  }
  if (voxels_ == nullptr) return uniform_;
  return voxels_->type(x & (kChunkEdge - 1), y & (kChunkEdge - 1), z & (kChunkEdge - 1));
}

VoxelType GridReader::get_in_other_chunk(int x, int y, int z) {
  unknown_ = 0;
  chunk_ = grid_->find_chunk(x >> kChunkShift, y >> kChunkShift, z >> kChunkShift);
  voxels_ = chunk_ == nullptr ? nullptr : ChunkStorage::of(*chunk_);
  uniform_ = chunk_ == nullptr ? kAir : chunk_->uniform().value_or(kAir);
  last_x_ = x;
  if (goes_on(x)) return get_in_new_row(x, y, z);
  last_y_ = y;
  last_z_ = z;
  reads_of_row_ = 0;
  if (voxels_ == nullptr) return uniform_;
  return voxels_->type(x & (kChunkEdge - 1), y & (kChunkEdge - 1), z & (kChunkEdge - 1));
}

// Unpacks the row. Requires: it lies in the chunk.
VoxelType GridReader::get_in_new_row(int x, int y, int z) {
  QUOIN_ASSERT(chunk_ == grid_->find_chunk(x >> kChunkShift, y >> kChunkShift, z >> kChunkShift), "a row of the chunk");
  last_y_ = y;
  last_z_ = z;
  reads_of_row_ = kReadsAlongX;
  row_x_ = static_cast<std::uint32_t>(x & ~(kChunkEdge - 1));
  row_yz_ = both(y, z);
  row_length_ = kChunkEdge;
  if (voxels_ == nullptr) {
    row_.fill(uniform_);
  } else {
    chunk_->read_row(y & (kChunkEdge - 1), z & (kChunkEdge - 1), row_);
  }
  return row_[static_cast<std::size_t>(x & (kChunkEdge - 1))];
}

void GridWriter::go_to(int x, int y, int z) {
  flush();
  row_x_ = x & ~(kChunkEdge - 1);
  row_y_ = y;
  row_z_ = z;
}

void GridWriter::flush() {
  const std::uint64_t mask = packed_row::where_equal(is_set_.data(), std::uint8_t{1});
  is_set_.fill(0);
  if (mask != 0) grid_->write_row({row_x_, row_y_, row_z_}, mask, types_);
}

}  // namespace quoin
