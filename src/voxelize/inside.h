#pragma once

#include "voxelize/crossings.h"

namespace quoin::voxelizing {

/// What of a chunk is within a mesh.
enum class Filled : std::uint8_t { None, All, Some };

/// Room that a thread uses again.
struct InsideScratch {
  std::vector<std::int16_t> votes;  ///< of every voxel, x fastest
};

/// Finds the voxels of a chunk whose centre is solid by `rule`; `bits` is set where that is some of them only.
///
/// Votes: by Winding each of the six rays from a centre along the axes says how often more it leaves the mesh than it
///        enters it; their sum is six times the winding number. By Parity each says whether it meets an odd number.
/// Requires: `rule` is not None.
[[nodiscard]] Filled find_inside(const Crossings& crossings, IVec3 chunk, SolidVoxels rule, InsideScratch& scratch,
                                 ChunkBits& bits);

}  // namespace quoin::voxelizing
