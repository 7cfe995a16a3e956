#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/function_ref.h>
#include <quoin/core/memory.h>
#include <quoin/grid/changes.h>
#include <quoin/grid/chunk.h>
#include <quoin/grid/density_grid.h>
#include <quoin/grid/voxel_registry.h>

#include "trace/tree_view.h"

namespace quoin::trace {

/// The content of 4x4 rows of a chunk, 64 voxels each.
enum class Slab : std::uint8_t { Empty, Full, Mixed };
using SlabRows = std::array<std::uint64_t, 16>;  ///< [z][y]

/// Classifies rows as empty, full or mixed.
[[nodiscard]] inline Slab slab_of(const SlabRows& rows) {
  std::uint64_t any = 0;
  std::uint64_t all = ~std::uint64_t{0};
  for (const std::uint64_t row : rows) {
    any |= row;
    all &= row;
  }
  return any == 0 ? Slab::Empty : all == ~std::uint64_t{0} ? Slab::Full : Slab::Mixed;
}

/// Rows of a chunk as bits. The palette decides which types count.
class ChunkRows {
 public:
  ChunkRows(const Chunk& chunk, const VoxelRegistry& types, Occupancy which);
  /// Counts the voxels of one type only.
  ChunkRows(const Chunk& chunk, VoxelType only);
  /// Counts the types that `counts` accepts. `counts` must outlive this object and is never called for air.
  ChunkRows(const Chunk& chunk, const FunctionRef<bool(VoxelType)>& counts);

  /// Returns true if no voxel counts.
  [[nodiscard]] bool none() const { return in_.empty(); }

  /// Returns the box of the counted voxels if it is known without a scan: if air is the only type that does not count.
  [[nodiscard]] std::optional<IBox> known_bounds() const {
    const bool are_all = std::all_of(out_.begin(), out_.end(), [](VoxelType type) { return type == kAir; });
    return are_all ? std::optional(chunk_->bounds()) : std::nullopt;
  }

  /// Reads the 4x4 rows that start at (y, z), multiples of 4. Sets `rows` only if they are mixed.
  [[nodiscard]] Slab read(int y, int z, SlabRows& rows) const;

  /// Calls `visit(y, z, row)` for the rows in a box's y and z range, slab by slab. Skips empty slabs.
  template <class Visit>
  void for_each_row(const IBox& box, Visit&& visit) const;

 private:
  void sort_types();
  [[nodiscard]] bool belongs(VoxelType type) const;

  const Chunk* chunk_;
  const VoxelRegistry* types_ = nullptr;  // null: one type only, or selected by counts_
  const FunctionRef<bool(VoxelType)>* counts_ = nullptr;
  Occupancy which_ = Occupancy::NonAir;
  VoxelType only_ = kAir;
  std::vector<VoxelType> in_;
  std::vector<VoxelType> out_;
  std::vector<std::uint32_t> asked_;  // palette indices of the shorter list
  std::uint64_t inverted_ = 0;        // all ones if asked_ lists the types that do not count
};

template <class Visit>
void ChunkRows::for_each_row(const IBox& box, Visit&& visit) const {
  for (int z = box.min.z & ~3; z < box.max.z; z += 4) {
    for (int y = box.min.y & ~3; y < box.max.y; y += 4) {
      SlabRows slab;
      const Slab kind = read(y, z, slab);
      if (kind == Slab::Empty) continue;
      if (kind == Slab::Full) slab.fill(~std::uint64_t{0});
      for (int i = 0; i < 16; ++i) {
        const int row_y = y + (i & 3);
        const int row_z = z + (i >> 2);
        const bool is_inside = row_y >= box.min.y && row_y < box.max.y && row_z >= box.min.z && row_z < box.max.z;
        if (is_inside) visit(row_y, row_z, slab[static_cast<std::size_t>(i)]);
      }
    }
  }
}

/// Rows of a chunk, joined with listed rows, or only their common voxels. `listed`: rows along x, by y + 64 z.
class ListedChunkRows {
 public:
  enum class Join : std::uint8_t { Either, Both };
  ListedChunkRows(const ChunkRows& rows, std::span<const std::uint64_t> listed, Join join)
      : rows_(&rows), listed_(listed), join_(join) {
    QUOIN_ASSERT(listed.size() == std::size_t{kChunkEdge} * kChunkEdge, "a row for each y and z");
  }

  [[nodiscard]] bool none() const { return rows_->none() && join_ == Join::Both; }
  /// As ChunkRows::read.
  [[nodiscard]] Slab read(int y, int z, SlabRows& rows) const;

 private:
  const ChunkRows* rows_;
  std::span<const std::uint64_t> listed_;
  Join join_;
};

/// The box of the counted voxels, computed row by row.
class RowsBox {
 public:
  void add(int y, int z, std::uint64_t row) {
    QUOIN_ASSERT((y | z) >= 0 && (y | z) < kChunkEdge, "0 <= y, z < 64");
    x_ |= row;
    const std::uint64_t any = row != 0 ? 1 : 0;
    y_ |= any << y;
    z_ |= any << z;
  }
  /// Adds 4x4 full rows.
  void add_slab(int y, int z) {
    QUOIN_ASSERT(((y | z) & ~(kChunkEdge - 4)) == 0, "multiples of 4 within the chunk");
    x_ = ~std::uint64_t{0};
    y_ |= std::uint64_t{15} << y;
    z_ |= std::uint64_t{15} << z;
  }
  /// Adds a cell of 4^3 voxels, in the bit order of nodes, at a multiple of 4.
  void add_cell(IVec3 at, std::uint64_t cell) {
    QUOIN_ASSERT(((at.x | at.y | at.z) & ~(kChunkEdge - 4)) == 0, "multiples of 4 within the chunk");
    std::uint64_t plane = (cell | cell >> 32);
    plane = (plane | plane >> 16) & 0xFFFFU;
    std::uint64_t row = plane | plane >> 8;
    row = (row | row >> 4) & 15U;
    x_ |= row << at.x;
    for (int i = 0; i < 4; ++i) {
      y_ |= std::uint64_t{(plane >> (4 * i) & 15U) != 0} << (at.y + i);
      z_ |= std::uint64_t{(cell >> (16 * i) & 0xFFFFU) != 0} << (at.z + i);
    }
  }
  /// Returns true if no voxel of the 16^3 voxels at `at` can enlarge the box.
  [[nodiscard]] bool covers_brick(IVec3 at) const { return covers(at, 0xFFFF); }
  /// Returns true if no voxel of the 4^3 voxels at `at` can enlarge the box.
  [[nodiscard]] bool covers_cell(IVec3 at) const { return covers(at, 0xF); }
  /// Returns the box in chunk coordinates.
  [[nodiscard]] IBox box() const {
    if (x_ == 0) return {};
    return {{std::countr_zero(x_), std::countr_zero(y_), std::countr_zero(z_)},
            {64 - std::countl_zero(x_), 64 - std::countl_zero(y_), 64 - std::countl_zero(z_)}};
  }

 private:
  [[nodiscard]] bool covers(IVec3 at, std::uint64_t size) const {
    QUOIN_ASSERT(((at.x | at.y | at.z) & ~(kChunkEdge - 1)) == 0, "a voxel of the chunk");
    return (x_ >> at.x & y_ >> at.y & z_ >> at.z & size) == size;
  }

  std::uint64_t x_ = 0;
  std::uint64_t y_ = 0;
  std::uint64_t z_ = 0;
};

/// Finds the blocks of a chunk that are full of one transparent type. Updates only the rows of four bricks that contain
/// a `wanted` slab; other rows of `blocks` stay unchanged. Cost: for each transparent type with enough voxels to fill a
/// cell, about the cost of building a tree node.
void find_uniform_blocks(const Chunk& chunk, const VoxelRegistry& types, const ChunkSlabs& wanted,
                         UniformBlocks& blocks);

/// Finds the blocks of all of a chunk that are full of one transparent type, of a type with shapes only those of listed
/// voxels. Cost: as above, for all rows.
void find_uniform_blocks(const Chunk& chunk, const VoxelRegistry& types, std::span<const std::uint64_t> listed,
                         UniformBlocks& blocks);

/// Leaves out the blocks that contain a listed voxel: rows along x by y + 64 z; no rows: none.
void split_blocks(std::span<const std::uint64_t> listed, UniformBlocks& blocks);

/// Four adjacent bricks along x, at (y, z) of a chunk, multiples of 16.
struct BrickRow {
  std::array<Node, 4> bricks{};
  /// Reads the bricks from `rows`, a ChunkRows or CellRows. Returns false if all four are empty or all four are full;
  /// then it sets `is_full` but not `bricks`.
  template <class Rows>
  bool read(const Rows& rows, int y, int z, RowsBox& box);
  bool is_full = false;
};

// Transposes 16 rows of 16 nibbles, [z][y][x / 4], to 16 words of 4^3 bits: nibble j of word i becomes nibble i of word
// j.
void transpose_nibbles(SlabRows& rows);

/// Reads the 4x4 rows that start at (y, z), multiples of 4, as words of 4^3 voxels, [x].
template <class Rows>
Slab read_cells(const Rows& rows, int y, int z, SlabRows& words, RowsBox& box) {
  const Slab kind = rows.read(y, z, words);
  if (kind == Slab::Empty) {
    words.fill(0);
  } else if (kind == Slab::Full) {
    words.fill(~std::uint64_t{0});
    box.add_slab(y, z);
  } else {
    for (int i = 0; i < 16; ++i) box.add(y + (i & 3), z + (i >> 2), words[static_cast<std::size_t>(i)]);
    transpose_nibbles(words);
  }
  return kind;
}

template <class Rows>
bool BrickRow::read(const Rows& rows, int y, int z, RowsBox& box) {
  QUOIN_ASSERT(((y | z) & ~(kChunkEdge - 16)) == 0, "multiples of 16 within the chunk");
  int empty = 0;
  int full = 0;
  SlabRows words;
  for (int slab = 0; slab < 16; ++slab) {
    const Slab kind = read_cells(rows, y + 4 * (slab & 3), z + 4 * (slab >> 2), words, box);
    empty += kind == Slab::Empty ? 1 : 0;
    full += kind == Slab::Full ? 1 : 0;
    for (std::size_t i = 0; i < 16; ++i) bricks[i / 4][i % 4 + static_cast<std::size_t>(slab) * 4] = words[i];
  }
  is_full = full == 16;
  return empty != 16 && full != 16;
}

/// Adds the blocks that are full in `rows`, the rows of one type. Tests only the rows of four bricks that contain a
/// `wanted` brick. Returns the full bricks.
template <class Rows>
std::uint64_t add_uniform(const Rows& rows, std::uint64_t wanted, UniformBlocks& blocks) {
  std::uint64_t bricks = 0;
  RowsBox unused;
  BrickRow four;
  for (std::size_t row = 0; row < 16; ++row) {
    if ((wanted >> (4 * row) & 15U) == 0) continue;
    const bool is_mixed = four.read(rows, static_cast<int>(row & 3) * 16, static_cast<int>(row >> 2) * 16, unused);
    for (std::size_t x = 0; x < 4; ++x) {
      std::uint64_t cells = is_mixed || !four.is_full ? 0 : kAll;
      for (std::size_t i = 0; is_mixed && i < 64; ++i) cells |= std::uint64_t{four.bricks[x][i] == kAll} << i;
      blocks.cells[x + 4 * row] |= cells;
      bricks |= std::uint64_t{cells == kAll} << (x + 4 * row);
    }
  }
  blocks.bricks |= bricks;
  return bricks;
}

/// Computes 4x4 rows of cells between samples; `join` combines their eight corners. `ends(y, z)` returns, for a row of
/// samples, the bits of the cells along x, each combined from the two ends of the cell; y and z are at most 64.
template <class Ends, class Join>
Slab join_corners(int y, int z, const Ends& ends, const Join& join, SlabRows& rows) {
  QUOIN_ASSERT(((y | z) & ~(kChunkEdge - 4)) == 0, "multiples of 4 within the chunk");
  // Along x, then along y, then along z.
  std::array<std::uint64_t, 4> before{};
  for (int dz = 0; dz <= 4; ++dz) {
    std::array<std::uint64_t, 5> along_x;
    for (int dy = 0; dy <= 4; ++dy) along_x[static_cast<std::size_t>(dy)] = ends(y + dy, z + dz);
    for (std::size_t dy = 0; dy < 4; ++dy) {
      const std::uint64_t both = join(along_x[dy], along_x[dy + 1]);
      if (dz > 0) rows[static_cast<std::size_t>(dz - 1) * 4 + dy] = join(before[dy], both);
      before[dy] = both;
    }
  }
  return slab_of(rows);
}

/// Rows of 64^3 cells between samples, as bits: set for cells with a solid corner. Cell (x, y, z) of a chunk lies
/// between its sample (x, y, z) and the next sample along each axis, which may belong to the next chunk.
class CellRows {
 public:
  CellRows(const DensityGrid& field, IVec3 chunk);

  /// Returns true if no cell has a solid corner.
  [[nodiscard]] bool none() const { return is_air_; }

  /// Reads 4x4 rows like ChunkRows::read.
  [[nodiscard]] Slab read(int y, int z, SlabRows& rows) const;

 private:
  // The signs of a chunk's rows; the rows of a missing or uniform chunk are all equal.
  struct Signs {
    const std::uint64_t* rows = nullptr;  // [z][y]; null where all are `all`
    std::uint64_t all = 0;
  };

  // Returns the cells along x with a solid sample at either end, for the samples' row (y, z), 0 to 64.
  [[nodiscard]] std::uint64_t either_end(int y, int z) const;

  std::array<Signs, 8> signs_;  // index: the chunk's offset, x + 2 y + 4 z
  bool is_air_ = true;
};

/// The samples of a field's chunk that are solid and of a counted material, one bit each, in rows along x. Includes the
/// first samples beyond the chunk along each axis.
class SolidRows {
 public:
  /// Counts all transparent materials.
  SolidRows(const DensityGrid& field, const VoxelRegistry& types, IVec3 chunk);
  /// Counts one material.
  SolidRows(const DensityGrid& field, VoxelType only, IVec3 chunk);

  [[nodiscard]] bool none() const { return rows_.empty(); }
  /// Returns sample i of a row as bit i, 0 <= y, z <= 64. `next` returns sample i + 1.
  [[nodiscard]] std::uint64_t at(int y, int z) const { return rows_[index(y, z)]; }
  [[nodiscard]] std::uint64_t next(int y, int z) const {
    return rows_[index(y, z)] >> 1 | std::uint64_t{last_[index(y, z)]} << 63;
  }

 private:
  static constexpr std::size_t kRows = kChunkEdge + 1;
  [[nodiscard]] std::size_t index(int y, int z) const {
    QUOIN_ASSERT((y | z) >= 0 && y <= kChunkEdge && z <= kChunkEdge && !none(), "0 <= y, z <= 64, with solid samples");
    return static_cast<std::size_t>(z) * kRows + static_cast<std::size_t>(y);
  }
  template <class RowsOf>
  void read(const DensityGrid& field, IVec3 chunk, const RowsOf& rows_of);
  void read_chunk(const DensityChunk& samples, const ChunkRows& materials, IVec3 offset);

  BlockVector<std::uint64_t> rows_;  // empty if no sample counts
  BlockVector<std::uint8_t> last_;   // sample 64 of each row
};

/// Returns true if a solid sample of a chunk has a transparent material. Cost: O(1) if the chunk has no such material,
/// otherwise up to 10 microseconds.
[[nodiscard]] bool has_glass(const DensityChunk& samples, const VoxelRegistry& types);

/// Rows of the cells between samples, like CellRows: set for cells with a solid corner of a transparent material.
class GlassRows {
 public:
  GlassRows(const DensityGrid& field, const VoxelRegistry& types, IVec3 chunk) : samples_(field, types, chunk) {}
  [[nodiscard]] bool none() const { return samples_.none(); }
  [[nodiscard]] Slab read(int y, int z, SlabRows& rows) const;

 private:
  SolidRows samples_;
};

/// Finds the blocks of a chunk's cells whose corners are all solid and of one transparent material.
[[nodiscard]] UniformBlocks uniform_glass(const DensityGrid& field, const VoxelRegistry& types, IVec3 chunk);

}  // namespace quoin::trace
