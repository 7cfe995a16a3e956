#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include <quoin/core/parallel.h>
#include <quoin/grid/density_grid.h>
#include <quoin/grid/downsample.h>
#include <quoin/grid/grid.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/scene/level_of_detail.h>
#include <quoin/scene/scene.h>
#include <quoin/trace/density_ray.h>
#include <quoin/trace/occupancy_tree.h>

#include "grid/shapes/shape_index.h"
#include "scene/tracer/placed_grid.h"
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
  /// Replaces the field by another snapshot of it, before `update` takes over the changes.
  void refer_to(const DensityGrid& whole) noexcept {
    whole_ = &whole;
    glass_.refer_to(whole);
  }

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

/// The shapes of a grid, for rays and other queries.
struct TracedShapes {
  ShapeIndex index;
  OccupancyTree touched;  ///< the voxels that shapes touch, also air: their own, and those that they reach into
  /// All opaque voxels, and those that shapes with visible parts touch (ShapeParts::Visible), so that a ray finds the
  /// first of both at once.
  OccupancyTree solid;
  /// The voxels that shapes with glass touch: without textures or with translucent ones, of transparent types. Empty if
  /// there are none, or if they are in SightTrees::glass.
  OccupancyTree glass;
  std::vector<std::uint8_t> is_glass;  ///< [type]: 1 if its shapes have glass; types beyond it have none
};

/// Returns how many voxels the shapes of any type reach outside their own: 0 or 1, not less than the true number. Cost:
/// O(types and elements).
[[nodiscard]] int reach_of_shapes(const VoxelRegistry& types);

/// Returns true if the shapes, orientations or looks of shapes of any type have changed or may have changed. Textures
/// decide which parts of shapes are visible and which are glass.
[[nodiscard]] bool has_other_shapes(const TypeChanges& changes, const VoxelRegistry& types);

/// The transparent voxels of a grid for the rays of images, in two trees: most rays meet one kind of content only.
struct SightTrees {
  /// The voxels in which rays meet glass: transparent cubes, except cells of faces, and voxels that shapes with glass
  /// touch. Blocks of one type contain no touched voxels.
  OccupancyTree glass{Occupancy::Glass};
  /// Cells of faces (CellContent::Faces), except those whose six neighbours hide all of their sides.
  OccupancyTree cells{Occupancy::Glass};
  std::vector<std::uint8_t> is_cell;  ///< [type]: 1 if its voxels are cells of faces; types beyond it have none
};

/// Returns true if the voxels of a type are cells of faces (CellContent::Faces) for some rays.
[[nodiscard]] bool is_cell_of_faces(const VoxelRegistry& types, VoxelType type);

/// The treatment of voxels whose type has shapes.
enum class ShapedVoxels : std::uint8_t {
  AsCubes,   ///< transparent cubes of their type's colour
  ByShape,   ///< not in the trees of opaque and transparent voxels, but in `shapes`, except for ShapeIndex::cubes_in
  ForSight,  ///< as ByShape, and also `sight`, for images by the CPU
};

/// The tracing data of one grid for rendering, and its read position in the grid's changes.
class TreeCache {
 public:
  TreeCache() = default;
  explicit TreeCache(ShapedVoxels shaped) : shaped_(shaped) {}

  /// Makes the trees, or updates them with the edits since the last call; rebuilds them for another grid. Returns true
  /// if there was anything to do.
  ///
  /// Requires: the types' visibility and shapes are unchanged since the last call; otherwise call `forget` first.
  /// Cost:     that of OccupancyTree::update and ShapeIndex::update for the chunks that changed. Grids without shapes
  ///           have no index.
  bool update(const Grid& grid, const VoxelRegistry& types);
  /// As above, for a field. Lifetime: as DensityTree. Cost: with transparent materials, also the cost of SplitField.
  bool update(const DensityGrid& field, const VoxelRegistry& types);
  /// Replaces the field that the trees refer to by another snapshot of it, before `update`.
  void refer_to(const DensityGrid& field) noexcept {
    if (field_) field_->refer_to(field);
    if (split_ != nullptr) split_->refer_to(field);
  }
  void forget() { *this = TreeCache(shaped_); }
  [[nodiscard]] const ChangeCursor& followed() const { return followed_; }
  [[nodiscard]] const ChangeCursor& followed_field() const { return followed_field_; }

  [[nodiscard]] const OccupancyTree& opaque() const { return opaque_; }
  /// Returns null if the grid has no transparent voxel.
  [[nodiscard]] const OccupancyTree* transparent() const { return transparent_ ? &*transparent_ : nullptr; }
  /// Returns null if the grid has no shapes, or ShapedVoxels::AsCubes. Lifetime: until the next update.
  [[nodiscard]] const TracedShapes* shapes() const { return shapes_.get(); }
  /// Returns the trees in which rays find glass and cells of faces; null if there are none. Requires:
  /// ShapedVoxels::ForSight. Lifetime: until the next update.
  [[nodiscard]] const OccupancyTree* glass_voxels() const {
    return sight_ == nullptr ? transparent() : if_any(sight_->glass);
  }
  [[nodiscard]] const OccupancyTree* face_cells() const { return sight_ == nullptr ? nullptr : if_any(sight_->cells); }
  /// Returns true if the trees have a type as the wrong kind of transparent voxels, since its textures have changed.
  [[nodiscard]] bool has_other_cells(const VoxelRegistry& types, VoxelType type) const;
  /// Returns all solid of the field; null if there is none.
  [[nodiscard]] const DensityTree* field() const { return field_ ? if_any(*field_) : nullptr; }
  /// Returns the opaque part of the field, or the whole field if all is opaque; null if there is none.
  [[nodiscard]] const DensityTree* opaque_field() const { return split_ ? if_any(split_->opaque()) : field(); }
  /// Returns the transparent part of the field; null if there is none.
  [[nodiscard]] const DensityGlass* glass() const { return split_ ? &split_->glass() : nullptr; }
  /// Returns true if there are transparent voxels or field parts, and, with ShapedVoxels::ForSight, shapes.
  [[nodiscard]] bool has_transparent() const {
    return transparent_.has_value() || split_ != nullptr || glass_voxels() != nullptr;
  }

 private:
  static const DensityTree* if_any(const DensityTree& tree) { return tree.cells().bounds().empty() ? nullptr : &tree; }
  static const OccupancyTree* if_any(const OccupancyTree& tree) { return tree.bounds().empty() ? nullptr : &tree; }
  void update_transparent(const Grid& grid, const VoxelRegistry& types, const GridChanges& changes);
  void update_glass_cubes(const Grid& grid, const VoxelRegistry& types, const std::vector<IVec3>& chunks);
  std::optional<std::vector<IVec3>> update_shapes(const Grid& grid, const VoxelRegistry& types,
                                                  const GridChanges& changes);
  void update_sight(const Grid& grid, const VoxelRegistry& types, std::vector<IVec3> chunks);
  void update_split(const DensityGrid& field, const VoxelRegistry& types, const DensityChanges& changes);

  ShapedVoxels shaped_ = ShapedVoxels::AsCubes;
  ChangeCursor followed_;
  OccupancyTree opaque_{Occupancy::Opaque};
  std::optional<OccupancyTree> transparent_;
  ChangeCursor followed_data_;  // unused without shapes
  std::unique_ptr<TracedShapes> shapes_;
  std::unique_ptr<SightTrees> sight_;  // null if rays meet no other transparent voxels than those of `transparent_`
  ChangeCursor followed_field_;
  std::optional<DensityTree> field_;
  std::unique_ptr<SplitField> split_;  // null if the field has no transparent part
};

/// A halved grid, ready to be traced.
struct CoarseLevel {
  const Grid* voxels = nullptr;        ///< empty if the grid has no voxels
  const DensityGrid* field = nullptr;  ///< null if the grid has none
  IBox tight;                          ///< around both
  int level = 0;
  TreeCache trees;

  /// Makes a placed grid trace this level instead of its own voxels and field. Requires: its placement matches the
  /// scene.
  void put_in(PlacedGrid& placed) const;
};

/// Halved grids with their trees, created on first request and kept. After an edit of a grid, only the chunks that it
/// can affect are rebuilt.
///
/// A grid is halved only while the volume of its voxels changes by at most an eighth: thin features, such as a bridge's
/// deck, would become visibly thicker. A field is halved only while at most an eighth of its surface is one sample
/// thin: thin features would lose their shape and then get holes. If a grid has both, both are halved equally often. A
/// field with transparent material is never halved: a halved sample may take a neighbour's material, which would break
/// up the shore of a lake.
/// Threads: all functions may run concurrently.
class HalvedGridCache {
  struct Types {
    const VoxelRegistry& full;
    const VoxelRegistry& halved;  ///< of all levels
  };
  struct Entry {
    ChangeCursor followed;
    ChangeCursor followed_field;
    ChangeCursor followed_states;  // unused if types have no shapes and are not turned
    GridPyramid pyramid;
    DensityPyramid fields;
    Grid no_voxels;
    std::vector<std::unique_ptr<CoarseLevel>> levels;  // the first is halved once
    bool is_coarsest = false;                          // no coarser level is similar to the grid
    void make(const SceneGrid& grid, const Types& types, int halvings, Threads threads);
    void renew(const SceneGrid& grid, const Types& types, Threads threads);
    [[nodiscard]] bool is_alike(const SceneGrid& grid, int halvings) const;
    bool take_level(const SceneGrid& grid, const Types& types, int halvings);
  };

 public:
  /// Access to the levels, which blocks other threads from making more. Levels keep their addresses until their grid
  /// changes.
  class Lock {
   public:
    /// Returns the grid at a level, or at a finer level if its volume would change too much. Returns null if it cannot
    /// be halved at all.
    [[nodiscard]] const CoarseLevel* find(GridHandle grid, int halvings) const;

   private:
    friend class HalvedGridCache;
    explicit Lock(const HalvedGridCache& grids) : grids_(&grids), lock_(grids.mutex_) {}
    const HalvedGridCache* grids_;
    std::unique_lock<std::mutex> lock_;
  };

  /// Makes the levels that the selected instances need.
  [[nodiscard]] Lock make(const Scene& scene, std::span<const SelectedInstance> selected, Threads threads);

  /// Removes a grid's levels if `is_stale(handle)` returns true.
  template <class IsStale>
  void forget(IsStale&& is_stale) {
    const std::lock_guard lock(mutex_);
    std::erase_if(entries_, [&](const auto& entry) { return is_stale(entry.first); });
  }

  HalvedGridCache() = default;

 private:
  mutable std::mutex mutex_;
  std::map<GridHandle, Entry> entries_;
  HalvedTypes halved_types_;
};

}  // namespace quoin
