#pragma once

#include <string>
#include <vector>

#include <quoin/core/slot_map.h>
#include <quoin/core/vec.h>
#include <quoin/grid/grid.h>
#include <quoin/grid/voxel_registry.h>

namespace quoin {

/// A grid as a scene holds it.
struct SceneGrid {
  std::string name;
  Grid grid;
  /// The point of the grid, in voxels, that an instance's position places and about which it turns.
  DVec3 pivot{0.0};
  /// The box that the file declares for it (an artist's canvas), in voxels; empty when none was declared. Voxels may
  /// lie outside after edits; `declared_box` says how large the grid counts as.
  IBox canvas;

  /// The canvas and the tight bounds together.
  [[nodiscard]] IBox declared_box() const { return unite(canvas, grid.bounds()); }
};

using GridHandle = Handle<SceneGrid>;

/// One placement of a grid in the world. Moving it touches no voxel and no mesh.
struct Instance {
  std::string name;
  GridHandle grid;
  DVec3 position{0.0};  ///< of the grid's pivot, in world units
  /// World from grid. Of any length: what reads it makes it unit, and takes a zero one as no rotation. Where any
  /// number of an instance is not finite, or its size not positive, it is left out of pictures, queries and bounds.
  DQuat rotation{1.0, 0.0, 0.0, 0.0};
  double voxel_size = 1.0;  ///< world units a voxel; positive
  bool mirrored = false;    ///< the grid's x is negated (about the pivot) before the rotation
  bool visible = true;      ///< false for hidden layers and nodes; such instances are kept, not drawn
};

using InstanceHandle = Handle<Instance>;

/// Many grids, placed any number of times each, that share one registry.
///
/// Axes: right-handed, +Y up, one world unit a voxel unless an instance says otherwise.
class Scene {
 public:
  VoxelRegistry types;

  GridHandle add_grid(SceneGrid grid) { return grids_.insert(std::move(grid)); }
  InstanceHandle add_instance(Instance instance) { return instances_.insert(std::move(instance)); }
  /// Removes the grid and every instance of it.
  bool remove_grid(GridHandle handle);
  bool remove_instance(InstanceHandle handle) { return instances_.remove(handle); }

  [[nodiscard]] const SlotMap<SceneGrid>& grids() const { return grids_; }
  [[nodiscard]] SlotMap<SceneGrid>& grids() { return grids_; }
  [[nodiscard]] const SlotMap<Instance>& instances() const { return instances_; }
  [[nodiscard]] SlotMap<Instance>& instances() { return instances_; }

  /// Non-air voxels of all grids; a grid that is placed several times counts once.
  [[nodiscard]] std::int64_t voxel_count() const;

  /// The box around the tight bounds of every placed grid, in world units; empty when nothing is placed.
  /// Hidden instances count when `hidden_too`.
  [[nodiscard]] DBox bounds(bool hidden_too) const;

 private:
  SlotMap<SceneGrid> grids_;
  SlotMap<Instance> instances_;
};

/// A point of the instance's grid (voxels) in the world.
[[nodiscard]] DVec3 world_from_grid(const Instance& instance, const SceneGrid& grid, DVec3 point_in_grid);

}  // namespace quoin
