#pragma once

#include <algorithm>
#include <cmath>

#include <quoin/core/vec.h>

namespace quoin {

/// Returns the rotation of a quaternion of any length: the quaternion itself if it is of unit length up to rounding,
/// the identity if it is zero. Non-finite quaternions stay non-finite.
[[nodiscard]] inline DQuat unit_rotation(const DQuat& q) {
  // Within this error, normalising would change only the last bits.
  constexpr double kRounding = 1e-12;
  if (std::abs(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w - 1.0) < kRounding) return q;
  if (q.x == 0.0 && q.y == 0.0 && q.z == 0.0 && q.w == 0.0) return {1.0, 0.0, 0.0, 0.0};
  // Scaled first: the square of a very small or large number is 0 or infinite.
  const double largest = std::max({std::abs(q.x), std::abs(q.y), std::abs(q.z), std::abs(q.w)});
  const DQuat scaled = q / largest;
  return scaled / std::sqrt(glm::dot(scaled, scaled));
}

}  // namespace quoin
