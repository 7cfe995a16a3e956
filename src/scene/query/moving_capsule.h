#pragma once

// A moving capsule in the space of a grid, and its distance from a voxel.
//
// Source: the distance between a line and a box is the minimum of a convex function that is quadratic between the
// points where the line crosses the planes of the box's faces. The distance between two moving convex bodies is
// convex in time. Newton's steps from the start therefore never pass the first time when the distance equals the
// radius.

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <quoin/core/shapes.h>

#include "scene/query/query_in_grid.h"
#include "scene/tracer/placed_grid.h"

namespace quoin {

/// A moving capsule in a grid's space. Lengths are in voxels.
struct MovingCapsule {
  DVec3 centre{0.0};
  DVec3 half_axis{0.0};
  double radius = 0.0;
  DVec3 displacement{0.0};

  /// Returns the point of its middle line nearest to a point, with its centre at `centre_then`.
  [[nodiscard]] DVec3 nearest_of_line(const DVec3& centre_then, const DVec3& point) const {
    const double square = glm::dot(half_axis, half_axis);
    if (!(square > 0.0)) return centre_then;
    return centre_then + half_axis * std::clamp(glm::dot(point - centre_then, half_axis) / square, -1.0, 1.0);
  }
};

inline bool is_capsule(const Capsule& capsule) {
  return is_finite(capsule.centre) && is_finite(capsule.half_axis) && std::isfinite(capsule.radius) &&
         capsule.radius > 0.0;
}
inline DVec3 reach_of(const Capsule& capsule) {
  return glm::abs(capsule.half_axis) + capsule.radius;
}
inline DVec3 reach_of(const MovingCapsule& capsule) {
  return glm::abs(capsule.half_axis) + capsule.radius;
}

inline MovingCapsule moving_in_grid(const PlacedGrid& placed, const Capsule& capsule, DVec3 displacement) {
  const ToGrid to_grid(placed);
  return {to_grid.point(capsule.centre), to_grid.axes * capsule.half_axis, capsule.radius / placed.voxel_size,
          to_grid.axes * displacement};
}

/// The distance of a line from a voxel.
struct LineGap {
  double distance = 0.0;
  DVec3 away{0.0};  ///< unit vector from the voxel to the line; 0 if they touch
};

/// Returns the distance of the line from `middle` - `half_axis` to `middle` + `half_axis` from a voxel centred at the
/// origin.
inline LineGap gap_of_line(const DVec3& middle, const DVec3& half_axis) {
  const auto apart_at = [&](double t) {
    const DVec3 point = middle + t * half_axis;
    return point - glm::clamp(point, -0.5, 0.5);
  };
  // Half of the slope of the distance's square, which only grows.
  const auto slope_at = [&](double t) { return glm::dot(apart_at(t), half_axis); };
  double low = -1.0;
  double high = 1.0;
  double below = slope_at(low);
  double above = slope_at(high);
  if (above < 0.0) {
    low = high;
  } else if (below < 0.0) {
    for (int i = 0; i < 6; ++i) {
      const double place = ((i & 1) != 0 ? 0.5 : -0.5) - middle[i >> 1];
      const double t = place / half_axis[i >> 1];
      if (!(t > low && t < high)) continue;
      const double slope = slope_at(t);
      (slope < 0.0 ? low : high) = t;
      (slope < 0.0 ? below : above) = slope;
    }
    // Linear from here to there.
    low += (high - low) * (below / (below - above));
  }
  const DVec3 offset = apart_at(low);
  const double distance = glm::length(offset);
  return {distance, distance > 0.0 ? offset / distance : DVec3(0.0)};
}

/// Returns the shortest way out of a voxel (centred at the origin) for a line that intersects it, with a negative
/// distance.
inline LineGap way_out_of_line(const DVec3& middle, const DVec3& half_axis) {
  LineGap best{-std::numeric_limits<double>::infinity(), {}};
  for (int i = 0; i < 6; ++i) {
    DVec3 axis(0.0);
    axis[i % 3] = 1.0;
    if (i >= 3) {
      axis = glm::cross(axis, half_axis);
      const double length = glm::length(axis);
      if (!(length > 1e-6 * glm::length(half_axis))) continue;
      axis /= length;
    }
    const double along = glm::dot(axis, middle);
    const DVec3 reaches = glm::abs(axis);
    const double reach = 0.5 * (reaches.x + reaches.y + reaches.z) + std::abs(glm::dot(axis, half_axis));
    const double distance = std::abs(along) - reach;
    if (distance > best.distance + 1e-12) best = {distance, along < 0.0 ? -axis : axis};
  }
  return best;
}

}  // namespace quoin
