#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/grid/grid.h>
#include <quoin/grid/voxel_registry.h>

namespace quoin {

/// Gathers the 32 even bits.
constexpr std::uint64_t even_bits(std::uint64_t bits) {
  bits &= 0x5555'5555'5555'5555U;
  bits = (bits | bits >> 1) & 0x3333'3333'3333'3333U;
  bits = (bits | bits >> 2) & 0x0F0F'0F0F'0F0F'0F0FU;
  bits = (bits | bits >> 4) & 0x00FF'00FF'00FF'00FFU;
  bits = (bits | bits >> 8) & 0x0000'FFFF'0000'FFFFU;
  return (bits | bits >> 16) & 0x0000'0000'FFFF'FFFFU;
}

/// Returns the number of a cell of a chunk: x + 64 y + 4096 z.
[[nodiscard]] inline std::uint32_t number_of(IVec3 cell) {
  return static_cast<std::uint32_t>(cell.x + kChunkEdge * (cell.y + kChunkEdge * cell.z));
}
/// The inverse of `number_of`.
[[nodiscard]] inline IVec3 cell_of(std::uint32_t number) {
  const auto n = static_cast<int>(number);
  return {n % kChunkEdge, n / kChunkEdge % kChunkEdge, n / kChunkEdge / kChunkEdge};
}

/// The cubes around one chunk of a halved grid, and the cells that are solid for that reason. Cubes are all voxels
/// except air and those with shapes.
///
/// Space: fine, voxels from the chunk's least corner, -2 to 129 on each axis; cells, -1 to 64. Outside of the
///        chunk, only voxels and cells that share a face with the inside are known.
class HalvingMasks {
 public:
  /// `chunk` is of the halved grid.
  HalvingMasks(const Grid& grid, const VoxelRegistry& types, IVec3 chunk);

  /// Returns the chunk of the full grid at `octant`, 0 or 1 on each axis; null if all is air.
  [[nodiscard]] const Chunk* octant(IVec3 octant) const { return chunks_[slot(octant)]; }
  /// The solid cells of a row, 0 <= y, z < 64.
  [[nodiscard]] std::uint64_t solid_cells(int y, int z) const;
  /// Returns the cubes of half a row, 0 <= y, z < 128; `half` is 0 or 1.
  [[nodiscard]] std::uint64_t voxels(int half, int y, int z) const {
    QUOIN_ASSERT(half == 0 || half == 1, "one of two halves");
    return fine(y, z)[static_cast<std::size_t>(half + 1)];
  }
  /// Returns true for a cube. `voxel`: from the chunk's least corner, inside the chunk or next to a voxel inside.
  [[nodiscard]] bool is_cube(IVec3 voxel) const {
    QUOIN_ASSERT(voxel.x >= -2 && voxel.x < kFineEdge + 2, "-2 <= x < 130");
    const int x = voxel.x + kChunkEdge;
    return (fine(voxel.y, voxel.z)[static_cast<std::size_t>(x / kChunkEdge)] >> (x % kChunkEdge) & 1U) != 0;
  }
  /// Returns the number of exposed faces of each voxel of half a row, as bit planes: [0] ones, [1] twos, [2] fours.
  [[nodiscard]] std::array<std::uint64_t, 3> exposed_faces(int half, int y, int z) const;

 private:
  static constexpr int kFineEdge = 2 * kChunkEdge;
  static constexpr int kRows = kFineEdge + 4;
  static constexpr int kCellRows = kChunkEdge + 2;

  /// 64 cells along x as bits, plus the cell before and the one after.
  struct CellBits {
    std::uint64_t bits = 0;
    bool before = false;
    bool after = false;
    [[nodiscard]] std::uint64_t lower() const { return bits << 1 | std::uint64_t{before}; }
    [[nodiscard]] std::uint64_t upper() const { return bits >> 1 | std::uint64_t{after} << 63; }
  };
  struct CellRow {
    CellBits any;
    CellBits half;                ///< at least 4 voxels
    std::array<CellBits, 3> rod;  ///< 2 or 3 voxels, some in either half along the axis
  };
  /// 128 voxels along x, and a word before and after.
  using FineRow = std::array<std::uint64_t, 4>;

  [[nodiscard]] static std::size_t slot(IVec3 octant) {
    QUOIN_ASSERT((IBox{IVec3(-1), IVec3(3)}.contains(octant)), "-1 <= x, y, z <= 2");
    return static_cast<std::size_t>((octant.z + 1) * 16 + (octant.y + 1) * 4 + octant.x + 1);
  }
  [[nodiscard]] const FineRow& fine(int y, int z) const {
    QUOIN_ASSERT(std::min(y, z) >= -2 && std::max(y, z) < kFineEdge + 2, "-2 <= y, z < 130");
    return fine_[static_cast<std::size_t>((z + 2) * kRows + y + 2)];
  }
  [[nodiscard]] FineRow& fine(int y, int z) { return const_cast<FineRow&>(std::as_const(*this).fine(y, z)); }
  [[nodiscard]] const CellRow& cells(int y, int z) const {
    QUOIN_ASSERT(std::min(y, z) >= -1 && std::max(y, z) <= kChunkEdge, "-1 <= y, z <= 64");
    return cells_[static_cast<std::size_t>((z + 1) * kCellRows + y + 1)];
  }
  void read_voxels(IVec3 octant, const VoxelRegistry& types);
  void count_cells(int y, int z);
  [[nodiscard]] std::uint64_t kept_rods(int y, int z, int axis) const;

  std::array<const Chunk*, 64> chunks_{};
  std::vector<FineRow> fine_;
  std::vector<CellRow> cells_;
};

/// Makes one chunk of a halved grid.
///
/// The four rows of voxels that make a row of cells are masks of 64 bits, one a type; only the cells that hold several
/// types are examined one by one.
class ChunkHalver {
 public:
  ChunkHalver(const Grid& grid, const VoxelRegistry& types, IVec3 chunk)
      : masks_(grid, types, chunk), grid_(&grid), types_(&types), chunk_(chunk) {}

  [[nodiscard]] Chunk make();

 private:
  /// The voxels of one type in the four rows [z][y] of half a row of cells, and the cells that contain it.
  struct Layer {
    VoxelType type = kAir;
    bool is_opaque = false;
    std::array<std::uint64_t, 4> voxels{};
    std::uint64_t cells = 0;
    std::uint64_t won = 0;  ///< the cells with several types that become this one
  };
  /// Cells of one type in a row of 64.
  struct Run {
    VoxelType type = kAir;
    std::uint64_t cells = 0;
  };
  /// The number of exposed faces per voxel of four rows, as bit planes.
  using Exposed = std::array<std::array<std::uint64_t, 3>, 4>;

  /// `half` of the row of cells at (y, z).
  void fill_half(int half, int y, int z, std::uint64_t solid);
  void find_layers(const Chunk& chunk, std::uint32_t slab, int half, int y, int z);
  void fill_mixed(int half, int y, int z, std::uint64_t mixed);
  /// Returns the heaviest of the layers in a cell.
  [[nodiscard]] std::size_t heaviest(const Exposed& exposed, int x) const;
  void add(VoxelType type, int half, std::uint64_t cells);
  // Adds the cells that shapes fill or cover.
  void add_shapes(Chunk& made) const;
  // Copies the states that turn types.
  void copy_states(Chunk& made) const;
  [[nodiscard]] std::uint32_t state_of(IVec3 cell, VoxelType type) const;

  HalvingMasks masks_;
  const Grid* grid_;
  const VoxelRegistry* types_;
  IVec3 chunk_;
  std::vector<Layer> layers_;
  std::vector<Run> runs_;
};

}  // namespace quoin
