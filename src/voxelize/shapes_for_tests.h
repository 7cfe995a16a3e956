#pragma once

// Meshes of known shapes, and slow, obvious answers about meshes.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <set>
#include <tuple>
#include <vector>

#include <glm/geometric.hpp>

#include <quoin/voxelize/voxelize.h>

namespace quoin::shapes {

using Voxels = std::set<std::tuple<int, int, int>>;  // z, y, x

inline void add_quad(TriangleMesh& mesh, std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
  mesh.triangles.push_back({a, b, c});
  mesh.triangles.push_back({a, c, d});
}

inline void append(TriangleMesh& mesh, const TriangleMesh& other) {
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  mesh.positions.insert(mesh.positions.end(), other.positions.begin(), other.positions.end());
  for (const auto& t : other.triangles) mesh.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
}

inline TriangleMesh box(DVec3 min, DVec3 max) {
  TriangleMesh mesh;
  for (int i = 0; i < 8; ++i) mesh.positions.push_back(box_corner(DBox{min, max}, i));
  add_quad(mesh, 0, 4, 6, 2);
  add_quad(mesh, 1, 3, 7, 5);
  add_quad(mesh, 0, 1, 5, 4);
  add_quad(mesh, 2, 6, 7, 3);
  add_quad(mesh, 0, 2, 3, 1);
  add_quad(mesh, 4, 5, 7, 6);
  return mesh;
}

inline TriangleMesh rotated(TriangleMesh mesh, DVec3 axis, double angle, DVec3 about = DVec3(0.0)) {
  const DQuat turn = glm::angleAxis(angle, glm::normalize(axis));
  for (DVec3& p : mesh.positions) p = about + turn * (p - about);
  return mesh;
}

/// A closed ring of rings: a torus, or with `tube` as wide as it goes something that crosses itself.
inline TriangleMesh torus(DVec3 centre, double ring, double tube, int around, int across) {
  TriangleMesh mesh;
  for (int i = 0; i < around; ++i) {
    const double a = 2.0 * std::numbers::pi * i / around;
    for (int j = 0; j < across; ++j) {
      const double b = 2.0 * std::numbers::pi * j / across;
      const double from_axis = ring + tube * std::cos(b);
      mesh.positions.push_back(centre + DVec3(from_axis * std::cos(a), tube * std::sin(b), -from_axis * std::sin(a)));
    }
  }
  const auto at = [&](int i, int j) { return static_cast<std::uint32_t>((i % around) * across + j % across); };
  for (int i = 0; i < around; ++i) {
    for (int j = 0; j < across; ++j) add_quad(mesh, at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
  }
  return mesh;
}

inline TriangleMesh sphere(DVec3 centre, double radius, int around, int across) {
  TriangleMesh mesh;
  mesh.positions.push_back(centre + DVec3(0.0, -radius, 0.0));
  for (int j = 1; j < across; ++j) {
    const double b = std::numbers::pi * (static_cast<double>(j) / across - 0.5);
    for (int i = 0; i < around; ++i) {
      const double a = 2.0 * std::numbers::pi * i / around;
      mesh.positions.push_back(centre +
                               radius * DVec3(std::cos(b) * std::cos(a), std::sin(b), -std::cos(b) * std::sin(a)));
    }
  }
  mesh.positions.push_back(centre + DVec3(0.0, radius, 0.0));
  const auto at = [&](int i, int j) { return static_cast<std::uint32_t>(1 + (j - 1) * around + i % around); };
  const auto top = static_cast<std::uint32_t>(mesh.positions.size() - 1);
  for (int i = 0; i < around; ++i) {
    mesh.triangles.push_back({0, at(i + 1, 1), at(i, 1)});
    mesh.triangles.push_back({top, at(i, across - 1), at(i + 1, across - 1)});
    for (int j = 1; j + 1 < across; ++j) add_quad(mesh, at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
  }
  return mesh;
}

inline std::array<DVec3, 3> corners(const TriangleMesh& mesh, std::size_t i) {
  const auto& t = mesh.triangles[i];
  return {mesh.positions[t[0]], mesh.positions[t[1]], mesh.positions[t[2]]};
}

/// The generalised winding number, exactly: the sum of the triangles' solid angles.
/// Source: A. Van Oosterom, J. Strackee, "The Solid Angle of a Plane Triangle" (1983).
inline double winding_number(const TriangleMesh& mesh, DVec3 p) {
  double sum = 0.0;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    auto [a, b, c] = corners(mesh, i);
    a -= p;
    b -= p;
    c -= p;
    const double la = glm::length(a), lb = glm::length(b), lc = glm::length(c);
    const double above = glm::dot(a, glm::cross(b, c));
    const double below = la * lb * lc + glm::dot(a, b) * lc + glm::dot(b, c) * la + glm::dot(c, a) * lb;
    sum += 2.0 * std::atan2(above, below);
  }
  return sum / (4.0 * std::numbers::pi);
}

/// Returns true if a triangle meets a closed box: none of thirteen axes separates them.
/// Source: T. Akenine-Moller, "Fast 3D Triangle-Box Overlap Testing" (2001).
inline bool meets_box(const std::array<DVec3, 3>& triangle, DVec3 centre, double half) {
  std::array<DVec3, 3> v = triangle;
  for (DVec3& corner : v) corner -= centre;
  const std::array<DVec3, 3> edges = {v[1] - v[0], v[2] - v[1], v[0] - v[2]};
  const auto separates = [&](DVec3 axis) {
    const double reach = half * (std::abs(axis.x) + std::abs(axis.y) + std::abs(axis.z));
    const auto [low, high] = std::minmax({glm::dot(axis, v[0]), glm::dot(axis, v[1]), glm::dot(axis, v[2])});
    return low > reach || high < -reach;
  };
  if (separates(glm::cross(edges[0], edges[1]))) return false;
  for (int axis = 0; axis < 3; ++axis) {
    DVec3 unit(0.0);
    unit[axis] = 1.0;
    if (separates(unit)) return false;
    for (const DVec3& edge : edges) {
      if (separates(glm::cross(unit, edge))) return false;
    }
  }
  return true;
}

/// Returns true if a triangle meets the segment from `from` to `to`, by signed volumes.
inline bool meets_segment(const std::array<DVec3, 3>& t, DVec3 from, DVec3 to) {
  const auto volume = [](DVec3 a, DVec3 b, DVec3 c, DVec3 d) { return glm::dot(glm::cross(b - a, c - a), d - a); };
  if ((volume(t[0], t[1], t[2], from) > 0.0) == (volume(t[0], t[1], t[2], to) > 0.0)) return false;
  const bool first = volume(from, to, t[0], t[1]) > 0.0;
  return first == (volume(from, to, t[1], t[2]) > 0.0) && first == (volume(from, to, t[2], t[0]) > 0.0);
}

inline double distance_to_segment(DVec3 p, DVec3 a, DVec3 b) {
  const double length = glm::dot(b - a, b - a);
  const double share = length > 0.0 ? std::clamp(glm::dot(p - a, b - a) / length, 0.0, 1.0) : 0.0;
  return glm::length(p - a - share * (b - a));
}

inline double distance_to_triangle(const std::array<DVec3, 3>& t, DVec3 p) {
  const DVec3 normal = glm::cross(t[1] - t[0], t[2] - t[0]);
  bool is_inside = glm::length(normal) > 0.0;
  for (std::size_t i = 0; i < 3; ++i) {
    is_inside &= glm::dot(glm::cross(normal, t[(i + 1) % 3] - t[i]), p - t[i]) >= 0.0;
  }
  if (is_inside) return std::abs(glm::dot(glm::normalize(normal), p - t[0]));
  return std::min(
      {distance_to_segment(p, t[0], t[1]), distance_to_segment(p, t[1], t[2]), distance_to_segment(p, t[2], t[0])});
}

inline double distance_to_mesh(const TriangleMesh& mesh, DVec3 p) {
  double least = 1e30;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    least = std::min(least, distance_to_triangle(corners(mesh, i), p));
  }
  return least;
}

inline Voxels voxels_of(const Grid& grid) {
  Voxels all;
  grid.for_each([&](IVec3 v, VoxelType) { all.insert({v.z, v.y, v.x}); });
  return all;
}

/// Returns the voxels that satisfy `is` in a box grown by two on each side.
template <class Is>
Voxels voxels_where(const DBox& bounds, const Is& is) {
  const IVec3 low = voxel_of(bounds.min) - 2;
  const IVec3 high = voxel_of(bounds.max) + 2;
  Voxels all;
  for (int z = low.z; z <= high.z; ++z) {
    for (int y = low.y; y <= high.y; ++y) {
      for (int x = low.x; x <= high.x; ++x) {
        if (is(IVec3(x, y, z))) all.insert({z, y, x});
      }
    }
  }
  return all;
}

inline Voxels solid_by_winding(const TriangleMesh& mesh) {
  return voxels_where(mesh.bounds(), [&](IVec3 v) { return std::abs(winding_number(mesh, DVec3(v) + 0.5)) > 0.5; });
}

inline Voxels surface_by_boxes(const TriangleMesh& mesh) {
  return voxels_where(mesh.bounds(), [&](IVec3 v) {
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
      if (meets_box(corners(mesh, i), DVec3(v) + 0.5, 0.5)) return true;
    }
    return false;
  });
}

inline Voxels surface_by_lines(const TriangleMesh& mesh) {
  return voxels_where(mesh.bounds(), [&](IVec3 v) {
    const DVec3 centre = DVec3(v) + 0.5;
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
      for (int axis = 0; axis < 3; ++axis) {
        DVec3 half(0.0);
        half[axis] = 0.5;
        if (meets_segment(corners(mesh, i), centre - half, centre + half)) return true;
      }
    }
    return false;
  });
}

}  // namespace quoin::shapes
