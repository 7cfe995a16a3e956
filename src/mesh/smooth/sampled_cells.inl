// Finds the cells around a slice that occlusion must interpolate, for every kernel.
//
//   points        signs[z & 1][window][row]            one bit per point: solid
//   cells         cell_words[z & mask][window][slot]   two bits per cell: a sample in it must be listed; it is solid
//   points again  sampled[z & mask][row][column]       halves, of the rows that a listed cell touches
//
//   columns  -16        16                  48        79      Two windows of 64 columns, so that one word holds
//            |- - - - - window 0 - - - - - -|                 all that the samples of a vertex touch in a row.
//                       |- - - - - window 1 - - - - - - -|

#pragma once

#include "mesh/smooth/slices.inl"

namespace quoin::smooth {
namespace {

// Registers that read the rows of three samples at once need adjacent rows at spread 2.
#ifdef QUOIN_KERNEL_AVX2
template <int kSpread>
constexpr int kRowStep = kSpread == 2 ? 2 : 1;
#else
template <int kSpread>
constexpr int kRowStep = 1;
#endif

// Returns the cells of a window whose points are all known: points of the last column are partly beyond the window.
std::uint64_t known_columns(const Work& work, int window) {
  const int cells = kPointX + work.n + std::min(work.n, kPointX) - 1 - kSecondWindow * window;
  return low_bits(std::clamp(cells, 0, kChunkEdge - 1));
}

// Finds the words of the cells of slice z in a window, from the signs of the points of slices z and z + 1. Returns the
// rows that have a listed cell.
template <bool kCounted>
RowSet find_cell_words(Work& work, int z, int window) {
  const std::uint64_t* const low = work.signs[z & 1][window];
  const std::uint64_t* const high = work.signs[(z + 1) & 1][window];
  CellWords* const words = work.cell_words_of(z, window);
  const std::uint64_t columns = known_columns(work, window);
  std::uint64_t rows[2] = {};
#ifdef QUOIN_KERNEL_AVX512
  // One register holds the listed and whole words of four rows: even rows, then odd rows.
  const bool is_apart = work.row_step == 2;
  for (int row = 0; row < kReachRows; row += 8) {
    const __m512i a = _mm512_loadu_si512(low + row), b = _mm512_loadu_si512(low + row + 1);
    const __m512i c = _mm512_loadu_si512(high + row), d = _mm512_loadu_si512(high + row + 1);
    __m512i any = _mm512_or_si512(_mm512_ternarylogic_epi64(a, b, c, 0xFE), d);
    __m512i all = _mm512_and_si512(_mm512_ternarylogic_epi64(a, b, c, 0x80), d);
    any = _mm512_or_si512(any, _mm512_srli_epi64(any, 1));
    all = _mm512_and_si512(all, _mm512_srli_epi64(all, 1));
    any = _mm512_and_si512(any, _mm512_set1_epi64(static_cast<long long>(columns)));
    const __m512i listed = kCounted ? _mm512_andnot_si512(all, any) : any;
    const __m512i whole = kCounted ? all : _mm512_setzero_si512();
    const __m512i even = _mm512_unpacklo_epi64(listed, whole), odd = _mm512_unpackhi_epi64(listed, whole);
    if (is_apart) {
      _mm512_storeu_si512(words + row / 2, even);
      _mm512_storeu_si512(words + Work::kOddRows + row / 2, odd);
    } else {
      const __m512i first = _mm512_setr_epi64(0, 1, 8, 9, 2, 3, 10, 11);
      const __m512i second = _mm512_setr_epi64(4, 5, 12, 13, 6, 7, 14, 15);
      _mm512_storeu_si512(words + row, _mm512_permutex2var_epi64(even, first, odd));
      _mm512_storeu_si512(words + row + 4, _mm512_permutex2var_epi64(even, second, odd));
    }
    rows[row / 64] |= std::uint64_t{_mm512_test_epi64_mask(listed, listed)} << (row & 63);
  }
#else
  for (int row = 0; row < kReachRows; ++row) {
    std::uint64_t any = low[row] | low[row + 1] | high[row] | high[row + 1];
    std::uint64_t all = low[row] & low[row + 1] & high[row] & high[row + 1];
    any |= any >> 1, all &= all >> 1;
    any &= columns;
    const std::uint64_t listed = kCounted ? any & ~all : any;
    words[work.slot_of(row)] = {listed, kCounted ? all : 0};
    rows[row / 64] |= std::uint64_t{listed != 0} << (row & 63);
  }
#endif
  return {rows[0], rows[1]};
}

template <bool kCounted>
void find_cell_words(Work& work, int z) {
  RowSet& rows = work.listed_rows[static_cast<std::size_t>(z & work.ring_mask)];
  rows = find_cell_words<kCounted>(work, z, 0);
  rows.unite(find_cell_words<kCounted>(work, z, 1));
}

// Copies the rows of points of slice z that listed cells touch, within the range that vertices read.
void copy_sampled(Work& work, int z) {
  const auto touched = [&](int slice) { return work.listed_rows[static_cast<std::size_t>(slice & work.ring_mask)]; };
  RowSet rows = touched(z);
  rows.unite(touched(z - 1));
  rows.unite(rows.raised());
  rows.intersect(work.occlusion_rows[static_cast<std::size_t>(z + kWidestApron)]);
  rows.for_each([&](int y) { gather_row(work, y, z, work.sampled_row(y, z)); });
}

// Finds all cells that the occlusion of vertices in slice z of cells reads.
template <int kSpread>
void find_cells_around(Work& work, int z) {
  const bool is_counted = work.occlusion.method == SmoothOcclusion::SolidShare;
  const int first = z - work.apron;
  if (work.next_slice <= first) {
    work.row_step = kRowStep<kSpread>;
    work.next_slice = first;
    find_signs(work, first);
    work.listed_rows[static_cast<std::size_t>((first - 1) & work.ring_mask)] = {};
  }
  for (; work.next_slice <= z + work.apron + 1; ++work.next_slice) {
    find_signs(work, work.next_slice + 1);
    is_counted ? find_cell_words<true>(work, work.next_slice) : find_cell_words<false>(work, work.next_slice);
    copy_sampled(work, work.next_slice);
  }
}

}  // namespace
}  // namespace quoin::smooth
