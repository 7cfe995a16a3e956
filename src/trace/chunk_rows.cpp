#include "trace/chunk_rows.h"

namespace quoin::trace {
namespace {

constexpr std::uint64_t kAll = ~std::uint64_t{0};

bool counts(const VoxelRegistry& types, VoxelType type, Occupancy which) {
  if (type == kAir) return false;
  if (which == Occupancy::NonAir) return true;
  return types.is_transparent(type) == (which == Occupancy::Transparent);
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
}

bool ChunkRows::belongs(VoxelType type) const {
  return counts(*types_, type, which_);
}

ChunkRows::Slab ChunkRows::slab(int y, int z) const {
  const Chunk::Mixed* mixed = chunk_->mixed();
  if (mixed == nullptr) return in_.empty() ? Slab::Empty : Slab::Full;
  const std::uint32_t slab = mixed->slabs[Chunk::slab_index(y, z)];
  if ((slab & Chunk::kUniformSlab) == 0) return Slab::Mixed;
  const std::uint32_t index = slab & ~Chunk::kUniformSlab;
  const VoxelType type = mixed->direct() ? static_cast<VoxelType>(index) : mixed->palette[index];
  return belongs(type) ? Slab::Full : Slab::Empty;
}

std::uint64_t ChunkRows::row(int y, int z) const {
  // Whichever list is shorter.
  const bool by_absence = out_.size() < in_.size();
  std::uint64_t mask = 0;
  for (const VoxelType type : by_absence ? out_ : in_) mask |= chunk_->row_mask(y, z, type);
  return by_absence ? ~mask : mask;
}

bool BrickRow::read(const ChunkRows& rows, int y, int z, RowsBox& box) {
  std::array<ChunkRows::Slab, 16> slabs{};
  bool is_same = true;
  for (int slab = 0; slab < 16; ++slab) {
    const auto i = static_cast<std::size_t>(slab);
    slabs[i] = rows.slab(y + 4 * (slab & 3), z + 4 * (slab >> 2));
    is_same &= slabs[i] == slabs[0];
    if (slabs[i] == ChunkRows::Slab::Full) box.add_slab(y + 4 * (slab & 3), z + 4 * (slab >> 2));
  }
  is_full = slabs[0] == ChunkRows::Slab::Full;
  if (is_same && slabs[0] != ChunkRows::Slab::Mixed) return false;
  for (int slab = 0; slab < 16; ++slab) {
    std::array<std::uint64_t, 16> words{};
    if (slabs[static_cast<std::size_t>(slab)] == ChunkRows::Slab::Full) words.fill(kAll);
    if (slabs[static_cast<std::size_t>(slab)] == ChunkRows::Slab::Mixed) {
      for (int i = 0; i < 16; ++i) {
        const int row_y = y + 4 * (slab & 3) + (i & 3);
        const int row_z = z + 4 * (slab >> 2) + (i >> 2);
        const std::uint64_t row = rows.row(row_y, row_z);
        words[static_cast<std::size_t>(i)] = row;
        box.add(row_y, row_z, row);
      }
      transpose_nibbles(words);
    }
    for (std::size_t i = 0; i < 16; ++i) bricks[i / 4][i % 4 + static_cast<std::size_t>(slab) * 4] = words[i];
  }
  return true;
}

}  // namespace quoin::trace
