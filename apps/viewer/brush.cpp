#include "brush.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

namespace quoin::viewer {

namespace {

// The outermost chunk on each side stays air.
constexpr int kGreatest = std::numeric_limits<int>::max() - 2 * kChunkEdge;
constexpr double kFarthestLayer = 1e5;  // voxels along the ray

VoxelType outcome(const Brush& brush, VoxelType current) {
  switch (brush.action) {
    case BrushAction::Place:
      return current == kAir ? brush.type : current;
    case BrushAction::Remove:
      return kAir;
    case BrushAction::Paint:
      return current == kAir ? kAir : brush.type;
    case BrushAction::Smooth:
    case BrushAction::Flatten:
      break;
  }
  return current;
}

// Returns true if a voxel that the brush covers becomes the brush's type with the brush's state.
bool gets_state(const Brush& brush, VoxelType current) {
  if (brush.action == BrushAction::Place) return current == kAir && brush.state != 0;
  if (brush.action != BrushAction::Paint || current == kAir) return false;
  return current == brush.type ? !brush.turns : brush.state != 0;
}

}  // namespace

std::uint32_t state_of(const Brush& brush, const SceneHit& hit, DVec3 look, const Instance& instance,
                       const SceneGrid& grid, const VoxelRegistry& types) {
  if (brush.action != BrushAction::Place || !brush.turns || brush.type >= types.size()) return brush.state;
  PlacingHit at{.face = hit.face};
  if (const auto ray = ray_in_grid(instance, grid, {hit.position, look})) {
    at.point = Vec3(ray->origin - DVec3(hit.voxel));
    at.look = ray->direction;
  }
  return placed_state(types[brush.type], at, brush.state);
}

IBox reach_of(const Brush& brush, IVec3 centre) {
  const int radius = std::clamp(brush.radius, 0, kMaxBrush);
  const IVec3 middle = glm::clamp(centre, IVec3{-kGreatest}, IVec3{kGreatest});
  if (middle != centre) return {};
  return {middle - radius, middle + radius + 1};
}

std::int64_t apply(const Brush& brush, IVec3 centre, Grid& grid) {
  const IBox box = reach_of(brush, centre);
  if (box.empty()) return 0;
  // Half a voxel more than the radius, so that spheres look round rather than pointed.
  const double reach = std::clamp(brush.radius, 0, kMaxBrush) + 0.5;
  const bool is_sphere = brush.shape == BrushShape::Sphere;
  std::vector<IVec3> stated;     // voxels that get the brush's state
  std::int64_t only_stated = 0;  // of these, voxels that keep their type
  const std::int64_t changed = grid.edit(box, [&](IVec3 voxel, VoxelType current) {
    const DVec3 offset(voxel - centre);
    if (is_sphere && glm::dot(offset, offset) > reach * reach) return current;
    const VoxelType next = outcome(brush, current);
    if (gets_state(brush, current) && (next != current || grid.data(voxel).state != brush.state)) {
      stated.push_back(voxel);
      only_stated += next == current ? 1 : 0;
    }
    return next;
  });
  for (const IVec3 voxel : stated) {
    grid.set(voxel, grid.get(voxel), {.state = brush.state, .bytes = grid.data(voxel).bytes});
  }
  return changed + only_stated;
}

IVec3 target_of(BrushAction action, IVec3 voxel, Direction face) {
  return action == BrushAction::Place ? voxel + normal_of(face) : voxel;
}

std::optional<Ray> ray_in_grid(const Instance& instance, const SceneGrid& grid, const Ray& ray_in_world) {
  if (!std::isfinite(instance.voxel_size) || !(instance.voxel_size > 0.0)) return std::nullopt;
  // The transformed axes define the transform; taken at the origin, where they are exact.
  Instance at_origin = instance;
  at_origin.position = DVec3{0.0};
  const DVec3 from_pivot = ray_in_world.origin - instance.position;
  Ray ray{grid.pivot, DVec3{0.0}};
  for (int axis = 0; axis < 3; ++axis) {
    DVec3 unit{0.0};
    unit[axis] = 1.0;
    const DVec3 image = world_from_grid(at_origin, grid, grid.pivot + unit);
    const double scale = glm::dot(image, image);
    if (!(scale > 0.0) || !std::isfinite(scale)) return std::nullopt;
    ray.origin[axis] += glm::dot(from_pivot, image) / scale;
    ray.direction[axis] = glm::dot(ray_in_world.direction, image) / scale;
  }
  if (!is_finite(ray.origin) || !is_finite(ray.direction)) return std::nullopt;
  return ray;
}

std::optional<IVec3> StrokeLayer::at(const Ray& ray_in_grid) const {
  const int axis = frame_of(face).axis;
  // The layer's surface on the touched side, where the mouse appears to be.
  const double plane = voxel[axis] + (frame_of(face).sign > 0 ? 1.0 : 0.0);
  const double slope = ray_in_grid.direction[axis];
  const double length = glm::length(ray_in_grid.direction);
  if (!(std::abs(slope) > 1e-3 * length)) return std::nullopt;
  const double t = (plane - ray_in_grid.origin[axis]) / slope;
  if (!(t > 0.0) || t * length > kFarthestLayer) return std::nullopt;
  const DVec3 point = ray_in_grid.origin + t * ray_in_grid.direction;
  if (glm::any(glm::greaterThan(glm::abs(point), DVec3(kGreatest)))) return std::nullopt;
  IVec3 found(glm::floor(point));
  found[axis] = voxel[axis];
  return found;
}

namespace {

constexpr double kFarthest = 1e5;  // samples along the ray
constexpr double kStrength = 0.5;  // of a smooth or flatten touch
// The outermost chunks stay air.
constexpr double kGreatestSample = std::numeric_limits<int>::max() - 4.0 * kChunkEdge;

// Balls flow into the ground a little.
double blend_of(const Brush& brush) {
  return brush.shape == BrushShape::Sphere ? 0.25 * sculpt_radius(brush) : 0.0;
}

IBox box_around(DVec3 centre, double reach) {
  if (!is_finite(centre) || glm::any(glm::greaterThan(glm::abs(centre), DVec3(kGreatestSample)))) return {};
  return {IVec3(glm::floor(centre - reach)), IVec3(glm::ceil(centre + reach)) + 1};
}

std::int64_t paint(const Brush& brush, DVec3 centre, DensityGrid& field) {
  const double radius = sculpt_radius(brush);
  const bool is_sphere = brush.shape == BrushShape::Sphere;
  return field.edit(box_around(centre, radius), [&](IVec3 sample, DensitySample value) {
    const DVec3 away = glm::abs(DVec3(sample) - centre);
    const double distance = is_sphere ? glm::length(away) : std::max({away.x, away.y, away.z});
    if (value.density < 0.0F && distance <= radius) value.material = brush.type;
    return value;
  });
}

}  // namespace

std::optional<SurfacePlace> SurfacePlace::of(const SceneHit& hit, const Instance& instance, const SceneGrid& grid) {
  if (!hit.in_field) return std::nullopt;
  const auto ray = ray_in_grid(instance, grid, {hit.position, hit.normal});
  if (!ray) return std::nullopt;
  SurfacePlace place;
  place.point = ray->origin;
  place.material = hit.type;
  const double length = glm::length(ray->direction);
  if (length > 0.0) place.normal = ray->direction / length;
  return place;
}

std::optional<DVec3> SurfacePlace::in_plane(const Ray& ray_in_grid) const {
  const double slope = glm::dot(ray_in_grid.direction, normal);
  const double length = glm::length(ray_in_grid.direction);
  if (!(std::abs(slope) > 1e-3 * length)) return std::nullopt;
  const double t = glm::dot(point - ray_in_grid.origin, normal) / slope;
  if (!(t > 0.0) || t * length > kFarthest) return std::nullopt;
  return ray_in_grid.origin + t * ray_in_grid.direction;
}

double sculpt_radius(const Brush& brush) {
  return std::clamp(brush.radius, 0, kMaxBrush) + 1.5;
}

IBox reach_of(const Brush& brush, DVec3 centre, const DensityGrid& field) {
  // Densities are clamped at the band; boxes are wider than balls.
  const double corner = brush.shape == BrushShape::Box ? 1.8 : 1.0;
  return box_around(centre, corner * sculpt_radius(brush) + static_cast<double>(field.band()) + blend_of(brush) + 2.0);
}

std::int64_t sculpt(const Brush& brush, DVec3 centre, const SurfacePlace& first, DensityGrid& field) {
  if (reach_of(brush, centre, field).empty()) return 0;
  const double radius = sculpt_radius(brush);
  const bool is_sphere = brush.shape == BrushShape::Sphere;
  switch (brush.action) {
    case BrushAction::Place:
      return is_sphere ? field.add_sphere(centre, radius, brush.type, blend_of(brush))
                       : field.add_box(centre - radius, centre + radius, brush.type);
    case BrushAction::Remove:
      return is_sphere ? field.remove_sphere(centre, radius, blend_of(brush))
                       : field.remove_box(centre - radius, centre + radius);
    case BrushAction::Paint:
      return paint(brush, centre, field);
    case BrushAction::Smooth:
      return field.smooth(centre, 2.0 * radius, kStrength);
    case BrushAction::Flatten:
      return field.flatten(centre, 2.0 * radius, {first.point, first.normal, kStrength, first.material});
  }
  return 0;
}

}  // namespace quoin::viewer
