// What a chunk's mesh reads, brought together from the chunk and its neighbours.

#include <algorithm>
#include <cmath>
#include <cstring>

#include <quoin/core/assert.h>

#include "grid/density/density_storage.h"
#include "mesh/smooth/cell.h"
#include "mesh/smooth/scratch.h"

namespace quoin::smooth {

namespace {

constexpr std::uint64_t kAllSolid = ~std::uint64_t{0};

// Every 2^level-th bit of a word, moved together.
std::uint64_t thinned(std::uint64_t word, int level) {
  QUOIN_ASSERT(level >= 0 && level <= kMaxSmoothLevel, "a level of detail");
  if (level == 0) return word;
  std::uint64_t out = 0;
  const int n = kChunkEdge >> level;
  for (int i = 0; i < n; ++i) out |= (word >> (i << level) & 1U) << i;
  return out;
}

// A lattice coordinate as that of a chunk (-1, 0, 1) and of a sample in it.
struct ChunkCoordinate {
  int chunk;
  int sample;
};

ChunkCoordinate chunk_coordinate(int point, int level) {
  const int sample = point * (1 << level);
  QUOIN_ASSERT(sample >= -kChunkEdge && sample < 2 * kChunkEdge, "a sample of the chunk or of one beside it");
  return {sample >> kChunkShift, sample & (kChunkEdge - 1)};
}

std::uint64_t solid_row(const DensityChunk* chunk, Half outside, ChunkCoordinate y, ChunkCoordinate z) {
  if (chunk == nullptr) return DensityChunk::is_solid(outside) ? kAllSolid : 0;
  return chunk->solid_row(y.sample, z.sample);
}

// The signs of 64 rows of one chunk column at once, as they lie in storage.
void copy_signs(const DensityChunk* chunk, Half outside, int z, std::uint64_t* to) {
  if (chunk != nullptr && DensityStorage::of(*chunk) != nullptr) {
    std::memcpy(to, DensityStorage::of(*chunk)->solid.data() + std::size_t{kChunkEdge} * static_cast<std::size_t>(z),
                kChunkEdge * sizeof(std::uint64_t));
    return;
  }
  const Half value = chunk == nullptr ? outside : *chunk->uniform();
  std::fill_n(to, kChunkEdge, DensityChunk::is_solid(value) ? kAllSolid : 0);
}

// Rows 0 to 63 of slice z at level 0.
void gather_inner_signs(const DensityNeighbourhood& chunks, int z, Work& work) {
  const ChunkCoordinate cz = chunk_coordinate(z, 0);
  copy_signs(chunks.at(0, 0, cz.chunk), chunks.outside, cz.sample, work.solid[z + 1] + 1);
  copy_signs(chunks.at(-1, 0, cz.chunk), chunks.outside, cz.sample, work.before[z + 1] + 1);
  copy_signs(chunks.at(1, 0, cz.chunk), chunks.outside, cz.sample, work.after[z + 1] + 1);
  for (int y = 1; y <= kChunkEdge; ++y) work.before[z + 1][y] >>= kChunkEdge - 1;
  for (int y = 1; y <= kChunkEdge; ++y) work.after[z + 1][y] &= 1U;
}

void gather_signs(const DensityNeighbourhood& chunks, Work& work) {
  const int last = work.cells.last;  // the last point
  for (int z = work.cells.first; z <= last; ++z) {
    const ChunkCoordinate cz = chunk_coordinate(z, work.level);
    if (work.level == 0) gather_inner_signs(chunks, z, work);
    for (int y = work.cells.first; y <= last; ++y) {
      if (work.level == 0 && y == 0) y = kChunkEdge;
      if (y > last) break;
      const ChunkCoordinate cy = chunk_coordinate(y, work.level);
      const auto row = [&](int dx) { return solid_row(chunks.at(dx, cy.chunk, cz.chunk), chunks.outside, cy, cz); };
      work.solid[z + 1][y + 1] = thinned(row(0), work.level);
      work.before[z + 1][y + 1] = row(-1) >> (kChunkEdge - (1 << work.level)) & 1U;
      work.after[z + 1][y + 1] = row(1) & 1U;
    }
  }
}

RowPart row_part(const DensityChunk* chunk, Half outside, ChunkCoordinate y, ChunkCoordinate z) {
  if (chunk == nullptr) return {nullptr, outside};
  const Half* const samples = chunk->row(y.sample, z.sample);
  return {samples, samples == nullptr ? chunk->get(0, y.sample, z.sample) : Half{0}};
}

// `kCount` points of a row of one chunk at level 0, from `first` on.
template <int kCount>
void copy_points(const RowPart& part, int first, Half* to) {
  if (part.samples != nullptr) {
    std::memcpy(to, part.samples + first, kCount * sizeof(Half));
  } else {
    std::fill_n(to, kCount, part.value);
  }
}

// All points of a row of one chunk at a coarser level.
void copy_thinned(const RowPart& part, int level, Half* to) {
  const int n = kChunkEdge >> level;
  for (int i = 0; i < n; ++i) to[i] = part.samples == nullptr ? part.value : part.samples[i << level];
}

// Nothing to mesh where the chunk and all that its cells touch are of one sign throughout.
bool is_of_one_sign(const DensityNeighbourhood& chunks) {
  bool is_solid = false;
  bool is_air = false;
  for (const DensityChunk* chunk : chunks.chunks) {
    const auto uniform = chunk == nullptr ? std::optional(chunks.outside) : chunk->uniform();
    if (!uniform) return false;
    (DensityChunk::is_solid(*uniform) ? is_solid : is_air) = true;
  }
  return !(is_solid && is_air);
}

}  // namespace

int apron_of(const SmoothOcclusionOptions& occlusion) {
  if (occlusion.method == SmoothOcclusion::None) return 0;
  // The largest n_x (|n_x| + |n_y| + |n_z|) of a unit vector is (1 + sqrt(3)) / 2.
  const double reach = 1.3660254037844388 * double{occlusion.spread} + 0.1 + double{occlusion.spread};
  return static_cast<int>(std::floor(reach + 1e-3)) + 1;
}

SmoothOcclusionOptions within_limits(SmoothOcclusionOptions occlusion, int level) {
  const SmoothOcclusionOptions defaults;
  const auto limit = [](float& value, float least, float most, float otherwise) {
    value = std::isnan(value) ? otherwise : std::clamp(value, least, most);
  };
  limit(occlusion.spread, 1.0F / 16.0F, 4.0F, defaults.spread);
  occlusion.spread = snap(occlusion.spread * depth_unit(level));
  limit(occlusion.offset, 0.0F, 0.99F, defaults.offset);
  limit(occlusion.power, 1.0F / 16.0F, 64.0F, defaults.power);
  return occlusion;
}

bool prepare(const DensityNeighbourhood& chunks, Work& work) {
  if (is_of_one_sign(chunks)) return false;
  work.chunks = &chunks;
  work.apron = apron_of(work.occlusion);
  gather_signs(chunks, work);
  return true;
}

std::array<RowPart, 3> row_parts(const Work& work, int y, int z) {
  const ChunkCoordinate cy = chunk_coordinate(y, work.level);
  const ChunkCoordinate cz = chunk_coordinate(z, work.level);
  const DensityNeighbourhood& chunks = *work.chunks;
  const auto part = [&](int dx) { return row_part(chunks.at(dx, cy.chunk, cz.chunk), chunks.outside, cy, cz); };
  return {part(-1), part(0), part(1)};
}

void gather_row(const Work& work, int y, int z, Half* row) {
  const std::array<RowPart, 3> parts = row_parts(work, y, z);
  if (work.level == 0) {
    copy_points<kPointX>(parts[0], kChunkEdge - kPointX, row - kPointX);
    copy_points<kChunkEdge>(parts[1], 0, row);
    copy_points<kPointX>(parts[2], 0, row + kChunkEdge);
    return;
  }
  std::array<Half, kChunkEdge> before{};
  copy_thinned(parts[0], work.level, before.data());
  const int side = std::min(work.n, kPointX);
  std::copy_n(before.data() + work.n - side, side, row - side);
  copy_thinned(parts[1], work.level, row);
  copy_thinned(parts[2], work.level, row + work.n);
}

void add_occlusion_rows(Work& work, RowSet rows, int z) {
  for (int i = 0; i < work.apron; ++i) {
    const RowSet raised = rows.raised();
    rows.unite(rows.lowered());
    rows.unite(raised);
  }
  for (int dz = -work.apron; dz <= work.apron + 1; ++dz) {
    work.occlusion_rows[static_cast<std::size_t>(z + dz + kWidestApron)].unite(rows);
  }
}

void begin_occlusion(Work& work) {
  // The slices from `apron` below a cell to as many above its upper points.
  const int slices = work.apron <= 6 ? 16 : 32;
  work.decoded_mask = slices - 1;
  const std::size_t size = static_cast<std::size_t>(slices + kRepeatedSlices) * kDecodedSlice + 64;
  if (work.decoded.size() < size) work.decoded.resize(size);
  work.next_decoded = work.cells.first - work.apron;
}

}  // namespace quoin::smooth

namespace quoin {

int reach_of(const SmoothOcclusionOptions& occlusion, int coarsest_level) {
  const int level = std::clamp(coarsest_level, 0, kMaxSmoothLevel);
  const SmoothOcclusionOptions limited = smooth::within_limits(occlusion, level);
  // Without occlusion, splitting sheets looks at the cells beside its own.
  return (std::max(smooth::apron_of(limited), 1) + 1) << level;
}

}  // namespace quoin
