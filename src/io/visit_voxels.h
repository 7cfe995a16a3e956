#pragma once

#include <array>
#include <bit>
#include <cstdint>

#include <quoin/grid/grid.h>

namespace quoin {

/// Calls `visit(voxel, type)` for every non-air voxel, in the order of Grid::for_each.
///
/// Cost: O(rows within each chunk's tight bounds + voxels), so that scattered voxels are cheap.
template <class Visit>
void visit_voxels(const Grid& grid, Visit visit) {
  std::array<VoxelType, kChunkEdge> row{};
  for (const IVec3 coords : grid.chunks()) {
    const Chunk& chunk = *grid.find_chunk(coords);
    const IBox box = chunk.bounds();
    const IVec3 origin = coords * kChunkEdge;
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
}

}  // namespace quoin
