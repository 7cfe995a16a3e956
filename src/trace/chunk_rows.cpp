#include "trace/chunk_rows.h"

#include <algorithm>

#include "grid/chunk/chunk_storage.h"
#include "grid/chunk/packed_row.h"

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
  return static_cast<std::uint32_t>(std::find(mixed.palette.begin(), mixed.palette.end(), type) -
                                    mixed.palette.begin());
}

// 16 rows of 16 nibbles, [z][y][x / 4], become 16 words of 4^3 bits: nibble j of word i becomes nibble i of word j.
void transpose_nibbles(std::array<std::uint64_t, 16>& w) {
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

}  // namespace

ChunkRows::ChunkRows(const Chunk& chunk, const VoxelRegistry& types, Occupancy which)
    : chunk_(&chunk), types_(&types), which_(which) {
  for (const VoxelType type : chunk.types()) (belongs(type) ? in_ : out_).push_back(type);
  const bool by_absence = out_.size() < in_.size();
  inverted_ = by_absence ? kAll : 0;
  if (const ChunkStorage* mixed = chunk.storage()) {
    for (const VoxelType type : by_absence ? out_ : in_) asked_.push_back(index_of(*mixed, type));
  }
}

bool ChunkRows::belongs(VoxelType type) const {
  return counts(*types_, type, which_);
}

ChunkRows::Slab ChunkRows::read(int y, int z, SlabRows& rows) const {
  const ChunkStorage* mixed = chunk_->storage();
  if (mixed == nullptr) return in_.empty() ? Slab::Empty : Slab::Full;
  const std::uint32_t slab = mixed->slabs[ChunkStorage::slab_index(y, z)];
  if ((slab & ChunkStorage::kUniformSlab) != 0) {
    const std::uint32_t index = slab & ~ChunkStorage::kUniformSlab;
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
  std::uint64_t any = 0;
  std::uint64_t all = kAll;
  for (const std::uint64_t mask : rows) {
    any |= mask;
    all &= mask;
  }
  // Edits leave slabs behind that are of one type but not stored so.
  return any == 0 ? Slab::Empty : all == kAll ? Slab::Full : Slab::Mixed;
}

bool BrickRow::read(const ChunkRows& rows, int y, int z, RowsBox& box) {
  int empty = 0;
  int full = 0;
  ChunkRows::SlabRows words;
  for (int slab = 0; slab < 16; ++slab) {
    const int slab_y = y + 4 * (slab & 3);
    const int slab_z = z + 4 * (slab >> 2);
    const ChunkRows::Slab kind = rows.read(slab_y, slab_z, words);
    if (kind == ChunkRows::Slab::Empty) {
      words.fill(0);
      ++empty;
    } else if (kind == ChunkRows::Slab::Full) {
      words.fill(kAll);
      box.add_slab(slab_y, slab_z);
      ++full;
    } else {
      for (int i = 0; i < 16; ++i) box.add(slab_y + (i & 3), slab_z + (i >> 2), words[static_cast<std::size_t>(i)]);
      transpose_nibbles(words);
    }
    for (std::size_t i = 0; i < 16; ++i) bricks[i / 4][i % 4 + static_cast<std::size_t>(slab) * 4] = words[i];
  }
  is_full = full == 16;
  return empty != 16 && full != 16;
}

}  // namespace quoin::trace
