#include "grid/halving/chunk_halver.h"

#include <algorithm>
#include <bit>

#include <quoin/core/assert.h>

#include "core/rows/packed_row.h"
#include "grid/chunk/chunk_storage.h"

namespace quoin {
namespace {

constexpr int kHalfEdge = kChunkEdge / 2;
constexpr std::uint64_t kHalfRow = 0xFFFF'FFFFU;

// The eight voxels of a cell of four rows, as bits.
unsigned cell_bits(const std::array<std::uint64_t, 4>& rows, int x) {
  QUOIN_ASSERT(x >= 0 && x < kHalfEdge, "0 <= x < 32");
  unsigned bits = 0;
  for (std::size_t i = 0; i < rows.size(); ++i) bits |= static_cast<unsigned>(rows[i] >> (2 * x) & 3U) << (2 * i);
  return bits;
}

int count_bits(unsigned byte) {
  static constexpr auto kCounts = [] {
    std::array<std::uint8_t, 256> counts{};
    for (unsigned i = 0; i < counts.size(); ++i) counts.at(i) = static_cast<std::uint8_t>(std::popcount(i));
    return counts;
  }();
  return kCounts[byte & 0xFFU];
}

}  // namespace

Chunk ChunkHalver::make() {
  Chunk made;
  for (int z = 0; z < kChunkEdge; ++z) {
    for (int y = 0; y < kChunkEdge; ++y) {
      const std::uint64_t solid = masks_.solid_cells(y, z);
      if (solid == 0) continue;
      runs_.clear();
      for (int half = 0; half < 2; ++half) {
        const std::uint64_t of_half = solid >> (half * kHalfEdge) & kHalfRow;
        if (of_half != 0) fill_half(half, y, z, of_half);
      }
      for (const Run& run : runs_) made.fill_row(y, z, run.cells, run.type);
    }
  }
  made.compact();
  return made;
}

void ChunkHalver::add(VoxelType type, int half, std::uint64_t cells) {
  QUOIN_ASSERT((half == 0 || half == 1) && (cells & ~kHalfRow) == 0, "32 cells of half a row");
  if (cells == 0) return;
  const auto found = std::find_if(runs_.begin(), runs_.end(), [type](const Run& run) { return run.type == type; });
  const std::uint64_t shifted = cells << (half * kHalfEdge);
  if (found == runs_.end()) {
    runs_.push_back({type, shifted});
  } else {
    found->cells |= shifted;
  }
}

void ChunkHalver::fill_half(int half, int y, int z, std::uint64_t solid) {
  // Solid cells hold voxels, so there is a chunk.
  const Chunk* const octant = masks_.octant({half, y / kHalfEdge, z / kHalfEdge});
  QUOIN_ASSERT(octant != nullptr, "solid cells hold voxels");
  const Chunk& chunk = *octant;
  const ChunkStorage* mixed = ChunkStorage::of(chunk);
  if (mixed == nullptr) return add(*chunk.uniform(), half, solid);
  const int fine_y = 2 * (y % kHalfEdge);
  const int fine_z = 2 * (z % kHalfEdge);
  const std::uint32_t slab = mixed->slabs[ChunkStorage::slab_index(fine_y, fine_z)];
  if ((slab & ChunkStorage::kUniformSlab) != 0) return add(chunk.get(0, fine_y, fine_z), half, solid);
  find_layers(chunk, slab, half, y, z);
  std::uint64_t found = 0;
  std::uint64_t several = 0;
  for (const Layer& layer : layers_) {
    several |= found & layer.cells;
    found |= layer.cells;
  }
  for (const Layer& layer : layers_) add(layer.type, half, layer.cells & solid & ~several);
  if ((several & solid) != 0) fill_mixed(half, y, z, several & solid);
}

// Finds the types in the four rows of half a row of cells, for a slab with a slot.
void ChunkHalver::find_layers(const Chunk& chunk, std::uint32_t slab, int half, int y, int z) {
  const ChunkStorage& mixed = *ChunkStorage::of(chunk);
  std::array<const std::uint64_t*, 4> rows{};
  std::array<std::uint64_t, 4> left{};
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const int fine_y = 2 * y + static_cast<int>(i & 1);
    const int fine_z = 2 * z + static_cast<int>(i >> 1);
    rows[i] = mixed.row(slab, ChunkStorage::row_in_slab(fine_y, fine_z));
    left[i] = masks_.voxels(half, fine_y, fine_z);
  }
  layers_.clear();
  for (std::size_t i = 0; i < rows.size(); ++i) {
    while (left[i] != 0) {
      const std::uint32_t index = packed_row::read(rows[i], mixed.bits, std::countr_zero(left[i]));
      Layer& layer = layers_.emplace_back();
      layer.type = mixed.direct() ? static_cast<VoxelType>(index) : mixed.palette[index];
      layer.is_opaque = types_->is_opaque(layer.type);
      std::uint64_t any = 0;
      for (std::size_t k = i; k < rows.size(); ++k) {
        if (left[k] == 0) continue;
        layer.voxels[k] = packed_row::equal_mask(rows[k], mixed.bits, index);
        left[k] &= ~layer.voxels[k];
        any |= layer.voxels[k];
      }
      layer.cells = even_bits(any | any >> 1);
    }
  }
}

// The cells that hold several types.
void ChunkHalver::fill_mixed(int half, int y, int z, std::uint64_t mixed) {
  Exposed exposed{};
  for (std::size_t i = 0; i < exposed.size(); ++i) {
    exposed[i] = masks_.exposed_faces(half, 2 * y + static_cast<int>(i & 1), 2 * z + static_cast<int>(i >> 1));
  }
  for (Layer& layer : layers_) layer.won = 0;
  for (; mixed != 0; mixed &= mixed - 1) {
    const int x = std::countr_zero(mixed);
    layers_[heaviest(exposed, x)].won |= std::uint64_t{1} << x;
  }
  for (const Layer& layer : layers_) add(layer.type, half, layer.won);
}

std::size_t ChunkHalver::heaviest(const Exposed& exposed, int x) const {
  std::array<unsigned, 3> faces{};
  for (std::size_t digit = 0; digit < faces.size(); ++digit) {
    faces[digit] = cell_bits({exposed[0][digit], exposed[1][digit], exposed[2][digit], exposed[3][digit]}, x);
  }
  std::size_t best = 0;
  int best_weight = 0;
  bool is_best_opaque = false;
  for (std::size_t i = 0; i < layers_.size(); ++i) {
    const Layer& layer = layers_[i];
    if ((layer.cells >> x & 1U) == 0) continue;
    const unsigned voxels = cell_bits(layer.voxels, x);
    int weight = count_bits(voxels);
    for (std::size_t digit = 0; digit < faces.size(); ++digit)
      weight += count_bits(voxels & faces[digit]) << (3 + digit);
    const bool is_better = layer.is_opaque != is_best_opaque
                               ? layer.is_opaque
                               : weight > best_weight || (weight == best_weight && layer.type < layers_[best].type);
    if (!is_better) continue;
    best = i;
    best_weight = weight;
    is_best_opaque = layer.is_opaque;
  }
  return best;
}

}  // namespace quoin
