#pragma once

#include <optional>

#include <quoin/grid/density_grid.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/trace/density_ray.h>

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

}  // namespace quoin
