#include <quoin/grid/grid.h>

#include "grid/packed_row.h"

namespace quoin {

void GridReader::find_chunk(int x, int y, int z) {
  const IVec3 at = chunk_of({x, y, z});
  chunk_x_ = at.x;
  chunk_y_ = at.y;
  chunk_z_ = at.z;
  known_ = true;
  chunk_ = grid_->find_chunk(at);
}

void GridReader::unpack_row(int x, int y, int z) {
  row_x_ = x & ~(kChunkEdge - 1);
  row_y_ = y;
  row_z_ = z;
  const IVec3 local = local_of({x, y, z});
  if (chunk_ == nullptr) {
    row_.fill(kAir);
  } else {
    chunk_->read_row(local.y, local.z, row_);
  }
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
  if (mask != 0) grid_->set_row({row_x_, row_y_, row_z_}, mask, types_);
}

}  // namespace quoin
