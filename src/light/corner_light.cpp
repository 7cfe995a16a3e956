#include "light/corner_light.h"

#include <algorithm>

namespace quoin {

float interpolated_occlusion(const FaceOcclusion& corners, float u, float v) {
  const auto at = [&](std::size_t corner) { return static_cast<float>(corners[corner]); };
  if (!flips_diagonal(corners)) {
    // (0,1,2), below the diagonal from corner 0 to 2, and (0,2,3).
    if (u >= v) return at(0) + u * (at(1) - at(0)) + v * (at(2) - at(1));
    return at(0) + v * (at(3) - at(0)) + u * (at(2) - at(3));
  }
  // (0,1,3), on corner 0's side of the diagonal from 1 to 3, and (1,2,3).
  if (u + v <= 1.0F) return at(0) + u * (at(1) - at(0)) + v * (at(3) - at(0));
  return at(2) + (1.0F - u) * (at(3) - at(2)) + (1.0F - v) * (at(1) - at(2));
}

FaceOcclusion corner_occlusion(GridReader& grid, const VoxelRegistry& types, IVec3 voxel, Direction face) {
  return corner_occlusion([&](IVec3 at) { return types.is_opaque(grid.get(at)); }, voxel, face);
}

float occlusion_at(const FaceOcclusion& corners, IVec3 voxel, Direction face, DVec3 position) {
  const FaceFrame& frame = frame_of(face);
  const auto within = [&](int axis) { return static_cast<float>(std::clamp(position[axis] - voxel[axis], 0.0, 1.0)); };
  return interpolated_occlusion(corners, within(frame.u), within(frame.v));
}

}  // namespace quoin
