#include "trace/chunk_rows.h"

#include <algorithm>

#include <quoin/core/assert.h>

#include "core/rows/packed_row.h"
#include "grid/chunk/chunk_storage.h"
#include "grid/density/density_storage.h"

namespace quoin::trace {
namespace {

bool counts(const VoxelRegistry& types, VoxelType type, Occupancy which) {
  if (type == kAir) return false;
  if (which == Occupancy::NonAir) return true;
  if (which == Occupancy::Glass && types.is_shaped(type)) return false;
  return types.is_transparent(type) == (which != Occupancy::Opaque);
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

Slab ListedChunkRows::read(int y, int z, SlabRows& rows) const {
  const Slab kind = rows_->read(y, z, rows);
  if (kind == (join_ == Join::Both ? Slab::Empty : Slab::Full)) return kind;
  if (kind != Slab::Mixed) rows.fill(kind == Slab::Full ? kAll : 0);
  for (int i = 0; i < 16; ++i) {
    const std::uint64_t listed = listed_[static_cast<std::size_t>(y + (i & 3) + kChunkEdge * (z + (i >> 2)))];
    std::uint64_t& row = rows[static_cast<std::size_t>(i)];
    row = join_ == Join::Both ? row & listed : row | listed;
  }
  return slab_of(rows);
}

void find_uniform_blocks(const Chunk& chunk, const VoxelRegistry& types, std::span<const std::uint64_t> listed,
                         UniformBlocks& blocks) {
  constexpr int kCell = 64;
  blocks = {};
  for (const VoxelType type : chunk.types()) {
    if (!types.is_transparent(type) || chunk.count(type) < kCell) continue;
    const ChunkRows rows(chunk, type);
    const bool is_whole =
        types.is_shaped(type)
            ? add_uniform(ListedChunkRows(rows, listed, ListedChunkRows::Join::Both), kAll, blocks) == kAll
            : add_uniform(rows, kAll, blocks) == kAll;
    blocks.is_whole |= is_whole;
  }
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

void split_blocks(std::span<const std::uint64_t> listed, UniformBlocks& blocks) {
  QUOIN_ASSERT(listed.empty() || listed.size() == std::size_t{kChunkEdge} * kChunkEdge, "a row for each y and z");
  for (std::size_t i = 0; i < listed.size(); ++i) {
    if (listed[i] == 0) continue;
    const std::size_t y = i % kChunkEdge;
    const std::size_t z = i / kChunkEdge;
    for (std::size_t x = 0; x < 16; ++x) {
      if ((listed[i] >> (4 * x) & 15U) == 0) continue;
      const std::size_t brick = x / 4 + 4 * (y / 16) + 16 * (z / 16);
      const std::size_t cell = x % 4 + 4 * (y / 4 % 4) + 16 * (z / 4 % 4);
      blocks.cells[brick] &= ~(std::uint64_t{1} << cell);
      blocks.bricks &= ~(std::uint64_t{1} << brick);
    }
    blocks.is_whole = false;
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

namespace {

// Cells whose corners all count.
class FullRows {
 public:
  explicit FullRows(const SolidRows& samples) : samples_(&samples) {}
  [[nodiscard]] Slab read(int y, int z, SlabRows& rows) const {
    const auto ends = [this](int at_y, int at_z) { return samples_->at(at_y, at_z) & samples_->next(at_y, at_z); };
    return join_corners(
        y, z, ends, [](std::uint64_t a, std::uint64_t b) { return a & b; }, rows);
  }

 private:
  const SolidRows* samples_;
};

// Calls `visit(at, row)` for the first `size` rows along y and z of a chunk, with the samples that are solid and of a
// counted material, until it returns false.
template <class Visit>
void visit_solid_rows(const DensityChunk& samples, const ChunkRows& materials, IVec3 size, const Visit& visit) {
  SlabRows words;
  for (int slab = 0; slab < 256; ++slab) {
    const IVec3 first{0, (slab & 15) * 4, (slab >> 4) * 4};
    if (first.y >= size.y || first.z >= size.z) continue;
    const Slab kind = materials.read(first.y, first.z, words);
    if (kind != Slab::Mixed) words.fill(kind == Slab::Full ? ~std::uint64_t{0} : 0);
    for (int i = 0; i < 16; ++i) {
      const IVec3 at = first + IVec3{0, i & 3, i >> 2};
      if (at.y >= size.y || at.z >= size.z) continue;
      if (!visit(at, words[static_cast<std::size_t>(i)] & samples.solid_row(at.y, at.z))) return;
    }
  }
}

}  // namespace

CellRows::CellRows(const DensityGrid& field, IVec3 chunk) {
  for (int i = 0; i < 8; ++i) {
    const DensityChunk* const found = field.find_chunk(chunk + IVec3{i & 1, i >> 1 & 1, i >> 2});
    if (found == nullptr) continue;
    Signs& signs = signs_[static_cast<std::size_t>(i)];
    if (const DensityStorage* const storage = DensityStorage::of(*found)) {
      signs.rows = storage->solid.data();
      is_air_ = false;
    } else if (DensityChunk::is_solid(*found->uniform())) {
      signs.all = ~std::uint64_t{0};
      is_air_ = false;
    }
  }
}

std::uint64_t CellRows::either_end(int y, int z) const {
  QUOIN_ASSERT((y | z) >= 0 && y <= kChunkEdge && z <= kChunkEdge, "0 <= y, z <= 64");
  const std::size_t part = (y >= kChunkEdge ? 2U : 0U) + (z >= kChunkEdge ? 4U : 0U);
  const auto row = static_cast<std::size_t>((z & (kChunkEdge - 1)) * kChunkEdge + (y & (kChunkEdge - 1)));
  const Signs& own = signs_[part];
  const Signs& next = signs_[part + 1];
  const std::uint64_t low = own.rows == nullptr ? own.all : own.rows[row];
  const std::uint64_t first_of_next = (next.rows == nullptr ? next.all : next.rows[row]) & 1U;
  return low | low >> 1 | first_of_next << 63;
}

Slab CellRows::read(int y, int z, SlabRows& rows) const {
  const auto ends = [this](int at_y, int at_z) { return either_end(at_y, at_z); };
  return join_corners(
      y, z, ends, [](std::uint64_t a, std::uint64_t b) { return a | b; }, rows);
}

SolidRows::SolidRows(const DensityGrid& field, const VoxelRegistry& types, IVec3 chunk) {
  read(field, chunk, [&](const Chunk& materials) { return ChunkRows(materials, types, Occupancy::Transparent); });
}

SolidRows::SolidRows(const DensityGrid& field, VoxelType only, IVec3 chunk) {
  read(field, chunk, [&](const Chunk& materials) { return ChunkRows(materials, only); });
}

template <class RowsOf>
void SolidRows::read(const DensityGrid& field, IVec3 chunk, const RowsOf& rows_of) {
  for (int i = 0; i < 8; ++i) {
    const IVec3 offset{i & 1, i >> 1 & 1, i >> 2};
    const DensityChunk* const samples = field.find_chunk(chunk + offset);
    if (samples == nullptr) continue;
    const ChunkRows materials = rows_of(samples->materials());
    if (!materials.none()) read_chunk(*samples, materials, offset);
  }
}

// `offset`: the chunk's offset, 0 or 1 along each axis. In the direction of an offset, only the first samples are read.
void SolidRows::read_chunk(const DensityChunk& samples, const ChunkRows& materials, IVec3 offset) {
  QUOIN_ASSERT(((offset.x | offset.y | offset.z) & ~1) == 0, "offsets of 0 or 1");
  if (rows_.empty()) {
    rows_.resize(kRows * kRows);
    last_.resize(kRows * kRows);
  }
  const IVec3 from = offset * kChunkEdge;
  const IVec3 size = IVec3(1) + (IVec3(1) - offset) * (kChunkEdge - 1);
  visit_solid_rows(samples, materials, size, [&](IVec3 at, std::uint64_t row) {
    const std::size_t to = index(from.y + at.y, from.z + at.z);
    if (offset.x == 0) {
      rows_[to] = row;
    } else {
      last_[to] = static_cast<std::uint8_t>(row & 1U);
    }
    return true;
  });
}

bool has_glass(const DensityChunk& samples, const VoxelRegistry& types) {
  if (!types.has_transparent()) return false;
  const ChunkRows materials(samples.materials(), types, Occupancy::Transparent);
  if (materials.none()) return false;
  bool has_none = true;
  visit_solid_rows(samples, materials, IVec3(kChunkEdge),
                   [&](IVec3, std::uint64_t row) { return has_none = row == 0; });
  return !has_none;
}

Slab GlassRows::read(int y, int z, SlabRows& rows) const {
  const auto ends = [this](int at_y, int at_z) { return samples_.at(at_y, at_z) | samples_.next(at_y, at_z); };
  return join_corners(
      y, z, ends, [](std::uint64_t a, std::uint64_t b) { return a | b; }, rows);
}

UniformBlocks uniform_glass(const DensityGrid& field, const VoxelRegistry& types, IVec3 chunk) {
  constexpr int kCell = 64;  // the first of a cell's corners that belong to the chunk itself
  UniformBlocks blocks;
  const DensityChunk* const samples = field.find_chunk(chunk);
  if (samples == nullptr) return blocks;
  for (const VoxelType type : samples->materials().types()) {
    if (!types.is_transparent(type) || samples->materials().count(type) < kCell) continue;
    const SolidRows solid(field, type, chunk);
    if (!solid.none()) blocks.is_whole |= add_uniform(FullRows(solid), kAll, blocks) == kAll;
  }
  return blocks;
}

}  // namespace quoin::trace
