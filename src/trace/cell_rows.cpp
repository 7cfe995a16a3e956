#include "trace/cell_rows.h"

#include "grid/density/density_storage.h"

namespace quoin::trace {

CellRows::CellRows(const DensityGrid& field, IVec3 chunk) {
  for (int i = 0; i < 8; ++i) {
    const DensityChunk* const found = field.find_chunk(chunk + IVec3{i & 1, i >> 1 & 1, i >> 2});
    if (found == nullptr) continue;
    Signs& signs = signs_[static_cast<std::size_t>(i)];
    if (const DensityStorage* const storage = DensityStorage::of(*found)) {
      signs.rows = storage->solid.data();
      is_air_ = false;
    } else if (DensityChunk::is_solid(*found->uniform())) {
      signs.all = ~std::uint64_t{0};
      is_air_ = false;
    }
  }
}

std::uint64_t CellRows::either_end(int y, int z) const {
  const std::size_t part = (y >= kChunkEdge ? 2U : 0U) + (z >= kChunkEdge ? 4U : 0U);
  const auto row = static_cast<std::size_t>((z & (kChunkEdge - 1)) * kChunkEdge + (y & (kChunkEdge - 1)));
  const Signs& own = signs_[part];
  const Signs& next = signs_[part + 1];
  const std::uint64_t low = own.rows == nullptr ? own.all : own.rows[row];
  const std::uint64_t first_of_next = (next.rows == nullptr ? next.all : next.rows[row]) & 1U;
  return low | low >> 1 | first_of_next << 63;
}

Slab CellRows::read(int y, int z, SlabRows& rows) const {
  const auto ends = [this](int at_y, int at_z) { return either_end(at_y, at_z); };
  return join_corners(
      y, z, ends, [](std::uint64_t a, std::uint64_t b) { return a | b; }, rows);
}

}  // namespace quoin::trace
