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

/// Converts a colour to linear light.
[[nodiscard]] LinearRgba16 linear_colour_of(Rgba8 colour);

/// The surface material of cells: the materials of their solid samples.
class SurfaceMaterials {
 public:
  explicit SurfaceMaterials(const VoxelRegistry& types);

  /// Returns the material of a cell of the centre chunk or of a chunk before it, in cells of `level`. Level 0: from its
  /// solid corners. Coarser levels: from the solid samples next to the surface along its crossed edges, since corners
  /// may be far below the surface; if none of its edges is crossed, from the solid samples of the coarsest lattice
  /// within the cell that has any. A cell of air gives air, white.
  [[nodiscard]] CellMaterial of_cell(const DensityNeighbourhood& chunks, IVec3 cell, int level) const;
  /// Returns the colour of a type; white if it is not registered.
  [[nodiscard]] LinearRgba16 albedo(VoxelType type) const;

 private:
  [[nodiscard]] CellMaterial blend(std::span<VoxelType> solid) const;

  std::vector<LinearRgba16> albedo_;  // by type
};

}  // namespace quoin
