#include <quoin/scene/scene_tracer.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include <glm/vector_relational.hpp>

#include <quoin/core/assert.h>
#include <quoin/core/memory.h>

#include "core/moved_from.h"
#include "scene/tracer/placed_grid.h"
#include "scene/tracer/scene_tracer_impl.h"

namespace quoin {

SceneTracer::SceneTracer(const Scene& scene, InstanceFilter filter, Threads threads) : impl_(std::make_unique<Impl>()) {
  impl_of(impl_).scene = &scene;
  impl_of(impl_).filter = filter;
  impl_of(impl_).update(threads);
}

bool SceneTracer::update(Threads threads) {
  return impl_of(impl_).update(threads);
}

void SceneTracer::update(const Scene& scene, Threads threads) {
  if (&scene != impl_of(impl_).scene) impl_of(impl_).refer_to(scene);
  impl_of(impl_).update(threads);
}

SceneTracer::SceneTracer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

SceneTracer SceneTracer::with_detail(std::span<const SelectedInstance> selected, Threads threads) const {
  auto detailed = std::make_unique<Impl>();
  detailed->scene = impl_of(impl_).scene;
  detailed->filter = impl_of(impl_).filter;
  detailed->placed = impl_of(impl_).placed;
  detailed->has_transparent = impl_of(impl_).has_transparent;
  detailed->unloaded = impl_of(impl_).unloaded;
  std::vector<InstanceTree::Change> halved;
  const HalvedGridCache::Lock levels = impl_of(impl_).coarse.make(*impl_of(impl_).scene, selected, threads);
  auto next = detailed->placed.begin();
  for (const SelectedInstance& choice : selected) {
    next = std::lower_bound(next, detailed->placed.end(), choice.instance,
                            [](const PlacedGrid& placed, InstanceHandle handle) { return placed.instance < handle; });
    if (next == detailed->placed.end()) break;
    if (next->instance != choice.instance) continue;
    next->detail = choice.detail;
    const GridHandle grid = impl_of(impl_).scene->instances()[choice.instance].grid;
    const CoarseLevel* level = levels.find(grid, choice.level);
    if (level == nullptr) continue;
    level->put_in(*next);
    halved.push_back({static_cast<std::size_t>(next - detailed->placed.begin()), bounds_in_world(*next, level->tight)});
  }
  detailed->instances = impl_of(impl_).instances;
  detailed->instances.change(halved);
  return SceneTracer(std::move(detailed));
}

SceneTracer::SceneTracer(SceneTracer&&) noexcept = default;
SceneTracer& SceneTracer::operator=(SceneTracer&&) noexcept = default;
SceneTracer::~SceneTracer() = default;

const Scene& SceneTracer::scene() const {
  return *impl_of(impl_).scene;
}
const SceneTracer::Impl& SceneTracer::impl() const {
  return impl_of(impl_);
}

const BlockVector<PlacedGrid>& placed_in(const SceneTracer& tracer) {
  return tracer.impl().placed;
}
bool SceneTracer::has_transparent() const {
  return impl_of(impl_).has_transparent;
}
std::size_t SceneTracer::bytes() const {
  std::set<const OccupancyTree*> trees;
  std::set<const ShapeIndex*> indices;
  const auto add_cells = [&](const DensityTree* field) {
    if (field != nullptr) trees.insert(&field->cells());
  };
  for (const PlacedGrid& placed : impl_of(impl_).placed) {
    trees.insert({placed.opaque, placed.transparent, placed.glass_voxels, placed.face_cells});
    if (placed.shapes != nullptr) {
      trees.insert({&placed.shapes->touched, &placed.shapes->solid, &placed.shapes->glass});
      indices.insert(&placed.shapes->index);
    }
    add_cells(placed.field);
    add_cells(placed.opaque_field);
  }
  trees.erase(nullptr);
  std::size_t total = 0;
  for (const OccupancyTree* tree : trees) total += tree->bytes();
  for (const ShapeIndex* index : indices) total += index->bytes();
  return total;
}

namespace {

bool is_any_of(const std::vector<VoxelType>& types, const std::vector<VoxelType>& ascending) {
  return std::any_of(types.begin(), types.end(),
                     [&](VoxelType type) { return std::binary_search(ascending.begin(), ascending.end(), type); });
}

bool has_type_of(const SceneGrid& grid, const std::vector<VoxelType>& ascending) {
  if (is_any_of(grid.grid.types(), ascending)) return true;
  const std::vector<IVec3> chunks = grid.field.chunks();
  return std::any_of(chunks.begin(), chunks.end(), [&](IVec3 chunk) {
    return is_any_of(grid.field.find_chunk(chunk)->materials().types(), ascending);
  });
}

void put_trees(const TreeCache& trees, PlacedGrid& placed) {
  placed.opaque = &trees.opaque();
  placed.transparent = trees.transparent();
  placed.glass_voxels = trees.glass_voxels();
  placed.face_cells = trees.face_cells();
  placed.shapes = trees.shapes();
  placed.field = trees.field();
  placed.opaque_field = trees.opaque_field();
  placed.glass = trees.glass();
}

}  // namespace

DBox bounds_in_world(const PlacedGrid& placed, const IBox& tight) {
  QUOIN_ASSERT(placed.voxel_size > 0.0, "a positive voxel size");
  const DVec3 low = (DVec3(tight.min) - placed.pivot) * placed.voxel_size;
  const DVec3 high = (DVec3(tight.max) - placed.pivot) * placed.voxel_size;
  DBox box{DVec3(0.0), DVec3(0.0)};
  for (int axis = 0; axis < 3; ++axis) {
    const DVec3 a = placed.world_axes[axis] * low[axis];
    const DVec3 b = placed.world_axes[axis] * high[axis];
    box = {box.min + glm::min(a, b), box.max + glm::max(a, b)};
  }
  box = {box.min + placed.position, box.max + placed.position};
  const DVec3 room = (box.max - box.min) * 1e-6 + (glm::abs(box.min) + glm::abs(box.max)) * 1e-15;
  return {box.min - room, box.max + room};
}

bool SceneTracer::Impl::update(Threads threads) {
  PendingChanges types(followed_types, scene->types);
  PendingChanges pending(followed_scene, *scene);
  SceneChanges& changes = *pending;
  const bool was_unfinished = std::exchange(is_unfinished, true);
  // Discarded trees are rebuilt, in all placed grids.
  changes.all |= update_types(*types);
  const int reach = types->empty() ? shape_reach : reach_of_shapes(scene->types);
  changes.all |= std::exchange(shape_reach, reach) != reach;
  const bool are_shapes_same = look_at_grids(changes);
  const bool moves_all = changes.all || !are_shapes_same;
  const bool are_placed = !was_unfinished && (moves_all ? move_all_instances() : move_instances(changes));
  if (!are_placed) {
    place_instances();
    changes.all = true;
  }
  find_unloaded(changes, moves_all || changes.all || has_other_trees);
  update_trees(changes, threads);
  types.commit();
  pending.commit();
  is_unfinished = false;
  return std::exchange(has_other_trees, false);
}

// Replaces the references to the former scene, except in `placed` and `unloaded`, which the next update replaces. That
// update reads the changes: the cursors also work with another snapshot.
void SceneTracer::Impl::refer_to(const Scene& other) noexcept {
  scene = &other;
  has_other_trees = true;
  for (const auto& each : grids) {
    if (each == nullptr) continue;
    each->grid = other.grids().find(each->handle);
    if (each->grid != nullptr) each->trees.refer_to(each->grid->field);
  }
}

// Discards the data of types that became transparent or ceased to be, or whose shapes or looks of shapes changed.
// Returns false if there are none.
bool SceneTracer::Impl::update_types(const TypeChanges& changes) {
  std::vector<VoxelType> changed;
  std::vector<VoxelType> recoloured;
  for (const TypeChange& change : changes.items_unless_all()) {
    // Textures decide which parts of shapes are glass.
    const bool has_other_looks = change.colour_changed && scene->types.is_shaped(change.type);
    if (change.visibility_changed || change.shape_changed || has_other_looks) changed.push_back(change.type);
    if (change.colour_changed && scene->types.is_transparent(change.type)) recoloured.push_back(change.type);
  }
  if (!has_other_visibility(changes) && changed.empty() && recoloured.empty()) return false;
  std::vector<GridHandle> kept;
  bool has_forgotten = false;
  for (const auto& each : grids) {
    if (each == nullptr) continue;
    std::vector<VoxelType> other = changed;
    for (const VoxelType type : recoloured) {
      if (each->trees.has_other_cells(scene->types, type)) other.push_back(type);
    }
    std::ranges::sort(other);
    const SceneGrid* grid = scene->grids().find(each->handle);
    const bool is_unaffected = !changes.all && other.empty() && !has_other_visibility(changes);
    // An edit may have removed the last voxel of such a type.
    if (!is_unaffected &&
        (changes.all || grid == nullptr || grid->grid.has_changed_since(each->trees.followed()) ||
         (each->trees.field() != nullptr && grid->field.has_changed_since(each->trees.followed_field())) ||
         has_type_of(*grid, other))) {
      each->trees.forget();
      has_forgotten = true;
    } else {
      kept.push_back(each->handle);
    }
  }
  coarse.forget([&](GridHandle handle) { return !std::binary_search(kept.begin(), kept.end(), handle); });
  return has_forgotten;
}

// Returns false if a grid came or went, or its bounds or pivot changed.
bool SceneTracer::Impl::look_at_grids(const SceneChanges& changes) {
  const auto is_gone = [&](GridHandle handle) { return scene->grids().find(handle) == nullptr; };
  if (changes.all) {
    for (auto& each : grids) {
      if (each != nullptr && is_gone(each->handle)) each.reset();
    }
    coarse.forget(is_gone);
    scene->grids().for_each([&](GridHandle handle, const SceneGrid&) { (void)look_at(handle); });
    return false;
  }
  bool is_same = true;
  bool has_gone = false;
  for (const GridHandle handle : changes.grids) {
    if (!is_gone(handle)) {
      is_same &= look_at(handle);
      continue;
    }
    has_gone = true;
    is_same = false;
    if (handle.index >= grids.size() || grids[handle.index] == nullptr) continue;
    if (grids[handle.index]->handle == handle) grids[handle.index].reset();
  }
  if (has_gone) coarse.forget(is_gone);
  return is_same;
}

// Returns false if the placement of the grid's contents changed.
bool SceneTracer::Impl::look_at(GridHandle handle) {
  const SceneGrid& grid = scene->grids()[handle];
  if (handle.index >= grids.size()) grids.resize(handle.index + std::size_t{1});
  auto& known = grids[handle.index];
  if (known == nullptr || known->handle != handle) {
    known = std::make_unique<TracedGrid>();
    known->handle = handle;
  }
  has_other_trees |= known->grid != &grid;
  const bool is_new = std::exchange(known->grid, &grid) == nullptr;
  IBox tight = grid.bounds();
  if (!tight.empty()) tight = {tight.min - shape_reach, tight.max + shape_reach};
  const bool was_partial = std::exchange(known->is_partial, grid.grid.is_partial() || grid.field.is_partial());
  // NaN differs from itself, so such a pivot counts as changed each time.
  if (!is_new && tight == known->tight && known->pivot == grid.pivot && was_partial == known->is_partial) return true;
  known->shape = ++shapes;
  known->pivot = grid.pivot;
  known->tight = tight;
  known->can_be_placed = !tight.empty() && is_finite(grid.pivot);
  return false;
}

// Returns the grid of an instance that can be traced, or null.
TracedGrid* SceneTracer::Impl::grid_to_place(const Instance& instance) const {
  if (!passes(filter, *scene, instance) || instance.grid.index >= grids.size()) return nullptr;
  TracedGrid* grid = grids[instance.grid.index].get();
  if (grid == nullptr || grid->handle != instance.grid || !grid->can_be_placed) return nullptr;
  return grid;
}

void SceneTracer::Impl::place(std::size_t i, InstanceHandle handle, const Instance& instance, TracedGrid& grid) {
  QUOIN_ASSERT(i < placed.size() && placed.size() == sources.size(), "a placed grid with its source");
  QUOIN_ASSERT(i == 0 || placed[i - 1].instance < handle, "instances in the order of their handles");
  placed[i].instance = handle;
  placed[i].grid = grid.grid;
  placed[i].voxels = &grid.grid->grid;
  put_trees(grid.trees, placed[i]);
  placed[i].pivot = grid.pivot;
  placed[i].world_axes = world_axes(instance);
  placed[i].position = instance.position;
  placed[i].voxel_size = instance.voxel_size;
  sources[i] = {handle,           &grid, grid.shape, instance.position, instance.rotation, instance.voxel_size,
                instance.mirrored};
}

// Updates the placement of an instance. Returns false if the instance must be added to the traced ones or removed.
bool SceneTracer::Impl::move_instance(InstanceHandle handle, std::vector<InstanceTree::Change>& moved) {
  const auto found = std::lower_bound(sources.begin(), sources.end(), handle,
                                      [](const Source& each, InstanceHandle key) { return each.instance < key; });
  const bool was_placed = found != sources.end() && found->instance == handle;
  const Instance* instance = scene->instances().find(handle);
  TracedGrid* grid = instance == nullptr ? nullptr : grid_to_place(*instance);
  const bool is_placed = grid != nullptr && has_valid_transform(*instance);
  if (is_placed != was_placed) return false;
  if (!is_placed || found->is_of(*instance, *grid)) return true;
  // With another grid, the trees of that grid may be missing.
  if (found->grid != grid) return false;
  const auto i = static_cast<std::size_t>(found - sources.begin());
  place(i, handle, *instance, *grid);
  moved.push_back({i, bounds_in_world(placed[i], grid->tight)});
  return true;
}

bool SceneTracer::Impl::move_instances(const SceneChanges& changes) {
  std::vector<InstanceTree::Change> moved;
  for (const InstanceHandle handle : changes.instances) {
    if (!move_instance(handle, moved)) return false;
  }
  instances.change(moved);
  return true;
}

// Updates the placement of all instances. Returns false, partly done, if the set of traced instances changed.
bool SceneTracer::Impl::move_all_instances() {
  for (const auto& each : grids) {
    if (each != nullptr) each->is_placed = false;
  }
  std::vector<InstanceTree::Change> moved;
  std::size_t next = 0;
  bool is_same = true;
  scene->instances().for_each([&](InstanceHandle handle, const Instance& instance) {
    if (!is_same) return;
    TracedGrid* grid = grid_to_place(instance);
    if (grid == nullptr) return;
    const bool is_next = next < sources.size() && sources[next].instance == handle;
    const bool has_moved = !is_next || !sources[next].is_of(instance, *grid);
    if (has_moved && !has_valid_transform(instance)) return;
    // With another grid, the trees of that grid may be missing.
    is_same = is_next && (!has_moved || sources[next].grid == grid);
    if (!is_same) return;
    grid->is_placed = true;
    if (has_moved) {
      place(next, handle, instance, *grid);
      moved.push_back({next, bounds_in_world(placed[next], grid->tight)});
    }
    ++next;
  });
  if (!is_same || next != placed.size()) return false;
  instances.change(moved);
  return true;
}

// Places all traced grids.
void SceneTracer::Impl::place_instances() {
  for (const auto& each : grids) {
    if (each != nullptr) each->is_placed = false;
  }
  BlockVector<DBox> boxes;
  placed.clear();
  sources.clear();
  scene->instances().for_each([&](InstanceHandle handle, const Instance& instance) {
    TracedGrid* grid = grid_to_place(instance);
    if (grid == nullptr || !has_valid_transform(instance)) return;
    grid->is_placed = true;
    placed.emplace_back();
    sources.emplace_back();
    place(placed.size() - 1, handle, instance, *grid);
    boxes.push_back(bounds_in_world(placed.back(), grid->tight));
  });
  instances = InstanceTree(std::move(boxes));
}

// Keeps `unloaded` up to date.
void SceneTracer::Impl::find_unloaded(const SceneChanges& changes, bool finds_all) {
  const bool has_partial =
      std::any_of(grids.begin(), grids.end(), [](const auto& grid) { return grid != nullptr && grid->is_partial; });
  if (!has_partial || finds_all) unloaded.clear();
  if (!has_partial) return;
  if (finds_all) {
    scene->instances().for_each(
        [&](InstanceHandle handle, const Instance& instance) { place_unloaded(handle, &instance); });
    return;
  }
  for (const InstanceHandle handle : changes.instances) place_unloaded(handle, scene->instances().find(handle));
}

// Inserts or updates an instance of a partial grid in `unloaded`. Removes an instance that is gone or not partial any
// more.
void SceneTracer::Impl::place_unloaded(InstanceHandle handle, const Instance* instance) {
  const auto at = std::lower_bound(unloaded.begin(), unloaded.end(), handle,
                                   [](const PlacedGrid& each, InstanceHandle key) { return each.instance < key; });
  const bool is_there = at != unloaded.end() && at->instance == handle;
  const TracedGrid* const grid =
      instance == nullptr || instance->grid.index >= grids.size() ? nullptr : grids[instance->grid.index].get();
  const bool is_wanted = grid != nullptr && grid->handle == instance->grid && grid->is_partial &&
                         is_finite(grid->pivot) && passes(filter, *scene, *instance) && has_valid_transform(*instance);
  if (!is_wanted) {
    if (is_there) unloaded.erase(at);
    return;
  }
  PlacedGrid placed_chunks;
  placed_chunks.instance = handle;
  placed_chunks.grid = grid->grid;
  placed_chunks.pivot = grid->pivot / double{kChunkEdge};
  placed_chunks.world_axes = world_axes(*instance);
  placed_chunks.position = instance->position;
  placed_chunks.voxel_size = instance->voxel_size * kChunkEdge;
  if (is_there) {
    *at = placed_chunks;
  } else {
    unloaded.insert(at, placed_chunks);
  }
}

void SceneTracer::Impl::update_trees(const SceneChanges& changes, Threads threads) {
  std::vector<TracedGrid*> used;
  const auto use = [&](TracedGrid* grid) {
    if (grid != nullptr && grid->is_placed) used.push_back(grid);
  };
  if (changes.all) {
    for (const auto& each : grids) use(each.get());
  }
  for (const GridHandle handle : changes.grids) {
    if (!changes.all && handle.index < grids.size()) use(grids[handle.index].get());
  }
  std::vector<std::uint8_t> is_other(used.size());
  parallel_for(used.size(), threads, [&](std::size_t i) {
    const bool has_other_voxels = used[i]->trees.update(used[i]->grid->grid, scene->types);
    const bool has_other_field = used[i]->trees.update(used[i]->grid->field, scene->types);
    is_other[i] = static_cast<std::uint8_t>(has_other_voxels || has_other_field);
  });
  has_other_trees |= std::find(is_other.begin(), is_other.end(), 1) != is_other.end();
  if (!changes.all && !has_other_trees) return;
  has_transparent = std::any_of(grids.begin(), grids.end(), [](const auto& grid) {
    return grid != nullptr && grid->is_placed && grid->trees.has_transparent();
  });
  if (!has_other_trees) return;
  QUOIN_ASSERT(sources.size() == placed.size(), "a source per placed grid");
  for (std::size_t i = 0; i < placed.size(); ++i) {
    const TracedGrid& grid = *sources[i].grid;
    placed[i].grid = grid.grid;
    placed[i].voxels = &grid.grid->grid;
    put_trees(grid.trees, placed[i]);
  }
}

}  // namespace quoin
