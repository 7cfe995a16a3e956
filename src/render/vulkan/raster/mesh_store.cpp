#include "render/vulkan/raster/mesh_store.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include <quoin/core/assert.h>

#include "core/caches.h"
#include "render/vulkan/raster/mesh_shader_data.h"
#include "render/vulkan/trees/shader_data.h"
#include "scene/tracer/placed_grid.h"

namespace quoin::vulkan {
namespace {

// Replaced meshes stay until their replacement has arrived; this limits their memory at a time.
constexpr std::size_t kBatchBytes = std::size_t{32} << 20;

void append_vertex(const ChunkSurface& surface, std::size_t i, std::vector<std::uint32_t>& words) {
  QUOIN_ASSERT(i < surface.smooth.positions.size(), "a vertex of the surface");
  const SmoothChunkMesh& mesh = surface.smooth;
  const Vec3 position = mesh.positions.data()[i];
  for (int axis = 0; axis < 3; ++axis) words.push_back(std::bit_cast<std::uint32_t>(position[axis]));
  words.push_back(octahedral(mesh.normals.data()[i]));
  const float open = mesh.occlusion.empty() ? 1.0F : 1.0F - std::clamp(mesh.occlusion.data()[i], 0.0F, 1.0F);
  const LinearRgba16 albedo = surface.albedo[i];
  words.push_back(albedo[0] | std::uint32_t{albedo[1]} << 16);
  words.push_back(albedo[2] | static_cast<std::uint32_t>(std::lround(open * 65535.0F)) << 16);
  words.push_back(surface.types[i]);
}

void append_materials(const VertexMaterials& materials, std::vector<std::uint32_t>& words) {
  const auto& [types, weights] = materials;
  words.push_back(types[0] | std::uint32_t{types[1]} << 16);
  words.push_back(types[2] | std::uint32_t{types[3]} << 16);
  words.push_back(weights[0] | std::uint32_t{weights[1]} << 8 | std::uint32_t{weights[2]} << 16 |
                  std::uint32_t{weights[3]} << 24);
}

// Rejects indices and sizes that would make a device read outside the surface's memory.
Status check(const ChunkSurface& surface) {
  const auto refuse = [](const char* message) { return make_error(ErrorCode::InvalidArgument, message); };
  if (surface.style == SurfaceStyle::Blocky) {
    if (surface.opaque_quads > surface.quads.size()) return refuse("surface: more opaque quads than quads");
    return {};
  }
  const SmoothChunkMesh& mesh = surface.smooth;
  const std::size_t count = mesh.positions.size();
  const bool is_whole = mesh.normals.size() == count && surface.albedo.size() == count &&
                        surface.types.size() == count && (mesh.occlusion.empty() || mesh.occlusion.size() == count) &&
                        (surface.materials.empty() || surface.materials.size() == count);
  if (!is_whole) return refuse("surface: its vertex arrays have different lengths");
  const bool is_of_triangles = mesh.indices.size() % 3 == 0 && surface.glass_indices % 3 == 0;
  if (!is_of_triangles) return refuse("surface: its index counts are not multiples of 3");
  if (surface.glass_indices > mesh.indices.size()) return refuse("surface: more glass indices than indices");
  const bool is_inside =
      std::all_of(mesh.indices.begin(), mesh.indices.end(), [&](std::uint32_t index) { return index < count; });
  if (!is_inside) return refuse("surface: an index is out of range");
  return {};
}

void set_directions(std::span<const Quad> opaque, StoredMesh& mesh) {
  mesh.opaque.back() = static_cast<std::uint32_t>(opaque.size());
  const auto is_before = [](const Quad& a, const Quad& b) { return a.direction() < b.direction(); };
  mesh.is_by_direction = std::is_sorted(opaque.begin(), opaque.end(), is_before);
  if (!mesh.is_by_direction) return;
  for (std::size_t i = 1; i < 6; ++i) {
    const auto from = std::partition_point(
        opaque.begin(), opaque.end(), [=](const Quad& quad) { return static_cast<std::size_t>(quad.direction()) < i; });
    mesh.opaque[i] = static_cast<std::uint32_t>(from - opaque.begin());
  }
}

}  // namespace

MeshStore::~MeshStore() {
  clear();
}

void MeshStore::clear() {
  for (auto& [key, grid] : grids_) {
    for (auto& [at, mesh] : grid.chunks) memory_->release(mesh.place);
  }
  grids_.clear();
  chunks_ = chunks_with_glass_ = bytes_ = 0;
  triangles_ = 0;
}

Status MeshStore::put(std::span<const SurfaceUpdate> surfaces, int level) {
  for (const SurfaceUpdate& update : surfaces) {
    if (update.surface == nullptr) continue;
    if (Status right = check(*update.surface); !right) return right;
  }
  std::vector<Change> changes;
  const auto give_up = [&] {
    memory_->discard();
    for (Change& change : changes) memory_->release(change.mesh.place);
  };
  try {
    Status done = put_all(surfaces, level, changes);
    if (!done) give_up();
    return done;
  } catch (...) {
    give_up();
    throw;
  }
}

Status MeshStore::put_all(std::span<const SurfaceUpdate> surfaces, int level, std::vector<Change>& changes) {
  std::size_t bytes = 0;
  Status done;
  for (const SurfaceUpdate& update : surfaces) {
    Change& change = changes.emplace_back(Change{{update.grid, level, update.content}, update.chunk, {}});
    if (update.surface != nullptr) done = upload(*update.surface, change.mesh);
    if (!done) return done;
    bytes += change.mesh.place.size;
    if (bytes < kBatchBytes) continue;
    if (done = finish(changes); !done) return done;
    bytes = 0;
  }
  return finish(changes);
}

Status MeshStore::upload(const ChunkSurface& surface, StoredMesh& mesh) {
  mesh.style = surface.style;
  QUOIN_ASSERT(mesh.place.size == 0, "a mesh without memory");
  std::vector<std::uint32_t> words;
  std::span<const std::byte> bytes;
  if (surface.style == SurfaceStyle::Blocky) {
    const std::span<const Quad> quads(surface.quads);
    set_directions(quads.first(surface.opaque_quads), mesh);
    const auto glass = quads.subspan(surface.opaque_quads);
    mesh.glass.assign(glass.begin(), glass.end());
    bytes = std::as_bytes(quads);
  } else {
    const SmoothChunkMesh& smooth = surface.smooth;
    mesh.indices = static_cast<std::uint32_t>(smooth.indices.size());
    mesh.glass_indices = static_cast<std::uint32_t>(surface.glass_indices);
    const std::size_t count = smooth.positions.size();
    words.reserve(kVertexWords * count + kMaterialWords * surface.materials.size() + smooth.indices.size());
    if (mesh.indices != 0) {
      for (std::size_t i = 0; i < count; ++i) append_vertex(surface, i, words);
      for (const VertexMaterials& each : surface.materials) append_materials(each, words);
      mesh.with_materials = static_cast<std::uint32_t>(surface.materials.size());
      QUOIN_ASSERT(surface.materials.size() < std::size_t{1} << (32 - kMeshVerticesShift), "a number of 28 bits");
    }
    mesh.first_index = words.size() * sizeof(std::uint32_t);
    words.insert(words.end(), smooth.indices.begin(), smooth.indices.end());
    bytes = std::as_bytes(std::span(words));
  }
  if (bytes.empty()) return {};
  const auto place = memory_->allocate(bytes.size(), "uploading meshes");
  if (!place) return place.error();
  mesh.place = *place;
  return memory_->write(mesh.place, bytes);
}

// Replaces the old surfaces by the new ones; keeps the old ones on failure.
Status MeshStore::finish(std::vector<Change>& changes) {
  Status done = memory_->flush();
  for (Change& change : changes) {
    if (done) {
      replace(change);
    } else {
      memory_->release(change.mesh.place);
    }
  }
  changes.clear();
  return done;
}

void MeshStore::replace(Change& change) {
  if (change.mesh.place.size == 0) {
    const auto grid = grids_.find(change.key);
    if (grid == grids_.end()) return;
    const auto old = grid->second.chunks.find(change.chunk);
    if (old == grid->second.chunks.end()) return;
    give_back(old->second);
    grid->second.chunks.erase(old);
    grid->second.bounds_known = false;
    if (grid->second.chunks.empty()) grids_.erase(grid);
    return;
  }
  StoredGrid& grid = grids_[change.key];
  const auto [at, is_new] = grid.chunks.try_emplace(change.chunk);
  grid.bounds_known = false;
  if (!is_new) give_back(at->second);
  at->second = std::move(change.mesh);
  ++chunks_;
  chunks_with_glass_ += at->second.has_glass() ? 1 : 0;
  triangles_ += at->second.triangles();
  bytes_ += at->second.place.size;
}

void MeshStore::give_back(StoredMesh& mesh) {
  QUOIN_ASSERT(chunks_ > 0 && bytes_ >= mesh.place.size && triangles_ >= mesh.triangles(),
               "removed meshes were counted");
  --chunks_;
  chunks_with_glass_ -= mesh.has_glass() ? 1 : 0;
  triangles_ -= mesh.triangles();
  bytes_ -= mesh.place.size;
  memory_->release(mesh.place);
}

void MeshStore::drop(MeshKey key) {
  const auto found = grids_.find(key);
  if (found == grids_.end()) return;
  for (auto& [at, mesh] : found->second.chunks) give_back(mesh);
  grids_.erase(found);
}

const MeshStore::StoredGrid* MeshStore::find(MeshKey key) {
  const auto found = grids_.find(key);
  if (found == grids_.end()) return nullptr;
  StoredGrid& grid = found->second;
  QUOIN_ASSERT(!grid.chunks.empty(), "grids without meshes are removed");
  if (!grid.bounds_known) {
    grid.low = grid.high = grid.chunks.begin()->first;
    grid.opaque_quads = 0;
    grid.bytes = 0;
    for (const auto& [at, mesh] : grid.chunks) {
      grid.low = glm::min(grid.low, at);
      grid.high = glm::max(grid.high, at);
      grid.opaque_quads += mesh.opaque.back() + mesh.indices / 6;
      grid.bytes += mesh.place.size;
    }
    grid.bounds_known = true;
  }
  return &grid;
}

void LevelMeshes::clear() {
  for (const auto& [key, level] : levels_) store_->drop(key);
  levels_.clear();
}

void LevelMeshes::look_at(const Scene& scene) {
  PendingChanges types(followed_types_, scene.types);
  const bool is_seen_otherwise = has_other_visibility(*types);
  for (auto level = levels_.begin(); level != levels_.end();) {
    const auto each = level++;
    if (scene.grids().find(each->first.grid) == nullptr) {
      drop(each);
    } else if (is_seen_otherwise || (!types->empty() && each->second.surfaces->style() == SurfaceStyle::Smooth)) {
      each->second.surfaces->forget();
    }
  }
  types.commit();
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
