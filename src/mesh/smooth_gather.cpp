// What a chunk's mesh reads, brought together from the chunk and its neighbours.

#include <algorithm>
#include <cmath>
#include <cstring>

#include "mesh/smooth_scratch.h"

namespace quoin::smooth {

namespace {

constexpr std::uint64_t kAllSolid = ~std::uint64_t{0};

// Every 2^level-th bit of a word, moved together.
std::uint64_t thinned(std::uint64_t word, int level) {
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
  return {sample >> kChunkShift, sample & (kChunkEdge - 1)};
}

std::uint64_t solid_row(const DensityChunk* chunk, Half outside, ChunkCoordinate y, ChunkCoordinate z) {
  if (chunk == nullptr) return DensityChunk::is_solid(outside) ? kAllSolid : 0;
  return chunk->solid_row(y.sample, z.sample);
}

void gather_signs(const DensityNeighbourhood& chunks, Work& work) {
  const int last = work.cells.last;  // the last point
  for (int z = work.cells.first; z <= last; ++z) {
    const ChunkCoordinate cz = chunk_coordinate(z, work.level);
    for (int y = work.cells.first; y <= last; ++y) {
      const ChunkCoordinate cy = chunk_coordinate(y, work.level);
      const auto row = [&](int dx) { return solid_row(chunks.at(dx, cy.chunk, cz.chunk), chunks.outside, cy, cz); };
      work.solid[z + 1][y + 1] = thinned(row(0), work.level);
      work.before[z + 1][y + 1] = row(-1) >> (kChunkEdge - (1 << work.level)) & 1U;
      work.after[z + 1][y + 1] = row(1) & 1U;
    }
  }
}

// A row of cells is active where its 2x2 rows of points are neither all solid nor all air.
void find_active(Work& work) {
  const CellRange& cells = work.cells;
  const std::uint64_t in_range = kAllSolid >> (kChunkEdge - std::min(cells.last, work.n));
  const std::uint64_t with_before = cells.first < 0 ? 1 : 0;
  const int top = work.n - 1;
  for (int z = cells.first; z < cells.last; ++z) {
    const auto s = [&](const auto& words, int dy, int dz) { return words[z + 1 + dz] + dy; };
    const std::uint64_t* const s00 = s(work.solid, 0, 0);
    const std::uint64_t* const s01 = s(work.solid, 0, 1);
    const std::uint64_t* const a00 = s(work.after, 0, 0);
    const std::uint64_t* const a01 = s(work.after, 0, 1);
    const std::uint64_t* const b00 = s(work.before, 0, 0);
    const std::uint64_t* const b01 = s(work.before, 0, 1);
    std::uint64_t* const active = work.active[z + 1];
    std::uint64_t* const active_before = work.active_before[z + 1];
    for (int i = cells.first + 1; i <= cells.last; ++i) {
      const std::uint64_t any = s00[i] | s00[i + 1] | s01[i] | s01[i + 1];
      const std::uint64_t all = s00[i] & s00[i + 1] & s01[i] & s01[i + 1];
      const std::uint64_t any_after = a00[i] | a00[i + 1] | a01[i] | a01[i + 1];
      const std::uint64_t all_after = a00[i] & a00[i + 1] & a01[i] & a01[i + 1];
      const std::uint64_t any_before = b00[i] | b00[i + 1] | b01[i] | b01[i + 1];
      const std::uint64_t all_before = b00[i] & b00[i + 1] & b01[i] & b01[i + 1];
      active[i] = (any | any >> 1 | any_after << top) & ~(all & (all >> 1 | all_after << top)) & in_range;
      active_before[i] = (any | any_before) & ~(all & all_before) & with_before;
    }
    RowSet rows;
    for (int i = cells.first + 1; i <= cells.last; ++i) {
      if ((active[i] | active_before[i]) != 0) rows.add(i - 1);
    }
    work.active_rows[static_cast<std::size_t>(z + 1)] = rows;
  }
}

// Rows of points within `apron` of an active cell's; 0: those of its corners only.
bool find_needed(int apron, Work& work) {
  work.needed_rows.fill({});
  bool is_any = false;
  for (int z = work.cells.first; z < work.cells.last; ++z) {
    RowSet rows = work.active_rows[static_cast<std::size_t>(z + 1)];
    if (rows.empty()) continue;
    is_any = true;
    rows.unite(rows.raised());
    for (int i = 0; i < apron; ++i) {
      const RowSet raised = rows.raised();
      rows.unite(rows.lowered());
      rows.unite(raised);
    }
    for (int dz = -apron; dz <= apron + 1; ++dz) {
      work.needed_rows[static_cast<std::size_t>(z + dz + kWidestApron)].unite(rows);
    }
  }
  return is_any;
}

void fill(Half* to, int count, Half value) {
  std::fill_n(to, count, value);
}

// Points [first, first + count) of a row of one chunk, counted in that chunk.
void copy_points(const DensityChunk* chunk, Half outside, int y, int z, int level, int first, int count, Half* to) {
  if (chunk == nullptr) return fill(to, count, outside);
  const Half* const from = chunk->row(y, z);
  if (from == nullptr) return fill(to, count, chunk->get(0, y, z));
  if (level == 0) {
    std::memcpy(to, from + first, static_cast<std::size_t>(count) * sizeof(Half));
    return;
  }
  for (int i = 0; i < count; ++i) to[i] = from[(first + i) << level];
}

void gather_points(const DensityNeighbourhood& chunks, int apron, Work& work) {
  const int n = work.n;
  // Sixteen points at a time on both sides, which is quicker than a few.
  const int side = work.level <= 2 ? 16 : n;
  for (int z = -apron - 1; z <= n + apron; ++z) {
    const RowSet& needed = work.needed_rows[static_cast<std::size_t>(z + kWidestApron)];
    if (needed.empty()) continue;
    const ChunkCoordinate cz = chunk_coordinate(z, work.level);
    for (int y = -apron - 1; y <= n + apron; ++y) {
      if (!needed.has(y)) continue;
      const ChunkCoordinate cy = chunk_coordinate(y, work.level);
      Half* const row = work.row(y, z);
      const auto copy = [&](int dx, int first, int count, Half* to) {
        copy_points(chunks.at(dx, cy.chunk, cz.chunk), chunks.outside, cy.sample, cz.sample, work.level, first, count,
                    to);
      };
      copy(-1, n - side, side, row - side);
      copy(0, 0, n, row);
      copy(1, 0, side, row + n);
    }
  }
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
  if (occlusion.form == SmoothOcclusion::None) return 0;
  // The largest n_x (|n_x| + |n_y| + |n_z|) of a unit vector is (1 + sqrt(3)) / 2.
  const double reach = 1.3660254037844388 * double{occlusion.spread} + 0.1 + double{occlusion.spread};
  return static_cast<int>(std::floor(reach + 1e-3)) + 1;
}

SmoothOcclusionOptions within_limits(SmoothOcclusionOptions occlusion, int level) {
  const SmoothOcclusionOptions defaults;
  const auto limit = [](float& value, float least, float most, float otherwise) {
    value = std::isnan(value) ? otherwise : std::clamp(value, least, most);
  };
  limit(occlusion.spread, 1.0F / 16.0F, level == kCoarsestLevel ? 2.0F : 4.0F, defaults.spread);
  limit(occlusion.offset, 0.0F, 0.99F, defaults.offset);
  limit(occlusion.power, 1.0F / 16.0F, 64.0F, defaults.power);
  return occlusion;
}

bool gather(const DensityNeighbourhood& chunks, Work& work) {
  if (is_of_one_sign(chunks)) return false;
  gather_signs(chunks, work);
  find_active(work);
  const int apron = apron_of(work.occlusion);
  if (!find_needed(apron, work)) return false;
  gather_points(chunks, apron, work);
  return true;
}

}  // namespace quoin::smooth

namespace quoin {

int reach_of(const SmoothOcclusionOptions& occlusion, int coarsest_level) {
  const SmoothOcclusionOptions limited = smooth::within_limits(occlusion, coarsest_level);
  return (smooth::apron_of(limited) + 1) << coarsest_level;
}

}  // namespace quoin
