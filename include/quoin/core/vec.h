#pragma once

#include <algorithm>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>

#include <glm/gtc/quaternion.hpp>
#include <glm/vec3.hpp>

// glm is part of Quoin's interface: whoever includes it with other settings would hand over other bytes.
#if defined(GLM_FORCE_QUAT_DATA_WXYZ) || defined(GLM_FORCE_QUAT_CTOR_XYZW)
#error "Quoin needs glm's quaternions as they are by default: stored as x, y, z, w and made of (w, x, y, z)"
#endif

namespace quoin {

/// Integer voxel or chunk coordinates.
using IVec3 = glm::ivec3;
/// Mesh vertices: float, relative to a grid or a chunk.
using Vec3 = glm::vec3;
/// World positions: double.
using DVec3 = glm::dvec3;
/// Rotations. Constructor order is glm's: (w, x, y, z).
using DQuat = glm::dquat;

static_assert(sizeof(IVec3) == 12 && sizeof(Vec3) == 12 && sizeof(DVec3) == 24 && alignof(DVec3) == alignof(double) &&
                  sizeof(DQuat) == 32 && alignof(DQuat) == alignof(double),
              "Quoin needs glm's types packed, without GLM_FORCE_DEFAULT_ALIGNED_GENTYPES");

/// A point, which is no voxel. Functions of a voxel or chunk refuse it, and `voxel_of` says in which voxel it lies. The
/// members of IBox and PlacedVoxel cannot refuse it: see `box_around`.
template <std::floating_point T>
using Point = glm::vec<3, T, glm::defaultp>;

/// The voxel in which a point of a grid lies; of a point between two the greater one, along each axis. What is beyond
/// the int32 range counts as its end, NaN as 0.
[[nodiscard]] inline IVec3 voxel_of(DVec3 point) {
  const auto whole = [](double x) {
    constexpr double kLeast = std::numeric_limits<int>::min();
    constexpr double kGreatest = std::numeric_limits<int>::max();
    return std::isnan(x) ? 0 : static_cast<int>(std::clamp(std::floor(x), kLeast, kGreatest));
  };
  return {whole(point.x), whole(point.y), whole(point.z)};
}

/// Neither infinite nor NaN in any component.
[[nodiscard]] inline bool is_finite(DVec3 v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

/// A box of whole voxels (or chunks): `min` inclusive, `max` exclusive.
///
/// Empty when any component of `max` is not greater than that of `min`; the default box is empty.
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

/// Orders coordinates by z, then y, then x, as chunks are listed: for std::map and std::sort.
struct ByZyx {
  [[nodiscard]] constexpr bool operator()(IVec3 a, IVec3 b) const {
    if (a.z != b.z) return a.z < b.z;
    return a.y != b.y ? a.y < b.y : a.x < b.x;
  }
};

/// Spreads integer coordinates (of voxels, of chunks) over a hash table: for std::unordered_map.
struct CoordinateHash {
  [[nodiscard]] std::size_t operator()(IVec3 c) const {
    std::uint64_t h = 0;
    for (int axis = 0; axis < 3; ++axis) {
      h = (h ^ static_cast<std::uint32_t>(c[axis])) * 0x9E37'79B9'7F4A'7C15U;
    }
    return static_cast<std::size_t>(h ^ (h >> 32));
  }
};

/// The smallest box that contains both; an empty box adds nothing.
[[nodiscard]] inline IBox unite(const IBox& a, const IBox& b) {
  if (a.empty()) return b;
  if (b.empty()) return a;
  return {glm::min(a.min, b.min), glm::max(a.max, b.max)};
}

/// The box that both cover; empty when they do not meet.
[[nodiscard]] inline IBox intersect(const IBox& a, const IBox& b) {
  return {glm::max(a.min, b.min), glm::min(a.max, b.max)};
}

/// A box in double precision, both ends inclusive. The default box is empty (min > max).
struct DBox {
  DVec3 min{std::numeric_limits<double>::infinity()};
  DVec3 max{-std::numeric_limits<double>::infinity()};

  [[nodiscard]] bool empty() const { return !(min.x <= max.x && min.y <= max.y && min.z <= max.z); }
  /// Grows to hold a point.
  void extend(DVec3 p) {
    min = glm::min(min, p);
    max = glm::max(max, p);
  }
};

/// The voxels that a box of a grid's space meets, but in a face, edge or corner alone; a box without a volume has those
/// in which its points lie. Empty of an empty one, and of one beyond the int32 range.
[[nodiscard]] inline IBox box_around(const DBox& box) {
  if (box.empty()) return {};
  const IVec3 min = voxel_of(box.min);
  return {min, glm::max(voxel_of(glm::ceil(box.max)), voxel_of(DVec3(min) + 1.0))};
}

/// Corner 0 to 7 of a box: at its greater x, y and z where bit 0, 1 and 2 of `index` are set.
[[nodiscard]] inline DVec3 box_corner(const DBox& box, int index) {
  return {((index & 1) != 0 ? box.max : box.min).x, ((index & 2) != 0 ? box.max : box.min).y,
          ((index & 4) != 0 ? box.max : box.min).z};
}
[[nodiscard]] inline DVec3 box_corner(const IBox& box, int index) {
  return box_corner(DBox{DVec3(box.min), DVec3(box.max)}, index);
}

}  // namespace quoin
