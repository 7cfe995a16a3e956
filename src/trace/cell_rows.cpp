#include "trace/cell_rows.h"

#include <algorithm>

#include <quoin/core/assert.h>

#include "grid/density/density_storage.h"

namespace quoin::trace {
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
    constexpr std::uint64_t kAll = ~std::uint64_t{0};
    if (!solid.none()) blocks.is_whole |= add_uniform(FullRows(solid), kAll, blocks) == kAll;
  }
  return blocks;
}

}  // namespace quoin::trace
