#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include <quoin/core/memory.h>
#include <quoin/scene/scene_tracer.h>

#include "scene/tracer/instance_tree.h"
#include "scene/tracer/placed_grid.h"
#include "scene/tracer/tree_cache.h"

namespace quoin {

/// The last known state of a scene's grid.
struct TracedGrid {
  GridHandle handle;
  const SceneGrid* grid = nullptr;
  DVec3 pivot{0.0};
  IBox tight;
  bool can_be_placed = false;               ///< it is not empty, and its pivot is finite
  bool is_placed = false;                   ///< by a traced instance
  bool is_partial = false;                  ///< its voxels or its field
  std::uint64_t shape = 0;                  ///< unique number; replaced when pivot or bounds change
  TreeCache trees{ShapedVoxels::ForSight};  ///< up to date while it is placed
};

struct SceneTracer::Impl {
  // The state that a placed grid was read from, for comparison with the current instance.
  struct Source {
    InstanceHandle instance;
    TracedGrid* grid = nullptr;
    std::uint64_t shape = 0;
    DVec3 position{0.0};
    DQuat rotation{1.0, 0.0, 0.0, 0.0};
    double voxel_size = 1.0;
    bool mirrored = false;

    [[nodiscard]] bool is_of(const Instance& now, const TracedGrid& its_grid) const {
      return grid == &its_grid && shape == its_grid.shape && position == now.position && rotation == now.rotation &&
             voxel_size == now.voxel_size && mirrored == now.mirrored;
    }
  };

  const Scene* scene = nullptr;
  InstanceFilter filter = InstanceFilter::Visible;
  ChangeCursor followed_types;
  ChangeCursor followed_scene;
  std::vector<std::unique_ptr<TracedGrid>> grids;  // by the scene's slots; null for unused ones
  BlockVector<PlacedGrid> placed;
  std::vector<Source> sources;  // of `placed`
  InstanceTree instances;       // of `placed`, in the world
  // Instances of partial grids, including empty ones, by their handles; in the space of a grid whose voxels are chunks.
  // They have no trees.
  BlockVector<PlacedGrid> unloaded;
  bool has_transparent = false;
  int shape_reach = 0;     // how far the shapes of any type reach outside their voxel, rounded up
  HalvedGridCache coarse;  // the levels of `with_detail`

  bool update(Threads threads);
  void refer_to(const Scene& other) noexcept;

  std::uint64_t shapes = 0;      // number of shapes so far
  bool has_other_trees = false;  // `placed` refers to outdated grids or trees
  bool is_unfinished = false;    // an update was interrupted

  bool update_types(const TypeChanges& changes);
  [[nodiscard]] bool look_at_grids(const SceneChanges& changes);
  [[nodiscard]] bool look_at(GridHandle handle);
  [[nodiscard]] bool move_instance(InstanceHandle handle, std::vector<InstanceTree::Change>& moved);
  [[nodiscard]] bool move_instances(const SceneChanges& changes);
  [[nodiscard]] TracedGrid* grid_to_place(const Instance& instance) const;
  void place(std::size_t i, InstanceHandle handle, const Instance& instance, TracedGrid& grid);
  [[nodiscard]] bool move_all_instances();
  void place_instances();
  void find_unloaded(const SceneChanges& changes, bool finds_all);
  void place_unloaded(InstanceHandle handle, const Instance* instance);
  void update_trees(const SceneChanges& changes, Threads threads);
};

}  // namespace quoin
