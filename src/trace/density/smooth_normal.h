#pragma once

#include <glm/geometric.hpp>

#include <quoin/trace/density_ray.h>

namespace quoin {

/// The normal with which a field is lit where a ray hit it: of unit length and without the steps that
/// DensityHit::normal has from cell to cell. Of the differences of the field a sample to each side; that of the hit
/// where these point elsewhere, as they do at solids thinner than two samples.
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
