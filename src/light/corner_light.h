#pragma once

#include <array>
#include <cstddef>

#include <quoin/core/direction.h>
#include <quoin/grid/grid.h>
#include <quoin/mesh/occlusion.h>

namespace quoin {

/// The four corner levels that a blocky mesh carries for a face. Cost: 8 voxel look-ups.
[[nodiscard]] FaceOcclusion corner_levels(GridReader& grid, const VoxelRegistry& types, IVec3 voxel, Direction face);

/// The same of whatever says which voxels are opaque. Cost: 8 questions.
template <class IsOpaque>
[[nodiscard]] FaceOcclusion corner_levels(IsOpaque&& is_opaque, IVec3 voxel, Direction face) {
  const FaceFrame& frame = frame_of(face);
  const IVec3 front = voxel + normal_of(face);
  std::array<std::array<bool, 3>, 3> is_occluder{};
  for (int dv = -1; dv <= 1; ++dv) {
    for (int du = -1; du <= 1; ++du) {
      if (du == 0 && dv == 0) continue;
      IVec3 at = front;
      at[frame.u] += du;
      at[frame.v] += dv;
      is_occluder[static_cast<std::size_t>(dv + 1)][static_cast<std::size_t>(du + 1)] = is_opaque(at);
    }
  }
  const auto level = [&](std::size_t u, std::size_t v) {
    return vertex_occlusion(is_occluder[1][u], is_occluder[v][1], is_occluder[v][u]);
  };
  return {level(0, 0), level(2, 0), level(2, 2), level(0, 2)};
}

/// The occlusion level at a point of a face, 0 to 3, interpolated over the mesh's two triangles.
///
/// `position`: in the grid, on the face.
[[nodiscard]] float level_at(const FaceOcclusion& levels, IVec3 voxel, Direction face, DVec3 position);

/// A quad's corner levels at (u, v), both 0 to 1, over the triangles that `flips_diagonal` chooses.
[[nodiscard]] float interpolated_level(const FaceOcclusion& levels, float u, float v);

}  // namespace quoin
