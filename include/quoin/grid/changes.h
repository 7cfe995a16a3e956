#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/changes.h>
#include <quoin/core/function_ref.h>
#include <quoin/core/vec.h>
#include <quoin/grid/chunk.h>
#include <quoin/grid/voxel_registry.h>

namespace [[gnu::visibility("default")]] quoin {

class Grid;
class DensityGrid;

/// A set of the 256 slabs of a chunk. A slab is 4x4 rows of 64 voxels along x, the storage unit of a chunk.
class ChunkSlabs {
 public:
  /// Creates an empty set.
  ChunkSlabs() = default;
  [[nodiscard]] static ChunkSlabs all() {
    ChunkSlabs slabs;
    slabs.words_.fill(~std::uint64_t{0});
    return slabs;
  }
  /// Returns the slabs that a box in chunk coordinates overlaps. Requires: the box lies within 0 to 64.
  [[nodiscard]] static ChunkSlabs of(const IBox& box);

  /// Adds the slab of row (y, z). Requires: 0 <= y, z < 64.
  void add(int y, int z) {
    QUOIN_ASSERT((y | z) >= 0 && (y | z) < kChunkEdge, "0 <= y, z < 64");
    words_[static_cast<std::size_t>(z >> 4)] |= std::uint64_t{1} << bit_of(y, z);
  }
  void add(const ChunkSlabs& others) {
    for (std::size_t i = 0; i < words_.size(); ++i) words_[i] |= others.words_[i];
  }
  /// Returns true if the set contains the slab of row (y, z). Requires: 0 <= y, z < 64.
  [[nodiscard]] bool has(int y, int z) const {
    QUOIN_ASSERT((y | z) >= 0 && (y | z) < kChunkEdge, "0 <= y, z < 64");
    return (words_[static_cast<std::size_t>(z >> 4)] >> bit_of(y, z) & 1U) != 0;
  }
  /// Returns the 16 slabs at z as a mask; bit y / 4 is the slab of row (y, z). Requires: 0 <= z < 64.
  [[nodiscard]] std::uint32_t along_y(int z) const {
    QUOIN_ASSERT(z >= 0 && z < kChunkEdge, "0 <= z < 64");
    return static_cast<std::uint32_t>(words_[static_cast<std::size_t>(z >> 4)] >> (16 * (z >> 2 & 3)) & 0xFFFFU);
  }
  /// Returns the 4x4 slabs starting at row (y, z) as a mask. Bit j + 4 * k is the slab of row (y + 4 * j, z + 4 * k).
  /// Requires: y and z are 0, 16, 32 or 48.
  [[nodiscard]] std::uint32_t block(int y, int z) const {
    QUOIN_ASSERT((y | z) >= 0 && ((y | z) & ~48) == 0, "0, 16, 32 or 48");
    std::uint32_t slabs = 0;
    const std::uint64_t word = words_[static_cast<std::size_t>(z >> 4)] >> (y >> 2);
    for (unsigned i = 0; i < 4; ++i) slabs |= static_cast<std::uint32_t>(word >> (16 * i) & 15U) << (4 * i);
    return slabs;
  }
  bool operator==(const ChunkSlabs&) const = default;

 private:
  static int bit_of(int y, int z) { return (z >> 2 & 3) << 4 | y >> 2; }

  std::array<std::uint64_t, 4> words_{};  // [z / 16]: bit y / 4 + 16 (z / 4 % 4)
};

/// The changed voxels of a chunk.
struct ChunkChange {
  IVec3 chunk{0};
  IBox box;  ///< smallest box around the changed voxels, in chunk coordinates
  /// Bit Neighbourhood::index(dx, dy, dz) is set if the chunk at that offset contains one of the 26 neighbours of a
  /// changed voxel.
  std::uint32_t neighbours = 0;
  ChunkSlabs slabs;  ///< the slabs that contain a changed voxel
  /// False if the chunk was only loaded or unloaded (Grid::load_chunk, Grid::unload_chunk), without an edit.
  bool is_edit = true;

  /// Returns true if the mesh of the chunk at an offset may have changed.
  /// Requires: -1 <= offset.x, offset.y, offset.z <= 1.
  [[nodiscard]] bool affects(IVec3 offset) const {
    return (neighbours >> Neighbourhood::index(offset.x, offset.y, offset.z) & 1U) != 0;
  }
};
using GridChanges = Changes<ChunkChange>;

/// Returns the chunks whose blocky meshes must be rebuilt, sorted by z, then y, then x.
///
/// The result contains every changed chunk, even if it no longer exists. It also contains each existing chunk with
/// one of the 26 neighbours of a changed voxel. In a partial grid, an unloaded chunk adds its neighbours too, because
/// their meshes must be removed. If everything changed, the result is all chunks of the grid.
/// Shapes: meshes of types with shapes also depend on voxels up to kShapeReach away, and on the state of voxels
///         (Grid::data_changes_since). LiveMeshes follows both.
/// Requires: `changes` lead up to the grid's present state.
[[nodiscard]] std::vector<IVec3> chunks_to_mesh(const Grid& grid, const GridChanges& changes);

/// A row of 64 voxels along x in one chunk, with at least one change. Valid only during the callback that receives it.
struct RowChange {
  IVec3 first{0};                          ///< the voxel of `before[0]` and `now[0]`
  std::uint64_t changed = 0;               ///< bit i is set if voxel `first` + (i, 0, 0) changed
  std::span<const VoxelType> before, now;  ///< 64 types each

  /// Calls `visit(IVec3 voxel, VoxelType before, VoxelType now)` for each changed voxel, x ascending.
  template <class Visit>
  void for_each(Visit&& visit) const {
    for (std::uint64_t left = changed; left != 0; left &= left - 1) {
      const int i = std::countr_zero(left);
      visit(first + IVec3{i, 0, 0}, before[static_cast<std::size_t>(i)], now[static_cast<std::size_t>(i)]);
    }
  }
};

/// Calls `visit` for every row of voxels that differs between two states of a grid.
///
/// Use it for rules that react to edits from any source: falling sand, water, wires. `before` is a snapshot from the
/// last time the cursor was read. `changes` is the result of `now.changes_since` for that cursor. If everything
/// changed, the two states are compared completely.
///
/// Order:    chunks by z, y, x; within a chunk, rows by z, then y.
/// Limits:   a voxel that changed and changed back is not reported. In flowing water, for example, each voxel is
///           replaced by an equal one, so the inside does not seem to change. A rule must therefore check all
///           voxels that it moves itself (examples/falling_sand.cpp).
/// Partial:  chunks that are unloaded in at least one of the two states are skipped.
/// Cost:     O(changed slabs). Chunks shared by both states cost nothing.
void visit_changes(const Grid& before, const Grid& now, const GridChanges& changes,
                   FunctionRef<void(const RowChange&)> visit);

/// The voxels of a chunk whose data changed, either directly or because their type changed.
struct DataChange {
  IVec3 chunk{0};
  IBox box;             ///< a box around the changed voxels, in chunk coordinates
  bool is_edit = true;  ///< as in ChunkChange
};
using DataChanges = Changes<DataChange>;

/// Calls `visit` for every voxel whose data differs between two states of a grid.
///
/// `before` is a snapshot from the last time the cursor was read. `changes` is the result of `now.data_changes_since`
/// for that cursor. If everything changed, the two states are compared completely.
///
/// Order:    chunks by z, y, x; within a chunk, voxels by z, y, x.
/// Partial:  chunks that are unloaded in at least one of the two states are skipped.
/// Cost:     O(voxels with data in the slabs of 4x4 rows that contain a change). Shared storage costs nothing.
void visit_data_changes(const Grid& before, const Grid& now, const DataChanges& changes,
                        FunctionRef<void(IVec3 voxel, const VoxelData& before, const VoxelData& now)> visit);

/// The changed samples of a chunk, in density or material.
struct DensityChange {
  IVec3 chunk{0};
  IBox box;  ///< smallest box around the changed samples, in chunk coordinates
  /// For each neighbouring chunk, by Neighbourhood::index(dx, dy, dz): the distance in samples from its own samples to
  /// the nearest changed one, along the axis where it is greatest. 0 for the changed chunk itself.
  std::array<std::uint8_t, 27> distance{};
  bool is_edit = true;  ///< as in ChunkChange

  /// Returns true if the chunk at an offset, grown by `reach` samples on each side, contains a changed sample.
  /// Requires: -1 <= offset.x, offset.y, offset.z <= 1; 0 <= reach <= 64.
  [[nodiscard]] bool affects(IVec3 offset, int reach) const {
    QUOIN_ASSERT(reach >= 0 && reach <= 64, "0 <= reach <= 64");
    return distance[Neighbourhood::index(offset.x, offset.y, offset.z)] <= reach;
  }
};
using DensityChanges = Changes<DensityChange>;

/// Returns the chunks whose smooth meshes must be rebuilt, each once, sorted by z, then y, then x.
///
/// A chunk is in the result if its 64^3 samples, grown by `reach` on each side, contain a changed sample. Chunks that
/// are all far air are included too, because a surface can end in them. If everything changed, the result is all
/// chunks of the grid and their 26 neighbours. `reach_of` (quoin/mesh/smooth.h) returns the reach of a mesher.
///
/// Requires: 0 <= reach <= 64.
[[nodiscard]] std::vector<IVec3> chunks_to_mesh(const DensityGrid& grid, const DensityChanges& changes, int reach);

}  // namespace quoin
