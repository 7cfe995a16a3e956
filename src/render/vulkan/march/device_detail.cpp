#include "render/vulkan/march/device_detail.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/caches.h"

namespace quoin::vulkan {
namespace {

// Sets a halved grid in a placed grid's entry for the device.
void put_in(const CoarseLevel& coarse, const SceneGrid& grid, const DeviceGrid& voxels, std::int32_t index,
            DevicePlaced& each) {
  each.placed.grid = &grid;
  coarse.put_in(each.placed);
  each.grid = index;
  each.origin = voxels.origin();
  each.low = DVec3(coarse.tight.min - each.origin);
  each.high = DVec3(coarse.tight.max - each.origin);
}

}  // namespace

void DeviceDetail::clear() {
  memory_->discard();
  for (auto& [key, level] : levels_) level.voxels.release(*memory_);
  levels_.clear();
  coarse_.forget([](GridHandle) { return true; });
  impostors_.clear();
  memory_->release(table_place_);
  table_.clear();
}

void DeviceDetail::look_at(const Scene& scene) {
  PendingChanges types(followed_types_, scene.types);
  PendingChanges changes(followed_scene_, scene);
  if (has_other_visibility(*types) || has_other_shapes(*types, scene.types)) clear();
  if (has_other_shaped_types(*types, scene.types)) impostors_.clear();  // they refer to sides of shapes
  if (changes->all || !changes->grids.empty()) impostors_.follow(scene);
  const auto is_gone = [&](GridHandle handle) { return scene.grids().find(handle) == nullptr; };
  if (changes->all || std::any_of(changes->grids.begin(), changes->grids.end(), is_gone)) {
    coarse_.forget(is_gone);
    for (auto level = levels_.begin(); level != levels_.end();) {
      const auto each = level++;
      if (!is_gone(each->first.grid)) continue;
      each->second.voxels.release(*memory_);
      levels_.erase(each);
    }
  }
  types.commit();
  changes.commit();
}

Result<Placement> DeviceDetail::place(DeviceScene& device, const Scene& scene, const ImageDetail& detail,
                                      const Camera& camera, const RenderOptions& options, Threads threads,
                                      std::uint64_t max_bytes) {
  ++image_;
  Placement placement = device.placement();
  const ImpostorScreen screen(camera, options.width, options.height);
  const auto put = [&]() -> Status {
    const bool waits = options.detail.impostor_seconds == std::numeric_limits<double>::infinity();
    const auto sent = impostors_.send(scene, detail.far, waits, device.shapes());
    if (!sent) return sent.error();
    std::vector<SelectedInstance> selected = detail.selected;
    keep_whole(*sent, selected);
    if (Status done = put_halved(device, scene, selected, threads, placement); !done) return done;
    Status done = impostors_.draw(scene, *sent, screen, options.width, options.height, placement);
    return done ? memory_->flush() : done;
  };
  // Removes a partly built entry, whether the device or the host ran out of memory.
  try {
    if (Status done = put(); !done) {
      clear();
      return done.error();
    }
  } catch (...) {
    clear();
    throw;
  }
  drop_unused(max_bytes);
  impostors_.drop_unused(max_bytes);
  return placement;
}

Status DeviceDetail::put_halved(const DeviceScene& device, const Scene& scene,
                                std::span<const SelectedInstance> selected, Threads threads, Placement& placement) {
  std::vector<ShaderGrid> table = device.grid_table();
  std::vector<InstanceTree::Change> halved;
  const HalvedGridCache::Lock coarse = coarse_.make(scene, selected, threads);
  auto next = placement.placed.begin();
  for (const SelectedInstance& choice : selected) {
    next = find_placed(next, placement.placed.end(), choice.instance);
    if (next == placement.placed.end()) break;
    if (next->placed.instance != choice.instance) continue;
    next->placed.detail = choice.detail;
    const GridHandle grid = scene.instances()[choice.instance].grid;
    const CoarseLevel* found = coarse.find(grid, choice.level);
    if (found == nullptr) continue;
    const Level* level = nullptr;
    if (Status done = put_level(*found, grid, scene.types, table, level); !done) return done;
    placement.has_transparent |= level->voxels.has_transparent();  // shapes are cubes there
    put_in(*found, scene.grids()[grid], level->voxels, level->index, *next);
    halved.push_back(
        {static_cast<std::size_t>(next - placement.placed.begin()), bounds_in_world(next->placed, found->tight)});
  }
  placement.instances.change(halved);
  if (!is_same(table, table_)) {
    if (Status done = put_table(*memory_, table_place_, std::as_bytes(std::span(table))); !done) return done;
    table_ = std::move(table);
  }
  placement.grids = table_place_.address;
  return {};
}

// Updates a level and adds it to the table, once per image.
Status DeviceDetail::put_level(const CoarseLevel& coarse, GridHandle grid, const VoxelRegistry& types,
                               std::vector<ShaderGrid>& table, const Level*& level) {
  Level& known = levels_[{grid, coarse.level}];
  level = &known;
  if (known.last_use == image_) return {};
  const TreeCache& trees = coarse.trees;
  const VoxelRegistry* const turned = types.has_turned_by_state() ? &types : nullptr;
  Status done = known.voxels.update(*memory_, {coarse.voxels, &trees.opaque(), trees.transparent(),
                                               trees.opaque_field(), trees.glass(), nullptr, nullptr, turned});
  known.last_use = image_;
  known.index = static_cast<std::int32_t>(table.size());
  table.push_back(known.voxels.shader_grid());
  return done;
}

void DeviceDetail::drop_unused(std::uint64_t max_bytes) {
  drop_oldest(
      levels_, halved_bytes(), max_bytes, [&](auto each) { return each->second.last_use != image_; },
      [](auto each) { return each->second.voxels.bytes(); },
      [&](auto each) {
        each->second.voxels.release(*memory_);
        levels_.erase(each);
      });
}

std::uint64_t DeviceDetail::halved_bytes() const {
  std::uint64_t sum = 0;
  for (const auto& [key, level] : levels_) sum += level.voxels.bytes();
  return sum;
}

}  // namespace quoin::vulkan
