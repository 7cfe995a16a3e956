#pragma once

#include <quoin/core/direction.h>
#include <quoin/grid/grid.h>
#include <quoin/mesh/occlusion.h>

namespace quoin {

/// The occlusion level at a point of a face, 0 to 3: the four corner levels that a blocky mesh carries there,
/// interpolated over the same two triangles.
///
/// `position`: in the grid, on the face. Cost: 8 voxel look-ups.
[[nodiscard]] float corner_level(GridReader& grid, const VoxelRegistry& types, IVec3 voxel, Direction face,
                                 DVec3 position);

/// A quad's corner levels at (u, v), both 0 to 1, over the triangles that `flips_diagonal` chooses.
[[nodiscard]] float interpolated_level(const FaceLevels& levels, float u, float v);

}  // namespace quoin
