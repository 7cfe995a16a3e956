#pragma once

#include <cmath>

#include <glm/mat3x3.hpp>

#include <quoin/scene/scene.h>

namespace quoin {

/// As `unit_rotation`, whatever its length.
[[nodiscard]] DQuat made_unit(const DQuat& q);

/// The rotation that a quaternion of any length stands for: itself when it is of unit length but for rounding, none for
/// a zero one. What is not finite stays so.
[[nodiscard]] inline DQuat unit_rotation(const DQuat& q) {
  // What is no longer than this says the same, but for the last bits.
  constexpr double kRounding = 1e-12;
  if (std::abs(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w - 1.0) < kRounding) return q;
  return made_unit(q);
}

/// The grid's axes in the world, as columns: the rotation after the mirror, without the voxels' size. Exact for quarter
/// turns, whose quaternions hold the irrational square root of one half.
[[nodiscard]] glm::dmat3 world_axes(const Instance& instance);

}  // namespace quoin
