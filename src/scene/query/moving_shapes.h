#pragma once

// A box or a capsule on its way through the space of a grid, the voxels or cells that are near it on that way, and the
// distance of a capsule from a voxel.
//
// Source: the distance between a line and a box is the minimum of a convex function that is quadratic between the
// points where the line crosses the planes of the box's faces. The distance between two moving convex bodies is
// convex in time. Newton's steps from the start therefore never pass the first time when the distance equals the
// radius.

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>

#include <quoin/core/vec.h>

#include "scene/query/query_in_grid.h"
#include "scene/tracer/placed_grid.h"

namespace quoin {

/// A moving box in a grid's space. Lengths are in voxels.
struct MovingBox {
  DVec3 centre{0.0};
  glm::dmat3 axes{1.0};  ///< columns: the box's own, unit
  DVec3 half_size{0.0};  ///< along them
  glm::dmat3 half_axes{1.0};
  DVec3 displacement{0.0};
};

/// `half_axes`: `half_axes_of(box)`.
inline MovingBox moving_in_grid(const PlacedGrid& placed, const OrientedBox& box, const glm::dmat3& half_axes,
                                DVec3 displacement) {
  const ToGrid to_grid(placed);
  return {to_grid.point(box.centre), glm::transpose(placed.world_axes) * glm::mat3_cast(unit_rotation(box.rotation)),
          box.half_size / placed.voxel_size, to_grid.axes * half_axes, to_grid.axes * displacement};
}

/// Returns the length of any finite vector without overflow in the squares.
inline double length_of(DVec3 v) {
  const double largest = std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
  if (largest == 0.0) return 0.0;
  return std::min(largest * glm::length(v / largest), std::numeric_limits<double>::max());
}

/// Calls `visit(box)` for a box until it returns false. A box without thickness across its path may lie between two
/// voxels, touching both but inside neither. It is then visited on each side of its position, and collides only if it
/// does on all sides.
template <class Visit>
void visit_sides(const MovingBox& box, const Visit& visit) {
  std::array<int, 3> thin{};
  unsigned count = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double along = std::abs(glm::dot(box.displacement, box.axes[axis]));
    if (box.half_size[axis] < kTouch && along <= 1e-12 * length_of(box.displacement)) thin.at(count++) = axis;
  }
  for (unsigned sides = 0; sides < 1U << count; ++sides) {
    MovingBox moved = box;
    for (unsigned i = 0; i < count; ++i) {
      moved.centre += box.axes[thin.at(i)] * ((sides >> i & 1U) != 0 ? 2.0 * kTouch : -2.0 * kTouch);
    }
    if (!visit(moved)) return;
  }
}

/// Returns the half-extents of a shape along each axis.
inline DVec3 reach_of(const MovingBox& box) {
  return reach_of_axes(box.half_axes);
}

/// Returns the range of fractions in which a shape's bounds overlap `tight`.
template <class Moving>
std::pair<double, double> times_within(const Moving& shape, DVec3 reach, const IBox& tight) {
  double first = 0.0;
  double last = 1.0;
  for (int axis = 0; axis < 3; ++axis) {
    const double low = tight.min[axis] - reach[axis] - 1.0 - shape.centre[axis];
    const double high = tight.max[axis] + reach[axis] + 1.0 - shape.centre[axis];
    const double d = shape.displacement[axis];
    if (d == 0.0) {
      if (low > 0.0 || high < 0.0) return {1.0, 0.0};
      continue;
    }
    first = std::max(first, std::min(low / d, high / d));
    last = std::min(last, std::max(low / d, high / d));
  }
  return {first, last};
}

/// A shape's bounds between two fractions of its way.
template <class Moving>
DBox bounds_between(const Moving& shape, DVec3 reach, double from, double to) {
  const DVec3 a = shape.centre + from * shape.displacement;
  const DVec3 b = shape.centre + to * shape.displacement;
  return {glm::min(a, b) - reach, glm::max(a, b) + reach};
}

/// Follows a shape's path in steps of its own size, up to the fraction `most`. `contents.check(near, from, to)` tests
/// the voxels or cells near the path between two fractions, within `contents.bounds()`. The path ends after
/// `contents.fraction()`, the fraction of the best contact so far.
template <class Moving, class Contents>
void follow_way(const Moving& shape, double most, Contents& contents) {
  const DVec3 reach = reach_of(shape);
  const IBox tight = contents.bounds();
  const auto check = [&](double from, double to) {
    const DBox bounds = bounds_between(shape, reach, from, to);
    contents.check(voxels_within({bounds.min - 1e-6, bounds.max + 1e-6}, tight), from, to);
  };
  const double length = length_of(shape.displacement);
  const double step = std::max(1.0, std::min({reach.x, reach.y, reach.z}));
  if (tight.empty()) return;
  const auto [first, last] = times_within(shape, reach, tight);
  if (first > last) return;
  // Whole steps from the start, so that the result does not depend on the grid's bounds.
  const double steps = std::max(1.0, std::ceil(length / step));
  double i = std::floor(first * steps);
  // At this distance steps are lost in rounding; the whole range is checked at once.
  if (i + 1.0 == i) return check(first, std::min(last, most));
  for (; i / steps <= std::min(last, most); ++i) {
    check(i / steps, std::min((i + 1.0) / steps, 1.0));
    if (contents.fraction() <= (i + 1.0) / steps || i + 1.0 >= steps) break;
  }
}

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

/// Returns the nearest point of a voxel, or a box of the grid, that is centred at the origin.
inline DVec3 nearest_of(const DVec3& point, HalfVoxel /*half*/) {
  return glm::clamp(point, -0.5, 0.5);
}
inline DVec3 nearest_of(const DVec3& point, const DVec3& half) {
  return glm::clamp(point, -half, half);
}
constexpr double half_along(HalfVoxel /*half*/, int /*axis*/) {
  return 0.5;
}
inline double half_along(const DVec3& half, int axis) {
  return half[axis];
}

/// Returns the distance of the line from `middle` - `half_axis` to `middle` + `half_axis` from a voxel, or a box of the
/// grid, centred at the origin.
template <class Half = HalfVoxel>
LineGap gap_of_line(const DVec3& middle, const DVec3& half_axis, const Half& half = {}) {
  const auto apart_at = [&](double t) {
    const DVec3 point = middle + t * half_axis;
    return point - nearest_of(point, half);
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
      const double side = half_along(half, i >> 1);
      const double place = ((i & 1) != 0 ? side : -side) - middle[i >> 1];
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

/// Returns the shortest way out of a voxel, or a box of the grid, (centred at the origin) for a line that intersects
/// it, with a negative distance.
template <class Half = HalfVoxel>
LineGap way_out_of_line(const DVec3& middle, const DVec3& half_axis, const Half& half = {}) {
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
    const double reach = reach_along(axis, half) + std::abs(glm::dot(axis, half_axis));
    const double distance = std::abs(along) - reach;
    if (distance > best.distance + 1e-12) best = {distance, along < 0.0 ? -axis : axis};
  }
  return best;
}

}  // namespace quoin
