#pragma once

#include <span>
#include <vector>

#include <quoin/grid/density_chunk.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/mesh/smooth_mesh.h>

namespace quoin {

struct CellMaterial {
  LinearRgba16 albedo{};
  VoxelType type = kAir;
};

/// A colour in linear light.
[[nodiscard]] LinearRgba16 linear_colour_of(Rgba8 colour);

/// What the surface of a cell is made of: the materials of its solid samples.
class SurfaceMaterials {
 public:
  explicit SurfaceMaterials(const VoxelRegistry& types);

  /// Of a cell of the centre chunk or of one before it, in cells of `level`. Level 0: by its solid corners. Coarser: by
  /// the solid samples next to the surface along its crossed edges, since corners may lie well below it; when no edge
  /// of its own is crossed, by the solid samples of the coarsest lattice within the cell that has any. All air gives
  /// air, white.
  [[nodiscard]] CellMaterial of_cell(const DensityNeighbourhood& chunks, IVec3 cell, int level) const;
  /// White of what is not registered.
  [[nodiscard]] LinearRgba16 albedo(VoxelType type) const;

 private:
  [[nodiscard]] CellMaterial blend(std::span<VoxelType> solid) const;

  std::vector<LinearRgba16> albedo_;  // by type
};

}  // namespace quoin
