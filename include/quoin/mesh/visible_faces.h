#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <quoin/core/direction.h>
#include <quoin/grid/neighbourhood.h>
#include <quoin/grid/voxel_registry.h>

namespace quoin {

/// Whether the face of a voxel of type `a` towards a voxel of type `b` shows: `a` is not air, and `b` is air, or
/// transparent and of another type.
[[nodiscard]] inline bool face_is_visible(const VoxelRegistry& types, VoxelType a, VoxelType b) {
  if (a == kAir) return false;
  if (b == kAir) return true;
  return types.is_transparent(b) && a != b;
}

/// Visible faces of a chunk as bit masks; BlockyMesher::find_faces makes them.
struct FaceRows {
  /// [direction][z * 64 + y]: bit x is set when that voxel's face shows.
  std::array<std::vector<std::uint64_t>, 6> rows;

  [[nodiscard]] std::int64_t count() const;
};

/// One byte a voxel of `region`, x fastest, then y, then z; bit d is set when the face towards direction d shows.
///
/// Bits: +X 0, -X 1, +Y 2, -Y 3, +Z 4, -Z 5. The region is clipped to the chunk and `out` resized to its volume.
/// Convenient, but makes a BlockyMesher for one use: in a loop keep one and call its `find_faces`.
void visible_faces(const Neighbourhood& chunks, const VoxelRegistry& types, const IBox& region,
                   std::vector<std::uint8_t>& out);

}  // namespace quoin
