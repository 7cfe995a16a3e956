#include "grid/change_records.h"

#include <algorithm>
#include <array>
#include <bit>

#include <quoin/core/assert.h>

#include "grid/chunk/chunk_storage.h"

namespace quoin {
namespace {

// Returns true if equal indices of two chunks mean the same type. Ignores entries that only one chunk has.
bool share_palette(const ChunkStorage* a, const ChunkStorage* b) {
  if (a == nullptr || b == nullptr || a->bits != b->bits) return false;
  const std::size_t both = std::min(a->palette.size(), b->palette.size());
  return std::equal(a->palette.begin(), a->palette.begin() + static_cast<std::ptrdiff_t>(both), b->palette.begin());
}

template <int kWords>
bool are_equal(const std::uint64_t* a, const std::uint64_t* b) {
  std::uint64_t other = 0;
  for (int i = 0; i < kWords; ++i) other |= a[i] ^ b[i];
  return other == 0;
}

// Returns true if two rows with `bits` bits per voxel are equal.
bool are_rows_equal(const std::uint64_t* a, const std::uint64_t* b, int bits) {
  switch (bits) {
    case 1:
      return are_equal<1>(a, b);
    case 2:
      return are_equal<2>(a, b);
    case 4:
      return are_equal<4>(a, b);
    case 8:
      return are_equal<8>(a, b);
    default:
      return are_equal<16>(a, b);
  }
}

// Returns true if a row is stored identically in both. Requires: they share a palette.
bool is_stored_alike(const ChunkStorage& a, const ChunkStorage& b, int y, int z) {
  QUOIN_ASSERT(a.bits == b.bits, "they share a palette");
  const std::uint32_t in_a = a.slabs[ChunkStorage::slab_index(y, z)];
  const std::uint32_t in_b = b.slabs[ChunkStorage::slab_index(y, z)];
  if (((in_a | in_b) & ChunkStorage::kUniformSlab) != 0) return in_a == in_b;
  const std::uint64_t* const row_in_a = a.row(in_a, ChunkStorage::row_in_slab(y, z));
  const std::uint64_t* const row_in_b = b.row(in_b, ChunkStorage::row_in_slab(y, z));
  return row_in_a == row_in_b || are_rows_equal(row_in_a, row_in_b, a.bits);  // most pages are shared
}

const Chunk& or_air(const Chunk* chunk) {
  static const Chunk all_air;
  return chunk == nullptr ? all_air : *chunk;
}

// Calls `compare(y, z, old row, new row)` for the rows that may differ.
template <class Compare>
void for_each_other_row(const Chunk& before, const Chunk& after, const IBox& within, const ChunkSlabs& slabs,
                        Compare&& compare) {
  QUOIN_ASSERT(within.empty() || intersect(within, kWholeChunk) == within, "within 0 to 64");
  if (before.shares_storage_with(after)) return;
  const bool share = share_palette(ChunkStorage::of(before), ChunkStorage::of(after));
  std::array<VoxelType, kChunkEdge> old_row;
  std::array<VoxelType, kChunkEdge> new_row;
  const auto compare_row = [&](int y, int z) {
    if (share && is_stored_alike(*ChunkStorage::of(before), *ChunkStorage::of(after), y, z)) return;
    before.read_row(y, z, old_row);
    after.read_row(y, z, new_row);
    compare(y, z, old_row, new_row);
  };
  for (int z = within.min.z; z < within.max.z; ++z) {
    for (std::uint32_t left = slabs.along_y(z); left != 0; left &= left - 1) {
      const int slab = 4 * std::countr_zero(left);
      const int end = std::min(slab + 4, within.max.y);
      for (int y = std::max(slab, within.min.y); y < end; ++y) compare_row(y, z);
    }
  }
}

std::uint64_t other_types(const std::array<VoxelType, kChunkEdge>& a, const std::array<VoxelType, kChunkEdge>& b) {
  std::uint64_t types = 0;
  for (std::size_t x = 0; x < kChunkEdge; ++x) types |= std::uint64_t{a[x] != b[x]} << x;
  return types;
}

}  // namespace

void difference_of_types(const Chunk& before, const Chunk& after, VoxelEdit& edit) {
  if (before.uniform().has_value() && after.uniform().has_value()) {
    if (before.uniform() != after.uniform()) edit.add_all();
    return;
  }
  if (before.uniform().has_value() || after.uniform().has_value()) {
    // One state is uniform: compares masks of the other's rows, as for a missing chunk, instead of types.
    const Chunk& one = before.uniform().has_value() ? before : after;
    const Chunk& other = before.uniform().has_value() ? after : before;
    if (one.shares_storage_with(other)) return;
    const bool is_of_air = one.uniform() == kAir;
    const IBox within = is_of_air ? other.bounds() : kWholeChunk;
    for (int z = within.min.z; z < within.max.z; ++z) {
      for (int y = within.min.y; y < within.max.y; ++y) {
        const std::uint64_t changed = ~other.row_mask(y, z, *one.uniform());
        if (changed != 0) edit.record.add(y, z, changed);
      }
    }
    // Uses the stored count if there is one.
    edit.voxels += is_of_air ? other.non_air_count() : static_cast<int>(kChunkVoxels) - other.count(*one.uniform());
    return;
  }
  for_each_other_row(
      before, after, kWholeChunk, ChunkSlabs::all(),
      [&](int y, int z, const auto& old_row, const auto& new_row) { edit.add(y, z, other_types(old_row, new_row)); });
}

void visit_other_rows(const Chunk* before, const Chunk* after, IVec3 chunk, const IBox& within, const ChunkSlabs& slabs,
                      FunctionRef<void(const RowChange&)> visit) {
  for_each_other_row(or_air(before), or_air(after), within, slabs,
                     [&](int y, int z, const auto& old_row, const auto& new_row) {
                       const std::uint64_t changed = other_types(old_row, new_row);
                       if (changed != 0) visit({chunk * kChunkEdge + IVec3{0, y, z}, changed, old_row, new_row});
                     });
}

ChunkDifference difference(const Chunk* before, const Chunk* after, const IBox& within) {
  ChunkDifference found;
  for_each_other_row(or_air(before), or_air(after), within, ChunkSlabs::all(),
                     [&](int y, int z, const auto& old_row, const auto& new_row) {
                       std::uint64_t solid = 0;
                       for (std::size_t x = 0; x < kChunkEdge; ++x) {
                         solid |= std::uint64_t{(old_row[x] == kAir) != (new_row[x] == kAir)} << x;
                       }
                       found.types.add(y, z, other_types(old_row, new_row));
                       found.solid.add(y, z, solid);
                     });
  return found;
}

}  // namespace quoin
