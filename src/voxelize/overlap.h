#pragma once

#include "voxelize/frame.h"

namespace quoin::voxelizing {

/// Marks the voxels of a chunk whose closed cube meets the triangle.
///
/// Source: M. Schwarz, H.-P. Seidel, "Fast Parallel Surface and Solid Voxelization on GPUs" (2010): a cube and a
///         triangle meet where the plane passes the cube and both overlap in all three projections.
void mark_overlapping(const Corners& corners, IVec3 chunk, ChunkBits& bits);

}  // namespace quoin::voxelizing
