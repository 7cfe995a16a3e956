// Brings a tracer up to date with its scene.

#include <algorithm>
#include <cmath>
#include <utility>

#include "scene/instance_axes.h"
#include "scene/scene_tracer_impl.h"

namespace quoin {
namespace {

bool has_type_of(const Grid& grid, const std::vector<VoxelType>& ascending) {
  const std::vector<VoxelType> types = grid.types();
  return std::any_of(types.begin(), types.end(),
                     [&](VoxelType type) { return std::binary_search(ascending.begin(), ascending.end(), type); });
}

}  // namespace

DBox bounds_in_world(const PlacedGrid& placed, const IBox& tight) {
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
  look_at_types();
  look_at_grids();
  if (!move_instances()) place_instances();
  update_trees(threads);
  return std::exchange(has_other_trees, false);
}

// Forgets what was made of types that were not seen through and now are, or the other way around.
void SceneTracer::Impl::look_at_types() {
  std::vector<bool> now(scene->types.size());
  for (std::size_t type = 0; type < now.size(); ++type) {
    now[type] = scene->types.is_transparent(static_cast<VoxelType>(type));
  }
  if (now == is_transparent) return;
  std::vector<VoxelType> changed;
  for (std::size_t type = 0; type < std::max(now.size(), is_transparent.size()); ++type) {
    const bool was = type < is_transparent.size() && is_transparent[type];
    const bool is = type < now.size() && now[type];
    if (was != is) changed.push_back(static_cast<VoxelType>(type));
  }
  is_transparent = std::move(now);
  if (changed.empty()) return;
  for (const auto& each : grids) {
    if (each == nullptr) continue;
    // Edited meanwhile, it may have lost the last voxel of such a type.
    const SceneGrid* grid = scene->grids().find(each->handle);
    if (grid == nullptr || grid->grid.version() != each->version || has_type_of(grid->grid, changed)) {
      each->trees.forget();
    }
  }
  coarse.forget([](GridHandle) { return true; });
}

void SceneTracer::Impl::look_at_grids() {
  const auto is_gone = [&](GridHandle handle) { return scene->grids().find(handle) == nullptr; };
  for (auto& each : grids) {
    if (each == nullptr) continue;
    each->is_placed = false;
    if (is_gone(each->handle)) each.reset();
  }
  coarse.forget(is_gone);
  scene->grids().for_each([&](GridHandle handle, const SceneGrid& grid) { look_at(handle, grid); });
}

void SceneTracer::Impl::look_at(GridHandle handle, const SceneGrid& grid) {
  if (handle.index >= grids.size()) grids.resize(handle.index + std::size_t{1});
  auto& known = grids[handle.index];
  if (known == nullptr) {
    known = std::make_unique<TracedGrid>();
    known->handle = handle;
  }
  has_other_trees |= known->grid != &grid;
  known->grid = &grid;
  const std::uint64_t identity = grid.grid.identity();
  const std::uint64_t version = grid.grid.version();
  // What is not a number differs from itself, and is looked at each time.
  if (known->identity == identity && known->version == version && known->pivot == grid.pivot) return;
  const IBox tight = grid.grid.bounds();
  if (!(tight == known->tight) || known->pivot != grid.pivot) known->shape = ++shapes;
  known->identity = identity;
  known->version = version;
  known->pivot = grid.pivot;
  known->tight = tight;
  known->can_be_placed = !tight.empty() && is_finite(grid.pivot);
}

// The grid of an instance that is to be traced where it has a place; null for any other.
TracedGrid* SceneTracer::Impl::grid_to_place(const Instance& instance) const {
  if ((!instance.visible && !hidden) || instance.grid.index >= grids.size()) return nullptr;
  TracedGrid* grid = grids[instance.grid.index].get();
  if (grid == nullptr || grid->handle != instance.grid || !grid->can_be_placed) return nullptr;
  return grid;
}

void SceneTracer::Impl::place(std::size_t i, InstanceHandle handle, const Instance& instance, TracedGrid& grid) {
  placed[i].instance = handle;
  placed[i].grid = grid.grid;
  placed[i].voxels = &grid.grid->grid;
  placed[i].opaque = &grid.trees.opaque();
  placed[i].transparent = grid.trees.transparent();
  placed[i].pivot = grid.pivot;
  placed[i].world_axes = world_axes(instance);
  placed[i].position = instance.position;
  placed[i].voxel_size = instance.voxel_size;
  sources[i] = {handle,           &grid, grid.shape, instance.position, instance.rotation, instance.voxel_size,
                instance.mirrored};
}

// Places anew what was moved; false, with some of it done, when other instances are to be traced than were.
bool SceneTracer::Impl::move_instances() {
  std::vector<InstanceTree::Change> moved;
  std::size_t next = 0;
  bool is_same = true;
  scene->instances().for_each([&](InstanceHandle handle, const Instance& instance) {
    if (!is_same) return;
    TracedGrid* grid = grid_to_place(instance);
    if (grid == nullptr) return;
    const bool is_next = next < sources.size() && sources[next].instance == handle;
    const bool has_moved = !is_next || !sources[next].is_of(instance, *grid);
    if (has_moved && !has_place(instance)) return;
    is_same = is_next;
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

// Places all that is to be traced.
void SceneTracer::Impl::place_instances() {
  std::vector<DBox> boxes;
  placed.clear();
  sources.clear();
  scene->instances().for_each([&](InstanceHandle handle, const Instance& instance) {
    TracedGrid* grid = grid_to_place(instance);
    if (grid == nullptr || !has_place(instance)) return;
    grid->is_placed = true;
    placed.emplace_back();
    sources.emplace_back();
    place(placed.size() - 1, handle, instance, *grid);
    boxes.push_back(bounds_in_world(placed.back(), grid->tight));
  });
  instances = InstanceTree(std::move(boxes));
}

void SceneTracer::Impl::update_trees(Threads threads) {
  std::vector<TracedGrid*> used;
  for (const auto& each : grids) {
    if (each != nullptr && each->is_placed) used.push_back(each.get());
  }
  std::vector<std::uint8_t> is_other(used.size());
  parallel_for(used.size(), threads, [&](std::size_t i) {
    is_other[i] = static_cast<std::uint8_t>(used[i]->trees.update(used[i]->grid->grid, scene->types));
  });
  has_other_trees |= std::find(is_other.begin(), is_other.end(), 1) != is_other.end();
  has_transparent = std::any_of(used.begin(), used.end(),
                                [](const TracedGrid* grid) { return grid->trees.transparent() != nullptr; });
  if (!has_other_trees) return;
  for (std::size_t i = 0; i < placed.size(); ++i) {
    const TracedGrid& grid = *sources[i].grid;
    placed[i].grid = grid.grid;
    placed[i].voxels = &grid.grid->grid;
    placed[i].opaque = &grid.trees.opaque();
    placed[i].transparent = grid.trees.transparent();
  }
}

}  // namespace quoin
