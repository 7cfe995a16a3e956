#pragma once

#include <algorithm>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>

#include <glm/gtc/quaternion.hpp>
#include <glm/vec3.hpp>

#include <quoin/core/assert.h>

// glm types are part of Quoin's interface. Other glm settings would change their memory layout.
#if defined(GLM_FORCE_QUAT_DATA_WXYZ) || defined(GLM_FORCE_QUAT_CTOR_XYZW)
#error "Quoin needs glm's quaternions as they are by default: stored as x, y, z, w and made of (w, x, y, z)"
#endif

namespace [[gnu::visibility("default")]] quoin {

/// Integer voxel or chunk coordinates.
using IVec3 = glm::ivec3;
/// Mesh vertex positions in float, relative to a grid or a chunk.
using Vec3 = glm::vec3;
/// World positions in double.
using DVec3 = glm::dvec3;
/// Rotations. The constructor takes (w, x, y, z), as in glm.
using DQuat = glm::dquat;

static_assert(sizeof(IVec3) == 12 && sizeof(Vec3) == 12 && sizeof(DVec3) == 24 && alignof(DVec3) == alignof(double) &&
                  sizeof(DQuat) == 32 && alignof(DQuat) == alignof(double),
              "Quoin needs glm's types packed, without GLM_FORCE_DEFAULT_ALIGNED_GENTYPES");

/// A floating-point position, as opposed to a voxel. Functions that take a voxel or a chunk reject it at compile time;
/// convert it with `voxel_of`. Initialising an IBox or a PlacedVoxel does not reject it; for boxes, use `box_around`.
template <std::floating_point T>
using Point = glm::vec<3, T, glm::defaultp>;

/// Returns the voxel that contains a point in grid space. A point on the face between two voxels lies in the voxel on
/// the greater side, on each axis. Coordinates beyond the int32 range are clamped to it; NaN counts as 0.
[[nodiscard]] inline IVec3 voxel_of(DVec3 point) {
  const auto whole = [](double x) {
    constexpr double kLeast = std::numeric_limits<int>::min();
    constexpr double kGreatest = std::numeric_limits<int>::max();
    return std::isnan(x) ? 0 : static_cast<int>(std::clamp(std::floor(x), kLeast, kGreatest));
  };
  return {whole(point.x), whole(point.y), whole(point.z)};
}

/// log2 of kChunkEdge.
inline constexpr int kChunkShift = 6;
/// Number of voxels along the edge of a chunk: the width of a machine word.
inline constexpr int kChunkEdge = 1 << kChunkShift;
inline constexpr std::size_t kChunkVoxels = std::size_t{1} << (3 * kChunkShift);

/// Returns the chunk that contains a voxel; voxel -1 lies in chunk -1.
[[nodiscard]] inline IVec3 chunk_of(IVec3 voxel) {
  return {voxel.x >> kChunkShift, voxel.y >> kChunkShift, voxel.z >> kChunkShift};
}
template <std::floating_point T>
IVec3 chunk_of(Point<T> point) = delete;  // chunk_of(voxel_of(point))
/// Returns the position of a voxel inside its chunk, 0 to 63 on each axis.
[[nodiscard]] inline IVec3 local_of(IVec3 voxel) {
  return {voxel.x & (kChunkEdge - 1), voxel.y & (kChunkEdge - 1), voxel.z & (kChunkEdge - 1)};
}
template <std::floating_point T>
IVec3 local_of(Point<T> point) = delete;

/// Returns true if no component is infinite or NaN.
[[nodiscard]] inline bool is_finite(DVec3 v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

/// A box of whole voxels (or chunks): `min` inclusive, `max` exclusive.
///
/// The box is empty if any component of `max` is not greater than the same component of `min`. The default box is
/// empty.
struct IBox {
  IVec3 min{0};
  IVec3 max{0};

  [[nodiscard]] bool empty() const { return max.x <= min.x || max.y <= min.y || max.z <= min.z; }
  [[nodiscard]] IVec3 size() const { return empty() ? IVec3{0} : max - min; }
  [[nodiscard]] bool contains(IVec3 p) const {
    return p.x >= min.x && p.y >= min.y && p.z >= min.z && p.x < max.x && p.y < max.y && p.z < max.z;
  }
  bool operator==(const IBox& other) const { return min == other.min && max == other.max; }
};

/// Orders coordinates by z, then y, then x, for std::map and std::sort. Chunks are listed in this order.
struct ByZyx {
  [[nodiscard]] constexpr bool operator()(IVec3 a, IVec3 b) const {
    if (a.z != b.z) return a.z < b.z;
    return a.y != b.y ? a.y < b.y : a.x < b.x;
  }
};

/// Hashes integer coordinates (of voxels or chunks), for std::unordered_map.
struct CoordinateHash {
  [[nodiscard]] std::size_t operator()(IVec3 c) const {
    std::uint64_t h = 0;
    for (int axis = 0; axis < 3; ++axis) {
      h = (h ^ static_cast<std::uint32_t>(c[axis])) * 0x9E37'79B9'7F4A'7C15U;
    }
    return static_cast<std::size_t>(h ^ (h >> 32));
  }
};

/// Returns the smallest box that contains both boxes. An empty box adds nothing.
[[nodiscard]] inline IBox unite(const IBox& a, const IBox& b) {
  if (a.empty()) return b;
  if (b.empty()) return a;
  return {glm::min(a.min, b.min), glm::max(a.max, b.max)};
}

/// Returns the overlap of both boxes; empty if they do not overlap.
[[nodiscard]] inline IBox intersect(const IBox& a, const IBox& b) {
  return {glm::max(a.min, b.min), glm::min(a.max, b.max)};
}

/// A box in double precision, both ends inclusive. The default box is empty (min > max).
struct DBox {
  DVec3 min{std::numeric_limits<double>::infinity()};
  DVec3 max{-std::numeric_limits<double>::infinity()};

  [[nodiscard]] bool empty() const { return !(min.x <= max.x && min.y <= max.y && min.z <= max.z); }
  /// Grows the box to contain a point.
  void extend(DVec3 p) {
    min = glm::min(min, p);
    max = glm::max(max, p);
  }
};

/// Returns the voxels whose interior overlaps a box in grid space. Voxels that only touch a face, an edge or a
/// corner of the box are left out. A box without volume gives the voxels that contain its points. Returns an empty box
/// for an empty box, and for a box above the int32 range. Below the int32 range, the result is the lowest layer of
/// voxels.
[[nodiscard]] inline IBox box_around(const DBox& box) {
  if (box.empty()) return {};
  const IVec3 min = voxel_of(box.min);
  return {min, glm::max(voxel_of(glm::ceil(box.max)), voxel_of(DVec3(min) + 1.0))};
}

/// Returns corner `index` (0 to 7) of a box. Bits 0, 1 and 2 of `index` select the greater x, y and z.
/// Requires: 0 <= index < 8.
[[nodiscard]] inline DVec3 box_corner(const DBox& box, int index) {
  QUOIN_ASSERT(index >= 0 && index < 8, "0 <= index < 8");
  return {((index & 1) != 0 ? box.max : box.min).x, ((index & 2) != 0 ? box.max : box.min).y,
          ((index & 4) != 0 ? box.max : box.min).z};
}
[[nodiscard]] inline DVec3 box_corner(const IBox& box, int index) {
  return box_corner(DBox{DVec3(box.min), DVec3(box.max)}, index);
}

/// A box with any position and rotation, in world units.
struct OrientedBox {
  DVec3 centre{0.0};
  DVec3 half_size{0.5};                ///< 0 or more per axis; zeros give a plate, a rod or a point
  DQuat rotation{1.0, 0.0, 0.0, 0.0};  ///< world from box; need not be normalised; zero counts as no rotation
};

/// A capsule in world units: all points within `radius` of a line segment.
// The radius comes first, so that a braced initialiser fits either a box or a capsule but never both.
struct Capsule {
  double radius = 0.5;  ///< 0 or less: the capsule hits nothing
  DVec3 centre{0.0};
  DVec3 half_axis{0.0, 0.5, 0.0};  ///< from the centre to one end of the segment; zero gives a ball
};

}  // namespace quoin
