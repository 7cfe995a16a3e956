#include "render/vulkan/march/device_scene.h"
#include "scene/tracer/placed_grid.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <utility>

#include <quoin/core/assert.h>
#include <quoin/core/memory.h>

#include "scene/surfaces.h"

namespace quoin::vulkan {
namespace {

constexpr std::int64_t kWidest = std::int64_t{1} << 29;  // voxels; shaders count in 32 bits
constexpr std::size_t kMaxInstances = std::size_t{1} << 24;

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

// Returns the bounds of voxels and field.
IBox content_bounds(const SceneGrid& grid) {
  return unite(grid.grid.bounds(), grid.field.bounds());
}

bool can_be_traced(const Scene& scene, const Instance& instance, const SceneGrid* grid, InstanceFilter filter) {
  return grid != nullptr && passes(filter, scene, instance) && has_valid_transform(instance) &&
         is_finite(grid->pivot) && !content_bounds(*grid).empty();
}

const char* const kSendingTextures = "uploading textures";

ShaderTexturedFace shader_face(const FaceTexels& face, std::uint64_t address) {
  const auto axis = [&](std::size_t i) { return std::uint32_t{face.axis[i]} | (face.scale[i] < 0.0 ? 4U : 0U); };
  return {address, face.log_size | axis(0) << 4 | axis(1) << 8, 0, Vec4(face.tint, face.emission)};
}

// Returns the words of a type's six faces that hold its TriplanarRule: field_textures.glsl.
std::array<std::uint32_t, 6> words_of(const TriplanarRule& rule) {
  // A float from 2^-12 on has no bits below 2^-36: the product with 2^64 is a whole number.
  const auto fraction = static_cast<std::uint64_t>(std::ldexp(std::fmod(double{rule.textures_per_voxel}, 1.0), 64));
  return {std::bit_cast<std::uint32_t>(rule.steep_y),
          std::bit_cast<std::uint32_t>(rule.flat_y),
          std::bit_cast<std::uint32_t>(rule.textures_per_voxel),
          static_cast<std::uint32_t>(fraction >> 32),
          static_cast<std::uint32_t>(fraction),
          0};
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

Status DeviceScene::update(const Scene& scene, InstanceFilter filter, Threads threads) {
  try {
    Status done = try_update(scene, filter, threads);
    if (done) done = memory_->flush();
    if (!done) clear();
    return done;
  } catch (...) {
    clear();
    throw;
  }
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
  surface_table_.clear();
  followed_types_ = followed_visibility_ = followed_scene_ = {};
}

// Lists the instances and keeps only the known grids that they use.
void DeviceScene::place(const Scene& scene, InstanceFilter filter) {
  placement_.placed.clear();
  for (auto& [handle, grid] : grids_) grid.is_used = false;
  BlockVector<DBox> boxes;
  scene.instances().for_each([&](InstanceHandle handle, const Instance& instance) {
    const SceneGrid* grid = scene.grids().find(instance.grid);
    if (!can_be_traced(scene, instance, grid, filter)) return;
    KnownGrid& known = grids_[instance.grid];
    known.is_used = true;
    known.bounds = content_bounds(*grid);
    known.pivot = grid->pivot;
    placement_.placed.push_back({placed_as(instance, *grid, handle)});
    boxes.push_back(bounds_in_world(placement_.placed.back().placed, known.bounds));
  });
  for (auto each = grids_.begin(); each != grids_.end();) {
    const auto known = each++;
    if (known->second.is_used) continue;
    known->second.voxels.release(*memory_);
    grids_.erase(known);
  }
  std::int32_t index = 0;
  for (auto& [handle, known] : grids_) known.index = index++;
  placement_.instances = InstanceTree(std::move(boxes));
}

// Returns the placed grids that may have changed; sets `places` if instances must be placed again.
std::vector<GridHandle> DeviceScene::changed_grids(const Scene& scene, InstanceFilter filter, bool& places) {
  const SceneChanges changes = scene.changes_since(followed_scene_);
  places = changes.all || filter != filter_ || !changes.instances.empty();
  filter_ = filter;
  std::vector<GridHandle> changed;
  for (const GridHandle handle : changes.grids) {
    const auto known = grids_.find(handle);
    const SceneGrid* grid = scene.grids().find(handle);
    // An empty grid may now be placed; a grid with a moved pivot changes its position.
    places |= known == grids_.end() || grid == nullptr || !(content_bounds(*grid) == known->second.bounds) ||
              grid->pivot != known->second.pivot;
    if (known != grids_.end() && grid != nullptr) changed.push_back(handle);
  }
  if (!places) return changed;
  place(scene, filter);
  changed.clear();
  for (const auto& [handle, known] : grids_) changed.push_back(handle);
  return changed;
}

// Updates the data that depends on the grids' present state.
void DeviceScene::finish_placed(const Scene& scene) {
  for (DevicePlaced& each : placement_.placed) {
    const auto found = grids_.find(scene.instances()[each.placed.instance].grid);
    QUOIN_ASSERT(found != grids_.end(), "the grid of a placed instance");
    const KnownGrid& known = found->second;
    each.grid = known.index;
    each.origin = known.voxels.origin();
    each.low = DVec3(known.bounds.min - each.origin);
    each.high = DVec3(known.bounds.max - each.origin);
  }
}

Status DeviceScene::update_grids(const Scene& scene, const std::vector<GridHandle>& changed, Threads threads) {
  std::vector<std::pair<KnownGrid*, const SceneGrid*>> all;
  for (const GridHandle handle : changed) {
    KnownGrid& known = grids_.find(handle)->second;
    if (is_too_wide(known.bounds))
      return make_error(ErrorCode::Unsupported, "vulkan: a grid spans more than 2^29 voxels");
    all.emplace_back(&known, &scene.grids()[handle]);
  }
  parallel_for(all.size(), threads, [&](std::size_t i) {
    all[i].first->trees.update(all[i].second->grid, scene.types);
    all[i].first->trees.update(all[i].second->field, scene.types);
  });
  for (const auto& [known, grid] : all) {
    const TreeCache& trees = known->trees;
    Status done = known->voxels.update(
        *memory_, {&grid->grid, &trees.opaque(), trees.transparent(), trees.opaque_field(), trees.glass()});
    if (!done) return done;
  }
  return {};
}

Status DeviceScene::try_update(const Scene& scene, InstanceFilter filter, Threads threads) {
  // Packing depends on the visibility of types.
  if (has_other_visibility(scene.types.changes_since(followed_visibility_))) {
    for (auto& [handle, grid] : grids_) grid.voxels.release(*memory_);
    grids_.clear();
    followed_scene_ = {};
  }
  bool places = false;
  const std::vector<GridHandle> changed = changed_grids(scene, filter, places);
  if (placement_.placed.size() > kMaxInstances) {
    return make_error(ErrorCode::LimitExceeded, "vulkan: more than 16,777,216 instances");
  }
  if (Status done = update_grids(scene, changed, threads); !done) return done;
  if (places) finish_placed(scene);
  if (places || !changed.empty()) {
    const auto any = [this](bool (DeviceGrid::*has)() const) {
      return std::any_of(grids_.begin(), grids_.end(), [=](const auto& grid) { return (grid.second.voxels.*has)(); });
    };
    placement_.has_transparent = any(&DeviceGrid::has_transparent);
    placement_.has_fields = any(&DeviceGrid::has_field);
    placement_.has_field_glass = any(&DeviceGrid::has_field_glass);
  }
  if (!scene.types.changes_since(followed_types_).empty()) {
    if (Status done = put_surfaces(scene.types); !done) return done;
  }
  return put_grids();
}

Status DeviceTexels::send() {
  QUOIN_ASSERT(!texture_.is_null() && place_.size == 0, "a texture, sent once");
  const auto place = memory_->allocate(texture_.bytes(), kSendingTextures);
  if (!place) return place.error();
  place_ = *place;
  const std::span<const Rgba8> all(texture_.level(0).data(), texture_.bytes() / sizeof(Rgba8));
  return memory_->write(place_, std::as_bytes(all));
}

void DeviceTextures::clear() {
  texels_.clear();
  memory_->release(numbers_);
  memory_->release(faces_);
  std::erase_if(*known_, [](const auto& each) { return each.second.expired(); });
}

Status DeviceTextures::put(const VoxelRegistry& types) {
  PendingChanges changes(followed_, types);
  if (changes->empty()) return {};
  Status done;
  try {
    done = try_put(types);
  } catch (...) {
    memory_->discard();
    clear();
    throw;
  }
  if (done) {
    changes.commit();
  } else {
    memory_->discard();
    clear();
  }
  return done;
}

// Returns the address of a texture's texels, and adds them to `used`.
Result<std::uint64_t> DeviceTextures::send(const Texture& texture,
                                           std::vector<std::shared_ptr<const DeviceTexels>>& used) {
  std::weak_ptr<const DeviceTexels>& known = (*known_)[texture.level(0).data()];
  std::shared_ptr<const DeviceTexels> found = known.lock();
  if (found == nullptr) {
    const auto made = std::make_shared<DeviceTexels>(*memory_, texture);
    if (Status done = made->send(); !done) return done.error();
    known = found = made;
  }
  if (used.empty() || used.back() != found) used.push_back(found);
  return found->address();
}

Status DeviceTextures::try_put(const VoxelRegistry& types) {
  std::vector<std::uint32_t> numbers(types.size() + 1);
  std::vector<ShaderTexturedFace> faces;
  std::vector<std::shared_ptr<const DeviceTexels>> used;
  for (std::size_t i = 0; types.has_textures() && i < types.size(); ++i) {
    const VoxelProperties& type = types[static_cast<VoxelType>(i)];
    if (type.faces.empty() || type.visibility != Visibility::Opaque) continue;
    const std::array<std::uint32_t, 6> rule = words_of(TriplanarRule(type.field_textures));
    for (const Direction direction : kDirections) {
      const auto address = send(type.faces[direction].texture, used);
      if (!address) return address.error();
      faces.push_back(shader_face(face_texels(type.faces[direction], direction, emission_of(type)), *address));
      faces.back().on_fields = rule[static_cast<std::size_t>(direction)];
    }
    numbers[i] = static_cast<std::uint32_t>(faces.size() / kDirections.size());
  }
  texels_ = std::move(used);
  if (faces.empty()) {
    clear();
    return {};
  }
  Status done = put_table(*memory_, numbers_, bytes_of(numbers));
  if (done) done = put_table(*memory_, faces_, bytes_of(faces));
  if (done) done = memory_->flush();
  if (done) std::erase_if(*known_, [](const auto& each) { return each.second.expired(); });
  return done;
}

void DeviceTextures::put_in(ShaderFrame& frame) const {
  frame.texture_numbers = numbers_.address;
  frame.textured_faces = faces_.address;
}

Status DeviceLamps::put(ShaderMemory& memory, std::shared_ptr<const LampTable> now) {
  if (now == table) return {};
  if (std::exchange(table, nullptr) == nullptr) memory.discard();  // a call that threw may have left writes
  if (now == nullptr) return {};
  Status done = put_table(memory, bricks, std::as_bytes(std::span(now->bricks)));
  if (done) done = put_table(memory, lists, std::as_bytes(std::span(now->lists)));
  if (done) done = memory.flush();
  if (!done) {
    memory.discard();
    return done;
  }
  table = std::move(now);
  return {};
}

// Bricks have spare numbers for growth.
Status DeviceLevels::put_changes(ShaderMemory& memory, const LightBricks& now, const LightBricks::Changed& changed) {
  const auto all_bricks = std::as_bytes(now.bricks());
  const auto all_numbers = std::as_bytes(now.numbers());
  if (changed.all || all_numbers.size() > numbers.size) {
    memory.release(numbers);
    const auto larger = memory.allocate(all_numbers.size() + all_numbers.size() / 4 + 4, "uploading light");
    if (!larger) return larger.error();
    numbers = *larger;
    Status done = put_table(memory, bricks, all_bricks);
    return done && !all_numbers.empty() ? memory.write(numbers, all_numbers) : done;
  }
  constexpr std::size_t kBrickBytes = sizeof(LightBricks::Brick);
  constexpr std::size_t kNumberBytes = LightBricks::kNumbers * sizeof(std::uint32_t);
  Status done;
  for (const std::size_t slot : changed.slots) {
    QUOIN_ASSERT((slot + 1) * kBrickBytes <= all_bricks.size(), "a brick of the table");
    if (done) done = memory.write(bricks, all_bricks.subspan(slot * kBrickBytes, kBrickBytes), slot * kBrickBytes);
  }
  for (const std::size_t first : changed.numbers) {
    const std::size_t offset = first * sizeof(std::uint32_t);
    QUOIN_ASSERT(offset + kNumberBytes <= all_numbers.size(), "numbers of the table");
    if (done) done = memory.write(numbers, all_numbers.subspan(offset, kNumberBytes), offset);
  }
  return done;
}

Status DeviceLevels::put(ShaderMemory& memory, LightBricks& now) {
  const bool knows_all = std::exchange(table, nullptr) != nullptr;
  if (!knows_all) memory.discard();  // a call that threw may have left writes
  LightBricks::Changed changed = now.take_changes();
  changed.all |= !knows_all;
  if (changed.all || !changed.slots.empty()) {
    Status done = put_changes(memory, now, changed);
    if (done) done = memory.flush();
    if (!done) {
      memory.discard();
      return done;
    }
  }
  table = &now;
  return {};
}

std::vector<LampPlace> DeviceScene::lamp_places(const Scene& scene) const {
  std::vector<LampPlace> places;
  for (const DevicePlaced& each : placement_.placed) {
    const auto found = grids_.find(scene.instances()[each.placed.instance].grid);
    QUOIN_ASSERT(found != grids_.end(), "the scene of the last update");
    const TreeCache& trees = found->second.trees;
    places.push_back(lamp_place(scene, each.placed, trees.opaque(), trees.transparent(), trees.field()));
  }
  return places;
}

Status put_table(ShaderMemory& memory, Place& place, std::span<const std::byte> bytes) {
  if (bytes.size() > place.size || place.size == 0) {
    memory.release(place);
    const auto larger = memory.allocate(bytes.size(), "uploading the scene");
    if (!larger) return larger.error();
    place = *larger;
  }
  return memory.write(place, bytes);
}

bool is_same(const std::vector<ShaderGrid>& a, const std::vector<ShaderGrid>& b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(ShaderGrid)) == 0);
}

void add_surface(const Surface& surface, float last, std::vector<Vec4>& table) {
  // A product with an infinite logarithm may be NaN on some devices.
  constexpr float kLeast = -1e30F;
  table.emplace_back(surface.colour, std::max(surface.log_clarity, kLeast));
  table.emplace_back(surface.emitted, surface.ior);
  table.emplace_back(glm::max(surface.log_transmittance, Vec3(kLeast)), last);
}

std::vector<Vec4> surface_table(const VoxelRegistry& types) {
  const Surfaces surfaces(types);
  std::vector<Vec4> table;
  for (std::size_t type = 0; type <= types.size(); ++type) {
    const auto id = static_cast<VoxelType>(std::min(type, kMaxVoxelTypes));
    add_surface(surfaces[id], types.is_opaque(id) && !types.occludes(id) ? 1.0F : 0.0F, table);
  }
  return table;
}

Status DeviceScene::put_surfaces(const VoxelRegistry& types) {
  std::vector<Vec4> table = surface_table(types);
  last_surface_ = static_cast<std::uint32_t>(types.size());
  has_unoccluding_ = types.has_unoccluding();
  if (table == surface_table_) return {};
  surface_table_ = std::move(table);
  return put_table(*memory_, surfaces_place_, bytes_of(surface_table_));
}

Status DeviceScene::put_grids() {
  std::vector<ShaderGrid> table;
  table.reserve(grids_.size());
  for (const auto& [handle, grid] : grids_) table.push_back(grid.voxels.shader_grid());
  if (!is_same(table, grid_table_)) {
    grid_table_ = std::move(table);
    if (Status done = put_table(*memory_, grids_place_, bytes_of(grid_table_)); !done) return done;
  }
  placement_.grids = grids_place_.address;
  return {};
}

}  // namespace quoin::vulkan
