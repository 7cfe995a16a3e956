// The loop over the slices of a chunk, for every kernel.
//
//   signs          solid[z + 1][y + 1]     one word per row of points; points -1 and n are in separate words
//   active cells   active[z + 1][y + 1]    one word per row of cells: the 2x2x2 points differ
//   slice z        places of active cells  -> vertices, stored by place for two slices
//                  places of crossed edges -> quads of the vertices of this slice and the last
//   occlusion      by lists (listed.inl) or, with many active cells, from decoded[z & ring_mask] (occlusion_lanes.inl)

#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>

#include <quoin/core/assert.h>

#include "mesh/smooth/smooth_cell.h"
#include "mesh/smooth/smooth_mesher.h"

namespace quoin::smooth {
namespace {

// The share of active cells above which interpolating all samples is faster than listing the required samples
// (docs/decisions/123).
#ifdef QUOIN_KERNEL_AVX512
constexpr double kManyActive = 0.38;
#elif defined(QUOIN_KERNEL_AVX2)
constexpr double kManyActive = 0.27;
#else
constexpr double kManyActive = 2.0;  // never
#endif

// Room for stores of the vector kernels beyond the end.
constexpr std::size_t kSlack = 32;

enum class Axis : std::uint8_t { X, Y, Z };

struct Slice {
  int z = 0;
  std::uint32_t first_vertex = 0;          // of the current slice
  std::uint32_t first_vertex_of_last = 0;  // of the slice before
};

SmoothCell cell_code(int x, int y, int z, int n) {
  const auto mask = static_cast<std::uint32_t>(n - 1);
  const auto part = [&](int c, int shift, int axis) {
    return (static_cast<std::uint32_t>(c) & mask) << shift | static_cast<std::uint32_t>(c < 0)
                                                                 << (SmoothCell::kPreviousShift + axis);
  };
  return {part(x, 0, 0) | part(y, 6, 1) | part(z, 12, 2)};
}

constexpr int kPlaceMask = 0x3FFF;
constexpr int kStartsSolid = 0x8000;
constexpr std::uint32_t kVertexMask = (1U << kVertexBits) - 1;

// The cells around an edge along an axis, in the order of kCellsAround; (u, v) are the next two axes.
template <Axis kAxis>
struct Around {
  static constexpr int u = (static_cast<int>(kAxis) + 1) % 3;
  static constexpr int v = (static_cast<int>(kAxis) + 2) % 3;
  // Returns 1 if a cell is before the edge along an axis.
  static constexpr int before(std::size_t cell, int axis) {
    return static_cast<int>(axis == u ? kCellsAround[cell] & 1U : axis == v ? kCellsAround[cell] >> 1 : 0U);
  }
  static constexpr int places_back(std::size_t cell) { return before(cell, 0) + before(cell, 1) * kPlaceStride; }
  // The distance of a cell back to an earlier index in its slice, and whether it is in the slice before.
  static constexpr std::array<int, 4> back = {places_back(0), places_back(1), places_back(2), places_back(3)};
  static constexpr std::array<bool, 4> is_last = {before(0, 2) != 0, before(1, 2) != 0, before(2, 2) != 0,
                                                  before(3, 2) != 0};
};

// The vectors from corner 0 to corner 2, and from corner 3 to corner 1, in whole cells: (1, 1) and (1, -1) along (u,
// v).
template <Axis kAxis>
constexpr std::array<int, 3> along_diagonal(int v_sign) {
  std::array<int, 3> along{};
  along[Around<kAxis>::u] = 1;
  along[Around<kAxis>::v] = v_sign;
  return along;
}

// Each kernel defines these functions for vertices, occlusion and quads, and append_places.
void make_vertices(Work& work, const Slice& slice, std::size_t count, SmoothChunkMesh& out);
void add_occlusion(Work& work, const Slice& slice, std::size_t count, float* occlusion);
template <Axis kAxis>
void make_quads(const Work& work, const Slice& slice, std::size_t count, std::uint32_t* out);

#ifndef QUOIN_KERNEL_AVX512
// Appends places one by one.
std::uint16_t* append_places(std::uint64_t bits, int first_place, std::uint16_t* end) {
  for (; bits != 0; bits &= bits - 1) *end++ = static_cast<std::uint16_t>(first_place + std::countr_zero(bits));
  return end;
}

std::uint16_t* append_edges(std::uint64_t bits, std::uint64_t solid, int first_place, std::uint16_t* end) {
  for (; bits != 0; bits &= bits - 1) {
    const int x = std::countr_zero(bits);
    *end++ = static_cast<std::uint16_t>((first_place + x) | static_cast<int>(solid >> x & 1U) << 15);
  }
  return end;
}
#endif

// The points of a row and the next, in two slices: solid in any of the four rows, and in all of them.
struct FourRows {
  std::uint64_t any;
  std::uint64_t all;
};

inline FourRows four_rows(const std::uint64_t* low, const std::uint64_t* high) {
  return {low[0] | low[1] | high[0] | high[1], low[0] & low[1] & high[0] & high[1]};
}

// A row of cells is active if its 2x2 rows of points are neither all solid nor all air.
void find_active(Work& work) {
  const CellRange& cells = work.cells;
  QUOIN_ASSERT(work.n > 0 && work.n <= kChunkEdge, "points of the chunk");
  QUOIN_ASSERT(cells.first >= -1 && cells.first < cells.last && cells.last <= work.n, "a range of cells of the chunk");
  const std::uint64_t in_range = ~std::uint64_t{0} >> (kChunkEdge - std::min(cells.last, work.n));
  const std::uint64_t with_before = cells.first < 0 ? 1 : 0;
  const int top = work.n - 1;
  for (int z = cells.first; z < cells.last; ++z) {
    const auto four = [z](const auto& words, int i) { return four_rows(words[z + 1] + i, words[z + 2] + i); };
    std::uint64_t* const active = work.active[z + 1];
    std::uint64_t* const active_before = work.active_before[z + 1];
    for (int i = cells.first + 1; i <= cells.last; ++i) {
      const FourRows own = four(work.solid, i);
      const FourRows after = four(work.after, i);
      const FourRows before = four(work.before, i);
      active[i] =
          (own.any | own.any >> 1 | after.any << top) & ~(own.all & (own.all >> 1 | after.all << top)) & in_range;
      active_before[i] = (own.any | before.any) & ~(own.all & before.all) & with_before;
    }
    // Bit y + 1 represents row y; row -1 is separate.
    std::uint64_t rows = 0;
    for (int y = 0; y < cells.last; ++y) {
      rows |= std::uint64_t{(active[y + 1] | active_before[y + 1]) != 0} << y;
    }
    const bool has_first = cells.first < 0 && (active[0] | active_before[0]) != 0;
    work.active_rows[static_cast<std::size_t>(z + 1)] = RowSet::of(has_first, rows);
  }
}

// Marks the rows of points at corners of active cells, and the rows within their apron.
bool find_needed(Work& work) {
  work.corner_rows.fill({});
  work.occlusion_rows.fill({});
  bool is_any = false;
  for (int z = work.cells.first; z < work.cells.last; ++z) {
    RowSet rows = work.active_rows[static_cast<std::size_t>(z + 1)];
    if (rows.empty()) continue;
    is_any = true;
    rows.unite(rows.raised());
    for (int dz = 0; dz <= 1; ++dz) work.corner_rows[static_cast<std::size_t>(z + dz + kWidestApron)].unite(rows);
    if (work.occlusion.method == SmoothOcclusion::None) continue;
    add_occlusion_rows(work, rows, z);
  }
  return is_any;
}

// Returns true if so many cells are active that most samples would be listed.
bool has_many_active(const Work& work) {
  std::int64_t active = 0;
  for (int z = 0; z < work.cells.last; ++z) {
    for (int y = 0; y < work.cells.last; ++y) active += std::popcount(work.active[z + 1][y + 1]);
  }
  return static_cast<double>(active) > kManyActive * work.n * work.n * work.n;
}

void gather_slice(Work& work, int z) {
  const RowSet& needed = work.corner_rows[static_cast<std::size_t>(z + kWidestApron)];
  if (needed.empty()) return;
  for (int y = -1; y <= work.n; ++y) {
    if (needed.has(y)) gather_row(work, y, z, work.row(y, z));
  }
}

// Lists the active cells of slice z of cells.
std::size_t list_cells(Work& work, int z) {
  const RowSet& rows = work.active_rows[static_cast<std::size_t>(z + 1)];
  std::uint16_t* end = work.places;
  const auto list_row = [&](int y) {
    if (work.active_before[z + 1][y + 1] != 0) *end++ = static_cast<std::uint16_t>(place_of(-1, y));
    end = append_places(work.active[z + 1][y + 1], place_of(0, y), end);
  };
  rows.for_each(list_row);
  return static_cast<std::size_t>(end - work.places);
}

// Returns the crossed edges along an axis that start in the row of points (y, z).
template <Axis kAxis>
std::uint64_t crossed_edges(const Work& work, int y, int z, std::uint64_t columns) {
  const std::uint64_t start = work.solid[z + 1][y + 1];
  std::uint64_t end = 0;
  if constexpr (kAxis == Axis::X) {
    end = start >> 1 | work.after[z + 1][y + 1] << (work.n - 1);
  } else if constexpr (kAxis == Axis::Y) {
    end = work.solid[z + 1][y + 2];
  } else {
    end = work.solid[z + 2][y + 1];
  }
  return (start ^ end) & columns;
}

// Lists the crossed edges along an axis that start at points of slice z.
template <Axis kAxis>
std::size_t list_edges(Work& work, int z) {
  const CellRange& cells = work.cells;
  const auto first = [&](Axis axis) { return kAxis == axis ? cells.first_edge() : cells.first + 1; };
  if (z < first(Axis::Z)) return 0;
  const std::uint64_t columns =
      (~std::uint64_t{0} >> (kChunkEdge - cells.last)) & (~std::uint64_t{0} << first(Axis::X));
  // A crossed edge has an active cell in its own row or in the row before; the cell of its own row is always in range.
  const RowSet& rows = work.active_rows[static_cast<std::size_t>(z + 1)];
  std::uint16_t* end = work.places;
  const auto list_row = [&](int y) {
    if (y < first(Axis::Y)) return;
    const std::uint64_t crossed = crossed_edges<kAxis>(work, y, z, columns);
    if (crossed != 0) end = append_edges(crossed, work.solid[z + 1][y + 1], place_of(0, y), end);
  };
  rows.for_each(list_row);
  return static_cast<std::size_t>(end - work.places);
}

template <Axis kAxis>
void quads_of_slice(Work& work, const Slice& slice, SmoothChunkMesh& out) {
  const std::size_t count = list_edges<kAxis>(work, slice.z);
  if (count == 0) return;
  const std::size_t before = out.indices.size();
  out.indices.reserve(before + 6 * (count + kSlack));
  make_quads<kAxis>(work, slice, count, out.indices.data() + before);
  out.indices.resize(before + 6 * count);
}

void mesh_slices(Work& work, SmoothChunkMesh& out) {
  find_active(work);
  if (!find_needed(work)) return;
  const bool has_occlusion = work.occlusion.method != SmoothOcclusion::None;
  Slice slice;
  if (has_occlusion) {
    work.is_dense = kManyActive < 1.0 && is_whole_spread(work.occlusion) && has_many_active(work);
    begin_occlusion(work);
  }
  gather_slice(work, work.cells.first);
  for (slice.z = work.cells.first; slice.z < work.cells.last; ++slice.z) {
    slice.first_vertex_of_last = slice.first_vertex;
    slice.first_vertex = static_cast<std::uint32_t>(out.positions.size());
    const std::size_t count = list_cells(work, slice.z);
    QUOIN_ASSERT(count <= kVertexMask + 1, "vertex numbers of a slice fit");
    const std::size_t vertices = slice.first_vertex + count;
    gather_slice(work, slice.z + 1);
    out.positions.reserve(vertices + kSlack);
    out.normals.reserve(vertices + kSlack);
    out.cells.reserve(vertices + kSlack);
    make_vertices(work, slice, count, out);
    out.positions.resize(vertices);
    out.normals.resize(vertices);
    out.cells.resize(vertices);
    if (has_occlusion) {
      out.occlusion.reserve(vertices + kSlack);
      add_occlusion(work, slice, count, out.occlusion.data() + slice.first_vertex);
      out.occlusion.resize(vertices);
    }
    quads_of_slice<Axis::X>(work, slice, out);
    quads_of_slice<Axis::Y>(work, slice, out);
    quads_of_slice<Axis::Z>(work, slice, out);
  }
}

}  // namespace
}  // namespace quoin::smooth
