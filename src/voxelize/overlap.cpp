#include "voxelize/overlap.h"

#include <algorithm>
#include <cmath>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace quoin::voxelizing {

namespace {

/// The half plane on the inner side of an edge in a projection, grown by a unit square: a square with the lowest corner
/// (a, b) meets it if a * slope_a + b * slope_b + offset >= 0.
struct HalfPlane {
  double slope_a = 0.0;
  double slope_b = 0.0;
  double offset = 0.0;

  [[nodiscard]] double at(double a, double b) const { return slope_a * a + slope_b * b + offset; }
};

/// `turn`: 1 if the projection is counter-clockwise, otherwise -1.
HalfPlane inner_side(double from_a, double from_b, double to_a, double to_b, double turn) {
  HalfPlane side;
  side.slope_a = -(to_b - from_b) * turn;
  side.slope_b = (to_a - from_a) * turn;
  side.offset =
      -(side.slope_a * from_a + side.slope_b * from_b) + std::max(side.slope_a, 0.0) + std::max(side.slope_b, 0.0);
  return side;
}

/// The precomputed data for testing a triangle.
struct Triangle {
  DVec3 normal{0.0};
  double nearer = 0.0;                            // plane offset for the cube's farthest corner along the normal
  double farther = 0.0;                           // and for the opposite corner
  std::array<std::array<HalfPlane, 3>, 3> sides;  // of the projections along each axis

  explicit Triangle(const Corners& corners) {
    normal = glm::cross(corners[1] - corners[0], corners[2] - corners[0]);
    const DVec3 far_corner(normal.x > 0.0 ? 1.0 : 0.0, normal.y > 0.0 ? 1.0 : 0.0, normal.z > 0.0 ? 1.0 : 0.0);
    nearer = glm::dot(normal, far_corner - corners[0]);
    farther = glm::dot(normal, DVec3(1.0) - far_corner - corners[0]);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto a = static_cast<int>((axis + 1) % 3);
      const auto b = static_cast<int>((axis + 2) % 3);
      const double turn = normal[static_cast<int>(axis)] < 0.0 ? -1.0 : 1.0;
      for (std::size_t i = 0; i < 3; ++i) {
        const DVec3& from = corners[i];
        const DVec3& to = corners[i == 2 ? 0 : i + 1];
        sides[axis][i] = inner_side(from[a], from[b], to[a], to[b], turn);
      }
    }
  }
  [[nodiscard]] bool overlaps(std::size_t axis, double a, double b) const {
    const auto& s = sides[axis];
    return s[0].at(a, b) >= 0.0 && s[1].at(a, b) >= 0.0 && s[2].at(a, b) >= 0.0;
  }
  [[nodiscard]] bool meets_plane(const DVec3& cube) const {
    const double along = glm::dot(normal, cube);
    return (along + nearer) * (along + farther) <= 0.0;
  }
};

}  // namespace

void mark_overlapping(const Corners& corners, IVec3 chunk, ChunkBits& bits) {
  // In chunk coordinates, without a relevant loss of precision: corners lie at most 2^14 chunks away.
  const DVec3 origin = DVec3(chunk) * static_cast<double>(kChunkEdge);
  const Corners local = {corners[0] - origin, corners[1] - origin, corners[2] - origin};
  const DVec3 low = glm::min(glm::min(local[0], local[1]), local[2]);
  const DVec3 high = glm::max(glm::max(local[0], local[1]), local[2]);
  // The cube [i, i + 1] is closed: it also meets triangles that touch its sides.
  const IVec3 first = glm::max(voxel_of(glm::ceil(low) - 1.0), IVec3(0));
  const IVec3 end = glm::min(voxel_of(high) + 1, IVec3(kChunkEdge));
  if (IBox{first, end}.empty()) return;
  const Triangle triangle(local);
  for (int z = first.z; z < end.z; ++z) {
    for (int y = first.y; y < end.y; ++y) {
      if (!triangle.overlaps(0, y, z)) continue;
      std::uint64_t row = 0;
      for (int x = first.x; x < end.x; ++x) {
        const bool meets =
            triangle.meets_plane(DVec3(x, y, z)) && triangle.overlaps(1, z, x) && triangle.overlaps(2, x, y);
        row |= std::uint64_t{meets} << static_cast<unsigned>(x);
      }
      bits[row_of(y, z)] |= row;
    }
  }
}

}  // namespace quoin::voxelizing
