#pragma once

// How an occupancy tree lies in memory.
//
//   region, 1,024^3 voxels      16^3 chunks                Node: bits; and the index of each ChunkNode
//     chunk, 64^3                 16^3 cells of 4^3          Node: bits; and the index of each of its 64 bricks
//       brick, 16^3                 16^3 voxels                Node: bits
//
// One shape serves all levels: a node is 16^3 units as 64 words, each the bits of 4^3 units (x + 4 y + 16 z). Beside
// the tree lie flat tables over the box of chunks around everything, so that a kernel finds an address by adding.

#include <array>
#include <cstddef>
#include <cstdint>

#include <quoin/core/assert.h>
#include <quoin/trace/occupancy_tree.h>

namespace quoin::trace {

/// Bits of 16^3 units: word [z / 4][y / 4][x / 4], bit x % 4 + 4 (y % 4) + 16 (z % 4).
using Node = std::array<std::uint64_t, 64>;

/// Of 64^3 voxels: which 4^3 cells hold any, and where the bricks of 16^3 voxels lie.
struct ChunkNode {
  Node cells{};                            ///< word b: the cells of brick b
  std::array<std::uint32_t, 64> bricks{};  ///< index of a brick; 0 is empty, 1 is full
};

/// Of a chunk of transparent voxels: which aligned blocks are full of one type.
struct UniformBlocks {
  Node cells{};              ///< cells of 4^3, as in ChunkNode
  std::uint64_t bricks = 0;  ///< bricks of 16^3, x + 4 y + 16 z
  bool is_whole = false;
};

/// Some bricks of a chunk.
struct ChunkBricks {
  IVec3 chunk{0};
  std::uint64_t bricks = 0;  ///< x + 4 y + 16 z
};

/// Of 16^3 chunks.
struct RegionNode {
  Node chunks{};                            ///< which chunks hold any voxel
  std::array<std::uint32_t, 4096> nodes{};  ///< index of a ChunkNode, x + 16 y + 256 z; 0 is none
};

/// A chunk as walks of single rays read it.
struct FlatChunk {
  std::uint64_t bricks = 0;  ///< those that are not empty, x + 4 y + 16 z
  const ChunkNode* node = nullptr;
};

/// What the kernels read of a tree with flat tables.
struct TreeView {
  /// Of a tree; null where the world is so sparse (islands far apart) that its tables would be larger than all the
  /// rest.
  [[nodiscard]] static const TreeView* of(const OccupancyTree& tree) { return tree.view_; }

  // `origin`, `box` and the strides of chunks, as registers read them.
  alignas(32) double corner[4];
  alignas(16) float low[4];
  alignas(16) float high[4];
  alignas(16) std::int32_t low_voxel[4];
  alignas(16) std::int32_t high_voxel[4];
  alignas(16) std::int32_t chunk_strides[4];
  // As everything else reads it.
  const std::uint32_t* cells;   ///< bits
  const std::uint32_t* bricks;  ///< indices
  const std::uint32_t* words;   ///< of bricks: 128 halves each, the lower half of a cell's word first
  const Node* nodes;            ///< the bricks again
  const FlatChunk* chunks;      ///< x first, then y, then z
  DVec3 origin;                 ///< of the tables, in the grid
  std::uint32_t last_cell_word;
  int first_cell;  ///< bit of the table's cell (0, 0, 0)
  IVec3 cell_strides;
  IVec3 brick_strides;
  IVec3 brick_sizes;
  IBox box;       ///< tight, from `origin`
  bool is_small;  ///< no ray from nearby reaches further within the box than kernels go
};

/// The nodes of a tree, until it changes.
class TreeNodes {
 public:
  explicit TreeNodes(const OccupancyTree& tree);
  /// Null where a region of 1,024^3 voxels is empty. Region coordinates are voxel coordinates / 1,024, rounded down.
  [[nodiscard]] const RegionNode* find_region(IVec3 region) const;
  /// Null where a chunk is empty. Chunk coordinates are voxel coordinates / 64, rounded down.
  [[nodiscard]] const ChunkNode* find_chunk(IVec3 chunk) const;
  [[nodiscard]] const ChunkNode& chunk(std::uint32_t index) const { return chunks_[index]; }
  [[nodiscard]] const Node& brick(std::uint32_t index) const { return bricks_[index]; }
  /// Of one of the tree's chunks. Requires: a tree of transparent voxels.
  [[nodiscard]] const UniformBlocks& uniform_blocks(const ChunkNode& chunk) const {
    QUOIN_ASSERT(uniform_ != nullptr && &chunk > chunks_, "a chunk of a tree of transparent voxels");
    return uniform_[&chunk - chunks_];
  }

 private:
  const OccupancyTree::Impl* tree_;
  const ChunkNode* chunks_;
  const Node* bricks_;
  const UniformBlocks* uniform_;
};

}  // namespace quoin::trace
