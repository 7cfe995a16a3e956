#pragma once

#include <quoin/core/function_ref.h>

#include "voxelize/frame.h"

namespace quoin::voxelizing {

inline constexpr std::int32_t kNoTriangle = -1;

/// Of every voxel of a chunk, x fastest: the triangle that is nearest to its centre, and how near. A thread uses it
/// again.
struct Nearest {
  std::vector<float> squared;           ///< of the distance in voxels; `reach` squared where there is none
  std::vector<std::int32_t> triangles;  ///< kNoTriangle where none is within reach
};

/// Which centres are asked.
struct Wanted {
  const ChunkBits* voxels = nullptr;  ///< null: all
  float reach = 0.0F;                 ///< what is as far or farther is none
};

/// The point of a triangle that is nearest to another, as shares of its corners.
///
/// Source: C. Ericson, "Real-Time Collision Detection" (2005), 5.1.5: the regions of the plane.
[[nodiscard]] DVec3 nearest_shares(const Corners& corners, DVec3 point);

/// Finds the nearest triangles. Of several as near it is the first.
///
/// `has_surface`: asked where a triangle of which `may_have_holes` says so would be the nearest: whether it has a
///                surface there. Space of `corners`: the frame.
/// Precision: single, relative to the chunk.
/// Cost: about 2 ns a triangle and voxel of its box, grown by the reach.
struct Holes {
  FunctionRef<bool(std::uint32_t triangle)> may_have_holes;
  FunctionRef<bool(std::uint32_t triangle, DVec3 shares)> has_surface;
};
void find_nearest(const Frame& frame, IVec3 chunk, std::span<const std::uint32_t> triangles, const Wanted& wanted,
                  const Holes& holes, Nearest& nearest);

}  // namespace quoin::voxelizing
