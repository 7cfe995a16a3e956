#include "render/light/lighting.h"
#include "scene/tracer/placed_grid.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <utility>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include <quoin/core/assert.h>
#include <quoin/mesh/smooth_occlusion.h>

#include "core/srgb.h"
#include "render/light/corner_light.h"
#include "render/light/glass_bodies.h"
#include "render/light/light_model.h"
#include "render/light/voxel_light.h"

namespace quoin {
namespace {

std::size_t index_of(Direction face) {
  return static_cast<std::size_t>(face);
}

void set_direction(RayPacket& rays, std::size_t lane, DVec3 direction) {
  rays.direction_x[lane] = direction.x;
  rays.direction_y[lane] = direction.y;
  rays.direction_z[lane] = direction.z;
}

const ModelFace& face_of_shape(const SurfacePoint& point) {
  QUOIN_ASSERT(point.model != nullptr && static_cast<std::size_t>(point.shape_face) < point.model->faces.size(),
               "a side of the shape");
  return point.model->faces[static_cast<std::size_t>(point.shape_face)];
}

// Returns true if a point of a shape lies on a side of its voxel.
bool is_on_side(const SurfacePoint& point) {
  return point.shape_face >= 0 && face_of_shape(point).on_side;
}

// Returns true if a point of a shape lies on the side of its voxel that it faces, as points of cubes do.
bool faces_out_of_voxel(const SurfacePoint& point) {
  return is_on_side(point) && !point.is_tilted && point.face == face_of_shape(point).direction;
}

// The groups of points that are lit together.
constexpr std::size_t kGroups = 16;

DVec3 normal_at(const SurfacePoint& point) {
  return point.has_normal() ? DVec3(point.normal) : DVec3(normal_of(point.face));
}

}  // namespace

void put_on_shape(const ShapeModel& model, std::int16_t face, const Vec3& normal, SurfacePoint& point) {
  point.model = &model;
  point.shape_face = face;
  point.normal = normal;
  point.is_tilted = normal != Vec3(normal_of(point.face));
  if (point.is_tilted) return;
  const int axis = frame_of(point.face).axis;
  point.position[axis] = double{face_of_shape(point).corners[0][axis]} + point.voxel[axis];
}

void turn_by_state(const PlacedGrid& placed, const VoxelRegistry& types, SurfacePoint& point) {
  // Shapes are turned already.
  if (placed.level == 0 && !types.is_opaque(point.type)) return;
  const std::uint32_t state = placed.voxels->data(point.voxel).state;
  point.orientation = static_cast<std::uint8_t>(types[point.type].orientations.of(state).index());
}

// Sorts the points' indices by grid, then by face, so that most groups of sixteen have parallel rays (saves 7 % of an
// image's time).
std::vector<std::uint32_t> Lighting::coherent_order(std::span<const SurfacePoint> points) {
  constexpr std::size_t kFaces = 6;
  std::vector<std::int32_t> grids;  // in order of first appearance
  std::vector<std::uint32_t> bucket(points.size());
  std::size_t slot = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::int32_t grid = points[i].placed;
    if (slot >= grids.size() || grids[slot] != grid) {
      const auto found = std::find(grids.begin(), grids.end(), grid);
      slot = static_cast<std::size_t>(found - grids.begin());
      if (found == grids.end()) grids.push_back(grid);
    }
    bucket[i] = static_cast<std::uint32_t>(kFaces * slot + index_of(points[i].face));
  }
  std::vector<std::uint32_t> begin(kFaces * grids.size() + 1);
  for (const std::uint32_t each : bucket) ++begin[each + 1];
  for (std::size_t i = 1; i < begin.size(); ++i) begin[i] += begin[i - 1];
  QUOIN_ASSERT(begin.back() == points.size(), "each point in one bucket");
  std::vector<std::uint32_t> order(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) order[begin[bucket[i]]++] = static_cast<std::uint32_t>(i);
  return order;
}

// Up to sixteen points of one placed grid, with the origins of their rays.
struct Lighting::Group {
  const OcclusionDirections::Fixed* directions = nullptr;  // if all pixels use the same
  RayPacket origins;
  std::size_t size = 0;
  std::array<const SurfacePoint*, RayPacket::kSize> points{};
  std::int32_t placed = 0;
  std::uint32_t surfaces = 0;  // lanes to be lit
  std::uint32_t unknown = 0;   // lanes of `surfaces` with unknown openness
  bool is_one_face = true;

  // `lift`: in the voxels that are traced.
  void add(const SurfacePoint& point, double lift) {
    QUOIN_ASSERT(size < points.size(), "a group has at most as many points as a packet has rays");
    if (point.kind == PointKind::Surface) {
      surfaces |= 1U << size;
      if (point.openness < 0.0F) unknown |= 1U << size;
    }
    DVec3 origin = point.position;
    if (point.has_normal()) {
      origin += lift * DVec3(point.normal);
    } else {
      const FaceFrame& frame = frame_of(point.face);
      origin[frame.axis] += lift * frame.sign;
    }
    origins.origin_x[size] = origin.x;
    origins.origin_y[size] = origin.y;
    origins.origin_z[size] = origin.z;
    set_direction(origins, size, normal_at(point));
    placed = point.placed;
    is_one_face &= !point.has_normal() && (size == 0 || point.face == points[0]->face);
    points[size++] = &point;
  }
};

Lighting::Lighting(const SceneView& view, const VoxelRegistry& types, const Surfaces& surfaces,
                   const LightOptions& options, const Environment& environment, const LampTable* lamps,
                   bool detail_colours, std::vector<GridLight> levels)
    : view_(&view),
      types_(&types),
      surfaces_(&surfaces),
      lamps_(options.max_lamps > 0 ? lamps : nullptr),
      options_(options),
      directions_(options.occlusion_rays),
      levels_(std::move(levels)),
      look_(light_look(environment, options.least_light)),
      exposure_(exposure_of(environment)),
      sky_(static_cast<float>(environment.sky.brightness)),
      daylight_(daylight_of(environment)) {
  QUOIN_ASSERT(check(options).has_value() && check(environment).has_value(), "options that `check` accepts");
  QUOIN_ASSERT(!is_propagated() || levels_.size() == placed_in(view.tracer()).size(), "levels of each placed grid");
  has_other_surfaces_ = detail_colours;
  const DVec3 sun = environment.sun.unit_direction();
  for (const PlacedGrid& placed : placed_in(view.tracer())) {
    if (detail_colours) detail_surfaces_.emplace_back().colour = colour_of_detail(placed.detail, placed.level);
    Frame& frame = frames_.emplace_back();
    frame.voxels_per_cell = placed.voxels_per_cell();
    frame.to_sun = glm::transpose(placed.world_axes) * sun;
    for (const Direction face : kDirections) {
      const double cosine = glm::dot(DVec3(normal_of(face)), frame.to_sun);
      frame.diffuse[index_of(face)] = static_cast<float>(std::max(cosine, 0.0) * daylight_.sun_brightness);
    }
  }
}

bool Lighting::is_propagated() const {
  return quoin::is_propagated(options_);
}

bool Lighting::needs_openness() const {
  return options_.occlusion_mode != OcclusionMode::Off && options_.shading != Shading::Unlit &&
         options_.shading != Shading::Normals;
}

std::int64_t Lighting::light(std::span<const SurfacePoint> points, std::span<Vec3> colours, int sample) const {
  QUOIN_ASSERT(colours.size() >= points.size(), "a colour for every point");
  if (options_.shading == Shading::Unlit) {
    if (has_other_surfaces_) {
      show_other_colours(points, colours);
      return 0;
    }
    // Inlined: a call per point would take half of the remaining time.
    for (std::size_t i = 0; i < points.size(); ++i) {
      colours[i] = points[i].kind == PointKind::Glow ? Vec3(0.0F) : colours_of_type(points[i]).own;
    }
    return 0;
  }
  if (options_.shading != Shading::Lit && !needs_openness()) {
    for (std::size_t i = 0; i < points.size(); ++i) colours[i] = shade(points[i], {}, 1.0F);
    return 0;
  }
  std::int64_t rays = 0;
  OcclusionDirections::Fixed directions;
  if (directions_.is_fixed())
    directions = directions_.turned(OcclusionDirections::turn_of(sample, directions_.count()));
  std::array<Vec3, kGroups * RayPacket::kSize> lit;
  const std::vector<std::uint32_t> order = coherent_order(points);
  const auto is_of = [&](std::size_t at, std::int32_t placed) {
    return at < order.size() && points[order[at]].placed == placed;
  };
  for (std::size_t begin = 0; begin < order.size();) {
    const std::int32_t placed = points[order[begin]].placed;
    const double lift = kRayLift / voxels_per_cell(placed);
    std::array<Group, kGroups> groups;
    std::size_t size = 0;
    std::size_t end = begin;
    for (; size < kGroups && is_of(end, placed); ++size) {
      Group& group = groups[size];
      if (directions_.is_fixed()) group.directions = &directions;
      for (; group.size < RayPacket::kSize && is_of(end, placed); ++end) group.add(points[order[end]], lift);
    }
    rays += light_groups(std::span(groups).first(size), lit);
    // All groups except the last are full.
    for (std::size_t i = begin; i < end; ++i) colours[order[i]] = lit[i - begin];
    begin = end;
  }
  return rays;
}

double Lighting::voxels_per_cell(std::int32_t placed) const {
  QUOIN_ASSERT(static_cast<std::size_t>(placed) < frames_.size(), "one of the placed grids");
  return frames_[static_cast<std::size_t>(placed)].voxels_per_cell;
}

std::int64_t Lighting::light_groups(std::span<const Group> groups, std::span<Vec3> colours) const {
  QUOIN_ASSERT(groups.size() <= kGroups && groups.size() * RayPacket::kSize <= colours.size(), "a colour per point");
  std::array<Vec3, kGroups * RayPacket::kSize> all_direct{};
  const bool has_sun = !is_propagated() && options_.shading == Shading::Lit;
  std::int64_t rays = has_sun ? find_sunlight(groups, all_direct) : 0;
  for (std::size_t k = 0; k < groups.size(); ++k) {
    const Group& group = groups[k];
    const auto direct = std::span(all_direct).subspan(k * RayPacket::kSize, RayPacket::kSize);
    std::array<float, RayPacket::kSize> openness{};
    rays += find_openness(group, openness);
    if (is_propagated()) find_propagated(group, direct);
    if (has_sun && lamps_ != nullptr) rays += add_lamplight(group, direct);
    for (std::size_t i = 0; i < group.size; ++i) {
      colours[k * RayPacket::kSize + i] = shade(*group.points[i], direct[i], openness[i]);
    }
  }
  return rays;
}

namespace {

// Voxels and their light, of single places.
class PlacedVoxels {
 public:
  PlacedVoxels(const GridLight& of, const VoxelRegistry& types)
      : light_((QUOIN_ASSERT(of.light != nullptr && of.voxels != nullptr, "light of a grid"), *of.light)),
        reader_(*of.voxels),
        types_(types) {}
  [[nodiscard]] std::uint16_t word(IVec3 voxel) const { return packed(light_.at(voxel)); }
  [[nodiscard]] bool passes(IVec3 voxel) { return !types_.is_opaque(reader_.get(voxel)); }

 private:
  const PropagatedLight& light_;
  GridReader reader_;
  const VoxelRegistry& types_;
};

}  // namespace

void Lighting::find_propagated(const Group& group, std::span<Vec3> light) const {
  const int level = placed_in(view_->tracer())[static_cast<std::size_t>(group.placed)].level;
  PlacedVoxels voxels(levels_[static_cast<std::size_t>(group.placed)], *types_);
  for (std::uint32_t left = group.surfaces; left != 0; left &= left - 1) {
    const auto i = static_cast<std::size_t>(std::countr_zero(left));
    const SurfacePoint& point = *group.points[i];
    MeanLevels levels;
    if (point.has_normal() || (point.model != nullptr && !faces_out_of_voxel(point))) {
      DVec3 at = point.position * std::ldexp(1.0, level);
      if (!point.in_field) at -= 0.5;  // light_before counts from the centre of voxel 0
      levels = light_before(voxels, at, Vec3(normal_at(point)), 1 << level);
    } else {
      const FacePlace place(point.voxel, point.face, point.position - DVec3(point.voxel), level);
      levels = light_on_face(voxels, place, point.face, level);
    }
    light[i] = light_colour(levels, Vec3(normal_at(point)), look_);
  }
}

float Lighting::diffuse(const Frame& frame, const SurfacePoint& point) const {
  if (!point.has_normal()) return frame.diffuse[index_of(point.face)];
  return static_cast<float>(std::max(glm::dot(DVec3(point.normal), frame.to_sun), 0.0) * daylight_.sun_brightness);
}

std::uint32_t Lighting::sunlit_lanes(const Group& group, std::span<Vec3> sunlight) const {
  const Frame& frame = frames_[static_cast<std::size_t>(group.placed)];
  std::uint32_t lanes = 0;
  for (std::size_t i = 0; i < group.size; ++i) {
    const float unshadowed = diffuse(frame, *group.points[i]);
    sunlight[i] = unshadowed * daylight_.sun;
    if (unshadowed > 0.0F && (group.surfaces >> i & 1U) != 0) lanes |= 1U << i;
  }
  return lanes;
}

std::int64_t Lighting::find_sunlight(std::span<const Group> groups, std::span<Vec3> sunlight) const {
  std::array<RayPacket, kGroups> packets;
  std::array<std::size_t, kGroups> group_of{};
  std::size_t size = 0;
  std::int64_t rays = 0;
  const auto light_of = [&](std::size_t k) { return sunlight.subspan(k * RayPacket::kSize, RayPacket::kSize); };
  for (std::size_t k = 0; k < groups.size(); ++k) {
    const Group& group = groups[k];
    const std::uint32_t lanes = sunlit_lanes(group, light_of(k));
    if (!options_.shadows || lanes == 0) continue;
    const Frame& frame = frames_[static_cast<std::size_t>(group.placed)];
    group_of[size] = k;
    RayPacket& to_sun = packets[size++];
    to_sun = group.origins;
    to_sun.active = lanes;
    to_sun.direction_x.fill(frame.to_sun.x);
    to_sun.direction_y.fill(frame.to_sun.y);
    to_sun.direction_z.fill(frame.to_sun.z);
    to_sun.max_t.fill(options_.shadow_distance_voxels / voxels_per_cell(group.placed));
    rays += std::popcount(lanes);
  }
  if (size == 0) return 0;
  std::array<std::uint32_t, kGroups> blocked;
  view_->any_hits(groups[0].placed, std::span(packets).first(size), blocked);
  for (std::size_t i = 0; i < size; ++i) {
    darken(groups[group_of[i]], packets[i], blocked[i], light_of(group_of[i]));
  }
  return rays;
}

std::int64_t Lighting::shadow(const Group& group, RayPacket& rays, std::span<Vec3> light) const {
  const std::int64_t count = std::popcount(rays.active);
  darken(group, rays, view_->any_hits(group.placed, rays, MostRays::Hit), light);
  return count;
}

void Lighting::darken(const Group& group, RayPacket& rays, std::uint32_t blocked, std::span<Vec3> light) const {
  for (std::uint32_t left = blocked; left != 0; left &= left - 1) {
    light[static_cast<std::size_t>(std::countr_zero(left))] = Vec3(0.0F);
  }
  rays.active &= ~blocked;
  if (view_->tracer().has_transparent() && rays.active != 0) tint(group, rays, light);
}

void Lighting::tint(const Group& group, const RayPacket& rays, std::span<Vec3> light) const {
  std::uint32_t met = 0;
  const std::uint32_t ended =
      surfaces_->has_cells_of_faces() ? ends_at_faces(*view_, *surfaces_, group.placed, rays, met) : 0;
  for (std::uint32_t left = ended; left != 0; left &= left - 1) {
    light[static_cast<std::size_t>(std::countr_zero(left))] = Vec3(0.0F);
  }
  RayPacket rest = rays;
  rest.active &= ~ended;
  if (rest.active == 0) return;
  ThroughHits hits;
  view_->find_glass(group.placed, rest, hits);
  std::uint32_t tinted = hits.glass;
  if (surfaces_->has_tinted_cells() && (met & ~ended) != 0) {
    view_->find_through(view_->view_from_grid(group.placed, rest), hits);
    tinted = hits.glass | hits.faces;
  }
  SeenThrough room;
  for (; tinted != 0; tinted &= tinted - 1) {
    const int lane = std::countr_zero(tinted);
    const auto i = static_cast<std::size_t>(lane);
    light[i] *= transmittance_along(*view_, *surfaces_, hits, lane, rest.max_t[i], room);
  }
}

// A group's points, from their grid's pivot, and their normals, along the world's axes: lamps light them.
struct Lighting::LampPlaces {
  std::array<std::array<double, RayPacket::kSize>, 3> point{};
  std::array<std::array<double, RayPacket::kSize>, 3> normal{};

  [[nodiscard]] DVec3 point_of(std::size_t i) const { return {point[0][i], point[1][i], point[2][i]}; }
  [[nodiscard]] DVec3 normal_of(std::size_t i) const { return {normal[0][i], normal[1][i], normal[2][i]}; }

  // Returns the points that the lamp may light: within its reach and turned to it, with room for rounding.
  [[nodiscard]] std::uint32_t near(DVec3 lamp_from_pivot, double reach) const {
    constexpr double kRoom = 1e-9;
    const double most = reach * reach * (1.0 + kRoom);
    std::array<std::uint8_t, RayPacket::kSize> is_near{};
    for (std::size_t i = 0; i < RayPacket::kSize; ++i) {
      const double x = lamp_from_pivot.x - point[0][i];
      const double y = lamp_from_pivot.y - point[1][i];
      const double z = lamp_from_pivot.z - point[2][i];
      const double squared = x * x + y * y + z * z;
      const double facing = x * normal[0][i] + y * normal[1][i] + z * normal[2][i];
      is_near[i] =
          static_cast<std::uint8_t>((squared <= most) & ((facing > 0.0) | (facing * facing <= kRoom * squared)));
    }
    std::uint32_t bits = 0;
    for (std::size_t i = 0; i < RayPacket::kSize; ++i) bits |= std::uint32_t{is_near[i]} << i;
    return bits;
  }
};

// All points of a brick have the same lamp list. Each point adds its lamps in list order in any group.
std::int64_t Lighting::add_lamplight(const Group& group, std::span<Vec3> lamplight) const {
  const PlacedGrid& placed = placed_in(view_->tracer())[static_cast<std::size_t>(group.placed)];
  std::array<std::span<const std::uint32_t>, RayPacket::kSize> lists;
  LampPlaces places;
  std::uint32_t left = group.surfaces;
  for (std::uint32_t lanes = left; lanes != 0; lanes &= lanes - 1) {
    const auto i = static_cast<std::size_t>(std::countr_zero(lanes));
    const IVec3 voxel = group.points[i]->voxel << placed.level;
    lists[i] = lamps_->at({voxel.x >> 4, voxel.y >> 4, voxel.z >> 4}, group.placed);
    if (lists[i].empty()) {
      left &= ~(1U << i);
      continue;
    }
    const DVec3 origin{group.origins.origin_x[i], group.origins.origin_y[i], group.origins.origin_z[i]};
    const DVec3 point = placed.world_axes * ((origin - placed.pivot) * placed.voxel_size);
    const DVec3 normal = placed.world_axes * normal_at(*group.points[i]);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      places.point[axis][i] = point[static_cast<int>(axis)];
      places.normal[axis][i] = normal[static_cast<int>(axis)];
    }
  }
  std::int64_t rays = 0;
  while (left != 0) {
    const auto list = lists[static_cast<std::size_t>(std::countr_zero(left))];
    std::uint32_t lanes = 0;
    for (std::uint32_t rest = left; rest != 0; rest &= rest - 1) {
      const auto i = static_cast<std::size_t>(std::countr_zero(rest));
      if (lists[i].data() == list.data()) lanes |= 1U << i;
    }
    left &= ~lanes;
    for (const std::uint32_t lamp : list) {
      QUOIN_ASSERT(lamp < lamps_->lamps.size(), "a lamp of the table");
      rays += add_lamp(group, places, lamps_->lamps[lamp], lanes, lamplight);
    }
  }
  return rays;
}

std::int64_t Lighting::add_lamp(const Group& group, const LampPlaces& places, const PlacedLamp& lamp,
                                std::uint32_t lanes, std::span<Vec3> lamplight) const {
  const PlacedGrid& placed = placed_in(view_->tracer())[static_cast<std::size_t>(group.placed)];
  // The difference of two far positions is taken first: it is small.
  const DVec3 lamp_from_pivot = lamp.position - placed.position;
  lanes &= places.near(lamp_from_pivot, lamp.reach);
  if (lanes == 0) return 0;
  std::array<Vec3, RayPacket::kSize> light;
  std::array<LampRay, RayPacket::kSize> to_lamp;
  std::uint32_t lit = 0;
  std::uint32_t traced = 0;
  for (; lanes != 0; lanes &= lanes - 1) {
    const auto i = static_cast<std::size_t>(std::countr_zero(lanes));
    to_lamp[i] = lamp_ray(lamp, lamp_from_pivot - places.point_of(i), places.normal_of(i));
    if (to_lamp[i].light == Vec3(0.0F)) continue;
    light[i] = to_lamp[i].light;
    lit |= 1U << i;
    if (to_lamp[i].distance > 0.0) traced |= 1U << i;
  }
  std::int64_t count = 0;
  if (options_.shadows && traced != 0) {
    RayPacket rays = group.origins;
    rays.active = traced;
    for (std::uint32_t left = traced; left != 0; left &= left - 1) {
      const auto i = static_cast<std::size_t>(std::countr_zero(left));
      set_direction(rays, i, to_lamp[i].direction * placed.world_axes);
      rays.max_t[i] = to_lamp[i].distance / placed.voxel_size;
    }
    count = shadow(group, rays, light);
  }
  for (; lit != 0; lit &= lit - 1) {
    const auto i = static_cast<std::size_t>(std::countr_zero(lit));
    lamplight[i] += light[i];
  }
  return count;
}

Vec3 Lighting::sky(float up) const {
  return sky_ * sky_colour(up, daylight_.sky);
}

std::int64_t Lighting::find_openness(const Group& group, std::span<float> openness) const {
  if (!needs_openness()) return 0;
  for (std::size_t i = 0; i < group.size; ++i) openness[i] = std::max(group.points[i]->openness, 0.0F);
  if (group.unknown == 0) return 0;
  // A field has no faces with corners.
  std::uint32_t traced = options_.occlusion_mode == OcclusionMode::Rays ? group.unknown : 0;
  std::uint32_t found = 0;
  for (std::size_t i = 0; i < group.size; ++i) {
    if ((group.unknown >> i & 1U) == 0 || !group.points[i]->in_field) continue;
    if (options_.occlusion_mode == OcclusionMode::Smooth) {
      openness[i] = smooth_openness(*group.points[i]);
      found |= 1U << i;
    } else {
      traced |= 1U << i;
    }
  }
  const std::int64_t rays = traced == 0 ? 0 : trace_openness(group, traced, openness);
  traced |= found;
  if (traced == group.unknown) return rays;
  GridReader reader(*placed_in(view_->tracer())[static_cast<std::size_t>(group.placed)].voxels);
  FaceOcclusion corners{};
  const SurfacePoint* last = nullptr;
  for (std::size_t i = 0; i < group.size; ++i) {
    if (((group.unknown & ~traced) >> i & 1U) == 0) continue;
    const SurfacePoint& point = *group.points[i];
    // Sides inside a voxel have no corners of voxels.
    if (point.model != nullptr && !is_on_side(point)) {
      openness[i] = 1.0F;
      continue;
    }
    // Neighbours often lie on the same face.
    const bool is_new = last == nullptr || point.voxel != last->voxel || point.face != last->face;
    last = &point;
    if (is_new) corners = corner_occlusion(reader, *types_, point.voxel, point.face);
    openness[i] = 1.0F - occlusion_at(corners, point.voxel, point.face, point.position) / 3.0F;
  }
  return rays;
}

float Lighting::smooth_openness(const SurfacePoint& point) const {
  const PlacedGrid& placed = placed_in(view_->tracer())[static_cast<std::size_t>(point.placed)];
  if (placed.opaque_field == nullptr) return 1.0F;  // transparent material casts no occlusion
  SmoothOcclusionOptions options = options_.smooth_occlusion;
  options.spread /= static_cast<float>(placed.voxels_per_cell());  // the same distance as in the full field
  return 1.0F - smooth_occlusion(placed.opaque_field->field(), point.position, point.normal, options);
}

std::int64_t Lighting::trace_openness(const Group& group, std::uint32_t lanes, std::span<float> openness) const {
  QUOIN_ASSERT((lanes & ~group.surfaces) == 0, "points of surfaces");
  std::array<int, RayPacket::kSize> open{};
  RayPacket rays = group.origins;
  rays.active = lanes;
  const double reach = options_.occlusion_distance_voxels / voxels_per_cell(group.placed);
  for (std::size_t i = 0; i < group.size; ++i) {
    rays.max_t[i] = group.points[i]->in_field ? reach * options_.field_occlusion_reach : reach;
  }
  const int count = directions_.count();
  const float factor = field_openness_factor(options_);
  const bool has_faces = surfaces_->has_cells_of_faces() && view_->tracer().has_transparent();
  for (int ray = 0; ray < count && rays.active != 0; ++ray) {
    set_occlusion_directions(group, ray, rays);
    std::uint32_t blocked = view_->any_hits(group.placed, rays);
    if (has_faces) {
      rays.active = lanes & ~blocked;
      std::uint32_t met = 0;
      blocked |= ends_at_faces(*view_, *surfaces_, group.placed, rays, met);
      rays.active = lanes;
    }
    for (std::size_t i = 0; i < group.size; ++i) open[i] += static_cast<int>((blocked >> i & 1U) == 0);
  }
  for (std::size_t i = 0; i < group.size; ++i) {
    if ((lanes >> i & 1U) == 0) continue;
    openness[i] = static_cast<float>(open[i]) / static_cast<float>(count);
    if (group.points[i]->in_field) openness[i] = std::min(openness[i] * factor, 1.0F);
  }
  return std::int64_t{count} * std::popcount(rays.active);
}

void Lighting::set_occlusion_directions(const Group& group, int ray, RayPacket& rays) const {
  QUOIN_ASSERT(ray >= 0 && ray < directions_.count(), "one of the occlusion rays");
  const auto number = static_cast<std::size_t>(ray);
  if (group.directions != nullptr && group.is_one_face) {
    const DVec3 direction = (*group.directions)[index_of(group.points[0]->face)][number];
    rays.direction_x.fill(direction.x), rays.direction_y.fill(direction.y), rays.direction_z.fill(direction.z);
    return;
  }
  for (std::size_t i = 0; i < group.size; ++i) {
    const SurfacePoint& point = *group.points[i];
    const std::size_t face = index_of(point.face);
    const bool is_fixed = group.directions != nullptr;
    // For an inclined surface, uses the directions of an upward face, rotated to the normal.
    const std::size_t of = point.has_normal() ? index_of(Direction::PosY) : face;
    DVec3 direction = is_fixed ? (*group.directions)[of][number] : directions_.spread(of, ray, point.pixel);
    if (point.has_normal()) direction = turned_from_up(direction, DVec3(point.normal));
    set_direction(rays, i, direction);
  }
}

Lighting::Colours Lighting::colours_of_field(const SurfacePoint& point, const FieldPoint* textured) const {
  const auto placed = static_cast<std::size_t>(point.placed);
  const DensityGrid& field = placed_in(view_->tracer())[placed].opaque_field->field();
  const DVec3 at = point.position - double{point.lift} * DVec3(point.normal);
  const IVec3 cell = voxel_of(at);
  const Surface blend = surfaces_->blend_of_field(field, cell, at - DVec3(cell), point.type, textured);
  return {blend.colour, blend.emitted};
}

// Inlined, as `colours_at`: a call per point would take a noticeable part of an unlit image's time.
__attribute__((always_inline)) inline Lighting::Colours Lighting::colours_of_type(const SurfacePoint& point) const {
  const auto placed = static_cast<std::size_t>(point.placed);
  QUOIN_ASSERT(placed < frames_.size(), "one of the placed grids");
  if (point.is_blended) {
    return colours_of_field(point, nullptr);
  }
  const Surface& surface = point.in_field ? surfaces_->of_field(point.type) : (*surfaces_)[point.type];
  return {surface.colour, surface.emitted};
}

__attribute__((always_inline)) inline Lighting::Colours Lighting::colours_at(const SurfacePoint& point) const {
  return has_other_surfaces_ ? other_colours_at(point) : colours_of_type(point);
}

void Lighting::show_textures(double spacing, bool is_perspective) {
  QUOIN_ASSERT(spacing > 0.0, "a positive distance of samples");
  is_perspective_ = is_perspective;
  has_other_surfaces_ = true;
  if (detail_surfaces_.empty()) faces_ = surfaces_->all_faces();
  const BlockVector<PlacedGrid>& placed = placed_in(view_->tracer());
  for (std::size_t i = 0; i < frames_.size(); ++i) {
    // Distances from the eye are in voxels, too.
    const double in_voxels = is_perspective ? spacing : spacing / placed[i].voxel_size;
    frames_[i].square_spacing = in_voxels * in_voxels;
    frames_[i].shows_means = frames_[i].voxels_per_cell != 1.0;
    frames_[i].eye = view_->grid_from_view(static_cast<std::int32_t>(i)).offset;
  }
}

// Returns null for a point that shows the colour of its type.
inline const FaceTexels* Lighting::texels_at(const SurfacePoint& point) const {
  if (point.type >= faces_.size() || point.in_field || point.shape_face >= 0 || point.kind == PointKind::Glow) {
    return nullptr;
  }
  const TypeFaces* const faces = faces_[point.type].get();
  if (faces == nullptr) return nullptr;
  if (point.shown_side != 0) return &faces->sides[point.shown_side - std::size_t{1}];
  if (point.orientation == 0) [[likely]] {
    return &faces->sides[index_of(point.face)];
  }
  return &faces->sides[index_of(AxisOrientation::at(point.orientation).inverse().apply(point.face))];
}

// Inlined, as it is part of each texel's colour.
__attribute__((always_inline)) inline double Lighting::square_spacing_at(const SurfacePoint& point) const {
  const Frame& frame = frames_[static_cast<std::size_t>(point.placed)];
  if (!is_perspective_) return frame.square_spacing;
  const DVec3 away = point.position - frame.eye;
  return frame.square_spacing * glm::dot(away, away);
}

// As `texel_at`, with the mipmap level of the point's distance. Inlined, as its only caller has all it needs at hand.
__attribute__((always_inline)) inline Vec3 Lighting::texel_colour(const FaceTexels& face,
                                                                  const SurfacePoint& point) const {
  const int level = mipmap_level(square_spacing_at(point), face.log_size);
  if (point.orientation == 0) [[likely]] {
    return face.colour(face.texel(point.position, point.voxel, level));
  }
  const DVec3 inside = point.position - DVec3(point.voxel);
  const DVec3 turned = AxisOrientation::at(point.orientation).inverse().apply(inside - 0.5) + 0.5;
  return face.colour(face.texel(turned, IVec3(0), level));
}

Lighting::Colours Lighting::colours_of_shape(const SurfacePoint& point) const {
  const VoxelProperties& type = (*types_)[point.type];
  const ModelFace& face = face_of_shape(point);
  const VoxelFace* const look = look_of(*point.model, face, type.faces);
  if (look == nullptr) return colours_of_type(point);
  const Vec3 tint = linear_colour(look->tint);
  const float emission = emission_of(type) * emission_factor(*look);
  if (look->texture.is_null()) return {tint, tint * emission};
  if (point.is_far) {
    const Vec3 mean = mean_colour(*look);
    return {mean, mean * emission};
  }
  const ShapeUv at = shape_uv(face, *look, point.position - DVec3(point.voxel));
  const int log_size = look->texture.level_count() - 1;
  const int level = mipmap_level(square_spacing_at(point) * at.square_density, log_size);
  const std::uint32_t size = 1U << (log_size - level);
  const std::size_t number = texel_number(at.uv[1], 1.0, size) * std::size_t{size} + texel_number(at.uv[0], 1.0, size);
  const Vec3 colour = linear_colour(look->texture.level(level)[number]) * tint;
  return {colour, colour * emission};
}

bool Lighting::is_cell_of_shapes(const SurfacePoint& point) const {
  return frames_[static_cast<std::size_t>(point.placed)].shows_means && !point.in_field &&
         types_->is_shaped(point.type);
}

// Shows the texel of a point of a textured face.
__attribute__((always_inline)) inline Vec3 Lighting::textured_colour(const FaceTexels& face,
                                                                     const SurfacePoint& point) const {
  QUOIN_ASSERT(static_cast<std::size_t>(point.placed) < frames_.size(), "one of the placed grids");
  // A return of its own: a choice of colours would cost near points 8 % more.
  if (point.is_far || frames_[static_cast<std::size_t>(point.placed)].shows_means) [[unlikely]] {
    return is_cell_of_shapes(point) ? surfaces_->mean_of_shapes(point.type) : face.mean();
  }
  return texel_colour(face, point);
}

Lighting::Colours Lighting::other_colours_at(const SurfacePoint& point) const {
  const FaceTexels* const face = texels_at(point);
  if (face == nullptr) return untextured_colours_at(point);
  const Vec3 colour = textured_colour(*face, point);
  const bool is_cell = (*surfaces_)[point.type].emission > 0.0F && is_cell_of_shapes(point);
  return {colour, colour * (is_cell ? surfaces_->emission_of_shapes(point.type) : face->emission)};
}

// A loop of its own: a call per point would take a fifth of the time of a lookup.
__attribute__((noinline)) void Lighting::show_other_colours(std::span<const SurfacePoint> points,
                                                            std::span<Vec3> colours) const {
  for (std::size_t i = 0; i < points.size(); ++i) {
    const FaceTexels* const face = texels_at(points[i]);
    if (face != nullptr) {
      colours[i] = textured_colour(*face, points[i]);
    } else {
      colours[i] = points[i].kind == PointKind::Glow ? Vec3(0.0F) : untextured_colours_at(points[i]).own;
    }
  }
}

__attribute__((noinline)) Lighting::Colours Lighting::untextured_colours_at(const SurfacePoint& point) const {
  const auto placed = static_cast<std::size_t>(point.placed);
  QUOIN_ASSERT(placed < frames_.size(), "one of the placed grids");
  const bool is_bare = point.in_field && point.type == kAir;
  if (!detail_surfaces_.empty() && !is_bare) return {detail_surfaces_[placed].colour, detail_surfaces_[placed].emitted};
  if (point.shape_face >= 0) return colours_of_shape(point);
  if (is_cell_of_shapes(point)) {
    const Vec3 mean = surfaces_->mean_of_shapes(point.type);
    return {mean, mean * surfaces_->emission_of_shapes(point.type)};
  }
  if (point.is_blended && surfaces_->has_textures()) {
    // Cells of halved fields are larger, but textures keep their size.
    const double scale = voxels_per_cell(point.placed);
    const FieldPoint textured{point.position * scale, point.normal, square_spacing_at(point) * scale * scale};
    return colours_of_field(point, &textured);
  }
  return colours_of_type(point);
}

Vec3 Lighting::normal_colour(const SurfacePoint& point) const {
  const PlacedGrid& placed = placed_in(view_->tracer())[static_cast<std::size_t>(point.placed)];
  const Vec3 normal(placed.world_axes * normal_at(point));
  Vec3 colour;
  for (int axis = 0; axis < 3; ++axis) colour[axis] = linear_from_srgb(0.5F + 0.5F * normal[axis]);
  return colour;
}

// `openness`: 1 if unknown.
Vec3 Lighting::shade(const SurfacePoint& point, Vec3 direct, float openness) const {
  const bool is_surface = point.kind == PointKind::Surface;
  switch (options_.shading) {
    case Shading::Lit:
      return shade_lit(point, direct, openness);
    case Shading::Occlusion:
      return Vec3(is_surface ? linear_from_srgb(openness) : 0.0F);
    case Shading::Normals:
      return is_surface ? normal_colour(point) : Vec3(0.0F);
    case Shading::Unlit:
    case Shading::UnlitWithOcclusion:
      break;
  }
  if (point.kind == PointKind::Glow) return Vec3(0.0F);
  const Vec3 colour = colours_at(point).own;
  const bool is_plain = options_.shading == Shading::Unlit || !is_surface;
  return is_plain ? colour : colour * (kLeastOfAll + (1.0F - kLeastOfAll) * openness);
}

Vec3 Lighting::shade_lit(const SurfacePoint& point, Vec3 direct, float openness) const {
  const Colours shown = colours_at(point);
  if (point.kind == PointKind::Unlit) return shown.own;
  Vec3 colour = shown.emitted;
  if (point.kind == PointKind::Surface) {
    Vec3 light(0.0F);
    if (is_propagated()) {
      const bool is_occluded = options_.occlusion_mode != OcclusionMode::Off;
      light = direct * (is_occluded ? kLeastOfAll + (1.0F - kLeastOfAll) * openness : 1.0F);
    } else if (options_.occlusion_mode == OcclusionMode::Off) {
      light = sky_ * kAmbientWithoutOcclusion * daylight_.ambient + direct;
    } else if (options_.occlusion_affects == OcclusionAffects::Ambient) {
      light = sky_ * kAmbient * openness * daylight_.ambient + direct;
    } else {
      light = (sky_ * kAmbient * daylight_.ambient + direct) * (kLeastOfAll + (1.0F - kLeastOfAll) * openness);
    }
    colour += shown.own * light;
  }
  return colour * exposure_;
}

}  // namespace quoin
