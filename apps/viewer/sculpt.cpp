#include "sculpt.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace quoin::viewer {

namespace {

constexpr double kFarthest = 1e5;  // samples along the ray
constexpr double kStrength = 0.5;  // of a smooth or flatten touch
// The outermost chunks stay air.
constexpr double kGreatest = std::numeric_limits<int>::max() - 4.0 * kChunkEdge;

// Balls flow into the ground a little.
double blend_of(const Brush& brush) {
  return brush.shape == BrushShape::Sphere ? 0.25 * sculpt_radius(brush) : 0.0;
}

IBox box_around(DVec3 centre, double reach) {
  if (!is_finite(centre) || glm::any(glm::greaterThan(glm::abs(centre), DVec3(kGreatest)))) return {};
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
