#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <quoin/core/function_ref.h>
#include <quoin/core/result.h>
#include <quoin/io/chunk_source.h>

#include "io/minecraft/block_types.h"
#include "io/minecraft/nbt.h"

namespace quoin::minecraft {

inline constexpr int kSectionEdge = 16;
inline constexpr std::size_t kSectionBlocks = 4096;
inline constexpr std::uint16_t kNoIndex = 0xFFFF;  ///< in no palette

/// 16^3 blocks of a chunk.
struct Section {
  int y = 0;  ///< its lowest blocks are at 16 y
  std::vector<Block> palette;
  std::array<std::uint16_t, kSectionBlocks> indices{};  ///< in the palette, by y, then z, then x
  /// for cells of 4^3, by y, then z, then x; or for columns, by z, then x
  std::vector<std::uint8_t> biome_indices;
  std::vector<BiomeTints> biomes;  ///< the section's biomes, at least one
};

/// Returns the compound with a chunk's content: "Level", or since 1.18 the root itself.
[[nodiscard]] inline nbt::Value chunk_content(nbt::Value root) {
  return root["Level"] ? root["Level"] : root;
}

/// The order of a chunk's sections. Downwards: those that are no longer wanted are not decoded.
enum class SectionOrder : std::uint8_t { AsStored, Downwards };

/// Reads the sections of a chunk's NBT one after the other, of any version from McRegion on. Reports broken sections
/// and continues with the others.
///
/// `top`:    sections that begin above this height are skipped.
/// `take`:   receives each section that is not all air; must not keep references to it. Returns false to stop.
/// `broken`: receives errors, with their offset in the NBT.
/// Errors: LimitExceeded.
class SectionReader {
 public:
  explicit SectionReader(BlockTypes& types) : types_(types) {}

  [[nodiscard]] Status read(nbt::Value root, SectionOrder order, int top, FunctionRef<bool(const Section&)> take,
                            FunctionRef<void(const Error&)> broken);

 private:
  [[nodiscard]] Status read_section(nbt::Value section, nbt::Value level);
  [[nodiscard]] Status read_legacy(nbt::Value section);
  [[nodiscard]] Status read_mcregion(nbt::Value level, SectionOrder order, int top,
                                     FunctionRef<bool(const Section&)> take);
  [[nodiscard]] Status put_legacy(std::size_t at, int id, int data);
  void begin_legacy();
  void end_legacy();
  void read_biomes(nbt::Value section, nbt::Value level);
  [[nodiscard]] bool is_air() const;

  BlockTypes& types_;
  Section section_;
  std::vector<std::uint16_t> legacy_index_;  // by id and data: in the palette; kNoIndex
  std::vector<std::uint32_t> legacy_used_;
  std::vector<std::pair<int, nbt::Value>> sections_;  // with their heights
};

/// The types of a section's blocks.
class SectionTypes {
 public:
  /// Finds the types of all blocks of the palette, in all biomes. Errors: LimitExceeded.
  [[nodiscard]] Status find(const Section& section, BlockTypes& types);
  /// Returns true if any block's type depends on the biome.
  [[nodiscard]] bool has_tints() const { return has_tints_; }
  /// Returns the types by [biome][index in the palette]; of one biome without tints.
  [[nodiscard]] const std::vector<VoxelType>& types() const { return types_; }
  /// Returns the type of a block. Requires: as the section was found; 0 <= x, y, z < 16.
  [[nodiscard]] VoxelType at(const Section& section, int x, int y, int z) const {
    const std::size_t index = section.indices[static_cast<std::size_t>((y * kSectionEdge + z) * kSectionEdge + x)];
    if (!has_tints_) return types_[index];
    const int biome = section.biome_indices.size() == 256 ? z * 16 + x : (y >> 2) * 16 + (z >> 2) * 4 + (x >> 2);
    return types_[section.biome_indices[static_cast<std::size_t>(biome)] * section.palette.size() + index];
  }

 private:
  std::vector<VoxelType> types_;
  bool has_tints_ = false;
};

/// Returns the i-th half byte, low halves first; 0 past the end: old worlds omit trailing zeros.
[[nodiscard]] int nibble(std::span<const std::byte> bytes, std::size_t i);
/// Unpacks indices of `bits` each from longs, from the lowest bit up. The number of longs shows if indices span two of
/// them. Returns false if it fits neither form. Requires: 1 <= bits <= 16.
[[nodiscard]] bool unpack_indices(nbt::Value longs, int bits, std::span<std::uint16_t> out);
/// As above, for indices that span longs, starting at index `first`. Requires: the longs hold them all.
void unpack_spanning(nbt::Value longs, int bits, std::size_t first, std::span<std::uint16_t> out);
/// Reads a list of blocks: compounds with a Name and Properties. Errors: BadFormat, LimitExceeded.
[[nodiscard]] Status read_block_palette(nbt::Value palette, BlockTypes& types, std::vector<Block>& out);
/// Returns the bits per index of a palette. Requires: size > 0.
[[nodiscard]] int bits_of_palette(std::size_t size, int least);

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
  void fill(const Section& section, Cell& cell, IVec3 first) const;
  void count_invisible(const Section& section, IVec3 corner);

  BlockTypes& types_;
  std::vector<Cell> cells_;
  std::vector<Cell> spare_;  // reused memory
  SectionTypes types_of_;
  std::vector<std::uint64_t> invisible_;  // by Block::invisible
  std::vector<Lamp> lamps_;
  bool has_states_ = false;
};

}  // namespace quoin::minecraft
