#include "render_vk/raster/level_meshes.h"
#include "scene/tracer/placed_grid.h"

#include "core/drop_oldest.h"

namespace quoin::vulkan {

void LevelMeshes::clear() {
  for (const auto& [key, level] : levels_) store_->drop(key);
  levels_.clear();
}

void LevelMeshes::look_at(const Scene& scene) {
  const TypeChanges types = scene.types.changes_since(followed_types_);
  const bool is_seen_otherwise = has_other_visibility(types);
  for (auto level = levels_.begin(); level != levels_.end();) {
    const auto each = level++;
    if (scene.grids().find(each->first.grid) == nullptr) {
      drop(each);
    } else if (is_seen_otherwise || (!types.empty() && each->second.surfaces->style() == SurfaceStyle::Smooth)) {
      each->second.surfaces->forget();
    }
  }
}

void LevelMeshes::drop(std::map<MeshKey, Level>::iterator level) {
  store_->drop(level->first);
  levels_.erase(level);
}

// Returns the style of the full grid's chunks, if there are any.
SurfaceStyle LevelMeshes::style_of(MeshKey key) {
  if (key.content == SurfaceContent::Field) return SurfaceStyle::Smooth;
  const MeshStore::StoredGrid* full = store_->find({key.grid, 0});
  return full == nullptr ? SurfaceStyle::Blocky : full->chunks.begin()->second.style;
}

Status LevelMeshes::put(MeshKey key, const PlacedGrid& placed, const VoxelRegistry& types, Threads threads) {
  const SurfaceStyle style = style_of(key);
  auto known = levels_.find(key);
  if (known != levels_.end() && known->second.surfaces->style() != style) {
    drop(known);
    known = levels_.end();
  }
  if (known == levels_.end()) {
    known = levels_.emplace(key, Level{std::make_unique<GridSurfaces>(key.grid, key.content, style), 0}).first;
  }
  if (known->second.last_use == image_) return {};
  known->second.last_use = image_;
  try {
    Status done = put_updates(key, known->second, placed, types, threads);
    if (!done) drop(known);
    return done;
  } catch (...) {
    drop(known);
    throw;
  }
}

Status LevelMeshes::put_updates(MeshKey key, Level& level, const PlacedGrid& placed, const VoxelRegistry& types,
                                Threads threads) {
  SceneGrid content;
  if (key.content == SurfaceContent::Voxels) content.grid = placed.voxels->snapshot();
  if (key.content == SurfaceContent::Field && placed.field != nullptr) content.field = placed.field->field().snapshot();
  const std::vector<SurfaceUpdate> updates = level.surfaces->update(content, types, threads);
  return updates.empty() ? Status{} : store_->put(updates, key.level);
}

void LevelMeshes::drop_unused(std::uint64_t max_bytes) {
  const auto bytes_of = [&](auto each) {
    const MeshStore::StoredGrid* stored = store_->find(each->first);
    return stored == nullptr ? 0 : stored->bytes;
  };
  std::uint64_t held = 0;
  for (auto each = levels_.begin(); each != levels_.end(); ++each) held += bytes_of(each);
  drop_oldest(
      levels_, held, max_bytes, [&](auto each) { return each->second.last_use != image_; }, bytes_of,
      [&](auto each) { drop(each); });
}

}  // namespace quoin::vulkan
