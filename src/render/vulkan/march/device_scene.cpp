#include "render/vulkan/march/device_scene.h"
#include "scene/tracer/placed_grid.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <utility>

#include <glm/geometric.hpp>

#include <quoin/core/assert.h>
#include <quoin/core/memory.h>

#include "scene/surfaces.h"
#include "scene/tracer/shape_rays.h"

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

// Appends numbers as bits.
void add_numbers(std::uint32_t x, std::uint32_t y, std::uint32_t z, std::uint32_t w, std::vector<Vec4>& out) {
  out.emplace_back(std::bit_cast<float>(x), std::bit_cast<float>(y), std::bit_cast<float>(z), std::bit_cast<float>(w));
}

// Returns the flags of a side; see shapes.glsl. `look`: null if it has the type's colour.
std::uint32_t side_flags(const ModelFace& face, const VoxelFace* look, const VoxelProperties& type) {
  const bool has_texels = look != nullptr && !look->texture.is_null();
  std::uint32_t flags = static_cast<std::uint32_t>(face.direction) << kSideDirection;
  if (type.visibility == Visibility::Opaque || (has_texels && look->alpha == FaceAlpha::Opaque)) flags |= kSideHides;
  const bool is_cutout = has_texels && look->alpha == FaceAlpha::Cutout;
  if (is_cutout && (flags & kSideHides) == 0) flags |= kSideIsCutout;
  if (look != nullptr) flags |= kSideHasLook;
  if (has_texels) flags |= kSideHasTexels | static_cast<std::uint32_t>(look->texture.level_count() - 1);
  if (!has_texels || look->alpha == FaceAlpha::Translucent) flags |= kSideIsGlass;
  if (face.on_side) flags |= kSideIsOnVoxel;
  if (face.normal != Vec3(normal_of(face.direction))) flags |= kSideIsTilted;
  if (is_lamp_side(face, look, type)) flags |= kSideIsLamp;
  return flags;
}

bool can_be_traced(const Scene& scene, const Instance& instance, const SceneGrid* grid, InstanceFilter filter) {
  return grid != nullptr && passes(filter, scene, instance) && has_valid_transform(instance) &&
         is_finite(grid->pivot) && !content_bounds(*grid).empty();
}

const char* const kSendingTextures = "uploading textures";

ShaderTexturedFace shader_face(const VoxelFace& of, const FaceTexels& face, std::uint64_t address) {
  const std::uint32_t use = static_cast<std::uint32_t>(of.alpha) << 12 | std::uint32_t{of.turn} << 16 |
                            (of.mirrored ? std::uint32_t{1} << 18 : 0);
  return {address, axes_of(face) | use, packed_colour(of.tint), Vec4(face.tint, face.emission)};
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

bool has_other_shaped_types(const TypeChanges& changes, const VoxelRegistry& types) {
  const auto is_other = [&](const TypeChange& change) { return change.shape_changed || types.is_shaped(change.type); };
  return changes.all || std::ranges::any_of(changes.items_unless_all(), is_other);
}

std::uint32_t axes_of(const FaceTexels& face) {
  const auto axis = [&](std::size_t i) { return std::uint32_t{face.axis[i]} | (face.scale[i] < 0.0 ? 4U : 0U); };
  return face.log_size | axis(0) << 4 | axis(1) << 8;
}

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
  memory_->release(shapes_place_);
  shape_table_.clear();
  memory_->release(means_place_);
  mean_table_.clear();
  if (shapes_ != nullptr) shapes_->clear();
  surface_table_.clear();
  followed_types_ = followed_visibility_ = followed_scene_ = {};
}

IBox DeviceScene::bounds_of(const SceneGrid& grid) const {
  const IBox bounds = content_bounds(grid);
  return bounds.empty() ? bounds : IBox{bounds.min - shape_reach_, bounds.max + shape_reach_};
}

// Lists the instances and keeps only the known grids that they use.
void DeviceScene::place(const Scene& scene, InstanceFilter filter) {
  placement_.placed.clear();
  for (auto& [handle, grid] : grids_) grid.is_used = false;
  BlockVector<DBox> boxes;
  scene.instances().for_each([&](InstanceHandle handle, const Instance& instance) {
    const SceneGrid* grid = scene.grids().find(instance.grid);
    if (!can_be_traced(scene, instance, grid, filter)) return;
    const ShapedVoxels shaped = shapes_ == nullptr ? ShapedVoxels::AsCubes : ShapedVoxels::ByShape;
    KnownGrid& known = grids_.try_emplace(instance.grid, shaped).first->second;
    known.is_used = true;
    known.bounds = bounds_of(*grid);
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
    places |= known == grids_.end() || grid == nullptr || !(bounds_of(*grid) == known->second.bounds) ||
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
  const VoxelRegistry* const turned = shapes_ != nullptr && scene.types.has_turned_by_state() ? &scene.types : nullptr;
  for (const auto& [known, grid] : all) {
    const TreeCache& trees = known->trees;
    Status done =
        known->voxels.update(*memory_, {&grid->grid, &trees.opaque(), trees.transparent(), trees.opaque_field(),
                                        trees.glass(), trees.shapes(), shapes_.get(), turned});
    if (!done) return done;
  }
  return shapes_ == nullptr ? Status{} : shapes_->send();
}

Status DeviceScene::try_update(const Scene& scene, InstanceFilter filter, Threads threads) {
  // Packing depends on the visibility of types, and on all properties of shaped ones.
  const TypeChanges types = scene.types.changes_since(followed_visibility_);
  if (has_other_visibility(types) || (shapes_ != nullptr && has_other_shaped_types(types, scene.types))) {
    for (auto& [handle, grid] : grids_) grid.voxels.release(*memory_);
    grids_.clear();
    followed_scene_ = {};
    if (shapes_ != nullptr) {
      shapes_->clear();
      shape_reach_ = reach_of_shapes(scene.types);
    }
  }
  if (shapes_ != nullptr) shapes_->use(scene.types);
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
    placement_.has_shapes = any(&DeviceGrid::has_shapes);
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

// Returns the address of a texture's texels, and adds them to `used`.
Result<std::uint64_t> send_texels(ShaderMemory& memory, KnownTexels& all, const Texture& texture,
                                  std::vector<std::shared_ptr<const DeviceTexels>>& used) {
  std::weak_ptr<const DeviceTexels>& known = all[texture.level(0).data()];
  std::shared_ptr<const DeviceTexels> found = known.lock();
  if (found == nullptr) {
    const auto made = std::make_shared<DeviceTexels>(memory, texture);
    if (Status done = made->send(); !done) return done.error();
    known = found = made;
  }
  if (used.empty() || used.back() != found) used.push_back(found);
  return found->address();
}

void DeviceTextures::clear() {
  texels_.clear();
  has_cells_ = false;
  memory_->release(numbers_);
  memory_->release(faces_);
  std::erase_if(*known_, [](const auto& each) { return each.second.expired(); });
}

Result<ShaderShape> DeviceShapes::shape_of(const PlacedShape& shape) {
  QUOIN_ASSERT(types_ != nullptr, "the types of the shapes");
  const VoxelProperties& type = (*types_)[shape.type];
  const Result<std::uint32_t> model = index_of(*shape.model, shape.type, type.shapes);
  if (!model) return model.error();
  const std::uint32_t opaque = type.visibility == Visibility::Opaque ? kShapeIsOpaque : 0;
  return ShaderShape{shape.type | opaque, *model};
}

Result<std::uint32_t> DeviceShapes::index_of(const ShapeModel& model, VoxelType type, const VoxelShapes& owner) {
  const auto known = models_.find({&model, type});
  if (known != models_.end()) return known->second.first;
  const std::size_t before = vectors_.size();
  const Result<std::uint32_t> first = add(model, (*types_)[type]);
  if (first) {
    models_[{&model, type}] = {*first, owner};
  } else {
    vectors_.resize(before);
  }
  return first;
}

Result<std::uint32_t> DeviceShapes::side_of(const ShapeModel& model, VoxelType type, const VoxelShapes& owner,
                                            std::size_t face) {
  QUOIN_ASSERT(types_ != nullptr && face < model.faces.size(), "the types of the shapes, and a side of the model");
  const Result<std::uint32_t> first = index_of(model, type, owner);
  if (!first) return first.error();
  const auto sides = std::bit_cast<std::uint32_t>(vectors_[*first].y);
  return sides + kSideVectors * static_cast<std::uint32_t>(face);
}

// Appends a model to the table. Returns its index.
Result<std::uint32_t> DeviceShapes::add(const ShapeModel& model, const VoxelProperties& type) {
  constexpr std::size_t kMost = std::size_t{1} << 30;  // a bit is a flag in shaders
  const std::size_t begin = vectors_.size();
  if (begin > kMost) return make_error(ErrorCode::LimitExceeded, "vulkan: too many models of shapes");
  const auto first = static_cast<std::uint32_t>(begin);
  QUOIN_ASSERT(model.free_faces <= model.faces.size(), "free sides among the sides");
  const auto plain = static_cast<std::uint32_t>(model.faces.size()) - model.free_faces;
  vectors_.resize(begin + 2);
  add_boxes(model);
  const auto sides = static_cast<std::uint32_t>(vectors_.size());
  for (const ModelFace& face : model.faces) {
    if (Status done = add_side(face, model, type); !done) return done.error();
  }
  const auto corners = static_cast<std::uint32_t>(vectors_.size());
  for (std::size_t i = plain; i < model.faces.size(); ++i) {
    for (const Vec3& corner : model.faces[i].corners) vectors_.emplace_back(corner, 0.0F);
  }
  std::vector<Vec4> head;
  add_numbers(static_cast<std::uint32_t>(model.boxes.size()), sides, plain, model.free_faces, head);
  add_numbers(corners, model.covered_sides, 0, 0, head);
  std::ranges::copy(head, vectors_.begin() + first);
  return first;
}

// Appends the boxes of the model that begins two vectors before the end, then their turns.
void DeviceShapes::add_boxes(const ShapeModel& model) {
  auto turn = static_cast<std::uint32_t>(2 + kBoxVectors * model.boxes.size());
  for (const ModelBox& box : model.boxes) {
    vectors_.emplace_back(box.min, std::bit_cast<float>(box.is_turned ? turn : 0U));
    vectors_.emplace_back(box.max, 0.0F);
    std::array<std::uint32_t, 4> sides{};
    for (std::size_t i = 0; i < box.faces.size(); ++i) {
      const std::uint32_t number = box.faces[i] < 0 ? kNoSide : static_cast<std::uint32_t>(box.faces[i]);
      sides[i / 2] |= number << (16 * (i % 2));
    }
    add_numbers(sides[0], sides[1], sides[2], 0, vectors_);
    if (box.is_turned) turn += 4;
  }
  for (const ModelBox& box : model.boxes) {
    if (!box.is_turned) continue;
    vectors_.emplace_back(box.origin, 0.0F);
    for (const Vec3& row : box.inverse) vectors_.emplace_back(row, 0.0F);
  }
}

Status DeviceShapes::add_side(const ModelFace& face, const ShapeModel& model, const VoxelProperties& type) {
  const VoxelFace* const look = look_of(model, face, type.faces);
  const DVec3 corner(face.corners[0]);
  vectors_.push_back(to_vec4(DVec3(face.normal), glm::dot(DVec3(face.normal), corner)));
  std::uint64_t address = 0;
  std::array<Vec4, 2> along{Vec4(0.0F), Vec4(0.0F)};
  float density = 1.0F;
  if (look != nullptr && !look->texture.is_null()) {
    const auto sent = send_texels(*memory_, *known_, look->texture, texels_);
    if (!sent) return sent.error();
    address = *sent;
    const ShapeUv begin = shape_uv(face, *look, corner);
    density = static_cast<float>(begin.square_density);
    for (std::size_t i = 0; i < 2; ++i) {
      DVec3 slope(0.0);
      for (int axis = 0; axis < 3; ++axis) {
        DVec3 step(0.0);
        step[axis] = 1.0;
        slope[axis] = double{shape_uv(face, *look, corner + step).uv[i]} - double{begin.uv[i]};
      }
      along[i] = to_vec4(slope, double{begin.uv[i]} - glm::dot(slope, corner));
    }
  }
  vectors_.insert(vectors_.end(), along.begin(), along.end());
  add_numbers(static_cast<std::uint32_t>(address), static_cast<std::uint32_t>(address >> 32),
              side_flags(face, look, type), std::bit_cast<std::uint32_t>(density), vectors_);
  vectors_.emplace_back(look == nullptr ? Vec3(1.0F) : linear_colour(look->tint),
                        emission_of(type) * (look == nullptr ? 1.0F : emission_factor(*look)));
  return {};
}

Status DeviceShapes::send() {
  if (sent_ == vectors_.size()) return {};
  if (vectors_.size() * sizeof(Vec4) > place_.size) {
    // Half as much again, as for trees.
    const std::size_t bytes = vectors_.size() * sizeof(Vec4);
    const auto larger = memory_->allocate(bytes + bytes / 2, "uploading shapes");
    if (!larger) return larger.error();
    memory_->release(place_);
    place_ = *larger;
    sent_ = 0;
  }
  const auto added = std::span(vectors_).subspan(sent_);
  Status done = memory_->write(place_, std::as_bytes(added), sent_ * sizeof(Vec4));
  // An image that fails later discards queued writes.
  if (done) done = memory_->flush();
  if (done) sent_ = vectors_.size();
  return done;
}

void DeviceShapes::clear() {
  models_.clear();
  vectors_.clear();
  sent_ = 0;
  texels_.clear();
  memory_->release(place_);
  types_ = nullptr;
  std::erase_if(*known_, [](const auto& each) { return each.second.expired(); });
}

Status DeviceTextures::put(const VoxelRegistry& types) {
  PendingChanges changes(followed_, types);
  if (changes->empty()) return {};
  decode_textures(types, {});
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

Status DeviceTextures::try_put(const VoxelRegistry& types) {
  std::vector<std::uint32_t> numbers(types.size() + 1, kHidesFaces);
  std::vector<ShaderTexturedFace> faces;
  std::vector<std::shared_ptr<const DeviceTexels>> used;
  bool has_cells = false;
  for (std::size_t i = 0; types.has_textures() && i < types.size(); ++i) {
    const VoxelProperties& type = types[static_cast<VoxelType>(i)];
    const bool is_opaque = type.visibility == Visibility::Opaque;
    numbers[i] = is_opaque ? kHidesFaces : 0;
    if (type.faces.empty()) continue;
    const std::array<std::uint32_t, 6> rule = words_of(TriplanarRule(type.field_textures));
    bool is_glass = true;
    for (const Direction direction : kDirections) {
      const auto address = send_texels(*memory_, *known_, type.faces[direction].texture, used);
      if (!address) return address.error();
      const VoxelFace& face = type.faces[direction];
      faces.push_back(shader_face(face, face_texels(face, direction, emission_of(type)), *address));
      faces.back().on_fields = rule[static_cast<std::size_t>(direction)];
      is_glass = is_glass && face.alpha == FaceAlpha::Translucent;
    }
    const auto number = static_cast<std::uint32_t>(faces.size() / kDirections.size());
    QUOIN_ASSERT(number <= kTextureNumber, "a number per type");
    numbers[i] |= number;
    if (!is_opaque) numbers[i] |= is_glass ? kIsTexturedGlass : kIsCellOfFaces;
    // Shapes of glass may be cubes.
    has_cells = has_cells || (!is_opaque && (is_glass || !types.is_shaped(static_cast<VoxelType>(i))));
    if (type.orientations.empty()) continue;
    numbers[i] |= kIsTurnedByState | state_turn(type.orientations, 0) << kTextureTurn;
  }
  texels_ = std::move(used);
  if (faces.empty()) {
    clear();
    return {};
  }
  has_cells_ = has_cells;
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
    if (trees.shapes() != nullptr) places.back().shapes = &trees.shapes()->touched;
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
    // Cells of shapes in halved grids are opaque, but darken no corners.
    const bool is_open = !types.occludes(id) && (types.is_opaque(id) || types.is_shaped(id));
    // Fluids, whose types have shapes: 1 + the first fluid of their kind.
    add_surface(surfaces[id], is_open ? 1.0F + static_cast<float>(surfaces.fluid(id)) : 0.0F, table);
  }
  return table;
}

std::vector<Vec4> shape_means(const VoxelRegistry& types) {
  std::vector<Vec4> means;
  means.reserve(2 * (types.size() + 1));
  for (std::size_t i = 0; i < types.size(); ++i) {
    const auto type = static_cast<VoxelType>(i);
    const bool is_shaped = types.is_shaped(type);
    means.emplace_back(is_shaped ? mean_of_shapes(types[type]) : Vec3(-1.0F), emission_of(types[type]));
    means.emplace_back(is_shaped ? emission_share_of_shapes(types[type]) : 1.0F, 0.0F, 0.0F, 0.0F);
  }
  means.emplace_back(Vec3(-1.0F), 0.0F);
  means.emplace_back(1.0F, 0.0F, 0.0F, 0.0F);
  return means;
}

Status DeviceScene::put_surfaces(const VoxelRegistry& types) {
  std::vector<Vec4> table = surface_table(types);
  last_surface_ = static_cast<std::uint32_t>(types.size());
  has_unoccluding_ = types.has_unoccluding() || (shapes_ != nullptr && types.has_shapes());
  std::vector<Vec4> means;
  if (shapes_ != nullptr && types.has_shapes()) means = shape_means(types);
  if (means != mean_table_) {
    mean_table_ = std::move(means);
    Status done = mean_table_.empty() ? Status{} : put_table(*memory_, means_place_, bytes_of(mean_table_));
    if (!done) return done;
  }
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
  return put_shape_table();
}

Status DeviceScene::put_shape_table() {
  std::vector<ShaderShapes> table;
  for (const auto& [handle, grid] : grids_) {
    if (placement_.has_shapes) table.push_back(grid.voxels.shader_shapes());
  }
  const auto bytes = bytes_of(table);
  const bool is_known = table.size() == shape_table_.size() &&
                        (table.empty() || std::memcmp(table.data(), shape_table_.data(), bytes.size()) == 0);
  if (is_known) return {};
  shape_table_ = std::move(table);
  return shape_table_.empty() ? Status{} : put_table(*memory_, shapes_place_, bytes_of(shape_table_));
}

void DeviceScene::put_shapes_in(ShaderFrame& frame) const {
  if (shapes_ == nullptr || shape_table_.empty()) return;
  frame.shape_grids = shapes_place_.address;
  frame.shaped_grids = static_cast<std::uint32_t>(shape_table_.size());
  frame.shape_models = shapes_->address();
  frame.shape_means = means_place_.address;
}

}  // namespace quoin::vulkan
