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

/// A field with transparent materials, in two parts for rays: the opaque part, a field that shares the chunks without
/// transparent material, and the transparent part.
///
/// Lifetime: `whole` must outlive it at the same address. This object cannot be moved.
class SplitField {
 public:
  /// Cost: 0.3 ms per chunk with transparent materials, plus the trees.
  SplitField(const DensityGrid& whole, const VoxelRegistry& types);
  SplitField(const SplitField&) = delete;
  SplitField& operator=(const SplitField&) = delete;

  /// Takes over the edits. Requires: as DensityGlass::update. Cost: like construction, for the changed chunks and, in
  /// the trees, those below.
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

/// Returns true if any solid of a field is transparent. Cost: O(chunks).
[[nodiscard]] bool has_glass(const DensityGrid& field, const VoxelRegistry& types);
/// As above, but tests only the changed chunks.
[[nodiscard]] bool has_glass(const DensityGrid& field, const VoxelRegistry& types, const DensityChanges& changes);

/// The tracing data of one grid for rendering, and its read position in the grid's changes.
class TreeCache {
 public:
  /// Makes the trees, or updates them with the edits since the last call; rebuilds them for another grid. Returns true
  /// if there was anything to do.
  ///
  /// Requires: the types' visibility is unchanged since the last call; otherwise call `forget` first.
  /// Cost:     that of OccupancyTree::update for the chunks that changed.
  bool update(const Grid& grid, const VoxelRegistry& types);
  /// As above, for a field. Lifetime: as DensityTree. Cost: with transparent materials, also the cost of SplitField.
  bool update(const DensityGrid& field, const VoxelRegistry& types);
  void forget() { *this = {}; }
  [[nodiscard]] const ChangeCursor& followed() const { return followed_; }
  [[nodiscard]] const ChangeCursor& followed_field() const { return followed_field_; }

  [[nodiscard]] const OccupancyTree& opaque() const { return opaque_; }
  /// Returns null if the grid has no transparent voxel.
  [[nodiscard]] const OccupancyTree* transparent() const { return transparent_ ? &*transparent_ : nullptr; }
  /// Returns all solid of the field; null if there is none.
  [[nodiscard]] const DensityTree* field() const { return field_ ? if_any(*field_) : nullptr; }
  /// Returns the opaque part of the field, or the whole field if all is opaque; null if there is none.
  [[nodiscard]] const DensityTree* opaque_field() const { return split_ ? if_any(split_->opaque()) : field(); }
  /// Returns the transparent part of the field; null if there is none.
  [[nodiscard]] const DensityGlass* glass() const { return split_ ? &split_->glass() : nullptr; }
  /// Returns true if there are transparent voxels or field parts.
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
  std::unique_ptr<SplitField> split_;  // null if the field has no transparent part
};

}  // namespace quoin
