#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <quoin/grid/grid.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/light/propagated_light.h>

#include "light/surface/levels.h"

namespace quoin {

/// Reads the light of voxels and their light-passing masks in rows of 64 along x. Each row has one slot in the cache.
/// Lifetime: `light`, `grid` and `types` must outlive it unchanged.
class LightRows {
 public:
  LightRows(const PropagatedLight& light, const Grid& grid, const VoxelRegistry& types)
      : light_(&light), grid_(&grid), types_(&types), rows_(kRows) {}

  struct Row {
    IVec3 at{0};  // x in chunks
    bool is_known = false;
    std::uint64_t passing = 0;
    std::array<std::uint16_t, kChunkEdge> words{};
  };

  /// Returns the row of a voxel. Lifetime: until the next call.
  [[nodiscard]] const Row& row_of(IVec3 voxel) {
    const IVec3 at{voxel.x >> kChunkShift, voxel.y, voxel.z};
    Row& row = rows_[place_of(at)];
    if (!row.is_known || row.at != at) look_up(voxel, at, row);
    return row;
  }
  [[nodiscard]] std::uint16_t word(IVec3 voxel) { return row_of(voxel).words[index_of(voxel)]; }
  [[nodiscard]] bool passes(IVec3 voxel) { return (row_of(voxel).passing >> index_of(voxel) & 1U) != 0; }
  [[nodiscard]] FrontLight front(IVec3 voxel) {
    const Row& row = row_of(voxel);
    if ((row.passing >> index_of(voxel) & 1U) == 0) return {};
    return {level_bytes(row.words[index_of(voxel)]), true};
  }

 private:
  static constexpr std::size_t kRows = 8'192;  // the rows of two neighbouring chunks

  [[nodiscard]] static std::size_t place_of(IVec3 at) {
    return static_cast<std::size_t>((at.y & 63) | (at.z & 63) << 6 | (at.x & 1) << 12);
  }
  [[nodiscard]] static std::size_t index_of(IVec3 voxel) {
    return static_cast<std::size_t>(voxel.x & (kChunkEdge - 1));
  }
  void look_up(IVec3 voxel, IVec3 at, Row& row) const {
    row.at = at;
    row.is_known = true;
    light_->read_row(voxel, row.words);
    row.passing = ~std::uint64_t{0};
    const Chunk* chunk = grid_->find_chunk(chunk_of(voxel));
    if (chunk == nullptr) return;
    std::array<VoxelType, kChunkEdge> held;
    const IVec3 local = local_of(voxel);
    chunk->read_row(local.y, local.z, held);
    for (std::size_t x = 0; x < held.size(); ++x) row.passing &= ~(std::uint64_t{types_->is_opaque(held[x])} << x);
  }

  const PropagatedLight* light_;
  const Grid* grid_;
  const VoxelRegistry* types_;
  std::vector<Row> rows_;
};

}  // namespace quoin
