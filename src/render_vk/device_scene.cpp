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
constexpr std::size_t kPage = 4096;
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

ShaderTree shader_tree(const TopTree& top, const OccupancyTree* tree, IVec3 origin) {
  ShaderTree shader;
  if (tree == nullptr || top.root.mask == 0) return shader;
  const IBox bounds = tree->bounds();
  shader.root = top.root;
  shader.low = IVec4(bounds.min - origin, top.root_level);
  shader.high = IVec4(bounds.max - origin, 0);
  return shader;
}

}  // namespace

Status DeviceScene::update(const Scene& scene, bool hidden, Threads threads) {
  Status done = try_update(scene, hidden, threads);
  if (done) done = memory_->flush();
  if (!done) clear();
  return done;
}

void DeviceScene::release(DeviceGrid& grid) {
  for (auto& [at, chunk] : grid.chunks) memory_->release(chunk.place);
  memory_->release(grid.opaque.place);
  memory_->release(grid.transparent.place);
}

void DeviceScene::clear() {
  memory_->discard();
  for (auto& [handle, grid] : grids_) release(grid);
  grids_.clear();
  placed_.clear();
  instances_ = {};
  has_transparent_ = false;
  grid_table_.clear();
  surface_table_.clear();
  memory_->release(grids_place_);
  memory_->release(surfaces_place_);
}

// Grids are packed by what their types are; new types count as opaque before they are registered.
void DeviceScene::forget_old_types(const VoxelRegistry& types) {
  bool is_other = false;
  visibility_.resize(std::max(visibility_.size(), types.size()), Visibility::Opaque);
  for (std::size_t i = 1; i < visibility_.size(); ++i) {
    const Visibility now = types.visibility(static_cast<VoxelType>(i));
    is_other |= visibility_[i] != now;
    visibility_[i] = now;
  }
  if (!is_other) return;
  for (auto& [handle, grid] : grids_) release(grid);
  grids_.clear();
}

// Lists the instances and keeps, of the known grids, those that are among them.
void DeviceScene::place(const Scene& scene, bool hidden) {
  placed_.clear();
  std::vector<DBox> boxes;
  std::map<GridHandle, DeviceGrid> kept;
  scene.instances().for_each([&](InstanceHandle handle, const Instance& instance) {
    const SceneGrid* grid = scene.grids().find(instance.grid);
    if (!can_be_traced(instance, grid, hidden)) return;
    const auto known = grids_.find(instance.grid);
    if (known != grids_.end() && known->second.identity == grid->grid.identity()) {
      kept.insert(grids_.extract(known));
    } else if (const auto [added, is_new] = kept.try_emplace(instance.grid); is_new) {
      added->second.identity = grid->grid.identity();
    }
    placed_.push_back({placed_as(instance, *grid, handle)});
    boxes.push_back(bounds_in_world(placed_.back().placed, grid->grid.bounds()));
  });
  for (auto& [handle, grid] : grids_) release(grid);
  grids_ = std::move(kept);
  instances_ = InstanceTree(std::move(boxes));
}

void DeviceScene::update_trees(const Scene& scene, Threads threads) {
  std::vector<std::pair<KeptTrees*, const Grid*>> all;
  for (auto& [handle, known] : grids_) all.emplace_back(&known.trees, &scene.grids()[handle].grid);
  parallel_for(all.size(), threads, [&](std::size_t i) { all[i].first->update(*all[i].second, scene.types); });
}

// What depends on the grids as they are by now.
void DeviceScene::finish_placed(const Scene& scene) {
  for (DevicePlaced& each : placed_) {
    const GridHandle handle = scene.instances()[each.placed.instance].grid;
    const DeviceGrid& known = grids_.find(handle)->second;
    const IBox bounds = scene.grids()[handle].grid.bounds();
    each.grid = known.index;
    each.origin = known.origin * kChunkEdge;
    each.low = DVec3(bounds.min - each.origin);
    each.high = DVec3(bounds.max - each.origin);
  }
}

Status DeviceScene::try_update(const Scene& scene, bool hidden, Threads threads) {
  forget_old_types(scene.types);
  place(scene, hidden);
  if (placed_.size() > kMostInstances) {
    return fail(ErrorCode::LimitExceeded, "vulkan: more than 16,777,216 instances");
  }
  for (const auto& [handle, known] : grids_) {
    if (!is_too_wide(scene.grids()[handle].grid.bounds())) continue;
    return fail(ErrorCode::Unsupported, "vulkan: a grid spans more than 2^29 voxels");
  }
  update_trees(scene, threads);
  std::int32_t index = 0;
  has_transparent_ = false;
  for (auto& [handle, known] : grids_) {
    known.index = index++;
    if (Status done = update_grid(known, scene.grids()[handle].grid); !done) return done;
    has_transparent_ |= known.transparent.top.root.mask != 0;
  }
  finish_placed(scene);
  if (Status done = put_surfaces(scene.types); !done) return done;
  return put_grids();
}

Status DeviceScene::update_grid(DeviceGrid& known, const Grid& grid) {
  if (!known.chunks.empty() && known.version == grid.version()) return {};
  const std::vector<IVec3> present = grid.chunks();
  std::vector<IVec3> changed;
  for (const IVec3 at : present) {
    const auto found = known.chunks.find(at);
    if (found == known.chunks.end() || found->second.version != grid.version(at)) changed.push_back(at);
  }
  for (auto& [at, chunk] : known.chunks) {
    if (grid.find_chunk(at) == nullptr) changed.push_back(at);
  }
  for (const IVec3 at : changed) {
    if (Status done = put_chunk(known, grid, at); !done) return done;
  }
  known.origin = present.front();
  for (const IVec3 at : present) known.origin = glm::min(known.origin, at);
  if (Status done = put_top(known, known.opaque, &DeviceChunk::opaque); !done) return done;
  if (Status done = put_top(known, known.transparent, &DeviceChunk::transparent); !done) return done;
  known.version = grid.version();
  return {};
}

Status DeviceScene::put_chunk(DeviceGrid& known, const Grid& grid, IVec3 chunk) {
  const Chunk* voxels = grid.find_chunk(chunk);
  if (voxels == nullptr) {
    const auto old = known.chunks.find(chunk);
    memory_->release(old->second.place);
    known.chunks.erase(old);
    return {};
  }
  DeviceChunk& entry = known.chunks[chunk];
  memory_->release(entry.place);
  ChunkRecord record = pack_chunk(known.trees.opaque(), known.trees.transparent(), *voxels, chunk);
  const auto place = memory_->allocate(record.words.size() * 4, "uploading voxels");
  if (!place) return tl::unexpected(place.error());
  entry.place = *place;
  record.move_to(place->address);
  entry.version = grid.version(chunk);
  entry.opaque = record.opaque;
  entry.transparent = record.transparent;
  return memory_->write(entry.place, bytes_of(record.words));
}

Status DeviceScene::put_top(DeviceGrid& known, DeviceTree& tree, Node DeviceChunk::*node) {
  std::vector<ChunkNodeAt> chunks;
  for (const auto& [at, chunk] : known.chunks) {
    if ((chunk.*node).mask != 0) chunks.push_back({at - known.origin, chunk.*node});
  }
  TopTree top = build_top_tree(chunks, tree.place.address);
  const std::size_t bytes = top.nodes.size() * sizeof(Node);
  if (bytes > tree.place.size) {
    memory_->release(tree.place);
    // Half as much again, so that a growing world does not move each time.
    const auto place = memory_->allocate(bytes + bytes / 2, "uploading voxels");
    if (!place) return tl::unexpected(place.error());
    tree.place = *place;
    tree.top.nodes.clear();
    top = build_top_tree(std::move(chunks), tree.place.address);
  }
  // Only the pages that changed.
  constexpr std::size_t kNodes = kPage / sizeof(Node);
  const std::span<const Node> now(top.nodes);
  const std::span<const Node> before(tree.top.nodes);
  for (std::size_t first = 0; first < now.size(); first += kNodes) {
    const auto page = now.subspan(first, std::min(kNodes, now.size() - first));
    const bool is_same = before.size() >= first + page.size() &&
                         std::equal(page.begin(), page.end(), before.begin() + static_cast<std::ptrdiff_t>(first));
    if (is_same) continue;
    if (Status done = memory_->write(tree.place, std::as_bytes(page), first * sizeof(Node)); !done) return done;
  }
  tree.top = std::move(top);
  return {};
}

Status DeviceScene::put_table(Place& place, std::span<const std::byte> bytes) {
  if (bytes.size() > place.size || place.size == 0) {
    memory_->release(place);
    const auto larger = memory_->allocate(bytes.size(), "uploading the scene");
    if (!larger) return tl::unexpected(larger.error());
    place = *larger;
  }
  return memory_->write(place, bytes);
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
  return put_table(surfaces_place_, bytes_of(surface_table_));
}

Status DeviceScene::put_grids() {
  std::vector<ShaderGrid> table;
  for (const auto& [handle, grid] : grids_) {
    const IVec3 origin = grid.origin * kChunkEdge;
    table.push_back({shader_tree(grid.opaque.top, &grid.trees.opaque(), origin),
                     shader_tree(grid.transparent.top, grid.trees.transparent(), origin)});
  }
  const auto is_same = [&] {
    return table.size() == grid_table_.size() &&
           (table.empty() || std::memcmp(table.data(), grid_table_.data(), table.size() * sizeof(ShaderGrid)) == 0);
  };
  if (is_same()) return {};
  grid_table_ = std::move(table);
  return put_table(grids_place_, bytes_of(grid_table_));
}

}  // namespace quoin::vulkan
