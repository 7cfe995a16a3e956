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

namespace quoin {

class Grid;
class DensityGrid;

/// Some of the 256 slabs of a chunk: each is 4x4 rows of 64 voxels along x, as chunks are stored.
class ChunkSlabs {
 public:
  /// None.
  ChunkSlabs() = default;
  [[nodiscard]] static ChunkSlabs all() {
    ChunkSlabs slabs;
    slabs.words_.fill(~std::uint64_t{0});
    return slabs;
  }
  /// Those that a box in the chunk's coordinates reaches. Requires: it lies within 0 to 64.
  [[nodiscard]] static ChunkSlabs of(const IBox& box);

  /// Adds that of a row. Requires: 0 <= y, z < 64.
  void add(int y, int z) {
    QUOIN_ASSERT((y | z) >= 0 && (y | z) < kChunkEdge, "0 <= y, z < 64");
    words_[static_cast<std::size_t>(z >> 4)] |= std::uint64_t{1} << bit_of(y, z);
  }
  void add(const ChunkSlabs& others) {
    for (std::size_t i = 0; i < words_.size(); ++i) words_[i] |= others.words_[i];
  }
  /// Whether that of a row is among them. Requires: 0 <= y, z < 64.
  [[nodiscard]] bool has(int y, int z) const {
    QUOIN_ASSERT((y | z) >= 0 && (y | z) < kChunkEdge, "0 <= y, z < 64");
    return (words_[static_cast<std::size_t>(z >> 4)] >> bit_of(y, z) & 1U) != 0;
  }
  /// Of the 16 slabs at a row's z, a bit each by y. Requires: 0 <= z < 64.
  [[nodiscard]] std::uint32_t along_y(int z) const {
    QUOIN_ASSERT(z >= 0 && z < kChunkEdge, "0 <= z < 64");
    return static_cast<std::uint32_t>(words_[static_cast<std::size_t>(z >> 4)] >> (16 * (z >> 2 & 3)) & 0xFFFFU);
  }
  /// Of the 4x4 slabs from (y, z) on a bit each, [z][y]. Requires: y and z are 0, 16, 32 or 48.
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

/// Voxels of one chunk that changed.
struct ChunkChange {
  IVec3 chunk{0};
  IBox box;  ///< the smallest around them, in the chunk's coordinates
  /// Bit Neighbourhood::index(dx, dy, dz): the chunk at that offset holds one of their 26 neighbours.
  std::uint32_t neighbours = 0;
  ChunkSlabs slabs;  ///< those that hold one of them
  /// False: nothing was edited, the chunk only came into memory or went out of it (Grid::load_chunk).
  bool is_edit = true;

  /// Whether the mesh of the chunk at an offset may have changed. Requires: -1 <= offset.x, offset.y, offset.z <= 1.
  [[nodiscard]] bool affects(IVec3 offset) const {
    return (neighbours >> Neighbourhood::index(offset.x, offset.y, offset.z) & 1U) != 0;
  }
};
using GridChanges = Changes<ChunkChange>;

/// The chunks whose blocky meshes have to be made again: those that hold one of the 26 neighbours of a changed voxel,
/// and are there; and those that changed and are there no more. Sorted by z, then y, then x. All of the grid's when all
/// has changed. Of a partial grid those are among them whose mesh has to go, since a chunk beside them was unloaded.
/// `changes` are those up to the grid's present state.
[[nodiscard]] std::vector<IVec3> chunks_to_mesh(const Grid& grid, const GridChanges& changes);

/// A row of 64 voxels along x in one chunk, some of which changed; valid during the call that tells of it.
struct RowChange {
  IVec3 first{0};                          ///< the voxel of `before[0]`
  std::uint64_t changed = 0;               ///< bit i: voxel `first` + (i, 0, 0)
  std::span<const VoxelType> before, now;  ///< 64 types each

  /// Calls `visit(IVec3 voxel, VoxelType before, VoxelType now)` for the voxels that changed, x ascending.
  template <class Visit>
  void for_each(Visit&& visit) const {
    for (std::uint64_t left = changed; left != 0; left &= left - 1) {
      const int i = std::countr_zero(left);
      visit(first + IVec3{i, 0, 0}, before[static_cast<std::size_t>(i)], now[static_cast<std::size_t>(i)]);
    }
  }
};

/// What edits did to single voxels: calls `visit` for every row of voxels that differs between two states of a grid,
/// chunks by z, y, x, in each the rows by z, then y. `before` is a snapshot of the time when the cursor was read for
/// the last time, `changes` what `now.changes_since` told since then; when all has changed, all of both is compared.
/// For rules that follow edits, whoever makes them: falling sand, water, wires. What became another type and then was
/// it again meanwhile (a stream, each of whose voxels was followed by the next) is no difference: what a rule moves it
/// looks at again by itself (examples/falling_sand.cpp). Chunks that are not loaded in one of the two are left out.
///
/// Cost: O(slabs that changed); chunks that the two share cost nothing.
void visit_changes(const Grid& before, const Grid& now, const GridChanges& changes,
                   FunctionRef<void(const RowChange&)> visit);

/// Voxels of one chunk whose data changed, because it was set or because they became another type.
struct DataChange {
  IVec3 chunk{0};
  IBox box;             ///< around them, in the chunk's coordinates
  bool is_edit = true;  ///< as in ChunkChange
};
using DataChanges = Changes<DataChange>;

/// What edits did to the data of single voxels: calls `visit` for every voxel whose data differs between two states of
/// a grid, chunks by z, y, x, in each the voxels by z, y, x. `before` is a snapshot of when the cursor was read
/// for the last time, `changes` what `now.data_changes_since` told since then; when all has changed, all of both is
/// compared.
///
/// Cost: O(voxels with data of the slabs, of 4x4 rows, in which some changed); what the two share costs nothing.
void visit_data_changes(const Grid& before, const Grid& now, const DataChanges& changes,
                        FunctionRef<void(IVec3 voxel, const VoxelData& before, const VoxelData& now)> visit);

/// Samples of one chunk that changed, in density or in material.
struct DensityChange {
  IVec3 chunk{0};
  IBox box;  ///< the smallest around them, in the chunk's coordinates
  /// [Neighbourhood::index(dx, dy, dz)]: how many samples past its own the chunk at that offset has to read to come
  /// upon one of them; 0 for the chunk itself.
  std::array<std::uint8_t, 27> distance{};
  bool is_edit = true;  ///< as in ChunkChange

  /// Whether the chunk at an offset, grown by `reach` samples on each side, holds one of them.
  /// Requires: -1 <= offset.x, offset.y, offset.z <= 1; 0 <= reach <= 64.
  [[nodiscard]] bool affects(IVec3 offset, int reach) const {
    QUOIN_ASSERT(reach >= 0 && reach <= 64, "0 <= reach <= 64");
    return distance[Neighbourhood::index(offset.x, offset.y, offset.z)] <= reach;
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
