// The start positions of label vertices, and their relaxation.
//
//   crossings of a cell   | along rows | from row to row | from slice to slice |    one bit per edge, as in mesh/nets

#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

#include "mesh/array/array_kernel.h"
#include "mesh/array/bit_rows.inl"
#include "mesh/nets/cell.h"

namespace quoin::array {
namespace {

// The sum of the crossing positions of a cell, in half cells, by its set of crossings; and the faces across which the
// vertex is linked with its neighbours.
struct CrossingSum {
  std::uint8_t halves[3];
  std::uint8_t count;
  std::uint8_t links;
};

// Each set of crossings extends one without its last edge: clang evaluates at most 2^20 steps of a constant.
constexpr auto kCrossingSums = [] {
  std::array<CrossingSum, 4096> sums{};
  unsigned on_face[4096][6] = {};
  for (std::size_t edge = 0; edge < smooth::kEdges; ++edge) {
    const std::size_t axis = edge / 4;
    const std::size_t others[] = {(axis + 1) % 3, (axis + 2) % 3};
    for (unsigned before = 0; before < 1U << edge; ++before) {
      const unsigned crossings = before | 1U << edge;
      CrossingSum& sum = sums[crossings];
      sum = sums[before];
      for (unsigned face = 0; face < 6; ++face) on_face[crossings][face] = on_face[before][face];
      ++sum.count;
      ++sum.halves[axis];
      for (const std::size_t other : others) {
        const std::size_t end = smooth::edge_start(edge) >> other & 1U;
        sum.halves[other] = static_cast<std::uint8_t>(sum.halves[other] + 2 * end);
        ++on_face[crossings][2 * other + end];
      }
    }
  }
  for (unsigned crossings = 0; crossings < 4096; ++crossings) {
    CrossingSum& sum = sums[crossings];
    // A face with three crossings has three labels: a line where surfaces meet leaves the cell there. Vertices on such
    // lines are linked only with their neighbours on the line, so that the line is smooth too. Four crossings may also
    // be two labels on opposite corners.
    unsigned least = 1;
    for (const unsigned count : on_face[crossings]) least = count == 3 ? 3 : least;
    for (unsigned face = 0; face < 6; ++face) {
      if (on_face[crossings][face] >= least) sum.links = static_cast<std::uint8_t>(sum.links | 1U << face);
    }
  }
  return sums;
}();

inline std::uint64_t shifted(const std::uint64_t* row, std::size_t w) {
  return row[w] << 1 | (w == 0 ? 0 : row[w - 1] >> 63);
}

void label_vertices(const CellSlice& slice, const RankedRows& ranked, Vec3* fractions, std::uint8_t* links) {
  for (std::size_t row = 0; row <= slice.rows; ++row) {
    std::uint32_t vertex = ranked.first[row];
    if (vertex == ranked.first[row + 1]) continue;
    const RowEdges e = edges_of_row(slice, row);
    const std::uint64_t* const active = ranked.active + row * slice.words;
    for (std::size_t w = 0; w < slice.words; ++w) {
      if (active[w] == 0) continue;
      const std::uint64_t bits[smooth::kEdges] = {e.along[0][w],
                                                  e.along[1][w],
                                                  e.along[2][w],
                                                  e.along[3][w],
                                                  shifted(e.between[0], w),
                                                  shifted(e.between[1], w),
                                                  e.between[0][w],
                                                  e.between[1][w],
                                                  shifted(e.across[0], w),
                                                  e.across[0][w],
                                                  shifted(e.across[1], w),
                                                  e.across[1][w]};
      for (std::uint64_t left = active[w]; left != 0; left &= left - 1, ++vertex) {
        const int bit = std::countr_zero(left);
        unsigned crossings = 0;
        for (std::size_t i = 0; i < smooth::kEdges; ++i) crossings |= static_cast<unsigned>(bits[i] >> bit & 1U) << i;
        const CrossingSum& sum = kCrossingSums[crossings];
        const float half = 0.5F / static_cast<float>(sum.count);
        float* const to = &fractions[vertex].x;
        for (int axis = 0; axis < 3; ++axis) to[axis] = static_cast<float>(sum.halves[axis]) * half;
        if (links != nullptr) links[vertex] = sum.links;
      }
    }
  }
}

// The minimum distance of vertices from their cell's faces, so that no two vertices coincide.
constexpr float kMargin = 1.0F / 32.0F;
// The share of the way towards the neighbours' mean per step. A full step would oscillate.
constexpr float kStep = 0.625F;

inline float relaxed(float from, float mean) {
  const float to = from + kStep * (mean - from);
  const float low = to > kMargin ? to : kMargin;
  return low < 1.0F - kMargin ? low : 1.0F - kMargin;
}

// Relaxes a vertex; the bits of `links` select its neighbours.
inline void relax_vertex(const Vec3* from, std::uint32_t vertex, const std::uint32_t (&neighbours)[6], unsigned links,
                         Vec3& out) {
  float sum[3] = {0.0F, 0.0F, 0.0F};
  float count = 0.0F;
  for (int i = 0; i < 6; ++i) {
    // Without branches: unlinked neighbours have weight 0.
    const bool is_linked = (links >> i & 1U) != 0;
    const float* const other = &from[is_linked ? neighbours[i] : vertex].x;
    const float one = is_linked ? 1.0F : 0.0F;
    for (int axis = 0; axis < 3; ++axis) sum[axis] += one * other[axis];
    sum[i / 2] += (i & 1) != 0 ? one : -one;
    count += one;
  }
  const float* const own = &from[vertex].x;
  float* const to = &out.x;
  const float share = 1.0F / count;
  for (int axis = 0; axis < 3; ++axis) to[axis] = relaxed(own[axis], sum[axis] * share);
}

void relax(const RelaxStep& step, const RankedRows& ranked) {
  const auto row_words = static_cast<std::ptrdiff_t>(step.words);
  const std::ptrdiff_t slice_rows = static_cast<std::ptrdiff_t>(step.rows) + 1;
  for (std::ptrdiff_t row = 0; row < slice_rows; ++row) {
    const std::uint32_t* const first = ranked.first + row;
    if (first[0] == first[1]) continue;
    // There are no links beyond the array, so any row is valid there.
    const std::ptrdiff_t steps[4] = {row == 0 ? 0 : -1, row == slice_rows - 1 ? 0 : 1,
                                     step.is_first_slice ? 0 : -slice_rows, step.is_last_slice ? 0 : slice_rows};
    const std::uint64_t* const active = ranked.active + row * row_words;
    const std::uint64_t* rows[4];
    std::uint32_t at[4];
    for (int i = 0; i < 4; ++i) {
      rows[i] = active + steps[i] * row_words;
      at[i] = first[steps[i]];
    }
    std::uint32_t vertex = *first;
    for (std::size_t w = 0; w < step.words; ++w) {
      for (std::uint64_t left = active[w]; left != 0; left &= left - 1, ++vertex) {
        const std::uint64_t below = (left & (0 - left)) - 1;
        std::uint32_t neighbours[6] = {vertex - 1, vertex + 1};
        for (int i = 0; i < 4; ++i) neighbours[2 + i] = at[i] + count_of(rows[i][w] & below);
        relax_vertex(step.from, vertex, neighbours, step.links[vertex], step.to[vertex]);
      }
      for (int i = 0; i < 4; ++i) at[i] += count_of(rows[i][w]);
    }
  }
}

}  // namespace
}  // namespace quoin::array
