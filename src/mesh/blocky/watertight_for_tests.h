#pragma once

// The definition of watertight, checked triangle by triangle.

#include <algorithm>
#include <array>
#include <cstdint>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include <quoin/mesh/blocky.h>

namespace quoin::oracle {

namespace detail {

/// A lattice point as a number, in an order that both ends of an edge agree on. Coordinates within +-2^20.
inline std::uint64_t point_number(IVec3 p) {
  const auto part = [](int c) { return static_cast<std::uint64_t>(c + (1 << 20)); };
  return part(p.x) << 42 | part(p.y) << 21 | part(p.z);
}

struct Edge {
  std::uint64_t low;
  std::uint64_t high;
  int direction;  ///< +1 from low to high, -1 back
};

/// Returns true if one of the points (sorted) is on the segment between two lattice points, without its ends.
inline bool has_point_inside(const std::vector<std::uint64_t>& points, IVec3 from, IVec3 to) {
  const IVec3 delta = to - from;
  const int steps = std::gcd(std::gcd(delta.x, delta.y), delta.z);
  for (int i = 1; i < steps; ++i) {
    if (std::binary_search(points.begin(), points.end(), point_number(from + delta / steps * i))) return true;
  }
  return false;
}

}  // namespace detail

/// Checks that the opaque and emissive voxels form a closed surface. Returns the first fault, or an empty string if the
/// mesh is watertight: after welding vertices by position, every directed edge has equally many opposite edges, no
/// vertex is inside an edge, and no triangle is degenerate or inside out.
inline std::string watertight_fault(const BlockyMesh& mesh) {
  std::vector<detail::Edge> edges;
  std::vector<std::uint64_t> points;
  std::vector<std::array<IVec3, 3>> triangles;
  for (const SurfaceClass surface : {SurfaceClass::Opaque, SurfaceClass::Emissive}) {
    const BlockyTriangles& part = mesh.surfaces[static_cast<std::size_t>(surface)];
    for (std::size_t i = 0; i < part.indices.size(); i += 3) {
      const auto corner = [&](std::size_t k) { return IVec3(part.positions[part.indices[i + k]]); };
      const std::array<IVec3, 3> t = {corner(0), corner(1), corner(2)};
      const Vec3 normal = glm::cross(Vec3(t[1] - t[0]), Vec3(t[2] - t[0]));
      if (!(glm::dot(normal, Vec3(normal_of(part.directions[part.indices[i]]))) > 0.0F)) {
        return "a triangle is inside out or degenerate";
      }
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint64_t a = detail::point_number(t[k]);
        const std::uint64_t b = detail::point_number(t[(k + 1) % 3]);
        edges.push_back({std::min(a, b), std::max(a, b), a < b ? 1 : -1});
        points.push_back(a);
      }
      triangles.push_back(t);
    }
  }
  std::sort(points.begin(), points.end());
  points.erase(std::unique(points.begin(), points.end()), points.end());
  std::sort(edges.begin(), edges.end(),
            [](const auto& a, const auto& b) { return std::pair(a.low, a.high) < std::pair(b.low, b.high); });
  for (std::size_t i = 0; i < edges.size();) {
    int sum = 0;
    const detail::Edge first = edges[i];
    for (; i < edges.size() && edges[i].low == first.low && edges[i].high == first.high; ++i) sum += edges[i].direction;
    if (sum != 0) return "an edge is not met by as many opposite ones";
  }
  for (const std::array<IVec3, 3>& t : triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      if (detail::has_point_inside(points, t[k], t[(k + 1) % 3])) return "a vertex lies inside an edge";
    }
  }
  return {};
}

}  // namespace quoin::oracle
