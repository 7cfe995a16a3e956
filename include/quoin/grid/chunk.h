#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/function_ref.h>
#include <quoin/core/ref.h>
#include <quoin/core/vec.h>
#include <quoin/grid/voxel_registry.h>

namespace quoin {

inline constexpr int kChunkShift = 6;
/// Voxels along a chunk's edge: the width of a machine word.
inline constexpr int kChunkEdge = 1 << kChunkShift;
inline constexpr std::size_t kChunkVoxels = std::size_t{1} << (3 * kChunkShift);

/// Chunk that holds a voxel; voxel -1 lies in chunk -1.
[[nodiscard]] inline IVec3 chunk_of(IVec3 voxel) {
  return {voxel.x >> kChunkShift, voxel.y >> kChunkShift, voxel.z >> kChunkShift};
}
/// Position of a voxel inside its chunk, 0..63 on each axis.
[[nodiscard]] inline IVec3 local_of(IVec3 voxel) {
  return {voxel.x & (kChunkEdge - 1), voxel.y & (kChunkEdge - 1), voxel.z & (kChunkEdge - 1)};
}

/// All of a chunk, in its own coordinates.
inline constexpr IBox kWholeChunk = {IVec3{0}, IVec3{kChunkEdge}};

/// 64^3 voxels, compressed by a palette to 1, 2, 4, 8 or 16 bits each.
///
/// Voxels lie in rows of 64 along x, so one bit plane of a row is one word. 4x4 rows (64x4x4 voxels) are a slab, the
/// unit of uniformity: a slab of one type holds no voxel data, a chunk of one type holds nothing but that type.
/// Writes notice that a slab or the chunk became uniform and that fewer bits would do, so that edits and their undoing
/// leave about the memory that a new chunk takes; `compact` gives back the rest.
/// Writes keep, at all times, how many voxels there are of each type and in each of the 3 x 64 layers, so counts and
/// tight bounds cost nothing to ask.
/// Copies share their storage until one of them is written, so that a copy costs no more than a pointer; a write to
/// what is shared copies it first. Threads: copies may be read, written and destroyed on several threads, each copy by
/// itself.
class Chunk {
 public:
  explicit Chunk(VoxelType uniform = kAir) : uniform_(uniform) {}

  /// From 64^3 types, x fastest, then y, then z. The smallest storage that holds them.
  static Chunk from_dense(std::span<const VoxelType, kChunkVoxels> types);

  /// Requires: 0 <= x, y, z < 64.
  [[nodiscard]] VoxelType get(int x, int y, int z) const {
    QUOIN_ASSERT((x | y | z) >= 0 && (x | y | z) < kChunkEdge, "0 <= x, y, z < 64");
    return mixed_ == nullptr ? uniform_ : mixed_->type(x, y, z);
  }
  [[nodiscard]] VoxelType get(IVec3 local) const { return get(local.x, local.y, local.z); }

  /// Sets the voxels of one row whose bits are set in `mask`; returns which of them had another type before.
  std::uint64_t set_row(int y, int z, std::uint64_t mask, VoxelType type);
  /// Sets the 64 voxels of one row; returns which of them had another type before.
  std::uint64_t write_row(int y, int z, std::span<const VoxelType, kChunkEdge> types) {
    return write_row(y, z, ~std::uint64_t{0}, types);
  }
  /// Sets those of the 64 voxels of one row whose bits are set in `mask`; returns which had another type before.
  std::uint64_t write_row(int y, int z, std::uint64_t mask, std::span<const VoxelType, kChunkEdge> types);
  void read_row(int y, int z, std::span<VoxelType, kChunkEdge> out) const;
  /// Returns true when the voxel had another type before. Requires: 0 <= x, y, z < 64.
  bool set(int x, int y, int z, VoxelType type);
  bool set(IVec3 local, VoxelType type) { return set(local.x, local.y, local.z, type); }
  /// Makes the whole chunk one type.
  void fill(VoxelType type);
  /// Sets the voxels of a box (clipped to the chunk); calls `on_change` for every row in which some had another type.
  void fill_box(const IBox& box, VoxelType type, FunctionRef<void(int y, int z, std::uint64_t changed)> on_change);

  /// Which of a row's voxels have this type.
  [[nodiscard]] std::uint64_t row_mask(int y, int z, VoxelType type) const;

  /// The one type of the whole chunk, if it is stored as such.
  [[nodiscard]] std::optional<VoxelType> uniform() const {
    return mixed_ == nullptr ? std::optional(uniform_) : std::nullopt;
  }
  [[nodiscard]] int non_air_count() const {
    if (mixed_ != nullptr) return mixed_->non_air;
    return uniform_ == kAir ? 0 : static_cast<int>(kChunkVoxels);
  }
  /// Whether no voxel is air.
  [[nodiscard]] bool is_full() const { return non_air_count() == static_cast<int>(kChunkVoxels); }
  /// Whether a copy of the other has not been written since, nor this: equal without a look. False says nothing.
  [[nodiscard]] bool shares_storage_with(const Chunk& other) const {
    return mixed_ == other.mixed_ && (mixed_ != nullptr || uniform_ == other.uniform_);
  }
  /// The same types everywhere, however they are stored. Cost: none where storage is shared; O(voxels) otherwise.
  [[nodiscard]] bool operator==(const Chunk& other) const;
  /// A number that says what the voxels are, whatever edits led to them and however they are stored: equal for equal
  /// chunks, on every machine. Not for those who mean harm. Cost: up to 0.1 ms; it is not kept.
  [[nodiscard]] std::uint64_t content_hash() const;
  /// How many voxels have this type. Cost: O(palette), or O(voxels) at 16 bits a voxel.
  [[nodiscard]] int count(VoxelType type) const;
  /// The types that occur, ascending. Cost: as `count`.
  [[nodiscard]] std::vector<VoxelType> types() const;
  /// The smallest box around the non-air voxels, in chunk coordinates; empty when all is air. Cost: O(64).
  [[nodiscard]] IBox bounds() const;
  /// Bytes held, this object included.
  [[nodiscard]] std::size_t bytes() const;
  /// Gives back what edits left behind: unused palette entries, bits, slabs that became uniform.
  void compact();

  /// The storage itself, for code that turns voxels into masks (meshing, tracing).
  struct Mixed : RefCounted {
    static constexpr std::uint32_t kNoSlot = 0xFFFF'FFFFU;
    /// Of types at 16 bits: so few that a chunk can keep their counts, so many that 256 types or fewer show.
    static constexpr std::uint32_t kRemainders = 1'024;
    int bits = 1;                            ///< a voxel: 1, 2, 4, 8 or 16
    std::vector<VoxelType> palette;          ///< type of each index; unused at 16 bits, where the index is the type
    std::vector<std::uint32_t> counts;       ///< voxels of each index; at 16 bits of each remainder by kRemainders
    std::array<std::uint32_t, 256> slabs{};  ///< [z / 4][y / 4]: kUniformSlab | index, or a slot in `words`
    std::vector<std::uint64_t> words;        ///< [slot][z % 4][y % 4][bits]: 64 voxels along x, lowest bits first
    std::array<std::array<std::uint16_t, kChunkEdge>, 3> layer_counts{};  ///< non-air voxels by axis and layer
    int non_air = 0;
    std::uint32_t used = 0;              ///< entries of `counts` that are not 0
    std::uint32_t recent = 0;            ///< palette index that was written last
    std::uint32_t credit = 0;            ///< voxels that changed, less what storing them anew has cost since
    std::uint32_t count_at = 0;          ///< at 16 bits: the credit from which on types may be counted
    std::uint32_t first_free = kNoSlot;  ///< a slot that no slab has; its first word holds the next one
    std::uint32_t free_count = 0;
    std::uint32_t slot_count = 0;  ///< free ones included

    [[nodiscard]] bool direct() const { return bits == 16; }
    /// The entry of `counts` for an index.
    [[nodiscard]] std::uint32_t counted_at(std::uint32_t index) const { return direct() ? index % kRemainders : index; }
    /// Books voxels that change from one index to another.
    void move_counts(std::uint32_t from_index, std::uint32_t to_index, std::uint32_t voxels) {
      const std::uint32_t from = counted_at(from_index);
      const std::uint32_t to = counted_at(to_index);
      if (counts[to] == 0) ++used;
      counts[to] += voxels;
      counts[from] -= voxels;
      if (counts[from] == 0) --used;
    }
    /// Books that a voxel became air, or was: -1 or 1.
    void count_voxel(int x, int y, int z, int delta) {
      non_air += delta;
      layer_counts[0][static_cast<std::size_t>(x)] += static_cast<std::uint16_t>(delta);
      layer_counts[1][static_cast<std::size_t>(y)] += static_cast<std::uint16_t>(delta);
      layer_counts[2][static_cast<std::size_t>(z)] += static_cast<std::uint16_t>(delta);
    }
    [[nodiscard]] const std::uint64_t* row(std::uint32_t slot, int row_in_slab) const {
      return words.data() + (static_cast<std::size_t>(slot) * 16 + static_cast<std::size_t>(row_in_slab)) *
                                static_cast<std::size_t>(bits);
    }
    [[nodiscard]] std::uint64_t* row(std::uint32_t slot, int row_in_slab) {
      return const_cast<std::uint64_t*>(std::as_const(*this).row(slot, row_in_slab));
    }
    // By shifts: who waits for the slot waits less than for a multiplication.
    [[nodiscard]] std::uint32_t read(std::uint32_t slot, int row_in_slab, int x) const {
      const int log = std::countr_zero(static_cast<unsigned>(bits) | 16U);
      const unsigned bit = static_cast<unsigned>(x) << log;
      const std::size_t in_slab = (static_cast<std::size_t>(row_in_slab) << log) + (bit >> 6);
      const std::uint64_t word = words.data()[(std::size_t{slot} << (log + 4)) + in_slab];
      return static_cast<std::uint32_t>(word >> (bit & 63U)) & ((1U << bits) - 1U);
    }
    /// Requires: 0 <= x, y, z < 64.
    [[nodiscard]] VoxelType type(int x, int y, int z) const {
      const std::uint32_t slab = slabs[slab_index(y, z)];
      const std::uint32_t index =
          (slab & kUniformSlab) != 0 ? slab & ~kUniformSlab : read(slab, Chunk::row_in_slab(y, z), x);
      return direct() ? static_cast<VoxelType>(index) : palette[index];
    }
  };
  static constexpr std::uint32_t kUniformSlab = 0x8000'0000U;
  [[nodiscard]] static std::size_t slab_index(int y, int z) {
    return static_cast<std::size_t>((z >> 2) * 16 + (y >> 2));
  }
  [[nodiscard]] static int row_in_slab(int y, int z) { return ((z & 3) << 2) | (y & 3); }
  /// Null when the chunk is uniform.
  [[nodiscard]] const Mixed* mixed() const { return mixed_.get(); }

 private:
  // What is about to be written: of this chunk alone.
  Mixed& own() {
    if (mixed_.is_shared()) [[unlikely]]
      copy_storage();
    return *mixed_;
  }
  void copy_storage();
  void make_mixed();
  std::uint32_t index_for(VoxelType type);
  std::uint32_t find_or_add(VoxelType type);
  std::uint32_t slot_for_writing(std::size_t slab);
  void release_slot(std::size_t slab, std::uint32_t index);
  void count_change(int y, int z, std::uint64_t became_air, std::uint64_t became_solid);
  std::uint32_t replace(int y, int z, std::uint64_t changed, VoxelType type);
  bool set_anywhere(int x, int y, int z, VoxelType type);
  void after_writing(int y, int z, std::uint32_t index, std::uint32_t changed);
  void pack_slab(std::size_t slab, std::span<const VoxelType, kChunkVoxels> types,
                 const std::vector<std::uint32_t>& index_of);
  void tidy();
  void repack(int bits);
  [[nodiscard]] std::size_t used_types() const;
  [[nodiscard]] bool is_one_entry() const;

  VoxelType uniform_;
  Ref<Mixed> mixed_;
};

}  // namespace quoin
