#include "grid/chunk_difference.h"

#include <array>
#include <cstring>

namespace quoin {
namespace {

// Whether the indices of two chunks mean the same types.
bool share_palette(const Chunk::Mixed* a, const Chunk::Mixed* b) {
  return a != nullptr && b != nullptr && a->bits == b->bits && a->palette == b->palette;
}

// Whether a row is stored alike in both. Requires: they share a palette.
bool is_stored_alike(const Chunk::Mixed& a, const Chunk::Mixed& b, int y, int z) {
  const std::uint32_t in_a = a.slabs[Chunk::slab_index(y, z)];
  const std::uint32_t in_b = b.slabs[Chunk::slab_index(y, z)];
  if (((in_a | in_b) & Chunk::kUniformSlab) != 0) return in_a == in_b;
  const int row = Chunk::row_in_slab(y, z);
  return std::memcmp(a.row(in_a, row), b.row(in_b, row), static_cast<std::size_t>(a.bits) * sizeof(std::uint64_t)) == 0;
}

void compare_row(const Chunk& before, const Chunk& after, int y, int z, ChunkDifference& found) {
  std::array<VoxelType, kChunkEdge> old_row;
  std::array<VoxelType, kChunkEdge> new_row;
  before.read_row(y, z, old_row);
  after.read_row(y, z, new_row);
  std::uint64_t types = 0;
  std::uint64_t solid = 0;
  for (std::size_t x = 0; x < kChunkEdge; ++x) {
    types |= std::uint64_t{old_row[x] != new_row[x]} << x;
    solid |= std::uint64_t{(old_row[x] == kAir) != (new_row[x] == kAir)} << x;
  }
  found.types.add(y, z, types);
  found.solid.add(y, z, solid);
}

}  // namespace

ChunkDifference difference(const Chunk* before, const Chunk* after) {
  static const Chunk kAllAir;
  const Chunk& a = before == nullptr ? kAllAir : *before;
  const Chunk& b = after == nullptr ? kAllAir : *after;
  ChunkDifference found;
  if (a.uniform().has_value() && a.uniform() == b.uniform()) return found;
  const bool share = share_palette(a.mixed(), b.mixed());
  for (int z = 0; z < kChunkEdge; ++z) {
    for (int y = 0; y < kChunkEdge; ++y) {
      if (share && is_stored_alike(*a.mixed(), *b.mixed(), y, z)) continue;
      compare_row(a, b, y, z, found);
    }
  }
  return found;
}

}  // namespace quoin
