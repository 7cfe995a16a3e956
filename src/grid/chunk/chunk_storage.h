#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/memory.h>
#include <quoin/grid/chunk.h>

#include "grid/chunk/paged_words.h"

namespace quoin {

/// The number of rows of a slab, and the bits per voxel for a palette size.
inline constexpr int kSlabRows = 16;
[[nodiscard]] inline int bits_for(std::size_t types) {
  QUOIN_ASSERT(types <= std::size_t{1} << 16, "types of 16 bits");
  if (types <= 2) return 1;
  if (types <= 4) return 2;
  if (types <= 16) return 4;
  return types <= 256 ? 8 : 16;
}

/// The slabs in storage order: those of one height are adjacent, because edits often are.
[[nodiscard]] inline std::size_t slab_in_order(std::size_t i) {
  QUOIN_ASSERT(i < 256, "a slab of the chunk");
  return i % 16 * 16 + i / 16;
}

/// The voxels of a chunk of several types. Shared by copies of the chunk until one of them is written.
///
///   slab [z / 4][y / 4]: 16 rows of 64 voxels along x, each `bits` words; a slab of one type has no slot in `words`
struct ChunkStorage : RefCounted {
  static constexpr std::uint32_t kUniformSlab = 0x8000'0000U;
  static constexpr std::uint32_t kNoSlot = 0xFFFF'FFFFU;
  /// Number of remainders that types are counted by at 16 bits: small enough for a table per chunk, large enough to
  /// detect 256 types or fewer.
  static constexpr std::uint32_t kRemainders = 1'024;
  int bits = 1;                            ///< per voxel: 1, 2, 4, 8 or 16
  BlockVector<VoxelType> palette;          ///< type of each index; unused at 16 bits, where the index is the type
  BlockVector<std::uint32_t> counts;       ///< voxels of each index; at 16 bits of each remainder by kRemainders
  std::array<std::uint32_t, 256> slabs{};  ///< [z / 4][y / 4]: kUniformSlab | index, or a slot in `words`
  PagedWords words;                        ///< [slot][z % 4][y % 4][bits]: 64 voxels along x, lowest bits first
  std::array<std::array<std::uint16_t, kChunkEdge>, 3> layer_counts{};  ///< non-air voxels by axis and layer
  int non_air = 0;
  std::uint32_t used = 0;              ///< entries of `counts` that are not 0
  std::uint32_t recent = 0;            ///< palette index that was written last
  std::uint32_t credit = 0;            ///< voxels changed, minus the cost of repacking
  std::uint32_t count_at = 0;          ///< at 16 bits: credit required before types are counted
  std::uint32_t first_free = kNoSlot;  ///< a slot that no slab uses; its first word holds the next one
  std::uint32_t free_count = 0;
  std::uint32_t slot_count = 0;  ///< includes free slots

  /// Returns the storage of a chunk; null if it is uniform.
  [[nodiscard]] static const ChunkStorage* of(const Chunk& chunk) { return chunk.storage_.get(); }
  /// Creates a chunk from storage. Requires: at least two types; counts, layers and slabs agree with `words`.
  [[nodiscard]] static Chunk chunk_of(Ref<ChunkStorage> storage) {
    QUOIN_ASSERT(storage != nullptr && storage->used >= 2, "voxels of several types");
    QUOIN_ASSERT(
        storage->words.size() == std::size_t{storage->slot_count} * static_cast<std::size_t>(kSlabRows * storage->bits),
        "words of each slot");
    Chunk chunk;
    chunk.storage_ = std::move(storage);
    return chunk;
  }

  [[nodiscard]] static std::size_t slab_index(int y, int z) {
    QUOIN_ASSERT((y | z) >= 0 && (y | z) < kChunkEdge, "0 <= y, z < 64");
    return static_cast<std::size_t>((z >> 2) * 16 + (y >> 2));
  }
  [[nodiscard]] static int row_in_slab(int y, int z) { return ((z & 3) << 2) | (y & 3); }

  [[nodiscard]] bool direct() const { return bits == 16; }
  /// Returns the entry of `counts` for an index.
  [[nodiscard]] std::uint32_t counted_at(std::uint32_t index) const { return direct() ? index % kRemainders : index; }
  /// Counts voxels that change from one index to another.
  void move_counts(std::uint32_t from_index, std::uint32_t to_index, std::uint32_t voxels) {
    const std::uint32_t from = counted_at(from_index);
    const std::uint32_t to = counted_at(to_index);
    QUOIN_ASSERT(from < counts.size() && to < counts.size() && counts[from] >= voxels, "counted voxels");
    if (counts[to] == 0) ++used;
    counts[to] += voxels;
    counts[from] -= voxels;
    if (counts[from] == 0) --used;
  }
  /// Counts a voxel that becomes air (-1) or was air (1).
  void count_voxel(int x, int y, int z, int delta) {
    QUOIN_ASSERT((x | y | z) >= 0 && (x | y | z) < kChunkEdge && delta * delta == 1, "one voxel of the chunk");
    non_air += delta;
    QUOIN_ASSERT(non_air >= 0 && non_air <= static_cast<int>(kChunkVoxels), "0 <= voxels <= voxels per chunk");
    layer_counts[0][static_cast<std::size_t>(x)] += static_cast<std::uint16_t>(delta);
    layer_counts[1][static_cast<std::size_t>(y)] += static_cast<std::uint16_t>(delta);
    layer_counts[2][static_cast<std::size_t>(z)] += static_cast<std::uint16_t>(delta);
  }
  // Uses shifts, which have less latency than a multiplication. A slab lies in one page.
  [[nodiscard]] std::size_t word_of(std::uint32_t slot, int row_in_slab) const {
    QUOIN_ASSERT((slot & kUniformSlab) == 0 && row_in_slab >= 0 && row_in_slab < kSlabRows, "a row of a slot");
    const int log = std::countr_zero(static_cast<unsigned>(bits) | 16U);
    return (std::size_t{slot} << (log + 4)) + (static_cast<std::size_t>(row_in_slab) << log);
  }
  [[nodiscard]] const std::uint64_t* row(std::uint32_t slot, int row_in_slab) const {
    QUOIN_ASSERT(slot < slot_count, "a slab with voxels of its own");
    return words.at(word_of(slot, row_in_slab));
  }
  /// As above, for writing. Requires: the page belongs to this chunk alone (Chunk::slot_for_writing).
  [[nodiscard]] std::uint64_t* own_row(std::uint32_t slot, int row_in_slab) {
    QUOIN_ASSERT(slot < slot_count, "a slab with voxels of its own");
    return words.own_at(word_of(slot, row_in_slab));
  }
  [[nodiscard]] std::uint32_t read(std::uint32_t slot, int row_in_slab, int x) const {
    QUOIN_ASSERT(x >= 0 && x < kChunkEdge, "0 <= x < 64");
    const auto bit = static_cast<unsigned>(x * bits);
    const std::uint64_t word = *words.at(word_of(slot, row_in_slab) + (bit >> 6));
    return static_cast<std::uint32_t>(word >> (bit & 63U)) & ((1U << bits) - 1U);
  }
  /// Requests the memory that `Chunk::set` of a voxel reads: its row, and the end of its slab.
  static void prefetch(const Chunk& chunk, IVec3 local) {
    const ChunkStorage* const m = of(chunk);
    if (m == nullptr) return;
    const std::uint32_t slot = m->slabs[slab_index(local.y, local.z)];
    if ((slot & kUniformSlab) != 0) return;
    __builtin_prefetch(m->row(slot, row_in_slab(local.y, local.z)) + (static_cast<unsigned>(local.x * m->bits) >> 6));
    __builtin_prefetch(m->row(slot, kSlabRows - 1) + m->bits - 1);
  }
  /// Requires: 0 <= x, y, z < 64.
  [[nodiscard]] VoxelType type(int x, int y, int z) const {
    const std::uint32_t slab = slabs[slab_index(y, z)];
    const std::uint32_t index = (slab & kUniformSlab) != 0 ? slab & ~kUniformSlab : read(slab, row_in_slab(y, z), x);
    QUOIN_ASSERT(direct() || index < palette.size(), "an index of the palette");
    return direct() ? static_cast<VoxelType>(index) : palette[index];
  }
};

/// Chunk::non_air_count, inline, for callers where the call would dominate the cost.
[[nodiscard]] inline int non_air_count(const Chunk& chunk) {
  const ChunkStorage* const mixed = ChunkStorage::of(chunk);
  return mixed != nullptr ? mixed->non_air : chunk.non_air_count();
}

/// The states of a row of voxels that are not 0 (VoxelData::state): for a caller that reads many, faster than
/// Chunk::data. Lifetime: until the chunk is written.
struct RowStates {
  std::uint64_t voxels = 0;               // bit x: that voxel has one
  const std::uint32_t* states = nullptr;  // of these voxels, x ascending

  /// Requires: 0 <= y, z < 64.
  [[nodiscard]] static RowStates of(const Chunk& chunk, int y, int z);
};

// Returns storage that only this chunk uses, for writing.
inline ChunkStorage& Chunk::own() {
  if (storage_.is_shared()) [[unlikely]]
    copy_storage();
  QUOIN_ASSERT(storage_ != nullptr && !storage_.is_shared(), "storage that no other chunk shares");
  return *storage_;
}

}  // namespace quoin
