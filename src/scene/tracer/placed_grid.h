#pragma once

#include <cmath>
#include <vector>

#include <glm/mat3x3.hpp>

#include <quoin/core/memory.h>
#include <quoin/core/vec.h>
#include <quoin/grid/grid.h>
#include <quoin/scene/level_of_detail.h>
#include <quoin/scene/scene.h>
#include <quoin/scene/scene_tracer.h>
#include <quoin/trace/density_ray.h>
#include <quoin/trace/occupancy_tree.h>

namespace quoin {

class DensityGlass;
struct TracedShapes;

/// A grid with the placement of an instance, ready to be traced. Instances of one grid share its trees. Lifetime: owns
/// nothing; the tracer and its scene must outlive it, and an update invalidates it.
struct PlacedGrid {
  InstanceHandle instance;
  const SceneGrid* grid = nullptr;  ///< as the scene holds it
  const Grid* voxels = nullptr;     ///< the traced grid: its voxels, or the halved grid
  DVec3 pivot{0.0};                 ///< in the coordinates of `voxels`
  const OccupancyTree* opaque = nullptr;
  const OccupancyTree* transparent = nullptr;  ///< null if the grid has no transparent voxel; without shaped voxels
  /// The voxels in which rays meet glass, and the visible cells of faces (SightTrees); null if there are none.
  const OccupancyTree* glass_voxels = nullptr;
  const OccupancyTree* face_cells = nullptr;
  const TracedShapes* shapes = nullptr;       ///< null if no voxel has a shape; halved grids have cubes instead
  const DensityTree* field = nullptr;         ///< in the space of `voxels`; null if the field has no solid
  const DensityTree* opaque_field = nullptr;  ///< the opaque part of the field: `field` if all is opaque; may be null
  const DensityGlass* glass = nullptr;        ///< the transparent part of the field, or null
  glm::dmat3 world_axes{1.0};  ///< columns: the grid's axes in the world, unit; a mirrored instance's x is negated
  DVec3 position{0.0};         ///< of the grid's pivot, in the world
  double voxel_size = 1.0;     ///< world units per voxel of `voxels`
  Detail detail = Detail::Near;
  int level = 0;  ///< of `voxels`: cells of (2^level)^3 voxels of the grid

  /// Returns the number of voxels of the full grid along an edge of one voxel of `voxels`.
  [[nodiscard]] double voxels_per_cell() const { return std::ldexp(1.0, level); }
};

/// The box around a placed grid whose voxels lie within `tight`, with room for rounding.
[[nodiscard]] DBox bounds_in_world(const PlacedGrid& placed, const IBox& tight);

/// Returns the placed grids of a tracer, by instance handle. Lifetime: the tracer owns them, until its next update.
[[nodiscard]] const BlockVector<PlacedGrid>& placed_in(const SceneTracer& tracer);

}  // namespace quoin
