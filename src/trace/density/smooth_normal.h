#pragma once

#include <glm/geometric.hpp>

#include <quoin/trace/density_ray.h>

namespace quoin {

/// Returns the unit normal for lighting a field at a ray's hit. Unlike DensityHit::normal, it has no steps between
/// cells. It is computed from differences of the field one sample to each side. Where these point away from the hit's
/// normal, as at solids thinner than two samples, it returns the hit's normal.
[[nodiscard]] inline DVec3 smooth_normal(const DensityGrid& field, const DVec3& point, const DensityHit& hit) {
  DVec3 gradient;
  for (int axis = 0; axis < 3; ++axis) {
    DVec3 step(0.0);
    step[axis] = 1.0;
    gradient[axis] = double{field.density_at(point + step)} - double{field.density_at(point - step)};
  }
  constexpr double kAgrees = 0.5;
  const double length = glm::length(gradient);
  return glm::dot(gradient, hit.normal) > kAgrees * length ? gradient / length : hit.normal;
}

}  // namespace quoin
