#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include <quoin/core/parallel.h>
#include <quoin/grid/downsample.h>
#include <quoin/scene/level_of_detail.h>
#include <quoin/scene/scene.h>

#include "scene/tracer/placed_grid.h"
#include "scene/tracer/tree_cache.h"

namespace quoin {

struct PlacedGrid;

/// A halved grid, ready to be traced.
struct CoarseLevel {
  const Grid* voxels = nullptr;        ///< of none where the grid has none
  const DensityGrid* field = nullptr;  ///< null where the grid has none
  IBox tight;                          ///< around both
  int level = 0;
  TreeCache trees;

  /// Has a placed grid traced through this instead of its own voxels and field. Requires: it is placed as the scene
  /// says.
  void put_in(PlacedGrid& placed) const;
};

/// Halved grids with their trees, made when first asked for and kept; where grids were edited since, the chunks that an
/// edit can have changed are made anew.
///
/// A grid is halved only as long as the volume of its voxels stays the same but for an eighth: what is thin, as a
/// bridge's deck, becomes twice as thick, and shows. Likewise its field, of whose surface besides at most an eighth may
/// be one sample thin: what is, loses its shape next, and then holes come. Where a grid has both, both are halved as
/// often. Not at all where anything of the field is transparent: a halved sample may take a neighbour's material, and
/// then the shore of a lake is in pieces. Threads: any number may call.
class HalvedGridCache {
  struct Entry {
    ChangeCursor followed;
    ChangeCursor followed_field;
    GridPyramid pyramid;
    DensityPyramid fields;
    Grid no_voxels;
    std::vector<std::unique_ptr<CoarseLevel>> levels;  // once halved first
    bool is_coarsest = false;                          // there are no more levels that are like the grid
    void make(const SceneGrid& grid, const VoxelRegistry& types, int halvings, Threads threads);
    void renew(const SceneGrid& grid, const VoxelRegistry& types, Threads threads);
    [[nodiscard]] bool is_alike(const SceneGrid& grid, int halvings) const;
    bool take_level(const SceneGrid& grid, const VoxelRegistry& types, int halvings);
  };

 public:
  /// What was made, to be looked at while nobody else makes more. Levels stay where they are until their grid changes.
  class Lock {
   public:
    /// The grid halved that often, or less often where it would swell or shrink too much; null where that is not at
    /// all.
    [[nodiscard]] const CoarseLevel* find(GridHandle grid, int halvings) const;

   private:
    friend class HalvedGridCache;
    explicit Lock(const HalvedGridCache& grids) : grids_(&grids), lock_(grids.mutex_) {}
    const HalvedGridCache* grids_;
    std::unique_lock<std::mutex> lock_;
  };

  /// Makes what the selected instances need.
  [[nodiscard]] Lock make(const Scene& scene, std::span<const SelectedInstance> selected, Threads threads);

  /// What was made of a grid goes when `is_stale(handle)`.
  template <class IsStale>
  void forget(IsStale&& is_stale) {
    const std::lock_guard lock(mutex_);
    std::erase_if(entries_, [&](const auto& entry) { return is_stale(entry.first); });
  }

  HalvedGridCache() = default;

 private:
  mutable std::mutex mutex_;
  std::map<GridHandle, Entry> entries_;
};

}  // namespace quoin
