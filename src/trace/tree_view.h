#pragma once

// The memory layout of an occupancy tree.
//
//   region, 1,024^3 voxels      16^3 chunks                Node: bits; and the index of each ChunkNode
//     chunk, 64^3                 16^3 cells of 4^3          Node: bits; and the address of each of its 64 bricks
//       brick, 16^3                 16^3 voxels                a run of lines
//
// All levels use one node shape: 16^3 units in 64 words, each with the bits of 4^3 units (x + 4 y + 16 z). In addition
// to the tree, flat tables cover the bounding box of all chunks, so that a kernel computes an address by addition.
//
// A brick stores its 64 words in layers of y (place x + 4 z + 16 y), since terrain is layered, in lines of eight words.
// If the brick begins or ends with equal words, all empty or all full, it omits up to half of the lines:
//
//   place        0  1  2  3  4  5  6  7     lines
//   stored       .  .  .  A  B  C  D  E     shift -3: places before line A read its first word
//   stored       A  B  C  D  E  F  .  .     shift  2: places after line F read its last word
//
// The position of a word in the run is its place plus the shift, as a saturating signed addition: one instruction for
// all lanes of a kernel.

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>

#include <quoin/core/assert.h>
#include <quoin/core/memory.h>
#include <quoin/trace/occupancy_tree.h>

namespace quoin::trace {

/// Bits of 16^3 units: word [z / 4][y / 4][x / 4], bit x % 4 + 4 (y % 4) + 16 (z % 4).
using Node = std::array<std::uint64_t, 64>;
inline constexpr std::uint64_t kAll = ~std::uint64_t{0};  ///< all units of a word

/// Eight words of a brick, in storage order.
using BrickLine = std::array<std::uint64_t, 8>;
inline constexpr int kBrickLines = 8;

/// The address of a brick of 16^3 voxels: 28 bits of a line number, three bits of the shift in two's complement, and a
/// 0 bit. With its lowest four bits cleared, it is a count of 32-bit half words.
using BrickCode = std::uint32_t;
inline constexpr BrickCode kEmptyBrick = 0;
inline constexpr BrickCode kFullBrick = 16 * kBrickLines;
/// The maximum number of lines that kernels can address.
inline constexpr std::size_t kMaxBrickLines = std::size_t{1} << 27;

/// The stored lines of a brick.
struct BrickRun {
  std::uint32_t first = 0;
  int shift = 0;  ///< in lines, -4 to 3: negative if the first lines are omitted

  static BrickRun of(BrickCode code) {
    const int shift = static_cast<std::int32_t>(code << 28) >> 29;
    return {(code >> 4) + static_cast<std::uint32_t>(shift > 0 ? shift : 0), shift};
  }
  [[nodiscard]] BrickCode code() const {
    QUOIN_ASSERT(shift >= -4 && shift <= 3 && first >> 28 == 0, "a shift of 3 bits, a line of 28 bits");
    return (first - static_cast<std::uint32_t>(shift > 0 ? shift : 0)) << 4 | (static_cast<std::uint32_t>(shift) & 7U)
                                                                                  << 1;
  }
  [[nodiscard]] int count() const { return kBrickLines - (shift < 0 ? -shift : shift); }
};

/// For each shift, by its three bits: the position of each cell's word (x + 4 y + 16 z), relative to the middle of a
/// brick that stores all its lines.
inline constexpr auto kBrickPlaces = [] {
  std::array<std::array<std::int8_t, 64>, 8> places{};
  for (int shift = -4; shift < 4; ++shift) {
    for (int cell = 0; cell < 64; ++cell) {
      const int place = (cell & 3) + 4 * (cell >> 4) + 16 * (cell >> 2 & 3) - 32 + 8 * shift;
      places[static_cast<std::size_t>(shift & 7)][static_cast<std::size_t>(cell)] =
          static_cast<std::int8_t>(place < -32  ? -32
                                   : place > 31 ? 31
                                                : place);
    }
  }
  return places;
}();

/// The 64 words of a brick, by cell: x + 4 y + 16 z.
class BrickWords {
 public:
  /// `middle` is four lines after the very first line, which belongs to the empty brick.
  BrickWords(const BrickLine* middle, BrickCode code)
      : words_(middle->data() + std::size_t{code >> 4} * 8), places_(kBrickPlaces[code >> 1 & 7U].data()) {}
  const std::uint64_t& operator[](std::size_t cell) const { return words_[places_[cell]]; }
  /// Returns true if the four words from `cell` on, whose x is 0, equal `four`.
  [[nodiscard]] bool has_four(std::size_t cell, const std::uint64_t* four) const {
    QUOIN_ASSERT(cell < 64 && (cell & 3) == 0, "the first cell of a row of four");
    const std::uint64_t* const own = words_ + places_[cell];
    const std::size_t step = is_kept(cell) ? 1 : 0;
    return ((own[0] ^ four[0]) | (own[step] ^ four[1]) | (own[2 * step] ^ four[2]) | (own[3 * step] ^ four[3])) == 0;
  }
  void read(Node& all) const {
    for (std::size_t cell = 0; cell < 64; cell += 4) {
      const std::uint64_t* const own = words_ + places_[cell];
      if (is_kept(cell)) {
        std::memcpy(&all[cell], own, 4 * sizeof *own);
      } else {
        all[cell] = all[cell + 1] = all[cell + 2] = all[cell + 3] = *own;
      }
    }
  }
  [[nodiscard]] Node node() const {
    Node all;
    read(all);
    return all;
  }

 private:
  // The words of four cells along x are either adjacent or all omitted.
  [[nodiscard]] bool is_kept(std::size_t cell) const { return places_[cell] != places_[cell + 1]; }

  const std::uint64_t* words_;
  const std::int8_t* places_;
};

/// The aligned blocks of a transparent chunk that are full of one type.
struct UniformBlocks {
  Node cells{};              ///< cells of 4^3, as in ChunkNode
  std::uint64_t bricks = 0;  ///< bricks of 16^3, x + 4 y + 16 z
  bool is_whole = false;
};

/// A chunk of 64^3 voxels: the occupied 4^3 cells, and the addresses of its 16^3 bricks.
struct ChunkNode {
  Node cells{};                            ///< word b: the cells of brick b
  std::array<BrickCode, 64> bricks{};      ///< kEmptyBrick and kFullBrick are shared by all
  std::unique_ptr<UniformBlocks> uniform;  ///< only in trees of transparent voxels
};

/// Some bricks of a chunk.
struct ChunkBricks {
  IVec3 chunk{0};
  std::uint64_t bricks = 0;  ///< x + 4 y + 16 z
};

/// A region of 16^3 chunks. Takes 0.7 KB, and 4 bytes per chunk: a grid of one chunk needs a region, too.
struct RegionNode {
  Node chunks{};                           ///< chunks with any voxel
  std::array<std::uint16_t, 64> before{};  ///< number of chunks in the words of `chunks` in front of each
  BlockVector<std::uint32_t> nodes;        ///< indices of the ChunkNodes, in the order of the bits of `chunks`

  /// Returns the index of a chunk's ChunkNode; 0: empty. `word`, `bit`: its bit in `chunks`.
  [[nodiscard]] std::uint32_t node(std::size_t word, unsigned bit) const {
    return (chunks[word] >> bit & 1U) == 0 ? 0 : nodes[place_of(word, bit)];
  }
  /// Sets the index of a chunk that is empty. Cost: O(chunks of the region).
  void insert(std::size_t word, unsigned bit, std::uint32_t node) {
    QUOIN_ASSERT((chunks[word] >> bit & 1U) == 0 && node != 0, "an empty chunk, and a node");
    nodes.insert(nodes.begin() + static_cast<std::ptrdiff_t>(place_of(word, bit)), node);
    chunks[word] |= std::uint64_t{1} << bit;
    for (std::size_t i = word + 1; i < before.size(); ++i) ++before[i];
  }
  /// Makes a chunk empty that is not. Cost: as `insert`.
  void erase(std::size_t word, unsigned bit) {
    QUOIN_ASSERT((chunks[word] >> bit & 1U) != 0, "a chunk with a node");
    nodes.erase(nodes.begin() + static_cast<std::ptrdiff_t>(place_of(word, bit)));
    chunks[word] &= ~(std::uint64_t{1} << bit);
    for (std::size_t i = word + 1; i < before.size(); ++i) --before[i];
  }
  [[nodiscard]] std::size_t bytes() const { return sizeof *this + nodes.capacity() * sizeof(std::uint32_t); }

 private:
  [[nodiscard]] std::size_t place_of(std::size_t word, unsigned bit) const {
    QUOIN_ASSERT(word < chunks.size() && bit < 64, "a bit of `chunks`");
    const std::uint64_t lower = chunks[word] & ((std::uint64_t{1} << bit) - 1);
    return before[word] + static_cast<std::size_t>(std::popcount(lower));
  }
};

/// A chunk in the form that walks of single rays read.
struct FlatChunk {
  std::uint64_t bricks = 0;  ///< non-empty bricks, x + 4 y + 16 z
  const ChunkNode* node = nullptr;
};

/// The part of a tree with flat tables that the kernels read.
struct TreeView {
  // `origin`, `box` and the strides of chunks, in the layout of registers.
  alignas(32) double corner[4];
  alignas(16) float low[4];
  alignas(16) float high[4];
  alignas(16) std::int32_t low_voxel[4];
  alignas(16) std::int32_t high_voxel[4];
  alignas(16) std::int32_t chunk_strides[4];
  // The same values for all other code.
  const std::uint32_t* cells;  ///< bits
  const BrickCode* bricks;
  const std::uint32_t* words;  ///< halves of the words of `lines`, the lower first
  const BrickLine* lines;      ///< as BrickWords takes them
  const FlatChunk* chunks;     ///< x first, then y, then z
  DVec3 origin;                ///< origin of the tables, in the grid
  std::uint32_t last_cell_word;
  int first_cell;  ///< bit of the table's cell (0, 0, 0)
  IVec3 cell_strides;
  IVec3 brick_strides;
  IVec3 brick_sizes;
  IBox box;       ///< tight, from `origin`
  bool is_small;  ///< no ray from nearby reaches further within the box than kernels go
};

/// The nodes of a tree, valid until it changes.
class TreeNodes {
 public:
  explicit TreeNodes(const OccupancyTree& tree);
  /// Returns null if a region of 1,024^3 voxels is empty. Region coordinates are voxel coordinates / 1,024, rounded
  /// down.
  [[nodiscard]] const RegionNode* find_region(IVec3 region) const;
  /// Returns null if a chunk is empty. Chunk coordinates are voxel coordinates / 64, rounded down.
  [[nodiscard]] const ChunkNode* find_chunk(IVec3 chunk) const;
  [[nodiscard]] const ChunkNode& chunk(std::uint32_t index) const { return *chunks_[index]; }
  [[nodiscard]] BrickWords brick(BrickCode code) const { return {lines_, code}; }
  /// Returns the uniform blocks of one of the tree's chunks. Requires: a tree of transparent voxels.
  [[nodiscard]] static const UniformBlocks& uniform_blocks(const ChunkNode& chunk) {
    QUOIN_ASSERT(chunk.uniform != nullptr, "a chunk of a tree of transparent voxels");
    return *chunk.uniform;
  }

 private:
  const OccupancyTree::Impl* tree_;
  const std::unique_ptr<ChunkNode>* chunks_;
  const BrickLine* lines_;
};

}  // namespace quoin::trace
