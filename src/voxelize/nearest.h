#pragma once

#include <quoin/core/function_ref.h>

#include "voxelize/voxel_frame.h"

namespace quoin::voxelizing {

inline constexpr std::int32_t kNoTriangle = -1;

/// The nearest triangle and its distance for each voxel centre of a chunk, x fastest. Reused by its thread.
struct Nearest {
  std::vector<float> squared;           ///< squared distances in voxels; `reach` squared without a triangle
  std::vector<std::int32_t> triangles;  ///< kNoTriangle if none is within reach
};

/// The centres to query.
struct Wanted {
  const ChunkBits* voxels = nullptr;  ///< null: all
  float reach = 0.0F;                 ///< triangles at this distance or beyond are ignored
};

/// Returns the nearest point of a triangle to a point, in barycentric coordinates.
///
/// Source: C. Ericson, "Real-Time Collision Detection" (2005), 5.1.5: the regions of the plane.
[[nodiscard]] DVec3 nearest_shares(const Corners& corners, DVec3 point);

/// Finds the nearest triangles. At ties the first wins.
///
/// `has_surface`: called if the nearest triangle may have holes; returns true if it has a surface there.
/// Space of `corners`: the frame.
/// Precision: single, relative to the chunk.
/// Cost: about 2 ns per triangle and voxel of its box, grown by the reach.
struct Holes {
  FunctionRef<bool(std::uint32_t triangle)> may_have_holes;
  FunctionRef<bool(std::uint32_t triangle, DVec3 shares)> has_surface;
};
void find_nearest(const Frame& frame, IVec3 chunk, std::span<const std::uint32_t> triangles, const Wanted& wanted,
                  const Holes& holes, Nearest& nearest);

}  // namespace quoin::voxelizing
