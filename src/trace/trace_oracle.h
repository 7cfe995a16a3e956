#pragma once

// The dense tracer in double precision, one voxel at a time: the reference for the hierarchical tracer.

#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include <quoin/grid/grid.h>
#include <quoin/trace/ray.h>

namespace quoin::oracle {

/// Walks voxel by voxel inside `box`, and reads each from the grid.
inline std::optional<RayHit> dense_first_hit(const Grid& grid, const IBox& box, const Ray& ray, double max_t) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  std::array<long long, 3> at{};
  for (int a = 0; a < 3; ++a) at[static_cast<std::size_t>(a)] = static_cast<long long>(std::floor(ray.origin[a]));
  double t = 0.0;
  int axis = -1;
  GridReader reader(grid);
  for (;;) {
    const IVec3 v{static_cast<int>(at[0]), static_cast<int>(at[1]), static_cast<int>(at[2])};
    if (box.contains(v) && reader.get(v) != kAir) {
      RayHit hit;
      hit.voxel = v;
      hit.t = t;
      hit.starts_inside = axis < 0;
      if (axis >= 0) hit.face = static_cast<Direction>(2 * axis + (ray.direction[axis] > 0 ? 1 : 0));
      return hit;
    }
    double best = kInfinity;
    for (int a = 0; a < 3; ++a) {
      const double d = ray.direction[a];
      if (d == 0.0) continue;
      const double plane = static_cast<double>(at[static_cast<std::size_t>(a)]) + (d > 0 ? 1.0 : 0.0);
      const double next = (plane - ray.origin[a]) / d;
      if (next < best) {
        best = next;
        axis = a;
      }
    }
    if (best > max_t || best == kInfinity) return std::nullopt;
    t = best;
    at[static_cast<std::size_t>(axis)] += ray.direction[axis] > 0 ? 1 : -1;
    bool is_leaving = false;
    for (int a = 0; a < 3; ++a) {
      const auto i = static_cast<std::size_t>(a);
      is_leaving |= ray.direction[a] >= 0 && at[i] >= box.max[a];
      is_leaving |= ray.direction[a] <= 0 && at[i] < box.min[a];
    }
    if (is_leaving) return std::nullopt;
  }
}

}  // namespace quoin::oracle
