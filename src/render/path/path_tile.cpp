#include "render/path/path_tile.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include <quoin/core/assert.h>

#include "render/light/light_model.h"
#include "render/light/occlusion_directions.h"
#include "render/shared/image_request.h"
#include "scene/tracer/placed_grid.h"

namespace quoin::path {
namespace {

constexpr int kBlock = CameraRays::kBlock;
constexpr std::size_t kBlockPixels = std::size_t{kBlock} * kBlock;
static_assert(kBlockPixels == kBlockPoints);
constexpr int kSureBounces = 3;       // before a path may end at random
constexpr float kMostLikely = 0.95F;  // maximum probability to continue

// Calls `put(index)` in key order; stable.
template <class Key, class Put>
void sort_by_key(std::size_t count, std::size_t keys, std::vector<std::uint32_t>& starts, Key&& key, Put&& put) {
  starts.assign(keys + 1, 0);
  for (std::size_t i = 0; i < count; ++i) {
    QUOIN_ASSERT(key(i) < keys, "a key below the number of keys");
    ++starts[key(i) + 1];
  }
  for (std::size_t i = 1; i < starts.size(); ++i) starts[i] += starts[i - 1];
  for (std::size_t i = 0; i < count; ++i) put(starts[key(i)]++, static_cast<std::uint32_t>(i));
}

void put(Vec3 v, BlockLanes<float> (&to)[3], std::size_t lane) {
  for (int i = 0; i < 3; ++i) to[i][lane] = v[i];
}
Vec3 get(const BlockLanes<float> (&from)[3], std::size_t lane) {
  return {from[0][lane], from[1][lane], from[2][lane]};
}

ShadeLight light_of(const SkyLight& sky, const PathLamps& lamps) {
  ShadeLight light;
  light.lamps = lamps.tree().branches();
  light.has_sun = sky.has_sun();
  const SkySample sun = sky.sun_sample(sky.to_sun());
  const Frame frame(sky.to_sun());
  light.one_less_cos = sky.one_less_cos();
  light.sun_density = sun.density;
  for (int i = 0; i < 3; ++i) {
    light.to_sun[i] = sun.direction[i];
    light.sun_radiance[i] = sun.radiance[i];
    light.sun_frame[0][i] = frame.x[i], light.sun_frame[1][i] = frame.y[i], light.sun_frame[2][i] = frame.z[i];
  }
  return light;
}

// Offsets that move a point off a face, by direction, in the grid. Constant-initialised, so that static initialisers
// may render images.
constexpr std::array<DVec3, 6> lifts_off_faces() {
  std::array<DVec3, 6> lifts{};
  for (std::size_t face = 0; face < lifts.size(); ++face) {
    const FaceFrame& frame = kFaceFrames[face];
    const double lift = frame.sign * kRayLift;
    lifts[face] = DVec3(frame.axis == 0 ? lift : 0.0, frame.axis == 1 ? lift : 0.0, frame.axis == 2 ? lift : 0.0);
  }
  return lifts;
}
constexpr std::array<DVec3, 6> kLifts = lifts_off_faces();

DVec3 in_grid(const PlacedGrid& placed, Vec3 direction) {
  return DVec3(direction) * placed.world_axes / placed.voxel_size;  // the transposed matrix times it
}

}  // namespace

FaceNormals face_normals(std::span<const PlacedGrid> placed) {
  FaceNormals normals(placed.size());
  for (std::size_t i = 0; i < placed.size(); ++i) {
    for (std::size_t face = 0; face < normals[i].size(); ++face) {
      const DVec3 normal(normal_of(static_cast<Direction>(face)));
      normals[i][face] = glm::normalize(Vec3(placed[i].world_axes * normal));
    }
  }
  return normals;
}

PathTile::PathTile(const TileContext& context, int column, int row)
    : context_(&context),
      column_(column),
      row_(row),
      kernel_(&kernel()),
      light_(light_of(*context.sky, *context.lamps)),
      has_textures_or_lamps_(context.surfaces->has_textures() || light_.lamps != nullptr),
      pixels_(kPixels),
      sums_(kPixels) {
  QUOIN_ASSERT(column >= 0 && row >= 0, "a pixel of the image");
  QUOIN_ASSERT(context.face_normals->size() == context.placed.size(), "normals of each placed grid");
  QUOIN_ASSERT(context.parts == nullptr || (context.parts->width() == context.options->width &&
                                            context.parts->height() == context.options->height),
               "parts of the image's size");
  for (std::size_t i = 0; i < kPixels; ++i) {
    const std::uint32_t place = hash_of(static_cast<std::uint32_t>(column + static_cast<int>(i) % kEdge),
                                        static_cast<std::uint32_t>(row + static_cast<int>(i) / kEdge));
    pixels_[i] = mix_bits(place ^ context.options->seed * 0x9E37'79B9U);
  }
  if (context.environment->ground) ground_ = context.environment->ground->height - context.camera->position.y;
  if (context.environment->fog) fog_top_ = context.environment->fog->top - context.camera->position.y;
}

bool PathTile::render(const std::function<bool(std::size_t)>& goes_on) {
  const int samples = context_->options->samples;
  for (int first = 0; first < samples; first += kSamplesAtOnce) {
    const int count = std::min(kSamplesAtOnce, samples - first);
    if (std::has_single_bit(static_cast<unsigned>(first))) learn(first);
    begin(first, count);
    while (!active_.empty()) {
      order_paths();
      meet();
      requests_.clear();
      shade_all();
      trace_requests();
      std::swap(active_, next_);
    }
    for (const Path& path : paths_) {
      PixelSums& sums = sums_[path.pixel];
      (path.is_caught ? sums.lit : sums.scene) += path.radiance;
      if (path.part != kNoPart) {
        SurfacePart& part = part_of(path);
        part.light += path.radiance;
        part.square += square(luminance(path.radiance));
      }
    }
    if (!goes_on(static_cast<std::size_t>(count))) return false;
  }
  return true;
}

// Later points of a low-discrepancy sequence fill the gaps between earlier ones. Lamp choices learned from the earlier
// points would then correlate with the later numbers and darken the image, so lamps are chosen by other numbers after
// each step. These are equally well distributed, as is every power-of-two block of the sequence.
void PathTile::learn(int first) {
  static_assert(std::has_single_bit(static_cast<unsigned>(kSamplesAtOnce)));
  memory_.learn();
  light_.lamp_numbers = mix_bits(static_cast<std::uint32_t>(first));
}

void PathTile::begin(int first, int count) {
  paths_.clear();
  active_.clear();
  const PathOptions& options = *context_->options;
  for (int block_y = 0; block_y < kEdge; block_y += kBlock) {
    for (int block_x = 0; block_x < kEdge; block_x += kBlock) {
      std::array<std::size_t, kBlockPixels> pixel{};
      BlockLanes<std::uint32_t> numbers;
      for (std::size_t i = 0; i < kBlockPixels; ++i) {
        pixel[i] =
            (static_cast<std::size_t>(block_y) + i / kBlock) * kEdge + static_cast<std::size_t>(block_x) + i % kBlock;
        numbers[i] = pixels_[pixel[i]];
      }
      for (int sample = first; sample < first + count; ++sample) {
        BlockLanes<float> x;
        BlockLanes<float> y;
        kernel_->pairs(numbers, static_cast<std::uint32_t>(sample), 0, x, y);
        for (std::size_t i = 0; i < kBlockPixels; ++i) {
          if (column_ + static_cast<int>(pixel[i] % kEdge) >= options.width) continue;
          if (row_ + static_cast<int>(pixel[i] / kEdge) >= options.height) continue;
          begin_path(pixel[i], {x[i], y[i]}, sample);
        }
      }
    }
  }
}

Pair PathTile::on_lens(Pair u) const {
  const int blades = context_->options->lens.blades;
  if (blades < 3) return on_disc(u);
  // Chooses one of the triangles around the middle, then a point in it.
  const float place = u.x * static_cast<float>(blades);
  const float first = std::min(std::floor(place), static_cast<float>(blades - 1));
  double turned = context_->options->lens.turn_radians / (2.0 * std::numbers::pi);
  turned -= std::floor(turned);
  const auto corner = [&](float which) {
    const float turns = which / static_cast<float>(blades) + static_cast<float>(turned);
    return of_turns(turns - std::floor(turns));
  };
  const SineCosine a = corner(first);
  const SineCosine b = corner(first + 1.0F);
  const float out = std::sqrt(place - first);
  const float side = u.y;
  return {out * (a.cosine + (b.cosine - a.cosine) * side), out * (a.sine + (b.sine - a.sine) * side)};
}

void PathTile::begin_path(std::size_t pixel, Pair jitter, int sample) {
  QUOIN_ASSERT(pixel < kPixels && sample >= 0, "a sample of a pixel of the tile");
  const PathOptions& options = *context_->options;
  const CameraRays& rays = *context_->rays;
  const Camera& camera = *context_->camera;
  active_.push_back(static_cast<std::uint32_t>(paths_.size()));
  Path& path = paths_.emplace_back();
  path.pixel = static_cast<std::uint16_t>(pixel);
  path.random = Random(pixels_[pixel], static_cast<std::uint32_t>(sample));
  path.is_first_sample = sample == 0;
  path.density = kNoOther;
  const int x = column_ + static_cast<int>(pixel % kEdge);
  const int y = row_ + static_cast<int>(pixel / kEdge);
  const DVec3 across = rays.corner() + rays.right() * (x + static_cast<double>(jitter.x)) +
                       rays.down() * (y + static_cast<double>(jitter.y));
  if (rays.is_perspective()) {
    DVec3 direction = glm::normalize(rays.forward() + across);
    if (options.lens.radius > 0.0) {
      const Pair lens = on_lens(path.random.pair(1));
      path.origin =
          (camera.right * static_cast<double>(lens.x) + camera.up * static_cast<double>(lens.y)) * options.lens.radius;
      const double t = options.lens.focus_distance / glm::dot(direction, rays.forward());
      direction = glm::normalize(direction * t - path.origin);
    }
    path.direction = Vec3(direction);
  } else {
    path.origin = across;
    path.direction = Vec3(rays.forward());
  }
  path.dimension = 2;
}

void PathTile::order_paths() {
  // Camera rays already come in blocks of pixels.
  if (active_.empty() || paths_[active_.front()].is_first) return;
  next_.resize(active_.size());
  sort_by_key(
      active_.size(), kBins, starts_, [&](std::size_t i) { return paths_[active_[i]].bin; },
      [&](std::uint32_t to, std::uint32_t from) { next_[to] = active_[from]; });
  std::swap(active_, next_);
}

void PathTile::meet() {
  next_.clear();
  vertices_.clear();
  constexpr std::size_t kLanes = RayPacket::kSize;
  for (std::size_t first = 0; first < active_.size(); first += kLanes) {
    meet_packet(std::span(active_).subspan(first, std::min(kLanes, active_.size() - first)));
  }
}

void PathTile::meet_packet(std::span<const std::uint32_t> indices) {
  QUOIN_ASSERT(!indices.empty() && indices.size() <= RayPacket::kSize, "1 to 16 paths");
  // Reused: clearing a packet takes longer than filling it.
  RayPacket& rays = packet_;
  SceneHits& hits = hits_;
  rays.active = 0;
  for (std::size_t i = 0; i < indices.size(); ++i) {
    const Path& path = paths_[indices[i]];
    rays.set(static_cast<int>(i), {path.origin, DVec3(path.direction)}, kInfinite);
  }
  context_->view->first_hits(rays, hits);
  rays_ += static_cast<std::int64_t>(indices.size());
  std::uint32_t through_glass = 0;
  std::uint32_t in_fog_lanes = 0;
  RayPacket::Lanes<double> until{};
  for (std::size_t i = 0; i < indices.size(); ++i) {
    until[i] = (hits.grids.hit >> i & 1U) != 0 ? hits.grids.t[i] : kInfinite;
    const Path& path = paths_[indices[i]];
    until[i] = std::min(until[i], ground_at(path.origin, path.direction));
    if (context_->has_media && context_->parts != nullptr) {
      note_behind(paths_[indices[i]], hits, static_cast<int>(i), until[i]);
    }
    if (ends_in_fog(path, until[i])) in_fog_lanes |= 1U << i;
  }
  if (context_->view->tracer().has_transparent()) {
    rays.max_t = until;
    through_glass = context_->view->any_transparent(rays);
  }
  for (std::size_t i = 0; i < indices.size(); ++i) {
    const std::uint32_t index = indices[i];
    const bool may_meet_glass = (through_glass >> i & 1U) != 0 || paths_[index].inside != kAir;
    if (may_meet_glass && meet_glass(index, until[i])) continue;
    if ((in_fog_lanes >> i & 1U) != 0) {
      const Fog& fog = *context_->environment->fog;
      hit_air(index, until[i], fog.colour, static_cast<float>(fog.anisotropy), 0);
    } else {
      meet_lane(index, rays, hits, static_cast<int>(i), until[i]);
    }
  }
}

void PathTile::meet_lane(std::uint32_t index, const RayPacket& rays, const SceneHits& hits, int lane, double until) {
  const auto i = static_cast<std::size_t>(lane);
  const bool is_hit = (hits.grids.hit >> i & 1U) != 0 && hits.grids.t[i] <= until;
  if (is_hit) {
    hit_matter(index, rays, hits, lane);
  } else if (until < kInfinite) {
    hit_ground(index, until);
  } else {
    leave(paths_[index], paths_[index].direction);
  }
}

bool PathTile::ends_in_fog(const Path& path, double& until) const {
  const std::optional<Fog>& fog = context_->environment->fog;
  if (!fog || !(fog->density > 0.0) || path.inside != kAir) return false;
  const Interval way = in_fog(path.origin, path.direction, until);
  const double met = way.begin + free_way(path.random.one(path.dimension + kFog), fog->density);
  if (!(met < way.end)) return false;
  until = met;
  return true;
}

double PathTile::ground_at(const DVec3& origin, Vec3 direction) const {
  if (!context_->environment->ground || !(direction.y < 0.0F) || !(origin.y > ground_)) return kInfinite;
  return (ground_ - origin.y) / static_cast<double>(direction.y);
}

void PathTile::leave(Path& path, Vec3 direction) {
  const SkyLight& sky = *context_->sky;
  const Environment& environment = *context_->environment;
  if (path.is_first && !context_->rays->is_perspective()) {
    direction = Vec3(glm::normalize(context_->rays->forward() + path.origin * context_->rays->sky_scale()));
  }
  Vec3 light = sky.sky(direction);
  if (path.density < kNoOther && sky.has_uneven_sky()) light *= balance(path.density, sky.sky_density(direction));
  const float density = environment.sun.is_visible || !path.is_seen ? sky.sun_density(direction) : 0.0F;
  if (density > 0.0F) {
    light += sky.sun(direction) * (path.density < kNoOther ? balance(path.density, density) : 1.0F);
  }
  if (path.is_first) {
    light = environment.sky.background.value_or(light);
    sums_[path.pixel].background += light;
    if (path.part != kNoPart) {
      SurfacePart& part = part_of(path);
      part.light += light;
      part.square += square(luminance(light));
    }
    if (path.is_first_sample) sums_[path.pixel].depth = std::numeric_limits<float>::infinity();
  } else {
    path.radiance += path.throughput * light;
  }
}

// ---- surfaces ----------------------------------------------------------------------------------------------------

void PathTile::add_emitted(Path& path, Vec3 emitted, std::int32_t lamp, float distance) const {
  if (is_black(emitted)) return;
  float share = path.is_seen ? 1.0F : static_cast<float>(context_->environment->lamp_brightness);
  if (lamp >= 0 && path.density < kNoOther) {
    const DVec3 vertex = path.origin + context_->camera->position;
    const PathLamps& lamps = *context_->lamps;
    const float chance = lamps.tree().probability(static_cast<std::uint32_t>(lamp), Vec3(vertex - lamps.origin()),
                                                  path.normal, memory_.table(path.place));
    share *= balance(path.density, lamps.density(lamp, vertex, path.direction, distance) * chance);
  }
  path.radiance += path.throughput * emitted * share;
}

void PathTile::note_layers(Path& path, const Vertex& vertex, double t, VoxelType type) {
  if (path.is_noted) return;
  path.is_noted = true;
  PixelSums& sums = sums_[path.pixel];
  sums.albedo += vertex.material.colour;
  sums.normal += vertex.normal;
  if (!path.is_first_sample) return;
  sums.type = type;
  if (!vertex.is_ground) {
    const auto placed = static_cast<std::size_t>(vertex.placed);
    sums.instance = context_->placed[placed].instance.index + 1;
  }
  if (path.is_first) sums.depth = static_cast<float>(t);
}

SurfacePart& PathTile::part_of(const Path& path) {
  QUOIN_ASSERT(context_->parts != nullptr && path.part < SurfaceParts::kOfPixel, "a path with a part");
  const auto x = static_cast<std::size_t>(column_ + path.pixel % kEdge);
  const auto y = static_cast<std::size_t>(row_ + path.pixel / kEdge);
  return context_->parts->at(y * static_cast<std::size_t>(context_->options->width) + x)[path.part];
}

void PathTile::note_part(Path& path, const Vertex& vertex, std::uint32_t surface, bool is_curved) {
  if (context_->parts == nullptr || path.part != kNoPart || path.is_caught) return;
  for (std::size_t slot = 0; slot < SurfaceParts::kOfPixel; ++slot) {
    path.part = static_cast<std::uint8_t>(slot);
    SurfacePart& part = part_of(path);
    if (part.surface != 0 && part.surface != surface) continue;
    part.surface = surface;
    part.samples += 1.0F;
    part.albedo += vertex.material.colour;
    if (!is_curved) return;
    part.normal += vertex.normal;
    part.place += Vec3(vertex.in_view);
    return;
  }
  path.part = kNoPart;
}

namespace {

// The surface of a shape at a point of its grid: that of its type, with the colour of the texel of level 0.
Surface surface_of_shape(const VoxelProperties& type, const Surfaces& surfaces, const ShapeHit& hit,
                         const DVec3& point) {
  Surface surface = surfaces[hit.type];
  if (hit.face < 0 || hit.starts_inside) return surface;
  const ModelFace& face = hit.model->faces[static_cast<std::size_t>(hit.face)];
  const VoxelFace* const look = look_of(*hit.model, face, type.faces);
  if (look == nullptr) return surface;
  surface.colour = linear_colour(look->tint);
  if (!look->texture.is_null()) surface.colour *= linear_colour(shape_texel(face, *look, point - DVec3(hit.voxel)));
  surface.emitted = surface.colour * (surface.emission * emission_factor(*look));
  return surface;
}

}  // namespace

bool PathTile::is_lamp(const ShapeHit& hit) const {
  if (hit.face < 0) return false;
  const VoxelProperties& type = context_->view->tracer().scene().types[hit.type];
  const ModelFace& side = hit.model->faces[static_cast<std::size_t>(hit.face)];
  return glm::dot(hit.normal, side.normal) > 0.0F && is_lamp_side(side, look_of(*hit.model, side, type.faces), type);
}

void PathTile::hit_matter(std::uint32_t index, const RayPacket& rays, const SceneHits& hits, int lane) {
  Path& path = paths_[index];
  const auto i = static_cast<std::size_t>(lane);
  Vertex& vertex = vertices_.emplace_back();  // filled in place
  vertex.path = index;
  vertex.placed = hits.placed[i];
  QUOIN_ASSERT(vertex.placed >= 0 && static_cast<std::size_t>(vertex.placed) < context_->placed.size(),
               "a hit on one of the placed grids");
  const PlacedGrid& placed = context_->placed[static_cast<std::size_t>(vertex.placed)];
  const IVec3 voxel{hits.grids.x[i], hits.grids.y[i], hits.grids.z[i]};
  const Direction face = hits.grids.face[i];
  const bool in_field = (hits.in_field >> lane & 1U) != 0;
  const bool in_shape = (hits.in_shape >> lane & 1U) != 0;
  const Ray ray = rays.ray(lane);
  vertex.in_grid = context_->view->grid_from_view(vertex.placed).point(ray.origin + ray.direction * hits.grids.t[i]);
  VoxelType type = hits.material[i];
  const bool starts_inside = (hits.grids.starts_inside >> lane & 1U) != 0;
  Surface surface;
  if (in_field) {
    const DVec3 inside = vertex.in_grid - DVec3(voxel);
    const DVec3 normal(hits.normal(i));
    const FieldPoint point{vertex.in_grid * placed.voxels_per_cell(), Vec3(normal)};
    const FieldPoint* const textured = context_->surfaces->has_textures() ? &point : nullptr;
    surface = starts_inside
                  ? context_->surfaces->of_field(type)
                  : context_->surfaces->blend_of_field(placed.opaque_field->field(), voxel, inside, type, textured);
    vertex.in_grid += normal * kRayLift;
    vertex.normal = glm::normalize(Vec3(placed.world_axes * normal));
  } else if (in_shape) {
    const ShapeHit& hit = hits.shapes[i];
    type = hit.type;
    surface = surface_of_shape(context_->view->tracer().scene().types[type], *context_->surfaces, hit, vertex.in_grid);
    const DVec3 normal(hit.normal);
    vertex.in_grid += normal * kRayLift;
    vertex.normal = glm::normalize(Vec3(placed.world_axes * normal));
  } else {
    const auto of_face = static_cast<std::size_t>(face);
    vertex.in_grid = on_face(vertex.in_grid, voxel, face) + kLifts[of_face];
    vertex.normal = (*context_->face_normals)[static_cast<std::size_t>(vertex.placed)][of_face];
    type = placed.voxels->get(voxel);
    surface = (*context_->surfaces)[type];
  }
  if (path.is_first) sums_[path.pixel].scene_share += 1.0F;
  if (starts_inside) {  // from inside: its own colour, unlit
    path.radiance += path.throughput * (path.is_seen ? surface.colour : surface.emitted);
    if (path.is_first && path.is_first_sample) sums_[path.pixel].depth = 0.0F;
    vertices_.pop_back();
    return;
  }
  if (has_textures_or_lamps_) {
    const bool has_texels = context_->surfaces->has_textures() && !in_field && !in_shape;
    if (has_texels) show_texel(placed, type, face, vertex.in_grid, voxel, surface);
    if (light_.lamps != nullptr) vertex.place = memory_.place_of(vertex.placed, voxel, face);
  }
  vertex.in_view = context_->view->view_from_grid(vertex.placed).point(vertex.in_grid);
  vertex.material = {surface.colour, surface.roughness, surface.metalness};
  if (!path.is_noted) {
    // Emissive and glossy surfaces differ by type; matte surfaces differ by colour only.
    const bool is_matte = surface.roughness >= 1.0F && surface.metalness <= 0.0F && is_black(surface.emitted);
    note_part(path, vertex, surface_id(voxel, face, in_field, vertex.placed, is_matte ? kAir : type), in_field);
  }
  note_layers(path, vertex, hits.grids.t[i], type);
  // Light from lamps of shapes is only sampled.
  if (!is_black(surface.emitted) && (path.is_seen || !in_shape || !is_lamp(hits.shapes[i]))) {
    const std::int32_t lamp = in_field || in_shape ? -1 : context_->lamps->lamp_of(vertex.placed, voxel, face);
    add_emitted(path, surface.emitted, lamp, static_cast<float>(hits.grids.t[i]));
  }
}

void PathTile::show_texel(const PlacedGrid& placed, VoxelType type, Direction face, const DVec3& position, IVec3 voxel,
                          Surface& surface) const {
  const TypeFaces* const faces = context_->surfaces->faces(type);
  if (faces == nullptr) return;
  DVec3 inside = position - DVec3(voxel);
  Direction shown = face;
  const VoxelRegistry& types = context_->view->tracer().scene().types;
  if (types.is_turned_by_state(type) && placed.level == 0) {
    const AxisOrientation back = types[type].orientations.of(placed.voxels->data(voxel).state).inverse();
    inside = back.apply(inside - 0.5) + 0.5;
    shown = back.apply(face);
  }
  const FaceTexels& side = faces->sides[static_cast<std::size_t>(shown)];
  surface.colour = side.colour(side.texel(inside, IVec3(0), 0));
  surface.emitted = surface.colour * side.emission;
}

void PathTile::hit_ground(std::uint32_t index, double t) {
  QUOIN_ASSERT(context_->environment->ground.has_value(), "a scene with ground");
  Path& path = paths_[index];
  const GroundPlane& ground = *context_->environment->ground;
  if (path.is_first && ground.fade > 0.0) {
    const float near = std::clamp(-path.direction.y / static_cast<float>(ground.fade), 0.0F, 1.0F);
    if (path.random.one(path.dimension + kFade) >= near * near * (3.0F - 2.0F * near)) {
      leave(path, glm::normalize(Vec3(path.direction.x, -path.direction.y, path.direction.z)));
      return;
    }
  }
  Vertex vertex;
  vertex.path = index;
  vertex.is_ground = true;
  vertex.in_view = path.origin + DVec3(path.direction) * t;
  vertex.in_view.y = ground_ + kRayLift;
  vertex.normal = {0.0F, 1.0F, 0.0F};
  vertex.material.colour = ground.colour;
  PixelSums& sums = sums_[path.pixel];
  if (path.is_first && ground.only_shadows) {
    path.is_caught = true;
    sums.caught_share += 1.0F;
    sums.caught += context_->sky->sky(path.direction);
    if (path.is_first_sample) sums.depth = kNoOther;
  } else {
    if (path.is_first) sums.scene_share += 1.0F;
    if (!path.is_noted) note_part(path, vertex, kGroundSurface, false);
    note_layers(path, vertex, t, kAir);
  }
  // Shadow rays start in a grid: the first.
  if (!context_->placed.empty()) vertex.in_grid = context_->view->grid_from_view(0).point(vertex.in_view);
  vertices_.push_back(vertex);
}

// ---- light -------------------------------------------------------------------------------------------------------

Scatter PathTile::scatter_at(const Vertex& vertex, const Path& path, const Frame& frame) const {
  if (vertex.is_medium) return {vertex.material.colour, vertex.anisotropy};
  Vec3 out = frame.to_local(-path.direction);
  out.z = std::max(out.z, 1e-4F);
  return {vertex.material, glm::normalize(out)};
}

bool PathTile::survives(Path& path, bool in_medium) const {
  if (in_medium) ++path.scatterings;
  const bool is_sure = in_medium ? path.scatterings <= kSureBounces : path.bounces < kSureBounces;
  if (!is_sure) {
    // In white fog paths never end at random.
    const float likely = std::min(largest(path.throughput), in_medium ? 1.0F : kMostLikely);
    if (!(path.random.one(path.dimension + dimension::kRoulette) < likely)) return false;
    path.throughput /= likely;
  }
  if (!in_medium) ++path.bounces;
  return true;
}

bool PathTile::may_scatter(const Vertex& vertex) const {
  const Path& path = paths_[vertex.path];
  const PathOptions& options = *context_->options;
  const int left = vertex.is_medium ? options.max_scatterings - path.scatterings : options.max_bounces - path.bounces;
  return left > 0 && !is_black(path.throughput);
}

void PathTile::shade_all() {
  std::array<const Vertex*, kBlockPoints> of{};
  std::size_t count = 0;
  block_.in_air = 0;
  const auto shade_block = [&] {
    block_.lamps.active = (1U << count) - 1U;
    light_.shares = memory_.tables();
    kernel_->shade(light_, block_);
    for (std::size_t i = 0; i < count; ++i) shade(*of[i], i);
    block_.in_air = 0;
    count = 0;
  };
  for (const Vertex& vertex : vertices_) {
    if (!may_scatter(vertex)) continue;
    of[count] = &vertex;
    put_into_block(vertex, count);
    if (++count == kBlockPoints) shade_block();
  }
  if (count > 0) shade_block();
}

void PathTile::put_into_block(const Vertex& vertex, std::size_t lane) {
  QUOIN_ASSERT(lane < kBlockPoints && vertex.path < paths_.size(), "a lane, and the vertex of a path");
  const Path& path = paths_[vertex.path];
  block_.pixel[lane] = path.random.pixel();
  block_.sample[lane] = path.random.sample();
  block_.dimension[lane] = path.dimension;
  put(path.direction, block_.direction, lane);
  put(vertex.material.colour, block_.colour, lane);
  put(path.throughput, block_.throughput, lane);
  put(vertex.normal, block_.normal, lane);
  if (vertex.is_medium) block_.in_air |= 1U << lane;
  if (light_.lamps == nullptr) return;
  put(Vec3(vertex.in_view + context_->camera->position - context_->lamps->origin()), block_.lamps.point, lane);
  block_.lamps.table[lane] = vertex.place * static_cast<std::int32_t>(LightTree::kTopNodes);
}

void PathTile::shade(const Vertex& vertex, std::size_t lane) {
  Path& path = paths_[vertex.path];
  const Vec3 normal = vertex.is_medium ? vertex.normal : get(block_.normal, lane);
  Scattered next;
  if (vertex.is_matte()) {
    if (light_.has_sun) (void)ask(vertex, get(block_.sun, lane), kNoOther, get(block_.sun_light, lane), true);
    if (light_.lamps != nullptr || context_->sky->has_uneven_sky()) {
      const Frame frame(normal);
      const Scatter scatter = scatter_at(vertex, path, frame);
      ask_sky(vertex, path, frame, scatter);
      ask_lamp(vertex, lane, frame, scatter);
    }
    const float density = block_.next_density[lane];
    next = {get(block_.next, lane), density > 0.0F ? vertex.material.colour : Vec3(0.0F), density};
  } else {
    const Frame frame(vertex.is_medium ? path.direction : normal);
    const Scatter scatter = scatter_at(vertex, path, frame);
    ask_sun(vertex, lane, frame, scatter);
    ask_sky(vertex, path, frame, scatter);
    ask_lamp(vertex, lane, frame, scatter);
    next = scatter.sample({block_.pair[0][lane], block_.pair[1][lane]},
                          path.random.one(path.dimension + dimension::kLobe));
    if (!is_black(next.weight)) next.direction = glm::normalize(frame.to_world(next.direction));
  }
  go_on(vertex, lane, normal, next);
}

void PathTile::go_on(const Vertex& vertex, std::size_t lane, Vec3 normal, const Scattered& next) {
  Path& path = paths_[vertex.path];
  if (path.is_caught && path.bounces == 0) {
    const SkyLight& sky = *context_->sky;
    const float cosine = std::max(block_.sun[1][lane], 0.0F);
    Vec3 open = sky.sky(next.direction) * next.weight;
    if (sky.has_sun()) open += sky.sun_irradiance() * vertex.material.colour * (cosine / kPi);
    sums_[path.pixel].open += open;
  }
  if (is_black(next.weight)) return;
  path.throughput *= next.weight;
  if (!survives(path, vertex.is_medium)) return;
  path.dimension += kDimensions;
  path.direction = next.direction;
  path.bin = static_cast<std::uint8_t>(vertex.is_matte() ? block_.next_bin[lane] : bin_of(next.direction));
  path.density = next.density;
  path.origin = vertex.in_view;
  path.normal = normal;
  path.place = vertex.place;
  if (next.density < kNoOther) path.is_seen = false;
  path.is_first = false;
  path.inside = kAir;
  next_.push_back(vertex.path);
}

void PathTile::ask_sun(const Vertex& vertex, std::size_t lane, const Frame& frame, const Scatter& scatter) {
  if (!light_.has_sun) return;
  const SkySample sun = context_->sky->sun_sample(get(block_.sun, lane));
  const Vec3 in = frame.to_local(sun.direction);
  if (!(in.z > 0.0F) && !vertex.is_medium) return;
  Vec3 light = paths_[vertex.path].throughput * scatter.value(in);
  if (sun.density < kNoOther) {
    light *= sun.radiance / sun.density * balance(sun.density, scatter.density(in));
  } else {
    light *= sun.radiance;
  }
  (void)ask(vertex, sun.direction, kNoOther, light, true);
}

void PathTile::ask_sky(const Vertex& vertex, const Path& path, const Frame& frame, const Scatter& scatter) {
  if (!context_->sky->has_uneven_sky()) return;
  const SkySample sky = context_->sky->sample_sky(path.random.pair(path.dimension + dimension::kSky));
  const Vec3 in = frame.to_local(sky.direction);
  if ((!(in.z > 0.0F) && !vertex.is_medium) || !(sky.density > 0.0F)) return;
  const float share = balance(sky.density, scatter.density(in));
  (void)ask(vertex, sky.direction, kNoOther, path.throughput * scatter.value(in) * sky.radiance * (share / sky.density),
            false);
}

void PathTile::ask_lamp(const Vertex& vertex, std::size_t lane, const Frame& frame, const Scatter& scatter) {
  if (light_.lamps == nullptr) return;
  const LightTree::Choice chosen{block_.lamps.lamp[lane], block_.lamps.probability[lane]};
  const LampSample lamp = context_->lamps->sample(chosen, vertex.in_view + context_->camera->position,
                                                  {block_.lamp_pair[0][lane], block_.lamp_pair[1][lane]});
  if (is_black(lamp.radiance)) return;
  const Vec3 in = frame.to_local(lamp.direction);
  if (!(in.z > 0.0F) && !vertex.is_medium) return;
  const Vec3 value = scatter.value(in);
  Vec3 light = paths_[vertex.path].throughput * value * lamp.radiance;
  if (lamp.density < kNoOther) light *= balance(lamp.density, scatter.density(in));
  // Slightly in front of the lamp, because of rounding.
  if (!ask(vertex, lamp.direction, lamp.distance * (1.0F - 1e-4F), light, false)) return;
  Request& request = requests_.back();
  request.lamp = chosen.lamp;
  request.place = vertex.place;
  request.brightness = luminance(value * lamp.radiance);
}

bool PathTile::ask(const Vertex& vertex, Vec3 direction, float max_t, Vec3 light, bool is_sun) {
  if (is_black(light)) return false;
  if (ground_at(vertex.in_view, direction) < static_cast<double>(max_t)) return false;
  if (const std::optional<Fog>& fog = context_->environment->fog) {
    const Interval way = in_fog(vertex.in_view, direction, static_cast<double>(max_t));
    light *= exponential(static_cast<float>(-fog->density * (way.end - way.begin)));
    if (is_black(light)) return false;
  }
  Request& request = requests_.emplace_back();
  request.origin = vertex.in_grid;
  request.direction = direction;
  request.max_t = max_t;
  request.light = light;
  request.home = vertex.placed;
  request.path = vertex.path;
  request.bin = is_sun ? 0 : bin_of(direction);
  return true;
}

void PathTile::trace_requests() {
  const std::size_t placed = context_->placed.size();
  if (placed == 0) {
    for (const Request& request : requests_) paths_[request.path].radiance += request.light;
    return;
  }
  order_.resize(requests_.size());
  sort_by_key(
      requests_.size(), kBins, starts_, [&](std::size_t i) { return requests_[i].bin; },
      [&](std::uint32_t to, std::uint32_t from) { order_[to] = from; });
  if (placed > 1) {
    std::stable_sort(order_.begin(), order_.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return requests_[a].home < requests_[b].home; });
  }
  std::size_t first = 0;
  while (first < order_.size()) {
    std::size_t end = first + 1;
    while (end < order_.size() && end - first < kShadowPackets * RayPacket::kSize &&
           requests_[order_[end]].home == requests_[order_[first]].home) {
      ++end;
    }
    trace_some_requests(std::span(order_).subspan(first, end - first));
    first = end;
  }
  // In the order of the requests, independent of the order of the rays.
  for (const Request& request : requests_) paths_[request.path].radiance += request.light;
}

void PathTile::trace_some_requests(std::span<const std::uint32_t> requests) {
  constexpr std::size_t kLanes = RayPacket::kSize;
  QUOIN_ASSERT(!requests.empty() && requests.size() <= kShadowPackets * kLanes, "as many requests as fit");
  const std::int32_t home = requests_[requests.front()].home;
  QUOIN_ASSERT(home >= 0 && static_cast<std::size_t>(home) < context_->placed.size(), "one of the placed grids");
  const PlacedGrid& placed = context_->placed[static_cast<std::size_t>(home)];
  const std::size_t size = (requests.size() + kLanes - 1) / kLanes;
  // Only grows: clearing packets takes longer than filling them.
  if (shadow_packets_.size() < size) shadow_packets_.resize(size);
  for (std::size_t k = 0; k < size; ++k) shadow_packets_[k].active = 0;
  for (std::size_t i = 0; i < requests.size(); ++i) {
    const Request& request = requests_[requests[i]];
    shadow_packets_[i / kLanes].set(static_cast<int>(i % kLanes), {request.origin, in_grid(placed, request.direction)},
                                    static_cast<double>(request.max_t));
  }
  rays_ += static_cast<std::int64_t>(requests.size());
  std::array<std::uint32_t, kShadowPackets> blocked;
  context_->view->any_hits(home, std::span(shadow_packets_).first(size), blocked);
  for (std::size_t k = 0; k < size; ++k) {
    const std::size_t first = k * kLanes;
    finish_requests(requests.subspan(first, std::min(kLanes, requests.size() - first)), shadow_packets_[k], blocked[k]);
  }
}

void PathTile::finish_requests(std::span<const std::uint32_t> requests, RayPacket& rays, std::uint32_t blocked) {
  const std::int32_t home = requests_[requests.front()].home;
  rays.active &= ~blocked;
  if (context_->view->tracer().has_transparent() && rays.active != 0) {
    const RayPacket in_view = context_->view->view_from_grid(home, rays);
    for (std::uint32_t left = context_->view->any_transparent(in_view); left != 0; left &= left - 1) {
      const int lane = std::countr_zero(left);
      Request& request = requests_[requests[static_cast<std::size_t>(lane)]];
      find_transparent(*context_->view, *context_->surfaces, in_view.ray(lane), static_cast<double>(request.max_t),
                       seen_);
      if (seen_.is_closed()) {
        blocked |= 1U << lane;
        continue;
      }
      for (const GlassBody& body : seen_.bodies) {
        std::optional<Surface> textured;
        const Surface& surface = surface_of(*context_->surfaces, body, textured);
        const double voxels = length_of(surface, body);
        request.light *= tint_of(surface, voxels) * (1.0F - cover_of(surface, voxels));
      }
      for (const MetFace& face : seen_.faces) request.light *= face.passed();
    }
  }
  for (std::size_t i = 0; i < requests.size(); ++i) {
    Request& request = requests_[requests[i]];
    const bool is_blocked = (blocked >> i & 1U) != 0;
    if (request.lamp >= 0) {
      memory_.note(context_->lamps->tree(), request.place, request.lamp, request.brightness, is_blocked);
    }
    if (is_blocked) request.light = Vec3(0.0F);
  }
}

// ---- the image ---------------------------------------------------------------------------------------------------

std::int64_t PathTile::pixels_hit() const {
  return std::count_if(sums_.begin(), sums_.end(), [](const PixelSums& sums) { return sums.scene_share > 0.0F; });
}

void PathTile::write_to(PathImage& image) const {
  QUOIN_ASSERT(column_ < image.width && row_ < image.height, "a tile of the image");
  for (int y = 0; y < std::min(kEdge, image.height - row_); ++y) {
    for (int x = 0; x < std::min(kEdge, image.width - column_); ++x) {
      const std::size_t to = static_cast<std::size_t>(row_ + y) * static_cast<std::size_t>(image.width) +
                             static_cast<std::size_t>(column_ + x);
      sums_[static_cast<std::size_t>(y * kEdge + x)].write_to(image, to, context_->options->samples);
    }
  }
}

}  // namespace quoin::path
