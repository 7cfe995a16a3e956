#pragma once

#include <glm/common.hpp>

#include <quoin/core/direction.h>
#include <quoin/core/vec.h>

namespace quoin {

/// Where a ray meets a face, in the grid: `position`, which is there but for rounding, put onto the face.
[[nodiscard]] inline DVec3 on_face(DVec3 position, IVec3 voxel, Direction face) {
  // Secondary rays start at least this far inside the face that was hit, in voxels, so that they start in front of it
  // whatever the rounding.
  constexpr double kRim = 1e-6;
  const FaceFrame& frame = frame_of(face);
  const DVec3 low(voxel);
  DVec3 point = glm::clamp(position, low + kRim, low + (1.0 - kRim));
  point[frame.axis] = low[frame.axis] + (frame.sign > 0 ? 1.0 : 0.0);
  return point;
}

}  // namespace quoin
