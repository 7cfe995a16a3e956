#include <quoin/scene/scene_faces.h>

#include <algorithm>
#include <map>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/mesh/blocky.h>

#include "core/coordinates/chunk_order.h"
#include "core/moved_from.h"
#include "scene/scene_follower.h"

namespace quoin {
namespace {

struct GridFaces {
  ChangeCursor read;
  std::unordered_map<IVec3, std::int64_t, CoordinateHash> visible_of;  // chunks with a visible face
  std::int64_t visible = 0;
  FaceCounts counted;  // the part included in the scene's counts

  void put(IVec3 chunk, std::int64_t count) {
    QUOIN_ASSERT(count >= 0, "a count that is not negative");
    const auto known = visible_of.find(chunk);
    visible += count - (known == visible_of.end() ? 0 : known->second);
    if (count > 0) {
      visible_of[chunk] = count;
    } else if (known != visible_of.end()) {
      visible_of.erase(known);
    }
  }
};

/// A chunk whose faces need a new count.
struct ChunkCount {
  const Grid* grid = nullptr;
  GridFaces* faces = nullptr;
  IVec3 chunk{0};
  std::int64_t visible = 0;
};

bool has_any_of(const Grid& grid, const TypeChanges& changes) {
  const std::vector<VoxelType> types = grid.types();
  return changes.all || std::ranges::any_of(changes.items_unless_all(), [&](const TypeChange& change) {
           return (change.visibility_changed || change.shape_changed) && std::ranges::binary_search(types, change.type);
         });
}

/// Counts the chunks at `first`, `first + step` and so on.
void count_chunks(std::vector<ChunkCount>& chunks, std::size_t first, std::size_t step, const VoxelRegistry& types,
                  BlockyMesher& mesher) {
  QUOIN_ASSERT(step > 0, "a positive step");
  for (std::size_t i = first; i < chunks.size(); i += step) {
    chunks[i].visible = mesher.count_faces(chunks[i].grid->neighbourhood(chunks[i].chunk), types);
  }
}

}  // namespace

struct SceneFaces::Impl {
  explicit Impl(InstanceFilter filter) : follower(filter) {}

  SceneFollower follower;
  ChangeCursor types_read;
  std::map<GridHandle, GridFaces> grids;  // includes grids that no drawn instance places any more
  FaceCounts counts;
  std::optional<BlockyMesher> mesher;  // for the few chunks around an edit

  void forget_those_with(const TypeChanges& types, const Scene& scene, std::vector<GridHandle>& touched);
  void follow(const Scene& scene, GridHandle handle, std::vector<ChunkCount>& chunks);
  void count(std::vector<ChunkCount>& chunks, const VoxelRegistry& types, Threads threads);
  void count_in(const Scene& scene, GridHandle handle);
};

// Grids with voxels of types that became opaque or transparent, or have other shapes, are counted from scratch.
void SceneFaces::Impl::forget_those_with(const TypeChanges& types, const Scene& scene,
                                         std::vector<GridHandle>& touched) {
  for (auto& [handle, faces] : grids) {
    const SceneGrid* entry = scene.grids().find(handle);
    if (entry == nullptr || !has_any_of(entry->grid, types)) continue;
    faces.read = {};
    touched.push_back(handle);
  }
}

// Adds the chunks of a grid that must be counted again.
void SceneFaces::Impl::follow(const Scene& scene, GridHandle handle, std::vector<ChunkCount>& chunks) {
  const SceneGrid* entry = scene.grids().find(handle);
  if (entry == nullptr || !follower.places(handle)) return;
  GridFaces& faces = grids[handle];
  ChangeCursor data_read = faces.read;
  GridChanges changes = entry->grid.changes_since(faces.read);
  DataChanges data;
  if (scene.types.has_shapes()) data = entry->grid.data_changes_since(data_read);
  changes.all |= data.all;
  if (changes.all) {
    faces.visible_of.clear();
    faces.visible = 0;
  }
  std::vector<IVec3> near = chunks_to_mesh(entry->grid, changes);
  if (scene.types.has_shapes() && !changes.all) {
    const auto add = [&](const auto& change) { add_chunks_near(change.chunk, change.box, kShapeReach, near); };
    for (const ChunkChange& change : changes.items_unless_all()) add(change);
    for (const DataChange& change : data.items_unless_all()) add(change);
    sort_and_unite(near);
  }
  for (const IVec3 chunk : near) chunks.push_back({&entry->grid, &faces, chunk, 0});
}

void SceneFaces::Impl::count(std::vector<ChunkCount>& chunks, const VoxelRegistry& types, Threads threads) {
  // Each task makes its own mesher, which takes as long as a few chunks.
  constexpr std::size_t kChunksPerTask = 32;
  const std::size_t tasks =
      std::min<std::size_t>(chunks.size() / kChunksPerTask, std::size_t{4} * thread_count(threads));
  if (tasks > 1) {
    parallel_for(tasks, threads, [&](std::size_t task) {
      BlockyMesher own;
      count_chunks(chunks, task, tasks, types, own);
    });
  } else if (!chunks.empty()) {
    if (!mesher) mesher.emplace();
    count_chunks(chunks, 0, 1, types, *mesher);
  }
}

// Replaces a grid's previous counts by the current ones.
void SceneFaces::Impl::count_in(const Scene& scene, GridHandle handle) {
  const auto found = grids.find(handle);
  if (found == grids.end()) return;
  GridFaces& faces = found->second;
  counts -= std::exchange(faces.counted, {});
  QUOIN_ASSERT(counts.visible >= 0 && counts.total >= 0, "counts of the grids that were added");
  const SceneGrid* entry = scene.grids().find(handle);
  if (entry == nullptr) {
    grids.erase(found);
    return;
  }
  if (!follower.places(handle)) return;
  faces.counted = {faces.visible, 6 * entry->grid.voxel_count()};
  counts += faces.counted;
}

SceneFaces::SceneFaces(InstanceFilter filter) : impl_(std::make_unique<Impl>(filter)) {}
SceneFaces::SceneFaces(SceneFaces&&) noexcept = default;
SceneFaces& SceneFaces::operator=(SceneFaces&&) noexcept = default;
SceneFaces::~SceneFaces() = default;

const FaceCounts& SceneFaces::counts() const {
  return impl_of(impl_).counts;
}

const FaceCounts& SceneFaces::update(const Scene& scene, Threads threads) {
  Impl& me = impl_of(impl_);
  PendingChanges types(me.types_read, scene.types);
  SceneFollower::Update update(me.follower, scene);
  if (update.all()) {
    me.grids.clear();
    me.counts = {};
  }
  std::vector<GridHandle> touched(update.touched().begin(), update.touched().end());
  if (has_other_visibility(*types)) me.forget_those_with(*types, scene, touched);
  std::sort(touched.begin(), touched.end());
  touched.erase(std::unique(touched.begin(), touched.end()), touched.end());
  std::vector<ChunkCount> chunks;
  for (const GridHandle handle : touched) me.follow(scene, handle, chunks);
  me.count(chunks, scene.types, threads);
  for (const ChunkCount& counted : chunks) counted.faces->put(counted.chunk, counted.visible);
  for (const GridHandle handle : touched) me.count_in(scene, handle);
  types.commit();
  update.commit();
  return me.counts;
}

FaceCounts count_faces(const Scene& scene, InstanceFilter filter, Threads threads) {
  return SceneFaces(filter).update(scene, threads);
}

}  // namespace quoin
