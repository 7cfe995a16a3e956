#pragma once

#include <array>
#include <cstddef>

#include <quoin/core/assert.h>
#include <quoin/core/vec.h>
#include <quoin/grid/chunk.h>
#include <quoin/grid/voxel_registry.h>

namespace quoin {

/// A chunk and its 26 neighbours: everything that meshing a chunk may read, in one object.
///
/// A null chunk reads as air.
/// Lifetime: owns nothing; the grid must outlive it, and an edit of the grid ends it.
struct Neighbourhood {
  /// [(dz + 1) * 9 + (dy + 1) * 3 + (dx + 1)]; the centre is 13.
  std::array<const Chunk*, 27> chunks{};

  /// The offset of the chunk at an index, the inverse of `index`: -1 to 1 on each axis. Requires: 0 <= index < 27.
  [[nodiscard]] static IVec3 offset(int index) {
    QUOIN_ASSERT(index >= 0 && index < 27, "0 <= index < 27");
    return {index % 3 - 1, index / 3 % 3 - 1, index / 9 - 1};
  }
  /// The index of the chunk at an offset. Requires: -1 <= dx, dy, dz <= 1.
  [[nodiscard]] static std::size_t index(int dx, int dy, int dz) {
    QUOIN_ASSERT(dx * dx <= 1 && dy * dy <= 1 && dz * dz <= 1, "-1 <= dx, dy, dz <= 1");
    return static_cast<std::size_t>((dz + 1) * 9 + (dy + 1) * 3 + (dx + 1));
  }
  /// The chunk at an offset. Requires: -1 <= dx, dy, dz <= 1.
  [[nodiscard]] const Chunk* at(int dx, int dy, int dz) const { return chunks[index(dx, dy, dz)]; }
  [[nodiscard]] const Chunk* centre() const { return chunks[13]; }

  /// The voxel at a position relative to the centre chunk: (-1, -1, z) is in the edge neighbour.
  /// Requires: -64 <= local.x, local.y, local.z < 128.
  [[nodiscard]] VoxelType get(IVec3 local) const {
    const IVec3 chunk = chunk_of(local);
    const Chunk* found = at(chunk.x, chunk.y, chunk.z);
    return found == nullptr ? kAir : found->get(local_of(local));
  }
};

/// A neighbourhood of a chunk with nothing around it. Lifetime: as Neighbourhood.
[[nodiscard]] inline Neighbourhood isolated(const Chunk& chunk) {
  Neighbourhood n;
  n.chunks[13] = &chunk;
  return n;
}

}  // namespace quoin
