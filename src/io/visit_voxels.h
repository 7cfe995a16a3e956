#pragma once

#include <array>
#include <bit>
#include <cstdint>

#include <quoin/grid/grid.h>

namespace quoin {

/// Calls `visit(voxel, type)` for every non-air voxel of a chunk whose least corner is `origin`, by z, then y, then x.
///
/// Cost: O(rows within the tight bounds + voxels), so that scattered voxels are cheap.
template <class Visit>
void visit_voxels(const Chunk& chunk, IVec3 origin, Visit&& visit) {
  std::array<VoxelType, kChunkEdge> row{};
  const IBox box = chunk.bounds();
  for (int z = box.min.z; z < box.max.z; ++z) {
    for (int y = box.min.y; y < box.max.y; ++y) {
      std::uint64_t solid = ~chunk.row_mask(y, z, kAir);
      if (solid == 0) continue;
      chunk.read_row(y, z, row);
      for (; solid != 0; solid &= solid - 1) {
        const int x = std::countr_zero(solid);
        visit(origin + IVec3{x, y, z}, row[static_cast<std::size_t>(x)]);
      }
    }
  }
}

/// Calls `visit(voxel, type)` for every non-air voxel, in the order of Grid::for_each.
template <class Visit>
void visit_voxels(const Grid& grid, Visit&& visit) {
  for (const IVec3 coords : grid.chunks()) visit_voxels(*grid.find_chunk(coords), coords * kChunkEdge, visit);
}

}  // namespace quoin
