#pragma once

#include <array>
#include <cstdint>

#include <quoin/core/direction.h>
#include <quoin/grid/neighbourhood.h>
#include <quoin/grid/voxel_registry.h>

namespace quoin {

/// Occlusion of a face's four corners, each 0 (open) to 3 (dark), in the order (0,0) (1,0) (1,1) (0,1) of the
/// direction's (u, v): counter-clockwise from outside.
using FaceOcclusion = std::array<std::uint8_t, 4>;

/// Occlusion of one vertex from the three voxels that touch it in the layer in front of the face.
///
/// 3 when both sides are occluders, whatever the corner holds; else how many of the three are.
[[nodiscard]] constexpr std::uint8_t vertex_occlusion(bool side1, bool side2, bool corner) {
  if (side1 && side2) return 3;
  return static_cast<std::uint8_t>(static_cast<int>(side1) + static_cast<int>(side2) + static_cast<int>(corner));
}

/// Brightness that occlusion leaves: 1, 0.75, 0.5, 0.25.
[[nodiscard]] constexpr float occlusion_brightness(std::uint8_t occlusion) {
  return 1.0F - 0.25F * static_cast<float>(occlusion);
}

/// Occlusion of the four corners of a face of `voxel` (coordinates in the centre chunk). Occluders are opaque voxels:
/// glass and water do not darken.
///
/// Cost: 8 voxel look-ups; meshers do 64 faces at once instead.
[[nodiscard]] FaceOcclusion face_occlusion(const Neighbourhood& chunks, const VoxelRegistry& types, IVec3 voxel,
                                           Direction direction);

/// Whether to split a quad along corners 1-3, triangles (1,2,3) (0,1,3), instead of (0,1,2) (0,2,3).
///
/// Keeps the brighter diagonal: flips when the occlusion of corners 0 and 2 adds up to more than those of 1 and 3.
[[nodiscard]] constexpr bool flips_diagonal(const FaceOcclusion& corners) {
  return corners[0] + corners[2] > corners[1] + corners[3];
}

}  // namespace quoin
