#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <quoin/core/memory.h>
#include <quoin/grid/density_chunk.h>
#include <quoin/mesh/smooth.h>

#include "core/instruction_set.h"

namespace quoin::smooth {

// The mesher works on a lattice: every 2^level-th sample of the chunk and its neighbours. Lattice points of the chunk
// are 0 to n - 1 on each axis (n = 64 >> level), and cell c spans lattice points c and c + 1. Within a slice of cells
// or points, (x, y) has the index (y + 1) * 128 + x + 1: x and y begin at -1.

inline constexpr int kPlaceShift = 7;
inline constexpr int kPlaceStride = 1 << kPlaceShift;
inline constexpr int kSlicePlaces = 66 * kPlaceStride;

constexpr int place_of(int x, int y) {
  return (y + 1) * kPlaceStride + x + 1;
}

// The widest apron of lattice points around the chunk: occlusion of spread 4.
inline constexpr int kWidestApron = 12;
// A row of points is 128 long, point x at x + 16.
inline constexpr int kPointX = 16;
// Slices of points that occlusion may read begin at row -kWidestApron.
inline constexpr int kApronRows = 64 + 2 * kWidestApron + 2;

inline constexpr int kPointSlice = 66 * kPlaceStride;
inline constexpr int kDecodedStride = 96;
inline constexpr int kDecodedSlice = kApronRows * kDecodedStride;
inline constexpr int kRepeatedSlices = 5;

// Occlusion reads points -16 to 79 on each axis. Words hold 64 columns, starting at -16 or at 16.
inline constexpr int kReachRows = 96;
inline constexpr int kSecondWindow = 32;  // the first column of the second window, counted from -16
inline constexpr int kSampledStride = kReachRows;
inline constexpr int kSampledSlice = kReachRows * kSampledStride;
inline constexpr int kMostSlices = 32;  // maximum number that occlusion reads at once

// The lowest bits of a word.
constexpr std::uint64_t low_bits(int count) {
  return count == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << count) - 1;
}

// Words of signs: rows -1 to 64 of a slice.
inline constexpr int kSignRows = 72;

// The range of cells that a mesh covers, the same on each axis: [first, last).
struct CellRange {
  int first = -1;
  int last = 64;

  // Edges along an axis start in [first_edge, last) on that axis and in [first + 1, last) on the other axes.
  [[nodiscard]] int first_edge() const { return first < 0 ? 0 : first; }
};

// One bit per row of a slice of points, row y at bit y + 16.
struct RowSet {
  std::uint64_t low = 0;
  std::uint64_t high = 0;

  // Makes a set of row -1, and of rows 0 to 63 by their bits.
  static RowSet of(bool has_first, std::uint64_t rows) {
    return {std::uint64_t{has_first} << 15 | rows << 16, rows >> 48};
  }
  // The rows of points at the corners of a row of cells, where 0 means row -1.
  static RowSet of_cells(int row) {
    RowSet rows;
    const int bit = row + 15;
    (bit < 64 ? rows.low : rows.high) = std::uint64_t{1} << (bit & 63);
    rows.unite(rows.raised());
    return rows;
  }
  [[nodiscard]] bool has(int y) const {
    const int bit = y + 16;
    return ((bit < 64 ? low : high) >> (bit & 63) & 1U) != 0;
  }
  [[nodiscard]] bool empty() const { return (low | high) == 0; }
  void unite(const RowSet& other) {
    low |= other.low;
    high |= other.high;
  }
  // Shifts the set towards larger rows.
  [[nodiscard]] RowSet raised() const { return {low << 1, high << 1 | low >> 63}; }
  [[nodiscard]] RowSet lowered() const { return {low >> 1 | high << 63, high >> 1}; }
  void intersect(const RowSet& other) {
    low &= other.low;
    high &= other.high;
  }
  // Calls visit(y) for each row.
  template <class Visit>
  void for_each(Visit visit) const {
    for (std::uint64_t left = low; left != 0; left &= left - 1) visit(std::countr_zero(left) - 16);
    for (std::uint64_t left = high; left != 0; left &= left - 1) visit(std::countr_zero(left) + 48);
  }
};

// Two bits for each cell of a row in a window. `listed`: a sample in the cell must be interpolated. `whole`: the sample
// is certainly solid. Cells with neither bit are in air.
struct CellWords {
  std::uint64_t listed = 0;
  std::uint64_t whole = 0;
};

// The input, output and temporary data of the kernels. `point` gives the addresses of points.
struct Work {
  int level = 0;
  int n = 64;
  CellRange cells;
  SmoothOcclusionOptions occlusion;

  // Signs of the points of each row: bit x; the signs of points -1 and n are in separate words (bit 0).
  std::uint64_t solid[66][kSignRows];
  std::uint64_t before[66][kSignRows];
  std::uint64_t after[66][kSignRows];
  // Active cells of each row of cells, [z + 1][y + 1]: cells 0 to n - 1, and cell -1 in bit 0 of a separate word.
  std::uint64_t active[65][kSignRows];
  std::uint64_t active_before[65][kSignRows];
  // Rows of cells with an active cell, by slice [z + 1].
  std::array<RowSet, 66> active_rows;
  // Rows of points at the corners of active cells, and rows of points that occlusion reads, by slice [z +
  // kWidestApron].
  std::array<RowSet, kApronRows> corner_rows;
  std::array<RowSet, kApronRows> occlusion_rows;

  const DensityNeighbourhood* chunks = nullptr;
  // The points of the two current slices: [z & 1], rows -1 to 64.
  BlockVector<Half> points = BlockVector<Half>(std::size_t{2} * kPointSlice + 64);

  // Indices of the active cells of a slice, or of crossed edges; edges that start at a solid point have bit 15 set.
  alignas(64) std::uint16_t places[kSlicePlaces + 64];
  // The vertices of the last two slices, by index in the slice: the vertex number, counted from the slice's first, in
  // 13 bits, and its fractions in 64ths, 6 bits each.
  alignas(64) std::uint32_t vertices[2][kSlicePlaces + 64];
  // The positions of the slice's vertices within their cells, for occlusion, as multiples of 1/65,536.
  alignas(64) float fractions[3][kSlicePlaces / 2 + 64];
  alignas(64) float normals[3][kSlicePlaces / 2 + 64];

  // True if many cells are active. Occlusion then interpolates all samples, otherwise only those of listed cells.
  bool is_dense = false;
  int ring_mask = 0;   // occlusion stores slices as [z & ring_mask]
  int next_slice = 0;  // the first slice that is not gathered yet
  // Data for lists. Signs of points: [z & 1][window][y + 16]. Words of cells: [z & ring_mask][window][slot]; if
  // `row_step` is 2, rows y, y + 2, ... are consecutive, so that one register takes all rows of a vertex. Rows of
  // listed cells: [z & ring_mask]. Points: [z & ring_mask][y + 16][x + 16].
  std::uint64_t signs[2][2][kReachRows + 8]{};
  int row_step = 1;
  BlockVector<CellWords> cell_words;
  std::array<RowSet, kMostSlices> listed_rows;
  BlockVector<Half> sampled;
  // Used if is_dense: points as floats, [z & ring_mask][y + kWidestApron][x + kPointX]. The first kRepeatedSlices are
  // repeated after the last slice, so that all samples of a vertex are at fixed distances.
  BlockVector<float> decoded;
  int apron = 0;  // number of points below and above a cell's own that occlusion reads

  // Returns the row of points (y, z); the pointer is at x = 0.
  [[nodiscard]] Half* row(int y, int z) {
    return points.data() + static_cast<std::ptrdiff_t>(z & 1) * kPointSlice + (y + 1) * kPlaceStride + kPointX;
  }
  [[nodiscard]] float* decoded_row(int y, int z) {
    return decoded.data() + static_cast<std::ptrdiff_t>(z & ring_mask) * kDecodedSlice +
           (y + kWidestApron) * kDecodedStride + kPointX;
  }
  [[nodiscard]] Half* sampled_row(int y, int z) { return sampled.data() + sampled_offset(y, z); }
  [[nodiscard]] const Half* sampled_row(int y, int z) const { return sampled.data() + sampled_offset(y, z); }
  [[nodiscard]] std::ptrdiff_t sampled_offset(int y, int z) const {
    return std::ptrdiff_t{z & ring_mask} * kSampledSlice + (y + kPointX) * kSampledStride + kPointX;
  }
  static constexpr int kOddRows = kReachRows / 2 + 4;  // their first slot; registers read four slots
  static constexpr int kSlots = 2 * kOddRows;
  // Returns the slot of a row, counted from -16.
  [[nodiscard]] int slot_of(int row) const { return row_step == 1 ? row : (row & 1) * kOddRows + row / 2; }
  [[nodiscard]] const CellWords* cell_words_of(int z, int window) const {
    return cell_words.data() + (std::ptrdiff_t{z & ring_mask} * 2 + window) * kSlots;
  }
  [[nodiscard]] CellWords* cell_words_of(int z, int window) {
    return cell_words.data() + (std::ptrdiff_t{z & ring_mask} * 2 + window) * kSlots;
  }
};

inline constexpr int kVertexBits = 13;

// Returns the number of lattice points beyond its cell that a vertex may read for occlusion.
[[nodiscard]] int apron_of(const SmoothOcclusionOptions& occlusion);

// Returns the options with every number clamped to its range.
[[nodiscard]] SmoothOcclusionOptions within_limits(SmoothOcclusionOptions occlusion, int level);

// Returns true if the method for many active cells supports this occlusion.
[[nodiscard]] inline bool is_whole_spread(const SmoothOcclusionOptions& occlusion) {
  return occlusion.spread == 1.0F || occlusion.spread == 2.0F;
}

// Gathers the signs. Returns false if all are equal.
[[nodiscard]] bool prepare(const DensityNeighbourhood& chunks, Work& work);
// A row of one chunk's samples, or the one value of all its samples.
struct RowPart {
  const Half* samples;  // null: all are `value`
  Half value;
};
// Returns the row of points (y, z) in the chunk before, the chunk and the chunk after.
[[nodiscard]] std::array<RowPart, 3> row_parts(const Work& work, int y, int z);
// Packs every 2^level-th bit of a word.
[[nodiscard]] constexpr std::uint64_t thinned(std::uint64_t word, int level) {
  for (; level > 0; --level) {
    word &= 0x5555'5555'5555'5555U;
    word = (word | word >> 1) & 0x3333'3333'3333'3333U;
    word = (word | word >> 2) & 0x0F0F'0F0F'0F0F'0F0FU;
    word = (word | word >> 4) & 0x00FF'00FF'00FF'00FFU;
    word = (word | word >> 8) & 0x0000'FFFF'0000'FFFFU;
    word = (word | word >> 16) & 0x0000'0000'FFFF'FFFFU;
  }
  return word;
}
// Copies the row of points (y, z) to `row`, which points to x = 0. Includes sixteen points (at coarse levels n) before
// and after the chunk's own.
void gather_row(const Work& work, int y, int z, Half* row);
// Computes Work::signs of slice z of points; at coarse levels only for the rows that occlusion reads.
void find_signs(Work& work, int z);
// Marks the rows of points that occlusion reads for slice z of cells: those within the apron of `rows`.
void add_occlusion_rows(Work& work, RowSet rows, int z);
// Allocates the slices that occlusion reads, starting at the slice of the first cells. Requires: `is_dense` is set.
void begin_occlusion(Work& work);

// The maximum number of samples per call.
inline constexpr std::size_t kPlacesAtOnce = 4096;

// One kernel per instruction set; all give the same bytes.
struct Kernel {
  void (*mesh)(Work& work, SmoothChunkMesh& out);
  // Computes the occlusion of `count` samples in slice z of cells, given by `places`, `fractions` and `normals` of the
  // work. Writes up to 64 more numbers. Requires: `chunks`, `apron` and `occlusion_rows` are set, `begin_occlusion` was
  // called, and slices come in order; 0 < count <= kPlacesAtOnce, and 64 additional places are readable.
  void (*occlude)(Work& work, int z, std::size_t count, float* occlusion);
};

// The wider kernels exist only in builds that compile them. `kKernels` contains the available ones.
extern const Kernel kPlainKernel;
extern const Kernel kAvx2Kernel;
extern const Kernel kAvx512Kernel;
extern const KernelTable<Kernel> kKernels;

}  // namespace quoin::smooth
