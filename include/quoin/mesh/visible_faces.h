#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include <quoin/core/direction.h>
#include <quoin/core/vec.h>
#include <quoin/grid/chunk.h>
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

/// The visible faces of one voxel (coordinates in the centre chunk); none of air. Cost: up to 7 voxel look-ups.
[[nodiscard]] DirectionSet visible_faces(const Neighbourhood& chunks, const VoxelRegistry& types, IVec3 voxel);

/// The visible faces of the voxels of `region`: one set a voxel, x fastest, then y, then z.
///
/// The region is clipped to the chunk and `out` resized to its volume.
/// Convenient, but makes a BlockyMesher for one use: in a loop keep one and call its `find_faces`.
void visible_faces(const Neighbourhood& chunks, const VoxelRegistry& types, const IBox& region,
                   std::vector<DirectionSet>& out);

/// How many faces there are, and how many of them show.
struct FaceCounts {
  std::int64_t visible = 0;
  std::int64_t total = 0;  ///< 6 x voxels that are not air

  bool operator==(const FaceCounts&) const = default;
  FaceCounts& operator+=(const FaceCounts& other) {
    visible += other.visible;
    total += other.total;
    return *this;
  }
  FaceCounts& operator-=(const FaceCounts& other) {
    visible -= other.visible;
    total -= other.total;
    return *this;
  }
};

/// "Faces: 1,234 visible of 5,676 total".
[[nodiscard]] std::string to_string(const FaceCounts& faces);

}  // namespace quoin
