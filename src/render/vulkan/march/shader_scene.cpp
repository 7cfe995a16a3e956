#include "render/vulkan/march/shader_scene.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include <quoin/core/assert.h>
#include <quoin/render/propagated_light.h>

#include "core/srgb.h"
#include "render/light/light_model.h"
#include "render/light/occlusion_directions.h"
#include "render/shared/image_request.h"
#include "render/vulkan/trees/shader_memory.h"
#include "scene/tracer/placed_grid.h"

namespace quoin::vulkan {
namespace {

// Maximum distance, in voxels, of a local origin from a grid's bounds: points within keep their precision;
// farther points have no precision to lose.
constexpr double kNearby = 1024.0;

// Returns the rounding error of `to_vec4`.
Vec4 low_vec4(DVec3 v) {
  return to_vec4(v - DVec3(Vec3(v)));
}

// Returns a multiple of 64 voxels near a point, clamped to near the grid.
IVec3 base_at(DVec3 point, const DevicePlaced& grid) {
  const DVec3 near = glm::clamp(point, grid.low - kNearby, grid.high + kNearby);
  return IVec3(glm::floor(near)) & ~63;
}

// Returns the grid's distance along the camera's forward direction; 0 if it is small.
double depth_of(const DevicePlaced& grid, const glm::dmat3& view_axes, DVec3 camera_in_grid, DVec3 forward) {
  double depth = std::numeric_limits<double>::infinity();
  for (int corner = 0; corner < 8; ++corner) {
    const DVec3 point{(corner & 1) != 0 ? grid.high.x : grid.low.x, (corner & 2) != 0 ? grid.high.y : grid.low.y,
                      (corner & 4) != 0 ? grid.high.z : grid.low.z};
    depth = std::min(depth, glm::dot(view_axes * (point - camera_in_grid), forward));
  }
  const double voxel = grid.placed.voxel_size;
  if (!(depth > kNearby * voxel)) return 0.0;
  // Rounded to few bits, so that differences are exact on the device too.
  int exponent = 0;
  const double fraction = std::frexp(depth * (1.0 - 1e-5) - voxel, &exponent);
  return std::ldexp(std::floor(fraction * 4096.0), exponent - 12);
}

// Appends a box in single precision, enlarged for its rounding and that of rays.
void add_box(const DBox& box, std::uint32_t low_w, std::int32_t high_w, std::vector<Vec4>& out) {
  const DVec3 room = glm::max(glm::abs(box.min), glm::abs(box.max)) * 1e-5 + 1e-6;
  Vec4 low = to_vec4(box.min - room);
  Vec4 high = to_vec4(box.max + room);
  low.w = std::bit_cast<float>(low_w);
  high.w = std::bit_cast<float>(high_w);
  out.push_back(low);
  out.push_back(high);
}

// `view_origin`: from the camera.
void add_instances(const Placement& scene, const Camera& camera, DVec3 view_origin, FrameData& data) {
  const InstanceTree& tree = scene.instances;
  QUOIN_ASSERT(tree.boxes().size() == scene.placed.size(), "one box per instance");
  // Subtracts the two far positions first, as everywhere.
  const auto in_view = [&](const DBox& box) {
    return DBox{box.min - camera.position - view_origin, box.max - camera.position - view_origin};
  };
  for (const InstanceTree::Node& node : tree.nodes()) {
    const int count = node.count > 0 ? static_cast<int>(node.count) : -1 - node.axis;
    add_box(in_view(node.box), static_cast<std::uint32_t>(node.first), count, data.tree);
  }
  for (const std::size_t i : tree.order())
    add_box(in_view(tree.boxes()[i]), static_cast<std::uint32_t>(i), scene.placed[i].is_far ? 1 : 0, data.leaves);
}

// The camera's values, as in CameraRays.
struct Rays {
  bool is_perspective;
  DVec3 right, down, corner, forward;

  // Returns the size of a pixel at a depth.
  [[nodiscard]] double spread(double depth) const { return is_perspective ? depth : 1.0; }
};

// A grid's space, seen from the camera.
struct GridSpace {
  glm::dmat3 grid_axes;  // grid from view
  glm::dmat3 view_axes;
  DVec3 camera{0.0};  // in the tree's coordinates

  GridSpace(const DevicePlaced& grid, const Camera& from) {
    const PlacedGrid& placed = grid.placed;
    // The difference of two far positions is taken first: it is small, and mostly exact.
    const DVec3 position = placed.position - from.position;
    grid_axes = glm::transpose(placed.world_axes) / placed.voxel_size;
    view_axes = placed.world_axes * placed.voxel_size;
    camera = placed.pivot - grid_axes * position - DVec3(grid.origin);
  }
};

void set_start(const DevicePlaced& grid, const GridSpace& space, const Rays& rays, double depth,
               const RenderOptions& options, ShaderPlaced& out) {
  // For pixel (x, y): origin + x right + y down, in the grid.
  const double spread = rays.spread(depth);
  const DVec3 right = space.grid_axes * (rays.right * spread);
  const DVec3 down = space.grid_axes * (rays.down * spread);
  const DVec3 origin = space.camera + space.grid_axes * (rays.forward * depth + rays.corner * spread);
  const IVec3 base = base_at(origin + right * (0.5 * options.width) + down * (0.5 * options.height), grid);
  out.start_base = IVec4(base, 0);
  out.start = to_vec4(origin - DVec3(base), depth);
  out.start_x = to_vec4(right);
  out.start_y = to_vec4(down);
  out.start_low = low_vec4(origin - DVec3(base));
  out.start_x_low = low_vec4(right);
  out.start_y_low = low_vec4(down);
}

// `view_origin`: from the camera.
void set_spaces(const DevicePlaced& grid, const GridSpace& space, DVec3 view_origin, ShaderPlaced& out) {
  for (int axis = 0; axis < 3; ++axis) {
    out.grid_axes[static_cast<std::size_t>(axis)] = to_vec4(space.grid_axes[axis]);
    out.grid_axes_low[static_cast<std::size_t>(axis)] = low_vec4(space.grid_axes[axis]);
    out.view_axes[static_cast<std::size_t>(axis)] = to_vec4(space.view_axes[axis]);
  }
  const DVec3 origin = space.camera + space.grid_axes * view_origin;
  const DVec3 ref = glm::clamp(origin, grid.low - kNearby, grid.high + kNearby);
  const IVec3 base = base_at(ref, grid);
  out.ref_base = IVec4(base, grid.grid);
  out.ref_inside = to_vec4(ref - DVec3(base), grid.placed.voxel_size);
  out.ref_view = to_vec4(space.view_axes * (ref - origin), grid.placed.voxels_per_cell());
}

void set_sun(const PlacedGrid& placed, DVec3 sun, double brightness, ShaderPlaced& out) {
  const DVec3 sun_in_grid = glm::transpose(placed.world_axes) * sun;
  out.to_sun = to_vec4(sun_in_grid, brightness);
  for (const Direction face : kDirections) {
    const auto i = static_cast<std::size_t>(face);
    const double cosine = glm::dot(DVec3(normal_of(face)), sun_in_grid);
    out.diffuse[i / 4][static_cast<int>(i % 4)] = static_cast<float>(std::max(cosine, 0.0) * brightness);
  }
}

// Sets the start of rays, the origin of view space, as far ahead as space is empty.
void add_placed(const Placement& scene, const Camera& camera, const RenderOptions& options, const Rays& rays,
                FrameData& data) {
  const DVec3 sun = options.environment->sun.unit_direction();
  const double brightness = daylight_of(*options.environment).sun_brightness;
  std::vector<GridSpace> spaces;
  std::vector<double> depths;
  double least = scene.placed.empty() ? 0.0 : std::numeric_limits<double>::infinity();
  for (const DevicePlaced& grid : scene.placed) {
    const GridSpace& space = spaces.emplace_back(grid, camera);
    depths.push_back(depth_of(grid, space.view_axes, space.camera, rays.forward));
    least = std::min(least, depths.back());
  }
  const DVec3 view_origin = rays.forward * least;
  data.view_origin = view_origin;
  for (std::size_t i = 0; i < spaces.size(); ++i) {
    const DevicePlaced& grid = scene.placed[i];
    ShaderPlaced& placed = data.placed.emplace_back();
    set_start(grid, spaces[i], rays, depths[i], options, placed);
    set_spaces(grid, spaces[i], view_origin, placed);
    set_sun(grid.placed, sun, brightness, placed);
    placed.origin = IVec4(grid.origin, grid.placed.level);
    placed.detail_colour = {colour_of_detail(grid.placed.detail, grid.placed.level), 0.0F};
  }
  const double spread = rays.spread(least);
  data.frame.view_depth = static_cast<float>(least);
  data.frame.start = to_vec4(rays.corner * spread);
  data.frame.start_x = to_vec4(rays.right * spread);
  data.frame.start_y = to_vec4(rays.down * spread);
  add_instances(scene, camera, view_origin, data);
}

void add_directions(int rays, FrameData& data) {
  const OcclusionDirections directions(rays);
  if (directions.is_fixed()) {
    data.frame.flags |= kFixedDirections;
    QUOIN_ASSERT(rays >= 0 && rays <= 9, "room for nine rays per face");
    data.directions.resize(std::size_t{6} * 9);
    for (std::size_t face = 0; face < 6; ++face) {
      for (int ray = 0; ray < rays; ++ray) {
        data.directions[face * 9 + static_cast<std::size_t>(ray)] = to_vec4(directions.fixed(face, ray));
      }
    }
    return;
  }
  for (const OcclusionDirections::Angle& angle : directions.ring_angles()) {
    data.directions.push_back(to_vec4({angle.cosine, angle.sine, 0.0}));
  }
  for (const OcclusionDirections::Angle& angle : directions.turns()) {
    data.turns.push_back(to_vec4({angle.cosine, angle.sine, 0.0}));
  }
}

std::uint32_t flags_of(const Camera& camera, const RenderOptions& options) {
  const LightOptions& light = options.light;
  std::uint32_t flags = 0;
  if (camera.projection == Camera::Projection::Perspective) flags |= kPerspective;
  if (light.shading == Shading::Lit) flags |= kLit;
  if (light.shading == Shading::UnlitWithOcclusion) flags |= kUnlitOcclusion;
  if (light.shading == Shading::Occlusion) flags |= kShowOcclusion;
  if (light.shading == Shading::Normals) flags |= kShowNormals;
  if (light.shadows) flags |= kShadows;
  if (light.occlusion_mode == OcclusionMode::Rays) flags |= kOcclusionRays;
  // Only meshes have the smooth occlusion of fields; marched images never use it.
  const bool is_of_vertices =
      light.occlusion_mode == OcclusionMode::Vertex || light.occlusion_mode == OcclusionMode::Smooth;
  if (is_of_vertices) flags |= kOcclusionVertex;
  if (light.occlusion_affects == OcclusionAffects::All) flags |= kAffectsAll;
  if (options.detail.colours) flags |= kDetailColours;
  if (light.glass_surfaces && light.shading == Shading::Lit) flags |= kGlassSurfaces;
  return flags;
}

float capped(double value) {
  return static_cast<float>(std::min<double>(value, std::numeric_limits<float>::max()));
}

void set_light(const RenderOptions& options, ShaderFrame& frame) {
  const LightOptions& light = options.light;
  const Environment& environment = *options.environment;
  const auto sky = static_cast<float>(environment.sky.brightness);
  frame.light = {sky * kAmbient, sky * kAmbientWithoutOcclusion, kLeastOfAll,
                 static_cast<float>(light.field_occlusion_reach)};
  frame.lift = static_cast<float>(kRayLift);
  const Daylight daylight = daylight_of(environment);
  frame.ambient = {daylight.ambient, field_openness_factor(light)};
  frame.sun = {daylight.sun, 0.0F};
  frame.sky_zenith = {sky * daylight.sky.zenith, 0.0F};
  frame.sky_horizon = {sky * daylight.sky.horizon, 0.0F};
  frame.sky_ground = {sky * daylight.sky.ground, 0.0F};
  frame.ground_begins = sky::kGroundBegins;
  frame.ground_is_full = sky::kGroundIsFull;
  frame.occlusion_count = light.occlusion_rays;
  frame.occlusion_distance = capped(light.occlusion_distance_voxels);
  frame.shadow_distance = capped(light.shadow_distance_voxels);
  frame.exposure = exposure_of(environment);
}

}  // namespace

FrameData make_frame(const Placement& scene, const Camera& camera, const RenderOptions& options) {
  QUOIN_ASSERT(options.environment.has_value(), "options with an environment");
  FrameData data;
  const CameraRays image(camera, options.width, options.height);
  const Rays rays{image.is_perspective(), image.right(), image.down(), image.corner(), image.forward()};
  ShaderFrame& frame = data.frame;
  frame.flags = flags_of(camera, options);
  frame.right = to_vec4(rays.right);
  frame.down = to_vec4(rays.down, glm::length(rays.down) / std::sqrt(options.samples));
  frame.corner = to_vec4(rays.corner);
  frame.forward = to_vec4(rays.forward);
  frame.right_low = low_vec4(rays.right);
  frame.down_low = low_vec4(rays.down);
  frame.corner_low = low_vec4(rays.corner);
  frame.forward_low = low_vec4(rays.forward);
  frame.sky_scale = static_cast<float>(image.sky_scale());
  frame.width = options.width;
  frame.height = options.height;
  frame.samples = static_cast<float>(options.samples);
  frame.placed_count = static_cast<std::uint32_t>(scene.placed.size());
  set_light(options, frame);
  add_placed(scene, camera, options, rays, data);
  add_directions(options.light.occlusion_rays, data);
  return data;
}

void put_scene(const DeviceScene& scene, const Placement& placement, FrameData& data) {
  data.frame.grids = placement.grids;
  data.frame.last_surface = scene.last_surface();
  data.frame.surfaces = scene.surfaces_address();
  scene.put_shapes_in(data.frame);
  if (scene.has_unoccluding()) data.frame.flags |= kUnoccluding;
}

std::vector<ShaderLamp> shader_lamps(const LampTable& table, DVec3 camera, DVec3 view_origin) {
  std::vector<ShaderLamp> lamps;
  lamps.reserve(table.lamps.size());
  for (const PlacedLamp& from : table.lamps) {
    ShaderLamp& lamp = lamps.emplace_back();
    lamp.position = to_vec4(from.position - camera - view_origin, from.reach);
    const std::array<double, 3> fourth = {from.spread_squared, from.cos_inner, from.cos_outer};
    for (int axis = 0; axis < 3; ++axis) {
      const auto i = static_cast<std::size_t>(axis);
      lamp.axes[i] = to_vec4(from.axes[axis], fourth[i]);
    }
    for (std::size_t face = 0; face < 6; ++face) lamp.power[face] = {from.power[face], 0.0F};
    lamp.low = to_vec4(from.low, !from.is_point ? 0.0 : from.cos_inner > -2.0 ? 2.0 : 1.0);
    lamp.high = to_vec4(from.high);
    lamp.direction = to_vec4(from.direction);
  }
  return lamps;
}

std::vector<ShaderLamp> put_lamps(const DeviceLamps& lamps, const Camera& camera, FrameData& data) {
  QUOIN_ASSERT(lamps.table != nullptr && lamps.bricks.address != 0, "a table in device memory");
  QUOIN_ASSERT(std::has_single_bit(lamps.table->bricks.size()), "a power of two of bricks");
  data.frame.flags |= kLamps;
  data.frame.lamp_mask = static_cast<std::uint32_t>(lamps.table->bricks.size() - 1);
  data.frame.lamp_bricks = lamps.bricks.address;
  data.frame.lamp_lists = lamps.lists.address;
  return shader_lamps(*lamps.table, camera.position, data.view_origin);
}

void put_levels(const DeviceLevels& levels, const Scene& scene, const Placement& placement,
                const RenderOptions& options, FrameData& data) {
  QUOIN_ASSERT(levels.table != nullptr && levels.bricks.address != 0, "a table in device memory");
  QUOIN_ASSERT(std::has_single_bit(levels.table->bricks().size()), "a power of two of bricks");
  QUOIN_ASSERT(data.placed.size() == placement.placed.size(), "a frame of this placement");
  const LightLook look = light_look(*options.environment, options.light.least_light);
  data.frame.flags |= kPropagated;
  data.frame.level_sky = {look.sky, 0.0F};
  data.frame.level_lamps = {look.lamps, 0.0F};
  data.frame.level_least = {look.least, 0.0F};
  data.frame.light_mask = static_cast<std::uint32_t>(levels.table->bricks().size() - 1);
  data.frame.light_bricks = levels.bricks.address;
  data.frame.light_numbers = levels.numbers.address;
  for (std::size_t i = 0; i < data.placed.size(); ++i) {
    const GridHandle grid = scene.instances()[placement.placed[i].placed.instance].grid;
    data.placed[i].start_base.w = levels.table->index_of(grid);
  }
}

void set_sample(int sample, int occlusion_rays, ShaderPush& push) {
  const PixelPoint point = sample_point(sample);
  push.point_x = static_cast<float>(point.x);
  push.point_y = static_cast<float>(point.y);
  push.point_low_x = static_cast<float>(point.x - static_cast<double>(push.point_x));
  push.point_low_y = static_cast<float>(point.y - static_cast<double>(push.point_y));
  push.seed = hash_of(static_cast<std::uint32_t>(sample), 0);
  const OcclusionDirections::Turn turn = OcclusionDirections::turn_of(sample, occlusion_rays);
  push.turn_cosine = static_cast<float>(turn.about_normal.cosine);
  push.turn_sine = static_cast<float>(turn.about_normal.sine);
  for (int axis = 0; axis < 3; ++axis) {
    push.upright[static_cast<std::size_t>(axis)] = static_cast<float>(turn.upright[axis]);
  }
  push.first = sample == 0 ? 1 : 0;
  push.sample = static_cast<std::uint32_t>(sample);
}

std::vector<float> srgb_thresholds() {
  const SrgbEncoder& encode = SrgbEncoder::shared();
  std::vector<float> thresholds(256, 0.0F);
  for (std::uint32_t byte = 1; byte < 256; ++byte) {
    // Floats of equal sign are ordered like their bits.
    std::uint32_t below = 0;
    std::uint32_t reached = std::bit_cast<std::uint32_t>(1.0F);
    while (reached - below > 1) {
      const std::uint32_t middle = below + (reached - below) / 2;
      (encode(std::bit_cast<float>(middle)) >= byte ? reached : below) = middle;
    }
    thresholds[byte] = std::bit_cast<float>(reached);
  }
  return thresholds;
}

Result<Place> ShaderBytes::allocate(std::uint64_t size, const std::string& doing) {
  const std::uint64_t begin = bytes_.size();
  QUOIN_ASSERT(begin % kAlignment == 0 && begin <= kMost, "an aligned address below 1 GiB");
  const std::uint64_t left = kMost - begin;
  const std::uint64_t room = size > left ? size : (size + kAlignment - 1) / kAlignment * kAlignment;
  if (room > left) return make_error(ErrorCode::LimitExceeded, doing + ": more than 1 GiB for shaders");
  bytes_.resize(static_cast<std::size_t>(begin + room));
  return Place{0, begin, room, begin};
}

Status ShaderBytes::write(const Place& place, std::span<const std::byte> bytes, std::uint64_t offset) {
  QUOIN_ASSERT(offset + bytes.size() <= place.size || bytes.empty(), "bytes within the place");
  QUOIN_ASSERT(place.offset + place.size <= bytes_.size(), "an allocated place");
  std::copy(bytes.begin(), bytes.end(), bytes_.begin() + static_cast<std::ptrdiff_t>(place.offset + offset));
  return {};
}

namespace {

constexpr std::size_t kVector = sizeof(Vec4);

// Appends a table at a multiple of a vector's size. Returns its offset.
template <class T>
std::uint64_t add_table(const std::vector<T>& values, std::vector<std::byte>& out) {
  const std::size_t begin = (out.size() + kVector - 1) / kVector * kVector;
  const auto bytes = std::as_bytes(std::span(values));
  out.resize(begin);
  out.insert(out.end(), bytes.begin(), bytes.end());
  return begin;
}

}  // namespace

Result<std::unique_ptr<ShaderScene>> ShaderScene::of(const Scene& scene, InstanceFilter filter,
                                                     const LightOptions& light, Threads threads) {
  std::unique_ptr<ShaderScene> made(new ShaderScene(scene));
  if (Status done = made->scene_.update(scene, filter, threads); !done) return done.error();
  auto lamps = made->lamp_cache_.table(scene, light, environment_of(scene).lamp_brightness, threads,
                                       [&] { return made->scene_.lamp_places(scene); });
  if (Status done = made->lamps_.put(made->memory_, std::move(lamps)); !done) return done.error();
  return made;
}

Result<std::vector<std::byte>> ShaderScene::frame(const Camera& camera, const RenderOptions& asked) const {
  const RenderOptions options = with_environment(asked, environment_of(*content_));
  if (Status right = check(camera, options); !right) return right.error();
  FrameData data = make_frame(placement(), camera, options);
  put_scene(scene_, placement(), data);
  std::vector<ShaderLamp> lamps;
  if (lamps_.table != nullptr) lamps = put_lamps(lamps_, camera, data);
  ShaderFrame& frame = data.frame;
  std::vector<std::byte> out(sizeof frame);
  frame.placed = add_table(data.placed, out);
  frame.tree = add_table(data.tree, out);
  frame.leaves = add_table(data.leaves, out);
  frame.directions = add_table(data.directions, out);
  frame.turns = add_table(data.turns, out);
  frame.lamps = add_table(lamps, out);
  frame.thresholds = add_table(srgb_thresholds(), out);
  std::memcpy(out.data(), &frame, sizeof frame);
  return out;
}

}  // namespace quoin::vulkan
