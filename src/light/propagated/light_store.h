#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "grid/change_records.h"
#include "light/propagated/spread.h"

namespace quoin::propagated {

inline constexpr std::size_t kChannels = 4;  // sky, red, green, blue
inline constexpr std::size_t kBlocks = kChunkEdge * kChunkEdge / kBlock;

/// Levels of a channel in a chunk. Blocks of one level take two bytes, a chunk of one level nothing.
class ChannelLight {
 public:
  [[nodiscard]] static std::size_t block_of(int y, int z) {
    return static_cast<std::size_t>(z) * (kChunkEdge / kBlock) + static_cast<std::size_t>(y) / kBlock;
  }

  /// Null, and the level, where a block has one.
  [[nodiscard]] const LevelBlock* block(std::size_t i, unsigned& level) const {
    if (index_.empty()) {
      level = level_;
      return nullptr;
    }
    const std::uint16_t index = index_[i];
    level = index & 15U;
    return (index & kUniform) != 0 ? nullptr : &blocks_[index];
  }
  /// Bit planes of a row.
  [[nodiscard]] std::array<std::uint64_t, kPlanes> row(int y, int z) const;
  [[nodiscard]] unsigned at(int x, int y, int z) const;
  /// The level of the whole chunk, if it is stored as one.
  [[nodiscard]] std::optional<unsigned> uniform() const {
    return index_.empty() ? std::optional<unsigned>(level_) : std::nullopt;
  }

  void put(std::size_t i, const LevelBlock& block);
  /// After the last of some `put`: a chunk that has become one level is stored so.
  void tidy();
  [[nodiscard]] std::size_t bytes() const;

 private:
  static constexpr std::uint16_t kUniform = 0x8000;

  unsigned level_ = 0;                // where index_ is empty
  std::vector<std::uint16_t> index_;  // [block_of]: kUniform | level, or an index of blocks_
  std::vector<LevelBlock> blocks_;
  std::vector<std::uint16_t> free_;  // of blocks_
};

/// Light of a chunk; dark at first.
struct ChunkLight {
  std::array<ChannelLight, kChannels> channels;
  std::uint64_t serial = 0;  // of the journal
  /// [z / 4], bit y / 4: whether those 4x4 rows may have lamps. What solves finds out; edits have to tell.
  std::array<std::uint16_t, kChunkEdge / 4> lamp_slabs = all_slabs();

  [[nodiscard]] static std::array<std::uint16_t, kChunkEdge / 4> all_slabs() {
    std::array<std::uint16_t, kChunkEdge / 4> all;
    all.fill(0xFFFF);
    return all;
  }
  /// Voxels of the box, which is not empty, are others than before.
  void forget_lamps(const IBox& box);

  [[nodiscard]] std::uint16_t at(IVec3 local) const;
  void read_row(int y, int z, std::span<std::uint16_t, kChunkEdge> out) const;
  /// What all of it is, packed, if it is stored as one.
  [[nodiscard]] std::optional<std::uint16_t> uniform() const;
  [[nodiscard]] std::size_t bytes() const;
};

/// Collects which voxels of a chunk changed.
class ChangedRows {
 public:
  void add_block(std::size_t block, const std::array<std::uint64_t, kBlock>& changed);
  /// The smallest box around them, in the chunk's coordinates.
  [[nodiscard]] IBox box() const;
  /// Requires: some changed.
  [[nodiscard]] VoxelRecord record(IVec3 chunk) const;

 private:
  // Rows whose neighbours lie in the same chunks: those of y or z of 0, 1 to 62, 63.
  static constexpr std::array<std::uint8_t, 3> kFirst{0, 1, 63};
  [[nodiscard]] static std::size_t kind_of(int local);

  std::array<std::array<std::uint64_t, 3>, 3> any_{};  // [kind of z][kind of y]
  ChunkSlabs slabs_;
  std::uint64_t x_ = 0;
  std::uint64_t y_ = 0;
  std::uint64_t z_ = 0;
};

/// Makes all of a chunk one light.
[[nodiscard]] ChangedRows fill(ChunkLight& light, std::uint16_t word);

}  // namespace quoin::propagated
