#include "trace/cell_rows.h"

#include "grid/density/density_storage.h"

namespace quoin::trace {

CellRows::CellRows(const DensityGrid& field, IVec3 chunk) {
  for (int i = 0; i < 8; ++i) {
    const DensityChunk* const found = field.find_chunk(chunk + IVec3{i & 1, i >> 1 & 1, i >> 2});
    if (found == nullptr) continue;
    Signs& signs = signs_[static_cast<std::size_t>(i)];
    if (const DensityStorage* const storage = found->storage()) {
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
  // Along x, then along y, then along z.
  std::array<std::uint64_t, 4> before{};
  for (int dz = 0; dz <= 4; ++dz) {
    std::array<std::uint64_t, 5> ends;
    for (int dy = 0; dy <= 4; ++dy) ends[static_cast<std::size_t>(dy)] = either_end(y + dy, z + dz);
    for (std::size_t dy = 0; dy < 4; ++dy) {
      const std::uint64_t both = ends[dy] | ends[dy + 1];
      if (dz > 0) rows[static_cast<std::size_t>(dz - 1) * 4 + dy] = before[dy] | both;
      before[dy] = both;
    }
  }
  return slab_of(rows);
}

}  // namespace quoin::trace
