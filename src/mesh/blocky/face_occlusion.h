#pragma once

#include <quoin/core/direction.h>
#include <quoin/core/vec.h>
#include <quoin/grid/chunk.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/mesh/occlusion.h>

namespace quoin {

/// Returns the occlusion of the four corners of a face of `voxel` (coordinates in the centre chunk). Only opaque voxels
/// are occluders: glass and water do not darken.
///
/// Cost: 12 voxel look-ups; meshers do 64 faces at once instead.
[[nodiscard]] FaceOcclusion face_occlusion(const Neighbourhood& chunks, const VoxelRegistry& types, IVec3 voxel,
                                           Direction direction);

}  // namespace quoin
