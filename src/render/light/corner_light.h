#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

#include <quoin/core/direction.h>
#include <quoin/grid/grid.h>
#include <quoin/mesh/occlusion.h>

namespace quoin {

/// Returns the occlusion of a face's corners from a predicate for voxels that occlude. Cost: 8 calls.
template <class Occludes>
[[nodiscard]] FaceOcclusion corner_occlusion(Occludes&& occludes, IVec3 voxel, Direction face) {
  const FaceFrame& frame = frame_of(face);
  const IVec3 front = voxel + normal_of(face);
  std::array<std::array<bool, 3>, 3> is_occluder{};
  for (int dv = -1; dv <= 1; ++dv) {
    for (int du = -1; du <= 1; ++du) {
      if (du == 0 && dv == 0) continue;
      IVec3 at = front;
      at[frame.u] += du;
      at[frame.v] += dv;
      is_occluder[static_cast<std::size_t>(dv + 1)][static_cast<std::size_t>(du + 1)] = occludes(at);
    }
  }
  const auto occlusion = [&](std::size_t u, std::size_t v) {
    return vertex_occlusion(is_occluder[1][u], is_occluder[v][1], is_occluder[v][u]);
  };
  return {occlusion(0, 0), occlusion(2, 0), occlusion(2, 2), occlusion(0, 2)};
}

/// The occlusion of the four corners that a blocky mesh carries for a face. Cost: 8 voxel look-ups.
[[nodiscard]] inline FaceOcclusion corner_occlusion(GridReader& grid, const VoxelRegistry& types, IVec3 voxel,
                                                    Direction face) {
  return corner_occlusion([&](IVec3 at) { return types.occludes(grid.get(at)); }, voxel, face);
}

/// A quad's corner occlusion at (u, v), both 0 to 1, over the triangles that `flips_diagonal` chooses.
[[nodiscard]] inline float interpolated_occlusion(const FaceOcclusion& corners, float u, float v) {
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

/// The occlusion at a point of a face, 0 to 3, interpolated over the mesh's two triangles.
///
/// `position`: in the grid, on the face.
[[nodiscard]] inline float occlusion_at(const FaceOcclusion& corners, IVec3 voxel, Direction face, DVec3 position) {
  const FaceFrame& frame = frame_of(face);
  const auto within = [&](int axis) { return static_cast<float>(std::clamp(position[axis] - voxel[axis], 0.0, 1.0)); };
  return interpolated_occlusion(corners, within(frame.u), within(frame.v));
}

}  // namespace quoin
