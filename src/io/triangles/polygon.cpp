#include "io/triangles/polygon.h"

#include <cmath>

#include <glm/geometric.hpp>

#include <quoin/core/assert.h>

namespace quoin::triangles {

namespace {

struct Point {
  double x = 0.0;
  double y = 0.0;
  bool operator==(const Point&) const = default;
};

/// Returns twice the area of a triangle; positive if it turns left.
double area(const Point& a, const Point& b, const Point& c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

/// Projects the corners to the plane in which the polygon is largest, where it turns left.
std::vector<Point> flattened(std::span<const DVec3> corners) {
  QUOIN_ASSERT(corners.size() >= 3, "at least three corners");
  DVec3 normal(0.0);
  for (std::size_t i = 1; i + 1 < corners.size(); ++i) {
    normal += glm::cross(corners[i] - corners[0], corners[i + 1] - corners[0]);
  }
  int axis = std::abs(normal.x) > std::abs(normal.y) ? 0 : 1;
  if (std::abs(normal.z) > std::abs(normal[axis])) axis = 2;
  int u = (axis + 1) % 3;
  int v = (axis + 2) % 3;
  if (normal[axis] < 0.0) std::swap(u, v);
  std::vector<Point> points;
  points.reserve(corners.size());
  for (const DVec3& corner : corners) points.push_back({corner[u] - corners[0][u], corner[v] - corners[0][v]});
  return points;
}

/// Returns true if it never turns right and goes round once: from left to right and back.
bool is_convex(const std::vector<Point>& points) {
  const std::size_t count = points.size();
  int turns = 0;
  double last = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    const Point& a = points[i];
    const Point& b = points[(i + 1) % count];
    if (area(a, b, points[(i + 2) % count]) < 0.0) return false;
    const double step = b.x - a.x;
    if (step == 0.0) continue;
    turns += last != 0.0 && (step < 0.0) != (last < 0.0) ? 1 : 0;
    last = step;
  }
  return turns <= 2;
}

/// The ring of corners that remains while ears are cut off.
class Ring {
 public:
  explicit Ring(const std::vector<Point>& points) : points_(points), next_(points.size()), last_(points.size()) {
    const auto count = static_cast<std::uint32_t>(points.size());
    for (std::uint32_t i = 0; i < count; ++i) {
      next_[i] = (i + 1) % count;
      last_[i] = (i + count - 1) % count;
    }
  }
  [[nodiscard]] std::uint32_t next(std::uint32_t i) const { return next_[i]; }
  [[nodiscard]] std::array<std::uint32_t, 3> corner(std::uint32_t i) const { return {last_[i], i, next_[i]}; }
  [[nodiscard]] double turn(std::uint32_t i) const { return area(points_[last_[i]], points_[i], points_[next_[i]]); }
  void remove(std::uint32_t i) {
    QUOIN_ASSERT(i < next_.size() && next_[last_[i]] == i, "a corner that is left");
    next_[last_[i]] = next_[i];
    last_[next_[i]] = last_[i];
  }
  /// Returns true if a corner turns to the left and its triangle contains no other corner. Left-turning corners need no
  /// test: if one lies inside, so does a corner that does not turn left.
  [[nodiscard]] bool is_ear(std::uint32_t i) const {
    if (!(turn(i) > 0.0)) return false;
    const Point& a = points_[last_[i]];
    const Point& b = points_[i];
    const Point& c = points_[next_[i]];
    for (std::uint32_t at = next_[next_[i]]; at != last_[i]; at = next_[at]) {
      const Point& p = points_[at];
      if (p == a || p == b || p == c || turn(at) > 0.0) continue;
      if (area(a, b, p) >= 0.0 && area(b, c, p) >= 0.0 && area(c, a, p) >= 0.0) return false;
    }
    return true;
  }

 private:
  const std::vector<Point>& points_;
  std::vector<std::uint32_t> next_;
  std::vector<std::uint32_t> last_;
};

/// Returns the corner to cut off if there is no ear: the ring crosses itself there, or is on a line.
std::uint32_t flattest(const Ring& ring, std::uint32_t first, std::size_t left) {
  std::uint32_t best = first;
  std::uint32_t at = first;
  for (std::size_t i = 0; i < left; ++i, at = ring.next(at)) {
    if (std::abs(ring.turn(at)) < std::abs(ring.turn(best))) best = at;
  }
  return best;
}

void cut_ears(const std::vector<Point>& points, std::vector<std::array<std::uint32_t, 3>>& triangles) {
  Ring ring(points);
  std::uint32_t at = 0;
  for (std::size_t left = points.size(); left > 2; --left) {
    std::size_t tried = 0;
    while (tried < left && !ring.is_ear(at)) {
      at = ring.next(at);
      ++tried;
    }
    if (tried == left) at = flattest(ring, at, left);
    triangles.push_back(ring.corner(at));
    const std::uint32_t after = ring.next(at);
    ring.remove(at);
    at = ring.next(after);  // cutting adjacent ears in sequence would make slivers
  }
}

}  // namespace

bool cut_polygon(std::span<const DVec3> corners, std::vector<std::array<std::uint32_t, 3>>& triangles) {
  if (corners.size() < 3) return true;
  const auto fan = [&] {
    for (std::uint32_t i = 2; i < corners.size(); ++i) triangles.push_back({0, i - 1, i});
  };
  if (corners.size() == 3) {
    fan();
    return true;
  }
  const std::vector<Point> points = flattened(corners);
  const bool convex = is_convex(points);
  if (convex || corners.size() > kMostCornersOfConcave) {
    fan();
    return convex;
  }
  cut_ears(points, triangles);
  return true;
}

}  // namespace quoin::triangles
