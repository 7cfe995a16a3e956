#pragma once

#include <cstdint>
#include <map>
#include <memory>

#include <quoin/core/changes.h>
#include <quoin/scene/scene.h>
#include <quoin/scene/scene_tracer.h>

#include "live/grid_surfaces.h"
#include "render_vk/raster/mesh_store.h"
#include "scene/tracer/placed_grid.h"

namespace quoin::vulkan {

/// The meshes of halved grids, of their voxels and of their fields, made when a picture first asks for them and kept;
/// where grids were edited since, those of the chunks that an edit can have changed are made anew.
class LevelMeshes {
 public:
  /// What is put there goes with it.
  explicit LevelMeshes(MeshStore& store) : store_(&store) {}

  /// What was made of grids that are gone goes, and what changed types may show otherwise is made anew.
  void look_at(const Scene& scene);
  void clear();

  /// Begins a picture.
  void begin() { ++picture_; }
  /// Has the meshes of a grid halved `key.level` times in the store: as `placed` has it. Once a picture.
  /// Errors: of MeshStore::put, and bad_alloc; then nothing of this level is there.
  [[nodiscard]] Status put(MeshKey key, const PlacedGrid& placed, const VoxelRegistry& types, Threads threads);
  /// Drops what was not asked for by the last picture, the oldest first, until no more than that is held.
  void drop_unused(std::uint64_t max_bytes);

 private:
  struct Level {
    std::unique_ptr<GridSurfaces> surfaces;
    std::uint64_t last_use = 0;
  };
  Status put_updates(MeshKey key, Level& level, const PlacedGrid& placed, const VoxelRegistry& types, Threads threads);
  [[nodiscard]] SurfaceStyle style_of(MeshKey key);
  void drop(std::map<MeshKey, Level>::iterator level);

  MeshStore* store_;
  std::map<MeshKey, Level> levels_;
  ChangeCursor followed_types_;
  std::uint64_t picture_ = 0;
};

}  // namespace quoin::vulkan
