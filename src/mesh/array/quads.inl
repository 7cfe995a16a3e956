// Two triangles around each crossed edge.
//
//   edges   a bit row; all four cells around a crossed edge have a vertex
//   cells   active[row of cells][word], the vertex of cell c is first[row] + the bits before c
//   quad    the cells around the edge, in the order of smooth::kCellsAround

#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>

#include "mesh/array/array_kernel.h"
#include "mesh/array/bit_rows.inl"
#include "mesh/nets/cell.h"

namespace quoin::array {
namespace {

inline float squared_distance(const Vec3& a, const Vec3& b) {
  const float x = a.x - b.x;
  const float y = a.y - b.y;
  const float z = a.z - b.z;
  return (x * x + y * y) + z * z;
}

// Writes a quad, split along its shorter diagonal; of equal ones, from corner 0.
[[gnu::always_inline]] inline void write_quad(const Vec3* positions, std::uint32_t q0, std::uint32_t q1,
                                              std::uint32_t q2, std::uint32_t q3, bool faces_along,
                                              std::uint32_t* out) {
  const bool from_second =
      squared_distance(positions[q1], positions[q3]) < squared_distance(positions[q0], positions[q2]);
  const auto [a, b, c, d] = smooth::split_quad(q0, q1, q2, q3, faces_along, from_second);
  out[0] = a;
  out[1] = b;
  out[2] = c;
  out[3] = a;
  out[4] = c;
  out[5] = d;
}

// Rows of cells, and the numbers of vertices before the current word.
template <int kRows>
struct RowCursor {
  const std::uint64_t* active[kRows];
  std::uint32_t first[kRows];
};

// Calls visit(place, vertices) for each crossed edge of a row, with the vertex of the cell at its bit in each row.
template <int kRows, class Visit>
[[gnu::always_inline]] inline void for_each_edge(const std::uint64_t* edges, std::size_t words, RowCursor<kRows> rows,
                                                 Visit visit) {
  for (std::size_t w = 0; w < words; ++w) {
    for (std::uint64_t left = edges[w]; left != 0; left &= left - 1) {
      const std::uint64_t below = (left & (0 - left)) - 1;
      std::uint32_t vertices[kRows];
      for (int i = 0; i < kRows; ++i) vertices[i] = rows.first[i] + count_of(rows.active[i][w] & below);
      visit(kWordBits * w + static_cast<std::size_t>(std::countr_zero(left)), vertices);
    }
    for (int i = 0; i < kRows; ++i) rows.first[i] += count_of(rows.active[i][w]);
  }
}

// Calls emit(is_along, place, q0, q1, q2, q3) for the crossed edges of a slice of cells, row by row. Calls
// `begin_row(axis, row)` before each row with edges.
template <class Emitter>
[[gnu::always_inline]] inline void for_each_quad(const CellSlice& slice, const RankedRows& ranked, Emitter& emit) {
  const std::size_t words = slice.words;
  const std::uint64_t* const last_active = ranked.active - (slice.rows + 1) * words;
  const std::uint32_t* const last_first = ranked.first - (slice.rows + 1);
  for (std::size_t row = 0; row <= slice.rows; ++row) {
    const std::uint32_t* const first = ranked.first + row;
    if (first[0] == first[1]) continue;
    const std::uint64_t* const active = ranked.active + row * words;
    const bool has_low = emit.has_low();
    if (has_low) {
      emit.begin_row(1, row);
      for_each_edge<2>(slice.low.between_rows + row * words, words,
                       {{last_active + row * words, active}, {last_first[row], *first}},
                       [&](std::size_t x, const std::uint32_t* v) { emit(x, v[0], v[1], v[1] + 1, v[0] + 1); });
    }
    if (row == 0) continue;
    const std::size_t before = row - 1;
    emit.begin_row(2, before);
    for_each_edge<2>(slice.between_slices + before * words, words, {{active - words, active}, {first[-1], *first}},
                     [&](std::size_t x, const std::uint32_t* v) { emit(x, v[0], v[0] + 1, v[1] + 1, v[1]); });
    if (!has_low) continue;
    emit.begin_row(0, before);
    for_each_edge<4>(slice.low.along_rows + before * words, words,
                     {{last_active + before * words, last_active + row * words, active - words, active},
                      {last_first[before], last_first[row], first[-1], *first}},
                     [&](std::size_t c, const std::uint32_t* v) { emit(c, v[0], v[1], v[3], v[2]); });
  }
}

// Writes the quads of a field in order. kHasSplitCells: some cells have several vertices.
template <bool kHasSplitCells>
struct FieldQuads {
  const CellSlice& slice;
  const std::uint64_t* solid;  // of the slice of samples before; null beyond the array
  const QuadRules& rules;
  std::uint32_t* out;
  const std::uint64_t* starts = nullptr;  // solid samples of the row where the edges start
  std::size_t shift = 0;                  // from an edge's bit to the bit of its start
  int edge_axis = 0;

  [[nodiscard]] bool has_low() const { return solid != nullptr; }
  void begin_row(int axis, std::size_t row) {
    edge_axis = axis;
    shift = axis == 0 ? 1 : 0;
    const bool is_inside = solid != nullptr && (axis != 1 || row != 0);
    starts = is_inside ? solid + (axis == 1 ? row - 1 : row) * slice.words : nullptr;
  }
  [[nodiscard]] bool starts_solid(std::size_t place) const {
    if (starts == nullptr || place < shift) return false;
    const std::size_t at = place - shift;
    return (starts[at / kWordBits] >> (at % kWordBits) & 1U) != 0;
  }
  // Returns the vertex of a cell, which may have several, on the current edge.
  [[nodiscard]] std::uint32_t resolved(std::uint32_t vertex, unsigned corner) const {
    if ((rules.split[vertex / kWordBits] >> (vertex % kWordBits) & 1U) == 0) return vertex;
    const unsigned edge = 4 * static_cast<unsigned>(edge_axis) + smooth::kCellsAround[corner];
    return rules.vertex_on_edge(rules.split_cells, vertex, edge);
  }
  void operator()(std::size_t place, std::uint32_t q0, std::uint32_t q1, std::uint32_t q2, std::uint32_t q3) {
    if constexpr (kHasSplitCells) {
      q0 = resolved(q0, 0);
      q1 = resolved(q1, 1);
      q2 = resolved(q2, 2);
      q3 = resolved(q3, 3);
    }
    write_quad(rules.positions, q0, q1, q2, q3, starts_solid(place) != rules.is_mirrored, out);
    out += 6;
  }
};

std::uint32_t* quads(const CellSlice& slice, const std::uint64_t* solid, const RankedRows& ranked,
                     const QuadRules& rules, std::uint32_t* out) {
  const auto write = [&](auto emit) {
    for_each_quad(slice, ranked, emit);
    return emit.out;
  };
  return rules.split != nullptr ? write(FieldQuads<true>{slice, solid, rules, out})
                                : write(FieldQuads<false>{slice, solid, rules, out});
}

// The labels at both ends of the edges of a row.
template <class T>
class LabelPairs {
 public:
  LabelPairs(const CellSlice& slice, const LabelRows& labels, std::int64_t z)
      : labels_(labels), rows_(static_cast<std::int64_t>(slice.rows)), z_(z) {}

  // Selects a row of edges that start in the slice of samples before slice z of cells.
  void begin_row(int axis, std::size_t row) {
    const auto y = static_cast<std::int64_t>(row);
    axis_ = axis;
    if (axis == 0) {
      start_ = end_ = row_at(y, z_ - 1);
    } else if (axis == 1) {
      start_ = row_at(y - 1, z_ - 1);
      end_ = row_at(y, z_ - 1);
    } else {
      start_ = row_at(y, z_ - 1);
      end_ = row_at(y, z_);
    }
  }
  [[nodiscard]] std::uint64_t start(std::size_t place) const {
    return label_at(start_, static_cast<std::int64_t>(place) - (axis_ == 0 ? 1 : 0));
  }
  [[nodiscard]] std::uint64_t end(std::size_t place) const { return label_at(end_, static_cast<std::int64_t>(place)); }

 private:
  [[nodiscard]] const std::byte* row_at(std::int64_t y, std::int64_t z) const {
    if (y < 0 || z < 0 || y >= rows_ || z >= labels_.size[2]) return nullptr;
    return labels_.data + y * labels_.stride[1] + z * labels_.stride[2];
  }
  [[nodiscard]] std::uint64_t label_at(const std::byte* row, std::int64_t x) const {
    if (row == nullptr || x < 0 || x >= labels_.size[0]) return labels_.background;
    return std::uint64_t{value_at<T>(row + x * labels_.stride[0], 0)} ^ labels_.sign;
  }

  const LabelRows& labels_;
  std::int64_t rows_;
  std::int64_t z_;
  int axis_ = 0;
  const std::byte* start_ = nullptr;
  const std::byte* end_ = nullptr;
};

// Returns true if `label` is the front of its interface with `other`: the background is, otherwise the lesser label.
inline bool is_front(std::uint64_t label, std::uint64_t other, std::uint64_t background) {
  return label == background || (other != background && label < other);
}

template <class T>
void count_interfaces(const CellSlice& slice, const LabelRows& labels, std::int64_t z, InterfaceTable& table) {
  LabelPairs<T> pairs(slice, labels, z);
  const auto count = [&](int axis, std::size_t row, const std::uint64_t* edges) {
    pairs.begin_row(axis, row);
    for (std::size_t w = 0; w < slice.words; ++w) {
      for (std::uint64_t left = edges[w]; left != 0; left &= left - 1) {
        const std::size_t place = kWordBits * w + static_cast<std::size_t>(std::countr_zero(left));
        const std::uint64_t a = pairs.start(place);
        const std::uint64_t b = pairs.end(place);
        const bool swap = is_front(a, b, labels.background);
        ++table.slot(swap ? b : a, swap ? a : b).number;
      }
    }
  };
  for (std::size_t row = 0; row <= slice.rows; ++row) {
    if (z != 0) count(1, row, slice.low.between_rows + row * slice.words);
    if (row == slice.rows) break;
    count(2, row, slice.between_slices + row * slice.words);
    if (z != 0) count(0, row, slice.low.along_rows + row * slice.words);
  }
}

// Writes the quads of labels, each at the next position of its interface.
template <class T>
struct LabelQuads {
  const QuadRules& rules;
  std::uint64_t background;
  InterfaceTable& table;
  std::uint32_t* out;
  LabelPairs<T> pairs;
  bool is_low;

  [[nodiscard]] bool has_low() const { return is_low; }
  void begin_row(int axis, std::size_t row) { pairs.begin_row(axis, row); }
  void operator()(std::size_t place, std::uint32_t q0, std::uint32_t q1, std::uint32_t q2, std::uint32_t q3) {
    const std::uint64_t a = pairs.start(place);
    const std::uint64_t b = pairs.end(place);
    const bool swap = is_front(a, b, background);
    const std::uint64_t at = table.slot(swap ? b : a, swap ? a : b).number++;
    write_quad(rules.positions, q0, q1, q2, q3, swap == rules.is_mirrored, out + 6 * at);
  }
};

template <class T>
void label_quads(const CellSlice& slice, const LabelRows& labels, std::int64_t z, const RankedRows& ranked,
                 const QuadRules& rules, InterfaceTable& table, std::uint32_t* out) {
  LabelQuads<T> emit{rules, labels.background, table, out, LabelPairs<T>(slice, labels, z), z != 0};
  for_each_quad(slice, ranked, emit);
}

}  // namespace
}  // namespace quoin::array
