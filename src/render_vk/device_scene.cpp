#include "render_vk/device_scene.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "light/surfaces.h"
#include "scene/instance_axes.h"
#include "scene/scene_tracer_impl.h"

namespace quoin::vulkan {
namespace {

constexpr std::int64_t kWidest = std::int64_t{1} << 29;  // voxels; shaders count in 32 bits
constexpr std::size_t kMostInstances = std::size_t{1} << 24;

template <class T>
std::span<const std::byte> bytes_of(const std::vector<T>& values) {
  return std::as_bytes(std::span(values));
}

bool is_too_wide(const IBox& bounds) {
  for (int axis = 0; axis < 3; ++axis) {
    if (std::int64_t{bounds.max[axis]} - bounds.min[axis] > kWidest) return true;
  }
  return false;
}

bool can_be_traced(const Instance& instance, const SceneGrid* grid, bool hidden) {
  return grid != nullptr && (instance.visible || hidden) && has_place(instance) && is_finite(grid->pivot) &&
         !grid->grid.bounds().empty();
}

PlacedGrid placed_as(const Instance& instance, const SceneGrid& grid, InstanceHandle handle) {
  PlacedGrid placed;
  placed.instance = handle;
  placed.pivot = grid.pivot;
  placed.world_axes = world_axes(instance);
  placed.position = instance.position;
  placed.voxel_size = instance.voxel_size;
  return placed;
}

}  // namespace

Status DeviceScene::update(const Scene& scene, bool hidden, Threads threads) {
  Status done = try_update(scene, hidden, threads);
  if (done) done = memory_->flush();
  if (!done) clear();
  return done;
}

void DeviceScene::clear() {
  memory_->discard();
  for (auto& [handle, grid] : grids_) grid.voxels.release(*memory_);
  grids_.clear();
  placement_ = {};
  grid_table_.clear();
  surface_table_.clear();
  memory_->release(grids_place_);
  memory_->release(surfaces_place_);
}

bool takes_other_visibility(std::vector<Visibility>& known, const VoxelRegistry& types) {
  bool is_other = false;
  known.resize(std::max(known.size(), types.size()), Visibility::Opaque);
  for (std::size_t i = 1; i < known.size(); ++i) {
    const Visibility now = types.visibility(static_cast<VoxelType>(i));
    is_other |= known[i] != now;
    known[i] = now;
  }
  return is_other;
}

// Grids are packed by what their types are.
void DeviceScene::forget_old_types(const VoxelRegistry& types) {
  if (!takes_other_visibility(visibility_, types)) return;
  for (auto& [handle, grid] : grids_) grid.voxels.release(*memory_);
  grids_.clear();
}

// Lists the instances and keeps, of the known grids, those that are among them.
void DeviceScene::place(const Scene& scene, bool hidden) {
  placement_.placed.clear();
  std::vector<DBox> boxes;
  std::map<GridHandle, KnownGrid> kept;
  scene.instances().for_each([&](InstanceHandle handle, const Instance& instance) {
    const SceneGrid* grid = scene.grids().find(instance.grid);
    if (!can_be_traced(instance, grid, hidden)) return;
    const auto known = grids_.find(instance.grid);
    if (known != grids_.end() && known->second.identity == grid->grid.identity()) {
      kept.insert(grids_.extract(known));
    } else if (const auto [added, is_new] = kept.try_emplace(instance.grid); is_new) {
      added->second.identity = grid->grid.identity();
    }
    placement_.placed.push_back({placed_as(instance, *grid, handle)});
    boxes.push_back(bounds_in_world(placement_.placed.back().placed, grid->grid.bounds()));
  });
  for (auto& [handle, grid] : grids_) grid.voxels.release(*memory_);
  grids_ = std::move(kept);
  placement_.instances = InstanceTree(std::move(boxes));
}

void DeviceScene::update_trees(const Scene& scene, Threads threads) {
  std::vector<std::pair<KeptTrees*, const Grid*>> all;
  for (auto& [handle, known] : grids_) all.emplace_back(&known.trees, &scene.grids()[handle].grid);
  parallel_for(all.size(), threads, [&](std::size_t i) { all[i].first->update(*all[i].second, scene.types); });
}

// What depends on the grids as they are by now.
void DeviceScene::finish_placed(const Scene& scene) {
  for (DevicePlaced& each : placement_.placed) {
    const GridHandle handle = scene.instances()[each.placed.instance].grid;
    const KnownGrid& known = grids_.find(handle)->second;
    const IBox bounds = scene.grids()[handle].grid.bounds();
    each.grid = known.index;
    each.origin = known.voxels.origin();
    each.low = DVec3(bounds.min - each.origin);
    each.high = DVec3(bounds.max - each.origin);
  }
}

Status DeviceScene::try_update(const Scene& scene, bool hidden, Threads threads) {
  forget_old_types(scene.types);
  place(scene, hidden);
  if (placement_.placed.size() > kMostInstances) {
    return fail(ErrorCode::LimitExceeded, "vulkan: more than 16,777,216 instances");
  }
  for (const auto& [handle, known] : grids_) {
    if (!is_too_wide(scene.grids()[handle].grid.bounds())) continue;
    return fail(ErrorCode::Unsupported, "vulkan: a grid spans more than 2^29 voxels");
  }
  update_trees(scene, threads);
  std::int32_t index = 0;
  placement_.has_transparent = false;
  for (auto& [handle, known] : grids_) {
    known.index = index++;
    const Grid& grid = scene.grids()[handle].grid;
    Status done = known.voxels.update(*memory_, grid, known.trees.opaque(), known.trees.transparent());
    if (!done) return done;
    placement_.has_transparent |= known.voxels.has_transparent();
  }
  finish_placed(scene);
  if (Status done = put_surfaces(scene.types); !done) return done;
  return put_grids();
}

Status put_table(DeviceMemory& memory, Place& place, std::span<const std::byte> bytes) {
  if (bytes.size() > place.size || place.size == 0) {
    memory.release(place);
    const auto larger = memory.allocate(bytes.size(), "uploading the scene");
    if (!larger) return tl::unexpected(larger.error());
    place = *larger;
  }
  return memory.write(place, bytes);
}

bool is_same(const std::vector<ShaderGrid>& a, const std::vector<ShaderGrid>& b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(ShaderGrid)) == 0);
}

Status DeviceScene::put_surfaces(const VoxelRegistry& types) {
  // A product with an infinite logarithm is not sure to be a number on every device.
  constexpr float kLeast = -1e30F;
  const Surfaces surfaces(types);
  std::vector<Vec4> table;
  last_surface_ = static_cast<std::uint32_t>(types.size());
  for (std::uint32_t type = 0; type <= last_surface_; ++type) {
    const Surface& surface = surfaces[static_cast<VoxelType>(type)];
    table.emplace_back(surface.colour, std::max(surface.log_clarity, kLeast));
    table.emplace_back(surface.emitted, 0.0F);
    table.emplace_back(glm::max(surface.log_transmittance, Vec3(kLeast)), 0.0F);
  }
  if (table == surface_table_) return {};
  surface_table_ = std::move(table);
  return put_table(*memory_, surfaces_place_, bytes_of(surface_table_));
}

Status DeviceScene::put_grids() {
  std::vector<ShaderGrid> table;
  for (const auto& [handle, grid] : grids_) table.push_back(grid.voxels.shader_grid());
  if (!is_same(table, grid_table_)) {
    grid_table_ = std::move(table);
    if (Status done = put_table(*memory_, grids_place_, bytes_of(grid_table_)); !done) return done;
  }
  placement_.grids = grids_place_.address;
  return {};
}

}  // namespace quoin::vulkan
