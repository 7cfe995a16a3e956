#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/memory.h>
#include <quoin/core/vec.h>
#include <quoin/grid/chunk.h>
#include <quoin/grid/connected.h>

namespace quoin {

// A row of 64 voxels is a word; a run is a stretch of ones in it. Runs are counted from the lowest bit.

/// Returns the lowest voxel of each run.
inline std::uint64_t run_starts(std::uint64_t row) {
  return row & ~(row << 1);
}
/// Counts set bits. Fast for at most one bit, the usual case for rows of runs, since popcount may be a function call.
inline std::uint32_t count_ones(std::uint64_t word) {
  if ((word & (word - 1)) == 0) return static_cast<std::uint32_t>(word != 0);
  return static_cast<std::uint32_t>(std::popcount(word));
}
inline std::uint32_t count_runs(std::uint64_t row) {
  return count_ones(run_starts(row));
}
/// Returns the index of the run that contains a voxel. Requires: such a run exists.
inline std::uint32_t run_of(std::uint64_t row, int x) {
  QUOIN_ASSERT((row >> x & 1U) != 0, "a voxel of a run");
  const std::uint64_t up_to_x = (std::uint64_t{2} << x) - 1;
  return count_ones(run_starts(row) & up_to_x) - 1;
}
/// Returns the row without its lowest run.
inline std::uint64_t without_lowest_run(std::uint64_t row) {
  return row & (row + (row & (~row + 1)));
}

/// Calls `touch(x in a, x in b)` for all pairs of touching runs in two neighbouring rows, at least once per pair.
template <class Touch>
void for_each_contact(std::uint64_t a, std::uint64_t b, Connectivity connectivity, Touch&& touch) {
  for (std::uint64_t both = a & b; both != 0; both = without_lowest_run(both)) {
    touch(std::countr_zero(both), std::countr_zero(both));
  }
  if (connectivity == Connectivity::Faces6) return;
  // Diagonal contacts: just past the ends of the runs of `a`.
  for (std::uint64_t above = (a << 1) & ~a & b; above != 0; above &= above - 1) {
    touch(std::countr_zero(above) - 1, std::countr_zero(above));
  }
  for (std::uint64_t below = (a >> 1) & ~a & b; below != 0; below &= below - 1) {
    touch(std::countr_zero(below) + 1, std::countr_zero(below));
  }
}

/// A union-find structure. The least number of a set represents it.
template <class Index>
class UnionFind {
 public:
  /// Each number starts as a separate set.
  void reset(std::size_t count) {
    QUOIN_ASSERT(count <= std::numeric_limits<Index>::max(), "numbers of that type");
    parents_.resize(count);
    for (std::size_t i = 0; i < count; ++i) parents_[i] = static_cast<Index>(i);
  }
  [[nodiscard]] Index find(Index i) {
    QUOIN_ASSERT(i < parents_.size(), "a number of the sets");
    while (parents_[i] != i) {
      parents_[i] = parents_[parents_[i]];
      i = parents_[i];
    }
    return i;
  }
  void unite(Index a, Index b) {
    a = find(a);
    b = find(b);
    if (a < b) {
      parents_[b] = a;
    } else {
      parents_[a] = b;
    }
  }
  [[nodiscard]] std::size_t size() const { return parents_.size(); }

 private:
  BlockVector<Index> parents_;
};

/// A connected component within one chunk; in the chunk's coordinates.
struct ChunkPart {
  std::array<std::uint8_t, 3> min{};
  std::array<std::uint8_t, 3> last{};  ///< inclusive
  std::uint32_t voxels = 0;
  std::uint32_t first = 0;  ///< (z * 64 + y) * 64 + x of the first voxel

  [[nodiscard]] IBox box() const { return {IVec3(min[0], min[1], min[2]), IVec3(last[0], last[1], last[2]) + 1}; }
  [[nodiscard]] IVec3 first_voxel() const {
    return {static_cast<int>(first & 63U), static_cast<int>(first >> 6 & 63U), static_cast<int>(first >> 12)};
  }
};

/// The parts of one chunk and their voxels. Shares the chunk.
///
/// A chunk with one part stores no more than the rule that selects its voxels. Otherwise each run has the number of its
/// part; the runs themselves are found in the chunk again.
class ChunkParts {
 public:
  /// Scratch memory for finding parts; one per thread.
  struct Scratch : LargeObject {
    std::array<std::uint64_t, std::size_t{kChunkEdge} * kChunkEdge> rows;
    std::array<std::uint32_t, std::size_t{kChunkEdge} * kChunkEdge> first_runs;
    UnionFind<std::uint32_t> runs;
    BlockVector<std::uint32_t> part_of_root;
  };

  ChunkParts() = default;
  ChunkParts(const Chunk& chunk, const ConnectedOptions& options, Scratch& scratch);

  [[nodiscard]] std::span<const ChunkPart> parts() const { return parts_; }
  [[nodiscard]] const Chunk& chunk() const { return chunk_; }
  /// Replaces the chunk by a chunk with the same types and other data.
  void take_data(const Chunk& chunk) { chunk_ = chunk; }
  /// Returns the voxels of a row that belong to parts.
  [[nodiscard]] std::uint64_t row(int y, int z) const;
  /// Returns the part of a voxel of a row. Requires: `row` is that row and contains the voxel.
  [[nodiscard]] std::uint32_t part_at(std::uint64_t row, int x, int y, int z) const {
    QUOIN_ASSERT(!parts_.empty(), "a chunk with parts");
    return parts_.size() == 1 ? 0 : part_of_run(first_run(y, z) + run_of(row, x));
  }
  /// Returns the voxels of a row that belong to one part. Requires: as `part_at`.
  [[nodiscard]] std::uint64_t row_of_part(std::uint64_t row, int y, int z, std::uint32_t part) const;
  [[nodiscard]] std::size_t bytes() const;

 private:
  // The rule that selects the voxels of a row.
  enum class Rule : std::uint8_t { AllButAir, OnlyListed, AllButListed, Search };

  void choose_rule(const ConnectedOptions& options);
  void read_rows(Scratch& scratch) const;
  void find_parts(Scratch& scratch, Connectivity connectivity);
  void keep_runs(Scratch& scratch);
  [[nodiscard]] std::uint32_t first_run(int y, int z) const {
    return layer_starts_[static_cast<std::size_t>(z)] + row_starts_[static_cast<std::size_t>(z * kChunkEdge + y)];
  }
  [[nodiscard]] std::uint32_t part_of_run(std::uint32_t run) const {
    QUOIN_ASSERT(run < (few_parts_.empty() ? many_parts_.size() : few_parts_.size()), "an existing run");
    return few_parts_.empty() ? many_parts_[run] : few_parts_[run];
  }
  [[nodiscard]] std::uint64_t search_row(int y, int z) const;

  Chunk chunk_;
  Rule rule_ = Rule::AllButAir;
  std::vector<VoxelType> types_;  // types listed by the rule, ascending
  std::vector<ChunkPart> parts_;
  BlockVector<std::uint32_t> layer_starts_;  // [z]: the first run of the layer
  BlockVector<std::uint16_t> row_starts_;    // [z * 64 + y]: first run of the row, relative to its layer
  BlockVector<std::uint8_t> few_parts_;      // [run], if there are at most 256 parts
  BlockVector<std::uint32_t> many_parts_;    // [run], otherwise
};

}  // namespace quoin
