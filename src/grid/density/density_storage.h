#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>
#include <optional>
#include <utility>

#include <quoin/core/assert.h>
#include <quoin/core/half.h>
#include <quoin/core/memory.h>
#include <quoin/core/vec.h>
#include <quoin/grid/density_chunk.h>
#include <quoin/grid/density_grid.h>

#include "core/memory/large_array.h"
#include "grid/chunk/chunk_storage.h"

namespace quoin {

/// Returns the largest half float that is at most `band`; at least the smallest positive one.
inline Half largest_within(float band) {
  Half half = half_from_float(band);
  if (float_from_half(half) > band) --half;
  return std::max<Half>(half, 1);
}

/// The density of samples whose value equals iso, which is common in files of integers. With 0, all cells around such a
/// sample would have their vertices at one point, and triangles between them would have no area.
inline constexpr float kDensityAtSurface = 1.0F / 256.0F;

/// The smallest normal half, 2^-14: subnormal numbers are slow, or flushed to 0, on many processors.
inline constexpr Half kLeastStored = 0x0400;

/// `stored_density` for a band that is a half.
inline Half stored_within(float density, Half band) {
  QUOIN_ASSERT(band != 0 && band <= 0x7C00U, "a positive band");
  const auto bits = std::bit_cast<std::uint32_t>(density);
  if ((bits & 0x7FFF'FFFFU) > 0x7F80'0000U) return band;  // NaN
  if (density == 0.0F) return 0;
  const Half magnitude = std::clamp<Half>(half_from_float(density) & 0x7FFFU, std::min(kLeastStored, band), band);
  return static_cast<Half>(magnitude | (bits >> 16 & 0x8000U));
}

/// The values of slabs in one block of memory, which several storages share. The first write to a slab whose slot has
/// several owners takes another slot of the block, so it copies one slab and moves no other.
///
///   storage of a snapshot   slabs: 0 1 2          block   slot     0  1  2  3
///   storage of the chunk    slabs: 0 3 2                  owners   2  1  2  1
///
/// Threads: storages with slots in one block may be read, written, copied and destroyed on several threads at once,
///          each by one thread at a time, as Ref. Only owners read a slot, and only a sole owner writes it.
class SlabValues {
 public:
  static constexpr std::size_t kSlabValues = std::size_t{kSlabRows} * kChunkEdge;

  SlabValues() = default;
  /// Creates slots with unspecified values. The caller owns the first `owned`, the others are free.
  SlabValues(std::size_t slots, std::size_t owned);

  /// Returns the values, [slot][z % 4][y % 4][x].
  [[nodiscard]] const Half* data() const { return data_; }
  [[nodiscard]] Half* data() { return data_; }
  /// Returns the number of values, those of free slots included.
  [[nodiscard]] std::size_t size() const { return block_ == nullptr ? 0 : block_->slots * kSlabValues; }
  /// Returns the allocated bytes, including those of other owners.
  [[nodiscard]] std::size_t allocated() const;

  /// Adds an owner to a slot. Requires: it has one, which does not release it meanwhile.
  void retain(std::uint32_t slot) const { owners(slot).fetch_add(1, std::memory_order_relaxed); }
  /// Removes an owner from a slot. Without owners it is free.
  void release(std::uint32_t slot) const { owners(slot).fetch_sub(1, std::memory_order_acq_rel); }
  /// Returns true if the slot has one owner.
  [[nodiscard]] bool is_sole(std::uint32_t slot) const { return owners(slot).load(std::memory_order_acquire) == 1; }
  /// Takes a free slot; nullopt if there is none.
  [[nodiscard]] std::optional<std::uint32_t> take();
  /// Returns true if other storages use the block.
  [[nodiscard]] bool is_shared() const { return block_ != nullptr && block_.is_shared(); }

 private:
  using Owners = std::atomic<std::uint32_t>;
  // The owners and the values follow this object in memory.
  struct alignas(16) Block : RefCounted {
    explicit Block(std::size_t count) : slots(count) {}
    static void operator delete(Block* block, std::destroying_delete_t) {
      const std::size_t bytes = bytes_of(block->slots);
      block->~Block();
      free_block(block, bytes);
    }
    std::size_t slots;
  };

  // The bytes of a block, and those before its values.
  static std::size_t bytes_before_values(std::size_t slots) {
    return sizeof(Block) + (slots * sizeof(Owners) + 15) / 16 * 16;
  }
  static std::size_t bytes_of(std::size_t slots) {
    return bytes_before_values(slots) + slots * kSlabValues * sizeof(Half);
  }
  [[nodiscard]] Owners& owners(std::uint32_t slot) const {
    QUOIN_ASSERT(block_ != nullptr && slot < block_->slots, "a slot of the block");
    return reinterpret_cast<Owners*>(block_.get() + 1)[slot];
  }

  Half* data_ = nullptr;
  Ref<Block> block_;
  std::uint32_t next_ = 0;  // where `take` begins to look
};

/// The densities of a chunk of several. Copies of the chunk share it until one of them is written: the writer copies
/// the tables, and slabs as it writes them.
struct DensityStorage : RefCounted, LargeObject {
  DensityStorage() = default;
  DensityStorage(const DensityStorage& other);
  DensityStorage& operator=(const DensityStorage&) = delete;
  ~DensityStorage();

  /// Returns the storage of a chunk; null if it is uniform.
  [[nodiscard]] static const DensityStorage* of(const DensityChunk& chunk) { return chunk.storage_.get(); }
  /// Creates a chunk of these densities. Requires: at least two values; each is a `stored_density`, and `solid` agrees.
  [[nodiscard]] static DensityChunk chunk_of(Ref<DensityStorage> storage, Chunk materials) {
    QUOIN_ASSERT(storage != nullptr, "several densities");
    DensityChunk chunk(Half{0});
    chunk.storage_ = std::move(storage);
    chunk.materials_ = std::move(materials);
    return chunk;
  }

  /// Negates the density of solid samples. `rows`: [z][y] masks of these samples; all must be solid.
  static void turn_outward(DensityChunk& chunk, const std::array<std::uint64_t, kChunkEdge * kChunkEdge>& rows);

  /// Returns a slot of a slab for writing, with the slab's values. A uniform slab gets a slot filled with its density.
  /// Errors: bad_alloc; the densities are unchanged.
  std::uint32_t slot_for_writing(std::size_t slab);
  /// Replaces a slab by one density.
  void make_uniform(std::size_t slab, Half density);
  /// Moves the values to a block of their own with `spare` free slots.
  void move_values(std::size_t spare);
  [[nodiscard]] std::size_t mixed_slabs() const {
    return static_cast<std::size_t>(std::count_if(slabs.begin(), slabs.end(), is_mixed));
  }
  [[nodiscard]] static bool is_mixed(std::uint32_t entry) { return (entry & ChunkStorage::kUniformSlab) == 0; }

  // The ray kernels read both tables at their addresses.
  std::array<std::uint32_t, 256> slabs =
      all_uniform(0);  ///< [z / 4][y / 4]: kUniformSlab | half, or a slot in `values`
  SlabValues values;   ///< of the mixed slabs: the storage owns their slots
  std::array<std::uint64_t, kChunkEdge * kChunkEdge> solid{};  ///< [z][y]: the signs of a row

  [[nodiscard]] const Half* row(std::uint32_t slot, int row_in_slab) const {
    QUOIN_ASSERT((std::size_t{slot} + 1) * 16 * kChunkEdge <= values.size(), "a slab with values of its own");
    QUOIN_ASSERT(row_in_slab >= 0 && row_in_slab < kSlabRows, "a row of the slab");
    return values.data() + (std::size_t{slot} * 16 + static_cast<std::size_t>(row_in_slab)) * kChunkEdge;
  }
  [[nodiscard]] Half* row(std::uint32_t slot, int row_in_slab) {
    return const_cast<Half*>(std::as_const(*this).row(slot, row_in_slab));
  }

 private:
  static constexpr std::array<std::uint32_t, 256> all_uniform(Half density) {
    std::array<std::uint32_t, 256> slabs{};
    slabs.fill(ChunkStorage::kUniformSlab | density);
    return slabs;
  }
  void add_slots();
};

/// Reads the densities of the eight corners of a cell between samples. Corner i lies `size` samples further along x, y
/// and z if bit 0, 1 and 2 of i are set.
///
/// `find_chunk(IVec3 chunk)` returns a chunk, or null if all its samples are `outside()`; called once for each chunk
/// with corners. Requires: 0 < size < 64, corners within int32.
template <class Number, class FindChunk, class Outside>
inline void read_cell_corners(IVec3 first, int size, const FindChunk& find_chunk, const Outside& outside,
                              Number* corners) {
  QUOIN_ASSERT(size > 0 && size < kChunkEdge, "0 < size < 64");
  const IVec3 chunk = chunk_of(first);
  const IVec3 local = local_of(first);
  const int last = kChunkEdge - 1 - size;  // beyond it the next chunk begins
  const unsigned beyond = unsigned{local.x > last} | unsigned{local.y > last} << 1 | unsigned{local.z > last} << 2;
  if (beyond == 0) {
    const DensityChunk* const one = find_chunk(chunk);
    const DensityStorage* const storage = one == nullptr ? nullptr : DensityStorage::of(*one);
    if (storage == nullptr) {
      std::fill_n(corners, 8, one == nullptr ? Number{outside()} : Number{float_from_half(*one->uniform())});
      return;
    }
    for (int row = 0; row < 4; ++row, corners += 2) {
      const int y = local.y + (row & 1) * size;
      const int z = local.z + (row >> 1) * size;
      const std::uint32_t slab = storage->slabs[ChunkStorage::slab_index(y, z)];
      if ((slab & ChunkStorage::kUniformSlab) != 0) {
        corners[0] = corners[1] = float_from_half(static_cast<Half>(slab));
        continue;
      }
      const Half* const samples = storage->row(slab, ChunkStorage::row_in_slab(y, z)) + local.x;
      corners[0] = float_from_half(samples[0]);
      corners[1] = float_from_half(samples[size]);
    }
    return;
  }
  std::array<const DensityChunk*, 8> chunks;
  unsigned known = 0;
  for (unsigned i = 0; i < 8; ++i) {
    const IVec3 offset(i & 1U, i >> 1 & 1U, i >> 2);
    const unsigned side = i & beyond;
    if ((known >> side & 1U) == 0) {
      known |= 1U << side;
      chunks[side] = find_chunk(chunk + IVec3(side & 1U, side >> 1 & 1U, side >> 2));
    }
    const IVec3 at = local_of(local + offset * size);
    corners[i] = chunks[side] == nullptr ? outside() : float_from_half(chunks[side]->get(at.x, at.y, at.z));
  }
}

/// Returns the differences of a field's `density_at` between the points one sample after and before a point, along each
/// axis, with the bits of six calls of `density_at`. Cost: half of theirs inside a chunk.
[[nodiscard]] DVec3 density_differences(const DensityGrid& field, const DVec3& point);

}  // namespace quoin
