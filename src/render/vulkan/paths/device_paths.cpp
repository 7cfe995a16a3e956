#include "render/vulkan/paths/device_paths.h"

#include <algorithm>
#include <bit>
#include <span>
#include <utility>

#include <quoin/core/assert.h>
#include <quoin/core/memory.h>

#include "render/path/scatter.h"
#include "render/vulkan/trees/tree_packing.h"

namespace quoin::vulkan {
namespace {

// Returns the path tracing materials of types: four vectors each; the last entry is for types out of range.
std::vector<Vec4> path_surface_table(const Surfaces& surfaces, std::size_t types) {
  std::vector<Vec4> table;
  table.reserve(4 * (types + 1));
  for (std::size_t type = 0; type <= types; ++type) {
    const Surface& surface = surfaces[static_cast<VoxelType>(std::min(type, kMaxVoxelTypes))];
    add_surface(surface, surface.roughness, table);
    const VoxelType fluid = surfaces.fluid(static_cast<VoxelType>(std::min(type, kMaxVoxelTypes)));
    table.emplace_back(surface.metalness, surface.scattering, surface.anisotropy, static_cast<float>(fluid));
  }
  return table;
}

// Returns true if the lamps have the same faces, and the same paths in the tree.
bool has_same_faces(const path::PathLamps& a, const path::PathLamps& b) {
  return std::ranges::equal(a.faces(), b.faces()) && std::ranges::equal(a.tree().ways(), b.tree().ways());
}

// Sets the texture of a lamp. `all`: has the textures of all types.
void put_texels(const path::PathLamp& from, const KnownTexels& all, ShaderPathLamp& lamp) {
  const auto known = all.find(from.texels->texels);
  const auto sent = known == all.end() ? nullptr : known->second.lock();
  QUOIN_ASSERT(sent != nullptr, "a texture of the scene of the last update");
  lamp.texels = sent->address();
  lamp.texel_axes = axes_of(*from.texels);
  lamp.turn = turn_bits(from.unturned) | static_cast<std::uint32_t>(from.face) << 16;
  lamp.light_of_texel = Vec4(from.texels->tint * from.light_of_texel, from.voxel_size);
}

template <class T>
Status put_values(DeviceMemory& memory, Place& place, std::span<const T> values) {
  return put_table(memory, place, std::as_bytes(values));
}

}  // namespace

void DevicePaths::look_at(const Scene* scene) {
  lamps_ = nullptr;
  if (scene != scene_) {
    cache_ = {};
    surfaces_.reset();
  }
  scene_ = scene;
  if (scene == nullptr) return;
  if (!surfaces_) {
    surfaces_.emplace(scene->types, Clouds::Scatter);
    has_sent_surfaces_ = false;
  } else if (surfaces_->update(scene->types)) {
    has_sent_surfaces_ = false;
  }
}

void DevicePaths::find_lamps(const Placement& placement, double brightness) {
  if (scene_ == nullptr || (lamps_ != nullptr && brightness_ == brightness)) return;
  BlockVector<PlacedGrid> placed;
  placed.reserve(placement.placed.size());
  for (const DevicePlaced& each : placement.placed) placed.push_back(each.placed);
  lamps_ = cache_.lamps(*scene_, placed, *surfaces_, brightness);
  brightness_ = brightness;
}

Status DevicePaths::put(DeviceMemory& memory, const Placement& placement, const PathOptions& options,
                        ShaderPathFrame& frame) {
  Status done = try_put(memory, placement, options, frame);
  if (done) return done;
  memory.discard();
  for (Place* place :
       {&surfaces_place_, &sky_pixels_, &sky_rows_, &sky_columns_, &gloss_, &lamp_ways_, &face_keys_, &face_lamps_}) {
    memory.release(*place);
  }
  has_sent_surfaces_ = false;
  environment_.reset();
  of_faces_ = nullptr;
  return done;
}

Status DevicePaths::try_put(DeviceMemory& memory, const Placement& placement, const PathOptions& options,
                            ShaderPathFrame& frame) {
  find_lamps(placement, options.environment->lamp_brightness);
  Status done = put_surfaces(memory);
  if (done) done = put_sky(memory, *options.environment);
  if (done && gloss_.size == 0) done = put_values(memory, gloss_, path::gloss_table());
  if (done) done = put_faces(memory);
  // Sends the kept data even if the rest of the image fails.
  if (done) done = memory.flush();
  if (!done) return done;
  frame.gloss = gloss_.address;
  frame.sky_model = static_cast<std::int32_t>(sky_->model());
  frame.to_sun = Vec4(sky_->to_sun(), sky_->one_less_cos());
  frame.sunlight = Vec4(sky_->sun_irradiance(), options.environment->sun.is_visible ? 1.0F : 0.0F);
  frame.sky = Vec4(sky_->uniform(), sky_->brightness());
  frame.sky_pixels = sky_pixels_.address;
  if (const path::EnvironmentLight* const image = sky_->image(); image != nullptr) {
    frame.sky_width = image->image().width;
    frame.sky_height = image->image().height;
    frame.sky_rows = sky_rows_.address;
    frame.sky_columns = sky_columns_.address;
  }
  frame.environment = {sky_->turn().sine, sky_->turn().cosine, 0.0F, 0.0F};
  if (lamps_ != nullptr && !lamps_->empty()) {
    frame.lamp_ways = lamp_ways_.address;
    frame.face_keys = face_keys_.address;
    frame.face_lamps = face_lamps_.address;
    frame.face_mask = static_cast<std::uint32_t>(std::max<std::size_t>(lamps_->faces().size(), 1) - 1);
  }
  if (sky_->has_sun()) frame.flags |= kPathSun;
  if (sky_->has_uneven_sky()) frame.flags |= kPathUneven;
  return done;
}

Status DevicePaths::put_surfaces(DeviceMemory& memory) {
  if (has_sent_surfaces_ || scene_ == nullptr) return {};
  const std::vector<Vec4> table = path_surface_table(*surfaces_, scene_->types.size());
  Status done = put_values(memory, surfaces_place_, std::span<const Vec4>(table));
  last_surface_ = static_cast<std::uint32_t>(scene_->types.size());
  has_sent_surfaces_ = static_cast<bool>(done);
  return done;
}

Status DevicePaths::put_sky(DeviceMemory& memory, const Environment& environment) {
  if (environment_ && path::is_same_sky(*environment_, environment)) return {};
  environment_.reset();
  sky_ = std::make_unique<const path::SkyLight>(environment);
  Status done;
  if (const path::SkyMap* const air = sky_->air(); air != nullptr)
    done = put_values(memory, sky_pixels_, air->pixels());
  if (const path::EnvironmentLight* const image = sky_->image(); image != nullptr) {
    done = put_values(memory, sky_pixels_, std::span<const float>(image->image().rgb));
    if (done) done = put_values(memory, sky_rows_, image->rows());
    if (done) done = put_values(memory, sky_columns_, image->columns());
  }
  if (done) environment_ = environment;
  return done;
}

Status DevicePaths::put_faces(DeviceMemory& memory) {
  if (lamps_ == nullptr || lamps_->empty()) return {};
  if (of_faces_ != nullptr && has_same_faces(*of_faces_, *lamps_)) return {};
  of_faces_ = nullptr;
  std::vector<IVec4> keys;
  std::vector<std::int32_t> lamps;
  for (const path::PathLamps::Face& face : lamps_->faces()) {
    keys.emplace_back(face.voxel, face.placed * 8 + static_cast<std::int32_t>(face.direction));
    lamps.push_back(face.lamp);
  }
  // Without emissive faces, lookups still need a free slot.
  if (lamps.empty()) {
    keys.emplace_back(0);
    lamps.push_back(-1);
  }
  QUOIN_ASSERT(std::has_single_bit(lamps.size()), "a power of two of slots");
  Status done = put_values(memory, lamp_ways_, lamps_->tree().ways());
  if (done) done = put_values(memory, face_keys_, std::span<const IVec4>(keys));
  if (done) done = put_values(memory, face_lamps_, std::span<const std::int32_t>(lamps));
  if (done) of_faces_ = lamps_;
  return done;
}

LampTables lamp_tables(const path::PathLamps& lamps, const KnownTexels& texels, DVec3 view_origin) {
  LampTables tables;
  tables.lamps.reserve(lamps.size());
  for (const path::PathLamp& from : lamps.lamps()) {
    ShaderPathLamp& lamp = tables.lamps.emplace_back();
    lamp.corner = Vec4(Vec3(from.corner - view_origin), from.is_point ? from.reach : 0.0F);
    lamp.u = Vec4(from.u, from.size_u);
    lamp.v = Vec4(from.v, from.size_v);
    constexpr float kOfShape = -4.0F;  // see kOnlySampled in path_lamps.glsl
    lamp.normal = Vec4(from.normal, from.is_of_shape ? kOfShape : from.cos_inner);
    lamp.radiance = Vec4(from.radiance, from.cos_outer);
    if (from.is_of_shape) lamp.light_of_texel = Vec4(from.far_boost, 0.0F, 0.0F, from.voxel_size);
    if (from.texels != nullptr) put_texels(from, texels, lamp);
  }
  const Vec3 to_view(lamps.origin() - view_origin);
  for (const path::LightTree::Node& from : lamps.tree().nodes()) {
    ShaderLampNode& node = tables.nodes.emplace_back();
    node.low = Vec4(from.bounds.low + to_view, from.bounds.power);
    node.high = Vec4(from.bounds.high + to_view, from.bounds.cos_spread);
    node.axis = Vec4(from.bounds.axis, from.bounds.cos_edge);
    node.next = {from.second, from.lamp, 0, 0};
  }
  return tables;
}

}  // namespace quoin::vulkan
