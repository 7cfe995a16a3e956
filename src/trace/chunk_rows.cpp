#include "trace/chunk_rows.h"

#include <algorithm>

#include <quoin/core/assert.h>

#include "core/rows/packed_row.h"
#include "grid/chunk/chunk_storage.h"

namespace quoin::trace {
namespace {

constexpr std::uint64_t kAll = ~std::uint64_t{0};

bool counts(const VoxelRegistry& types, VoxelType type, Occupancy which) {
  if (type == kAir) return false;
  if (which == Occupancy::NonAir) return true;
  return types.is_transparent(type) == (which == Occupancy::Transparent);
}

std::uint32_t index_of(const ChunkStorage& mixed, VoxelType type) {
  if (mixed.direct()) return type;
  const auto found = std::find(mixed.palette.begin(), mixed.palette.end(), type);
  QUOIN_ASSERT(found != mixed.palette.end(), "a type of the palette");
  return static_cast<std::uint32_t>(found - mixed.palette.begin());
}

}  // namespace

ChunkRows::ChunkRows(const Chunk& chunk, const VoxelRegistry& types, Occupancy which)
    : chunk_(&chunk), types_(&types), which_(which) {
  sort_types();
}

ChunkRows::ChunkRows(const Chunk& chunk, VoxelType only) : chunk_(&chunk), only_(only) {
  sort_types();
}

ChunkRows::ChunkRows(const Chunk& chunk, const FunctionRef<bool(VoxelType)>& counts)
    : chunk_(&chunk), counts_(&counts) {
  sort_types();
}

void ChunkRows::sort_types() {
  const ChunkStorage* const mixed = ChunkStorage::of(*chunk_);
  if (mixed == nullptr || mixed->direct()) {
    for (const VoxelType type : chunk_->types()) (belongs(type) ? in_ : out_).push_back(type);
  } else {
    for (std::size_t i = 0; i < mixed->palette.size(); ++i) {
      if (mixed->counts[i] != 0) (belongs(mixed->palette[i]) ? in_ : out_).push_back(mixed->palette[i]);
    }
  }
  const bool by_absence = out_.size() < in_.size();
  inverted_ = by_absence ? kAll : 0;
  if (mixed == nullptr) return;
  for (const VoxelType type : by_absence ? out_ : in_) asked_.push_back(index_of(*mixed, type));
}

bool ChunkRows::belongs(VoxelType type) const {
  if (counts_ != nullptr) return type != kAir && (*counts_)(type);
  return types_ == nullptr ? type == only_ : counts(*types_, type, which_);
}

Slab ChunkRows::read(int y, int z, SlabRows& rows) const {
  QUOIN_ASSERT(((y | z) & ~(kChunkEdge - 4)) == 0, "multiples of 4 within the chunk");
  const ChunkStorage* mixed = ChunkStorage::of(*chunk_);
  if (mixed == nullptr) return in_.empty() ? Slab::Empty : Slab::Full;
  const std::uint32_t slab = mixed->slabs[ChunkStorage::slab_index(y, z)];
  if ((slab & ChunkStorage::kUniformSlab) != 0) {
    const std::uint32_t index = slab & ~ChunkStorage::kUniformSlab;
    QUOIN_ASSERT(mixed->direct() || index < mixed->palette.size(), "an index of the palette");
    const VoxelType type = mixed->direct() ? static_cast<VoxelType>(index) : mixed->palette[index];
    return belongs(type) ? Slab::Full : Slab::Empty;
  }
  const std::uint64_t* row = mixed->row(slab, 0);
  const auto bits = static_cast<std::size_t>(mixed->bits);
  if (bits == 1 && asked_.size() == 1) {
    const std::uint64_t flip = ~packed_row::repeat(1, asked_[0]) ^ inverted_;
    for (std::size_t i = 0; i < rows.size(); ++i) rows[i] = row[i] ^ flip;
  } else {
    for (std::size_t i = 0; i < rows.size(); ++i) {
      std::uint64_t mask = 0;
      for (const std::uint32_t index : asked_) mask |= packed_row::equal_mask(row + i * bits, mixed->bits, index);
      rows[i] = mask ^ inverted_;
    }
  }
  // After edits, a slab may have one type without being stored as uniform.
  return slab_of(rows);
}

void find_uniform_blocks(const Chunk& chunk, const VoxelRegistry& types, const ChunkSlabs& wanted,
                         UniformBlocks& blocks) {
  constexpr int kCell = 64;
  std::uint64_t rows = 0;
  for (int row = 0; row < 16; ++row) {
    if (wanted.block((row & 3) * 16, (row >> 2) * 16) != 0) rows |= std::uint64_t{15} << (4 * row);
  }
  for (std::size_t i = 0; i < 64; ++i) {
    if ((rows >> i & 1U) != 0) blocks.cells[i] = 0;
  }
  blocks.bricks &= ~rows;
  blocks.is_whole = false;
  for (const VoxelType type : chunk.types()) {
    if (!types.is_transparent(type)) continue;
    const int count = chunk.count(type);
    if (count >= kCell) add_uniform(ChunkRows(chunk, type), rows, blocks);
    blocks.is_whole |= count == static_cast<int>(kChunkVoxels);
  }
}

void transpose_nibbles(SlabRows& w) {
  constexpr std::uint64_t kMasks[] = {0x0F0F'0F0F'0F0F'0F0FU, 0x00FF'00FF'00FF'00FFU, 0x0000'FFFF'0000'FFFFU,
                                      0x0000'0000'FFFF'FFFFU};
  for (unsigned stage = 0; stage < 4; ++stage) {
    const unsigned distance = 1U << stage;
    const unsigned shift = 4U << stage;
    for (unsigned i = 0; i < 16; ++i) {
      if ((i & distance) != 0) continue;
      const std::uint64_t t = ((w[i] >> shift) ^ w[i + distance]) & kMasks[stage];
      w[i + distance] ^= t;
      w[i] ^= t << shift;
    }
  }
}

}  // namespace quoin::trace
