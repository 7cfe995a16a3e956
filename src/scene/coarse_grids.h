#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include <quoin/core/parallel.h>
#include <quoin/grid/downsample.h>
#include <quoin/scene/level_of_detail.h>
#include <quoin/scene/scene.h>
#include <quoin/trace/occupancy_tree.h>

namespace quoin {

struct PlacedGrid;

/// What rays that make light need of a grid.
struct OpticalTrees {
  OccupancyTree opaque;
  std::optional<OccupancyTree> transparent;  ///< none when the grid has no transparent voxel

  [[nodiscard]] static OpticalTrees build(const Grid& grid, const VoxelRegistry& types);
};

/// A halved grid, ready to be traced.
struct CoarseLevel {
  const Grid* voxels = nullptr;
  int halvings = 0;
  OpticalTrees trees;

  /// Has a placed grid traced through this instead of its own voxels. Requires: it is placed as the scene says.
  void put_in(PlacedGrid& placed) const;
};

/// Halved grids with their trees, made when first asked for and kept; made anew for grids that were edited since.
///
/// Threads: any number may call.
class CoarseGrids {
  struct Entry {
    std::uint64_t version = 0;  // of the grid
    GridPyramid pyramid;
    std::vector<std::unique_ptr<CoarseLevel>> levels;  // once halved first
    void make(const Grid& grid, const VoxelRegistry& types, int halvings, Threads threads);
  };

 public:
  /// What was made, to be looked at while nobody else makes more. Levels stay where they are until their grid changes.
  class Lock {
   public:
    /// The grid halved that often, or less often where nothing would be left of it; null where that is not at all.
    [[nodiscard]] const CoarseLevel* find(GridHandle grid, int halvings) const;

   private:
    friend class CoarseGrids;
    explicit Lock(const CoarseGrids& grids) : grids_(&grids), lock_(grids.mutex_) {}
    const CoarseGrids* grids_;
    std::unique_lock<std::mutex> lock_;
  };

  /// Makes what the selected instances need.
  [[nodiscard]] Lock make(const Scene& scene, std::span<const SelectedInstance> selected, Threads threads);

  CoarseGrids() = default;

 private:
  mutable std::mutex mutex_;
  std::map<GridHandle, Entry> entries_;
};

}  // namespace quoin
