#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include <quoin/core/vec.h>

namespace quoin {

/// The six face directions; the value is also the bit in a visible-face mask.
enum class Direction : std::uint8_t { PosX = 0, NegX = 1, PosY = 2, NegY = 3, PosZ = 4, NegZ = 5 };

inline constexpr std::array<Direction, 6> kDirections = {Direction::PosX, Direction::NegX, Direction::PosY,
                                                         Direction::NegY, Direction::PosZ, Direction::NegZ};

/// How a face lies in space: its axis, its sign, and the two axes along its edges.
///
/// u x v points along the outward normal, so the corners (0,0) (1,0) (1,1) (0,1) in (u,v) run counter-clockwise as
/// seen from outside.
struct FaceFrame {
  std::uint8_t axis;  ///< 0 x, 1 y, 2 z
  std::int8_t sign;   ///< +1 or -1
  std::uint8_t u;     ///< axis of the first edge
  std::uint8_t v;     ///< axis of the second edge
};

inline constexpr std::array<FaceFrame, 6> kFaceFrames = {FaceFrame{0, +1, 1, 2}, FaceFrame{0, -1, 2, 1},
                                                         FaceFrame{1, +1, 2, 0}, FaceFrame{1, -1, 0, 2},
                                                         FaceFrame{2, +1, 0, 1}, FaceFrame{2, -1, 1, 0}};

/// The frame of a direction's faces.
[[nodiscard]] constexpr const FaceFrame& frame_of(Direction d) {
  return kFaceFrames[static_cast<std::size_t>(d)];
}

/// Unit vector of a direction.
[[nodiscard]] inline IVec3 normal_of(Direction d) {
  IVec3 n{0};
  n[frame_of(d).axis] = frame_of(d).sign;
  return n;
}

/// The direction along which a vector points most; of equal ones x before y before z. PosX for a vector of 0.
[[nodiscard]] inline Direction nearest_direction(const DVec3& vector) {
  int axis = 0;
  for (int other = 1; other < 3; ++other) {
    if (std::abs(vector[other]) > std::abs(vector[axis])) axis = other;
  }
  return static_cast<Direction>(2 * axis + (vector[axis] < 0.0 ? 1 : 0));
}

}  // namespace quoin
