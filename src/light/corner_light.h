#pragma once

#include <quoin/core/direction.h>
#include <quoin/grid/grid.h>
#include <quoin/mesh/occlusion.h>

namespace quoin {

/// The four corner levels that a blocky mesh carries for a face. Cost: 8 voxel look-ups.
[[nodiscard]] FaceLevels corner_levels(GridReader& grid, const VoxelRegistry& types, IVec3 voxel, Direction face);

/// The occlusion level at a point of a face, 0 to 3, interpolated over the mesh's two triangles.
///
/// `position`: in the grid, on the face.
[[nodiscard]] float level_at(const FaceLevels& levels, IVec3 voxel, Direction face, DVec3 position);

/// A quad's corner levels at (u, v), both 0 to 1, over the triangles that `flips_diagonal` chooses.
[[nodiscard]] float interpolated_level(const FaceLevels& levels, float u, float v);

}  // namespace quoin
