#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include <quoin/core/direction.h>
#include <quoin/core/vec.h>
#include <quoin/grid/chunk.h>
#include <quoin/grid/voxel_registry.h>

namespace [[gnu::visibility("default")]] quoin {

// The face of a voxel of type `a` towards a voxel of type `b` is visible if `a` is not air, and `b` is air or a
// transparent type other than `a`. Voxels with shapes (VoxelProperties::shapes) have none of these faces; an opaque one
// hides a face if it covers the whole side.

/// Visible faces of a chunk as bit masks, filled by BlockyMesher::find_faces.
struct FaceRows {
  /// [direction][z * 64 + y]: bit x is set if that voxel's face is visible.
  std::array<std::vector<std::uint64_t>, 6> rows;

  [[nodiscard]] std::int64_t count() const;
};

/// Returns the visible faces of one voxel (coordinates in the centre chunk); empty for air. Cost: up to 7 voxel
/// look-ups.
[[nodiscard]] DirectionSet visible_faces(const Neighbourhood& chunks, const VoxelRegistry& types, IVec3 voxel);

/// Finds the visible faces of the voxels in `region`: one set per voxel, x fastest, then y, then z.
///
/// The region is clipped to the chunk and `out` is resized to the clipped volume. Creates a BlockyMesher per call; in a
/// loop, keep a mesher and call its `find_faces`.
void visible_faces(const Neighbourhood& chunks, const VoxelRegistry& types, const IBox& region,
                   std::vector<DirectionSet>& out);

/// Number of faces in total and number of visible faces.
struct FaceCounts {
  std::int64_t visible = 0;
  std::int64_t total = 0;  ///< 6 x non-air voxels

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

/// Formats as "Faces: 1,234 visible of 5,676 total".
[[nodiscard]] std::string to_string(const FaceCounts& faces);

}  // namespace quoin
