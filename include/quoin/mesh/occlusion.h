#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include <quoin/core/assert.h>
#include <quoin/core/direction.h>
#include <quoin/core/vec.h>

namespace [[gnu::visibility("default")]] quoin {

/// Occlusion at the four corners of a face, each 0 (open) to 3 (dark). Corners are in the order (0,0) (1,0) (1,1)
/// (0,1) of the direction's (u, v): counter-clockwise from outside.
using FaceOcclusion = std::array<std::uint8_t, 4>;

/// The three voxels that determine the occlusion of one corner of a face, as offsets from the face's voxel. They touch
/// the corner and lie in the layer in front of the face.
struct CornerNeighbours {
  IVec3 side1;   ///< along the direction's u
  IVec3 side2;   ///< along the direction's v
  IVec3 corner;  ///< diagonal: along both
};

namespace detail {

constexpr std::array<CornerNeighbours, 4> corner_neighbours(Direction direction) {
  const FaceFrame& frame = frame_of(direction);
  constexpr std::array<std::array<int, 2>, 4> kSides = {{{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}};
  std::array<CornerNeighbours, 4> all{};
  for (std::size_t corner = 0; corner < 4; ++corner) {
    const auto offset = [&](int du, int dv) {
      std::array<int, 3> at{};
      at[frame.axis] = frame.sign;
      at[frame.u] = du;
      at[frame.v] = dv;
      return IVec3(at[0], at[1], at[2]);
    };
    const auto [du, dv] = kSides[corner];
    all[corner] = {offset(du, 0), offset(0, dv), offset(du, dv)};
  }
  return all;
}

}  // namespace detail

/// Voxels that determine the occlusion of each corner of each face: [direction][corner], corners as in FaceOcclusion.
///
///   for (const CornerNeighbours& at : kCornerNeighbours[static_cast<std::size_t>(face)])
///     vertex_occlusion(is_opaque(voxel + at.side1), is_opaque(voxel + at.side2), is_opaque(voxel + at.corner));
inline constexpr std::array<std::array<CornerNeighbours, 4>, 6> kCornerNeighbours = {
    detail::corner_neighbours(Direction::PosX), detail::corner_neighbours(Direction::NegX),
    detail::corner_neighbours(Direction::PosY), detail::corner_neighbours(Direction::NegY),
    detail::corner_neighbours(Direction::PosZ), detail::corner_neighbours(Direction::NegZ)};

/// Returns the occlusion of one vertex from the three voxels that touch it in the layer in front of the face.
///
/// The result is 3 if both sides are occluders; otherwise the number of occluders among the three voxels. Quoin's
/// blocky mesher asks the types (VoxelRegistry::occludes): glass and water do not darken.
[[nodiscard]] constexpr std::uint8_t vertex_occlusion(bool side1, bool side2, bool corner) {
  if (side1 && side2) return 3;
  return static_cast<std::uint8_t>(static_cast<int>(side1) + static_cast<int>(side2) + static_cast<int>(corner));
}

/// Returns the brightness for an occlusion of 0 to 3: 1, 0.75, 0.5, 0.25. Requires: occlusion <= 3.
[[nodiscard]] constexpr float occlusion_brightness(std::uint8_t occlusion) {
  QUOIN_ASSERT(occlusion <= 3, "0 <= occlusion <= 3");
  return 1.0F - 0.25F * static_cast<float>(occlusion);
}

/// Returns true if a quad must be split along corners 1-3 into triangles (1,2,3) (0,1,3), instead of (0,1,2) (0,2,3).
///
/// Keeps the brighter diagonal: flips if the occlusion of corners 0 and 2 exceeds the occlusion of corners 1 and 3.
[[nodiscard]] constexpr bool flips_diagonal(const FaceOcclusion& corners) {
  return corners[0] + corners[2] > corners[1] + corners[3];
}

}  // namespace quoin
