#pragma once

#include <array>
#include <cstddef>

#include <quoin/core/vec.h>
#include <quoin/grid/chunk.h>

namespace quoin {

/// A chunk and its 26 neighbours: everything that meshing a chunk may read, in one object.
///
/// A null chunk reads as air.
/// Lifetime: owns nothing; the grid must outlive it, and an edit of the grid ends it.
struct Neighbourhood {
  /// [(dz + 1) * 9 + (dy + 1) * 3 + (dx + 1)]; the centre is 13.
  std::array<const Chunk*, 27> chunks{};

  /// The offset of the chunk at an index, the inverse of `index`: -1 to 1 on each axis.
  [[nodiscard]] static IVec3 offset(int index) { return {index % 3 - 1, index / 3 % 3 - 1, index / 9 - 1}; }
  /// The index of the chunk at an offset of -1 to 1 on each axis.
  [[nodiscard]] static std::size_t index(int dx, int dy, int dz) {
    return static_cast<std::size_t>((dz + 1) * 9 + (dy + 1) * 3 + (dx + 1));
  }
  [[nodiscard]] const Chunk* at(int dx, int dy, int dz) const { return chunks[index(dx, dy, dz)]; }
  [[nodiscard]] const Chunk* centre() const { return chunks[13]; }

  /// The voxel at a position relative to the centre chunk, -64..127 on each axis: (-1, -1, z) is in the edge neighbour.
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
