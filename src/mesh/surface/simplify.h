#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <quoin/core/result.h>
#include <quoin/core/vec.h>
#include <quoin/mesh/smooth_mesh.h>

namespace quoin {

/// A bounding volume hierarchy of triangles, for distances of points.
///
/// Lifetime: the arrays must outlive it. Threads: concurrent queries are safe.
class TriangleTree {
 public:
  /// `indices`: three per triangle.
  TriangleTree(std::span<const Vec3> positions, std::span<const std::uint32_t> indices);

  /// Returns the distance of a point from the nearest triangle, or `most` if no triangle is nearer.
  [[nodiscard]] float distance(Vec3 point, float most) const;

 private:
  struct Node {
    Vec3 min;
    Vec3 max;
    std::uint32_t first;  // leaf: its first triangle in `order_`; otherwise the first of its two children
    std::uint32_t count;  // leaf: its number of triangles; otherwise 0
  };
  struct Item {
    Vec3 min;
    Vec3 max;
    std::uint32_t triangle;
  };

  void build(std::size_t node, std::span<Item> items, std::size_t first);
  [[nodiscard]] float squared_distance(Vec3 point, std::uint32_t triangle) const;

  std::span<const Vec3> positions_;
  std::span<const std::uint32_t> indices_;
  std::vector<std::uint32_t> order_;
  std::vector<Node> nodes_;
};

/// The triangles of a mesh, and the position of each vertex.
struct Triangulation {
  std::vector<Vec3> positions;
  std::vector<std::uint32_t> indices;  ///< three a triangle
  std::vector<std::uint32_t> corners;  ///< one per index: a value that stays with the corner
};

/// Gives every edge of a closed mesh one triangle on each side. Removes pairs of triangles that are back to back. A
/// vertex with several rings of triangles becomes one vertex per ring. These vertices move by `apart` (a length), each
/// towards its own ring, so that welding vertices by position does not join them again.
///
/// Triangles that form no ring (the mesh is open there) stay together. Cost: O(triangles), more if many triangles share
/// a vertex.
void make_manifold(Triangulation& mesh, float distance);

}  // namespace quoin
