#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <quoin/core/changes.h>
#include <quoin/core/vec.h>

namespace quoin {

class Grid;
class DensityGrid;

/// Voxels of one chunk that changed.
struct ChunkChange {
  IVec3 chunk{0};
  IBox box;  ///< the smallest around them, in the chunk's coordinates
  /// Bit Neighbourhood::index(dx, dy, dz): the chunk at that offset holds one of their 26 neighbours.
  std::uint32_t neighbours = 0;

  /// Whether the mesh of the chunk at an offset of -1 to 1 on each axis may have changed.
  [[nodiscard]] bool affects(IVec3 offset) const {
    return (neighbours >> ((offset.z + 1) * 9 + (offset.y + 1) * 3 + offset.x + 1) & 1U) != 0;
  }
};
using GridChanges = Changes<ChunkChange>;

/// The chunks whose blocky meshes have to be made again: those that hold one of the 26 neighbours of a changed voxel,
/// and are there; and those that changed and are there no more. Sorted by z, then y, then x. All of the grid's when all
/// has changed. `changes` are those up to the grid's present state.
[[nodiscard]] std::vector<IVec3> chunks_to_mesh(const Grid& grid, const GridChanges& changes);

/// Samples of one chunk that changed, in density or in material.
struct DensityChange {
  IVec3 chunk{0};
  IBox box;  ///< the smallest around them, in the chunk's coordinates
  /// [Neighbourhood::index(dx, dy, dz)]: how many samples past its own the chunk at that offset has to read to come
  /// upon one of them; 0 for the chunk itself.
  std::array<std::uint8_t, 27> distance{};

  /// Whether the chunk at an offset of -1 to 1 on each axis, grown by `reach` samples (0 to 64), holds one of them.
  [[nodiscard]] bool affects(IVec3 offset, int reach) const {
    return distance[static_cast<std::size_t>((offset.z + 1) * 9 + (offset.y + 1) * 3 + offset.x + 1)] <= reach;
  }
};
using DensityChanges = Changes<DensityChange>;

/// The chunks whose smooth meshes have to be made again: those that hold a changed sample within their own 64^3 samples
/// grown by `reach` on each side, whether they are there or not (all far air), since a surface can end in them. `reach`
/// is what the mesher says (`reach_of`, quoin/mesh/smooth.h). Sorted by z, then y, then x; each once. When all has
/// changed: the grid's chunks and all 26 beside each.
///
/// Requires: 0 <= reach <= 64.
[[nodiscard]] std::vector<IVec3> chunks_to_mesh(const DensityGrid& grid, const DensityChanges& changes, int reach);

}  // namespace quoin
