#pragma once

#include "voxelize/crossings.h"

namespace quoin::voxelizing {

/// The part of a chunk within a mesh.
enum class Filled : std::uint8_t { None, All, Some };

/// Memory that a thread reuses.
struct InsideScratch {
  std::vector<std::int16_t> votes;  ///< of every voxel, x fastest
};

/// The minimum and maximum votes of the lines along an axis in a chunk.
struct VoteRange {
  std::int16_t least = 0;
  std::int16_t most = 0;
};

/// Finds the voxels within a mesh.
///
/// Votes: with Winding, each of the six axis rays from a centre counts its exits from the mesh minus its entries; the
/// sum is six times the winding number. With Parity, each ray votes if it has an odd number of crossings. The minimum
/// and maximum votes of the lines of all axes decide most chunks, also in open meshes: `find` tests single voxels only
/// in the other chunks.
class Inside {
 public:
  /// Requires: `rule` is not None; `crossings` outlives it.
  Inside(const Crossings& crossings, SolidVoxels rule, Threads threads);

  /// Finds the voxels of a chunk whose centre is solid; sets `bits` only if it returns Some.
  [[nodiscard]] Filled find(IVec3 chunk, InsideScratch& scratch, ChunkBits& bits) const;

 private:
  const Crossings* crossings_;
  SolidVoxels rule_;
  std::array<std::vector<VoteRange>, 3> ranges_;  // of an axis: chunks along it, column after column
};

}  // namespace quoin::voxelizing
