#pragma once

#include <array>

#include <quoin/core/vec.h>
#include <quoin/grid/density_grid.h>
#include <quoin/grid/grid.h>
#include <quoin/grid/voxel_registry.h>

#include "light/emissive_chunks.h"

namespace quoin {

/// The voxels of a cell of 4^3 that emit light, or the surface of a field there, as one lamp. In the grid, in voxels.
struct EmissiveCell {
  DVec3 centre{0.0};            ///< of the faces that shine, weighted by their power
  double spread_squared = 0.0;  ///< the mean square of their distances from there
  std::array<Vec3, 6> power{};  ///< colour * emission, linear, times the number of faces, by direction
  IBox box;                     ///< bounds of the emitting surfaces
};

/// The emissive cells of one grid or field, kept up to date with its edits. A voxel face emits if the voxel before it
/// is neither opaque nor of the same type. A field's surface emits along each axis at the lattice edges that it crosses
/// in that direction, starting at an emitting sample. Each crossing counts as one sample of projected area. Inclined
/// surfaces are weighted so that the sum is their true area.
class EmissiveCells {
 public:
  static constexpr int kEdge = 4;  ///< voxels

  /// Cost: proportional to the changed chunks. A chunk without emitting types costs O(its types).
  void update(const Grid& grid, const VoxelRegistry& types);
  void update(const DensityGrid& field, const VoxelRegistry& types);

  /// Calls `visit(const EmissiveCell&)` for every cell. Chunks, and the cells in each chunk, are sorted by z, y, x.
  template <class Visit>
  void for_each(Visit&& visit) const {
    chunks_.for_each([&](IVec3, const EmissiveCell& cell) { visit(cell); });
  }

 private:
  EmissiveChunks<EmissiveCell> chunks_;
};

}  // namespace quoin
