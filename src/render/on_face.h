#pragma once

#include <algorithm>

#include <quoin/core/direction.h>
#include <quoin/core/vec.h>

namespace quoin {

/// Returns a ray's hit on a face, in the grid: `position`, which is exact except for rounding, moved onto the face.
[[nodiscard]] inline DVec3 on_face(DVec3 position, IVec3 voxel, Direction face) {
  // Secondary rays start at least this far inside the face that was hit, in voxels, so that they start in front of it
  // despite rounding.
  constexpr double kRim = 1e-6;
  const FaceFrame& frame = frame_of(face);
  const double front = frame.sign > 0 ? 1.0 : 0.0;
  // Selects instead of indexing with a late-known axis: an indexed write would stall the following read.
  const auto along = [&](int axis, double at, int cell) {
    const auto low = static_cast<double>(cell);
    return axis == frame.axis ? low + front : std::clamp(at, low + kRim, low + (1.0 - kRim));
  };
  return {along(0, position.x, voxel.x), along(1, position.y, voxel.y), along(2, position.z, voxel.z)};
}

}  // namespace quoin
