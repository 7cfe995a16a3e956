#pragma once

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include <quoin/io/chunk_source.h>

#include "io/minecraft/sections.h"

namespace quoin::minecraft {

/// Assembles sections into chunks of 64^3: a column of chunks, or a box of blocks.
class ColumnBuilder {
 public:
  explicit ColumnBuilder(BlockTypes& types) : types_(types) {}

  /// Adds a section at its minimum corner, a multiple of 16. Errors: LimitExceeded for types.
  [[nodiscard]] Status put(const Section& section, IVec3 corner);
  /// Adds a section of one block. Requires: as `put`; block.is_plain().
  void put_block(const Block& block, IVec3 corner);
  /// Returns the chunks by y, then z, then x, without chunks of air. The builder then keeps only the invisible blocks.
  [[nodiscard]] std::vector<SourceChunk> take();
  /// Moves the counts of invisible blocks so far to `part`, with a lamp for each light-emitting one.
  void take_invisible(SourcePart& part);

 private:
  struct Cell {
    IVec3 place{0};
    std::vector<VoxelType> types;
    std::vector<std::pair<std::uint32_t, std::uint32_t>> states;  // voxel, state
  };
  [[nodiscard]] Cell& cell(IVec3 place);
  [[nodiscard]] Status find_types(const Section& section);
  void fill(const Section& section, Cell& cell, IVec3 first) const;
  void count_invisible(const Section& section, IVec3 corner);

  BlockTypes& types_;
  std::vector<Cell> cells_;
  std::vector<Cell> spare_;               // reused memory
  std::vector<VoxelType> types_of_;       // [biome][index in the palette]
  std::vector<std::uint64_t> invisible_;  // by Block::invisible
  std::vector<Lamp> lamps_;
  bool has_states_ = false;
  bool has_tints_ = false;
};

}  // namespace quoin::minecraft
