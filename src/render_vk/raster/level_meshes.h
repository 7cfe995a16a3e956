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

/// The meshes of halved grids and halved fields. Created when an image first requests them, and kept. After edits only
/// the chunks that can have changed are rebuilt.
class LevelMeshes {
 public:
  /// Its meshes live in `store` and are destroyed with it.
  explicit LevelMeshes(MeshStore& store) : store_(&store) {}

  /// Drops the meshes of removed grids, and marks meshes for rebuilding that changed types may affect.
  void look_at(const Scene& scene);
  void clear();

  /// Begins an image.
  void begin() { ++image_; }
  /// Puts the meshes of a grid halved `key.level` times into the store, placed as `placed`. Called once per image.
  /// Errors: as MeshStore::put; also throws bad_alloc. The level is then empty.
  [[nodiscard]] Status put(MeshKey key, const PlacedGrid& placed, const VoxelRegistry& types, Threads threads);
  /// Drops the least recently used meshes not used by the last image, until at most `max_bytes` are held.
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
  std::uint64_t image_ = 0;
};

}  // namespace quoin::vulkan
