#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include <quoin/core/assert.h>
#include <quoin/core/half.h>
#include <quoin/core/vec.h>
#include <quoin/grid/density_chunk.h>

#include "grid/density/density_storage.h"

namespace quoin {

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
