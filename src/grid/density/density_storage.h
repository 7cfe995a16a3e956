#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/half.h>
#include <quoin/core/memory.h>
#include <quoin/core/vec.h>
#include <quoin/grid/density_chunk.h>

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

/// The densities of a chunk of several. Shared by copies of the chunk until one of them is written.
struct DensityStorage : RefCounted, LargeObject {
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

  std::array<std::uint32_t, 256> slabs{};  ///< [z / 4][y / 4]: ChunkStorage::kUniformSlab | half, or a slot in `values`
  BlockVector<Half> values;                ///< [slot][z % 4][y % 4][x]
  BlockVector<std::uint32_t> free_slots;
  std::array<std::uint64_t, kChunkEdge * kChunkEdge> solid{};  ///< [z][y]: the signs of a row

  [[nodiscard]] const Half* row(std::uint32_t slot, int row_in_slab) const {
    QUOIN_ASSERT((std::size_t{slot} + 1) * 16 * kChunkEdge <= values.size(), "a slab with values of its own");
    QUOIN_ASSERT(row_in_slab >= 0 && row_in_slab < kSlabRows, "a row of the slab");
    return values.data() + (std::size_t{slot} * 16 + static_cast<std::size_t>(row_in_slab)) * kChunkEdge;
  }
  [[nodiscard]] Half* row(std::uint32_t slot, int row_in_slab) {
    return const_cast<Half*>(std::as_const(*this).row(slot, row_in_slab));
  }
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

}  // namespace quoin
