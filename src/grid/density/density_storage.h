#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/grid/density_chunk.h>

#include "grid/chunk/chunk_storage.h"

namespace quoin {

/// The densities of a chunk of several. Shared by copies of the chunk until one of them is written.
struct DensityStorage : RefCounted {
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
  std::vector<Half> values;                ///< [slot][z % 4][y % 4][x]
  std::vector<std::uint32_t> free_slots;
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

}  // namespace quoin
