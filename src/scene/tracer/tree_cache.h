#pragma once

#include <memory>
#include <optional>

#include <quoin/grid/density_grid.h>
#include <quoin/grid/grid.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/trace/density_ray.h>
#include <quoin/trace/occupancy_tree.h>

#include "trace/density/density_glass.h"

namespace quoin {

/// A field with transparent materials, in two parts for rays: what of it blocks light, as a field of its own that
/// shares the chunks in which nothing is transparent, and the rest.
///
/// Lifetime: `whole` must outlive it, in its place; it stays in its own.
class SplitField {
 public:
  /// Cost: 0.3 ms a chunk that has transparent materials, besides the trees.
  SplitField(const DensityGrid& whole, const VoxelRegistry& types);
  SplitField(const SplitField&) = delete;
  SplitField& operator=(const SplitField&) = delete;

  /// Takes over what edits changed. Requires: as DensityGlass::update. Cost: as that of making it, for the chunks that
  /// changed and, of the trees, those below.
  void update(const VoxelRegistry& types, const DensityChanges& changes);

  [[nodiscard]] const DensityTree& opaque() const { return *opaque_; }
  [[nodiscard]] const DensityGlass& glass() const { return glass_; }

 private:
  const DensityGrid* whole_;
  DensityGrid opaque_field_;
  ChangeCursor followed_opaque_;
  std::optional<DensityTree> opaque_;  // of `opaque_field_`
  DensityGlass glass_;
};

/// Whether anything solid of a field is transparent. Cost: O(chunks).
[[nodiscard]] bool has_glass(const DensityGrid& field, const VoxelRegistry& types);
/// Likewise in the chunks that changed.
[[nodiscard]] bool has_glass(const DensityGrid& field, const VoxelRegistry& types, const DensityChanges& changes);

/// What rays that make light need of one grid, and how far it has followed the grid's changes.
class TreeCache {
 public:
  /// Makes the trees, or takes over what was edited since the last time; everything when it is another grid. Returns
  /// whether there was anything to do.
  ///
  /// Requires: the types' visibility is that of the last time; otherwise `forget` first.
  /// Cost:     that of OccupancyTree::update for the chunks that changed.
  bool update(const Grid& grid, const VoxelRegistry& types);
  /// The same of a field. Lifetime: as DensityTree. Cost: where it has transparent materials also that of SplitField.
  bool update(const DensityGrid& field, const VoxelRegistry& types);
  void forget() { *this = {}; }
  [[nodiscard]] const ChangeCursor& followed() const { return followed_; }
  [[nodiscard]] const ChangeCursor& followed_field() const { return followed_field_; }

  [[nodiscard]] const OccupancyTree& opaque() const { return opaque_; }
  /// Null when the grid has no transparent voxel.
  [[nodiscard]] const OccupancyTree* transparent() const { return transparent_ ? &*transparent_ : nullptr; }
  /// All that is solid of the field; null when there is none.
  [[nodiscard]] const DensityTree* field() const { return field_ ? if_any(*field_) : nullptr; }
  /// What of it is opaque, the same where all is; null when there is none.
  [[nodiscard]] const DensityTree* opaque_field() const { return split_ ? if_any(split_->opaque()) : field(); }
  /// What of it is transparent; null when there is none.
  [[nodiscard]] const DensityGlass* glass() const { return split_ ? &split_->glass() : nullptr; }
  /// Whether there are transparent voxels, or anything transparent in the field.
  [[nodiscard]] bool has_transparent() const { return transparent_.has_value() || split_ != nullptr; }

 private:
  static const DensityTree* if_any(const DensityTree& tree) { return tree.cells().bounds().empty() ? nullptr : &tree; }
  void update_transparent(const Grid& grid, const VoxelRegistry& types, const GridChanges& changes);
  void update_split(const DensityGrid& field, const VoxelRegistry& types, const DensityChanges& changes);

  ChangeCursor followed_;
  OccupancyTree opaque_{Occupancy::Opaque};
  std::optional<OccupancyTree> transparent_;
  ChangeCursor followed_field_;
  std::optional<DensityTree> field_;
  std::unique_ptr<SplitField> split_;  // where the field has anything transparent
};

}  // namespace quoin
