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
  struct Entry {
    ChangeCursor followed;
    ChangeCursor followed_field;
    GridPyramid pyramid;
    DensityPyramid fields;
    Grid no_voxels;
    std::vector<std::unique_ptr<CoarseLevel>> levels;  // the first is halved once
    bool is_coarsest = false;                          // no coarser level is similar to the grid
    void make(const SceneGrid& grid, const VoxelRegistry& types, int halvings, Threads threads);
    void renew(const SceneGrid& grid, const VoxelRegistry& types, Threads threads);
    [[nodiscard]] bool is_alike(const SceneGrid& grid, int halvings) const;
    bool take_level(const SceneGrid& grid, const VoxelRegistry& types, int halvings);
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
};

}  // namespace quoin
