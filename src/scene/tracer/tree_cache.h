#pragma once

#include <optional>
#include <quoin/grid/grid.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/trace/density_ray.h>
#include <quoin/trace/occupancy_tree.h>

namespace quoin {

/// What rays that make light need of one grid, and how far it has followed the grid's changes.
class TreeCache {
 public:
  /// Makes the trees, or takes over what was edited since the last time; everything when it is another grid. Returns
  /// whether there was anything to do.
  ///
  /// Requires: the types' visibility is that of the last time; otherwise `forget` first.
  /// Cost:     that of OccupancyTree::update for the chunks that changed.
  bool update(const Grid& grid, const VoxelRegistry& types);
  /// The same of a field. Lifetime: as DensityTree.
  bool update(const DensityGrid& field);
  void forget() { *this = {}; }
  [[nodiscard]] const ChangeCursor& followed() const { return followed_; }

  [[nodiscard]] const OccupancyTree& opaque() const { return opaque_; }
  /// Null when the grid has no transparent voxel.
  [[nodiscard]] const OccupancyTree* transparent() const { return transparent_ ? &*transparent_ : nullptr; }
  /// Null when the field has no solid.
  [[nodiscard]] const DensityTree* field() const {
    return field_ && !field_->cells().bounds().empty() ? &*field_ : nullptr;
  }

 private:
  void update_transparent(const Grid& grid, const VoxelRegistry& types, const GridChanges& changes);

  ChangeCursor followed_;
  OccupancyTree opaque_{Occupancy::Opaque};
  std::optional<OccupancyTree> transparent_;
  ChangeCursor followed_field_;
  std::optional<DensityTree> field_;
};

}  // namespace quoin
