#pragma once

#include <cmath>

#include <glm/mat3x3.hpp>

#include <quoin/scene/scene.h>

namespace quoin {

/// Normalises a quaternion of any length.
[[nodiscard]] DQuat made_unit(const DQuat& q);

/// Returns the rotation of a quaternion of any length: the quaternion itself if it is of unit length up to rounding,
/// the identity if it is zero. Non-finite quaternions stay non-finite.
[[nodiscard]] inline DQuat unit_rotation(const DQuat& q) {
  // Within this error, normalising would change only the last bits.
  constexpr double kRounding = 1e-12;
  if (std::abs(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w - 1.0) < kRounding) return q;
  return made_unit(q);
}

/// The grid's axes in the world, as columns: the rotation after the mirror, without the voxels' size. Exact for quarter
/// turns, whose quaternions hold the irrational square root of one half.
[[nodiscard]] glm::dmat3 world_axes(const Instance& instance);

}  // namespace quoin
