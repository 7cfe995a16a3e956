#pragma once

#include <array>
#include <map>
#include <vector>

#include <quoin/core/vec.h>
#include <quoin/grid/chunk.h>
#include <quoin/grid/density_grid.h>
#include <quoin/grid/grid.h>
#include <quoin/grid/voxel_registry.h>

#include "core/coordinates/chunk_order.h"

namespace quoin {

/// The voxels of a cell of 4^3 that emit light, or the surface of a field there, as one lamp. In the grid, in voxels.
struct EmissiveCell {
  DVec3 centre{0.0};            ///< of the faces that shine, weighted by their power
  double spread_squared = 0.0;  ///< the mean square of their distances from there
  std::array<Vec3, 6> power{};  ///< colour * emission, linear, times the number of faces, by direction
  IBox box;                     ///< tight around what emits
};

/// Of one grid, or one field, kept up to date while it is edited. A face shines where no opaque voxel, and none of its
/// own type, is before it. A field's surface shines along each axis by the edges of the lattice that it crosses along
/// that, from a sample that emits: so many samples wide it looks from there. Where it is inclined each counts so much
/// less that all together are its area.
class EmissiveCells {
 public:
  static constexpr int kEdge = 4;  ///< voxels

  /// Cost: of the chunks in which anything changed; a chunk without types that emit costs O(its types).
  void update(const Grid& grid, const VoxelRegistry& types);
  void update(const DensityGrid& field, const VoxelRegistry& types);

  /// Calls `visit(const EmissiveCell&)` for every cell: chunks by z, y, x, then cells likewise.
  template <class Visit>
  void for_each(Visit&& visit) const {
    for (const auto& [chunk, cells] : chunks_) {
      for (const EmissiveCell& cell : cells) visit(cell);
    }
  }

 private:
  struct ByZyx {
    bool operator()(IVec3 a, IVec3 b) const { return by_zyx(a, b); }
  };
  void look_at(const Grid& grid, const VoxelRegistry& types, IVec3 chunk);
  void look_at(const DensityGrid& field, const VoxelRegistry& types, IVec3 chunk);
  template <class Content, class Find>
  void follow(const Content& content, const VoxelRegistry& types, Find&& chunks_of);

  ChangeCursor followed_;
  ChangeCursor followed_types_;
  std::map<IVec3, std::vector<EmissiveCell>, ByZyx> chunks_;  // those that hold some
};

}  // namespace quoin
