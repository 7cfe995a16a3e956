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

#include <span>

#include <quoin/core/assert.h>

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
    const FourRows points = four_rows(low + row, high + row);
    const std::uint64_t any = (points.any | points.any >> 1) & columns;
    const std::uint64_t all = points.all & points.all >> 1;
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

// Occlusion by lists, for every kernel. A sample whose cell has eight corners of one sign needs no interpolation, since
// with fractions below 1 the sign is exact. Each vertex therefore looks up its 27 cells in words, and lists only the
// samples that need interpolation.
//
//   27 cells       | 0 | 0 | ? | 1 | ...      0: corners in air, adds nothing. 1: solid corners, adds one if samples
//                                             are counted. ?: listed
//   codes          vertex << 5 | sample       of the listed samples of 32 vertices, in order
//   values, bits   a number and a bit each    the part that a sample adds; set if it is solid
//
// The kernels define find_batch, find_values, list_samples and add_up.

constexpr int kBatch = 32;
constexpr int kSamples = 27;
constexpr int kCodeShift = 5;
// Codes that kernels read beyond the last one: a register's worth.
constexpr std::size_t kCodeSlack = 32;

// The index in Work::sampled of a column and a row, starting at -16; the slice number is above.
constexpr int kSliceShift = 16;

// Up to 32 vertices and the samples around them. Sample i + 3 j + 9 k is number i along x, j along y, k along z.
struct Batch {
  alignas(64) std::int32_t lowest[kBatch];       // column + 96 row + (slice << 16) of the cell of sample 0
  alignas(64) std::int32_t column[kBatch];       // of it, from -16
  alignas(64) std::int32_t row[kBatch];          // from -16
  alignas(64) std::int32_t slice[kBatch];        // z + 16
  alignas(64) std::int32_t steps[3][3][kBatch];  // [axis][i]: cells from sample 0 to i; integer spreads: unset
  alignas(64) float fraction[3][3][kBatch];      // [axis][i]: within the cell; integer spreads: only i = 0
  alignas(64) float packed[kBatch][4];           // fractions of sample 0, and the bits of `lowest`; AVX2 alone
  alignas(64) std::uint16_t codes[kBatch * kSamples + kCodeSlack];
  alignas(64) float values[kBatch * kSamples + kCodeSlack];
  alignas(64) std::uint8_t solid[kBatch * kSamples / 8 + 16];  // a bit per code
  std::uint32_t listed[kBatch];                                // a bit per sample; AVX-512 alone
  std::int32_t first_code[kBatch + 1];
  std::int32_t whole[kBatch];  // number of samples that are solid without being listed
};

constexpr int kSliceBias = 16;

// Returns the window with the samples that start at a column (counted from -16).
constexpr int window_of(int column) {
  return column < kSecondWindow + kPointX ? 0 : 1;
}

// Packs the bits of samples 0, 1, 2 along x. Spread 0 means any spread, by `steps`.
template <int kSpread>
std::uint32_t three_bits(std::uint64_t word, int second, int third) {
  const int a = kSpread != 0 ? kSpread : second;
  const int b = kSpread != 0 ? 2 * kSpread : third;
  return static_cast<std::uint32_t>((word & 1U) | (word >> a & 1U) << 1 | (word >> b & 1U) << 2);
}

struct SampleBits {
  std::uint32_t listed = 0;
  std::uint32_t whole = 0;
};

// Looks up the 27 cells of vertex `v` in the words.
template <int kSpread, bool kCounted>
SampleBits bits_of_samples(const Work& work, const Batch& batch, std::size_t v) {
  const auto step = [&](int axis, int i) { return kSpread != 0 ? i * kSpread : batch.steps[axis][i][v]; };
  const int column = batch.column[v];
  const int window = window_of(column);
  const int shift = column - kSecondWindow * window;
  SampleBits bits;
  for (int k = 0; k < 3; ++k) {
    const CellWords* const words = work.cell_words_of(batch.slice[v] - kSliceBias + step(2, k), window);
    for (int j = 0; j < 3; ++j) {
      const CellWords& row = words[work.slot_of(batch.row[v] + step(1, j))];
      const auto three = [&](std::uint64_t word) {
        return three_bits<kSpread>(word >> shift, step(0, 1), step(0, 2)) << (3 * j + 9 * k);
      };
      bits.listed |= three(row.listed);
      if constexpr (kCounted) bits.whole |= three(row.whole);
    }
  }
  return bits;
}

// Returns the number of samples that the batch lists.
std::size_t end_list(const std::uint16_t* end, std::size_t count, Batch& batch) {
  const std::ptrdiff_t listed = end - batch.codes;
  QUOIN_ASSERT(count <= std::size_t{kBatch}, "vertices of one batch");
  QUOIN_ASSERT(listed >= 0 && listed <= kBatch * kSamples, "at most 27 samples per vertex");
  batch.first_code[count] = static_cast<std::int32_t>(listed);
  return static_cast<std::size_t>(listed);
}

// Lists the samples to interpolate. Returns their number.
template <int kSpread, bool kCounted>
std::size_t list_one_by_one(const Work& work, std::size_t count, Batch& batch) {
  std::uint16_t* end = batch.codes;
  for (std::size_t v = 0; v < count; ++v) {
    const SampleBits bits = bits_of_samples<kSpread, kCounted>(work, batch, v);
    batch.first_code[v] = static_cast<std::int32_t>(end - batch.codes);
    batch.whole[v] = std::popcount(bits.whole);
    for (std::uint32_t left = bits.listed; left != 0; left &= left - 1) {
      *end++ = static_cast<std::uint16_t>(v << kCodeShift | static_cast<unsigned>(std::countr_zero(left)));
    }
  }
  return end_list(end, count, batch);
}

// Returns the solid samples among the listed samples of a vertex.
std::uint32_t solid_bits(const Batch& batch, std::size_t v) {
  const auto first = static_cast<unsigned>(batch.first_code[v]);
  std::uint64_t bits = 0;
  std::memcpy(&bits, batch.solid + first / 8, sizeof bits);
  return static_cast<std::uint32_t>(bits >> (first & 7U) & low_bits(batch.first_code[v + 1] - batch.first_code[v]));
}

// The sum and the minimum of all samples' values, in the order of occlusion_of.
struct Sum {
  float sum = 0.0F;
  float least = 0.0F;
};

#ifndef QUOIN_KERNEL_AVX512
Sum sum_of(const Batch& batch, std::size_t v) {
  std::array<float, 6> sums{};
  Sum out;
  for (std::int32_t i = batch.first_code[v]; i < batch.first_code[v + 1]; ++i) {
    sums[(batch.codes[i] & ((1U << kCodeShift) - 1)) % 6] += batch.values[i];
    out.least = std::min(out.least, batch.values[i]);
  }
  out.sum = ((sums[0] + sums[3]) + (sums[1] + sums[4])) + (sums[2] + sums[5]);
  return out;
}
#endif

// Combines the sum of the samples' values into the occlusion.
float occlusion_of_sum(const Sum& sum, const SmoothOcclusionOptions& options) {
  if (options.method == SmoothOcclusion::SoftShare) return soft_share(sum.sum);
  return weighted_occlusion(sum.sum, sum.least, options);
}

// Each kernel defines these functions. find_batch finds the cells and fractions of up to 32 vertices, starting at
// `first`. find_values computes the values and solid bits of all codes, as far as the form of occlusion needs them, and
// returns true if any is solid. The next function computes the occlusion of `count` vertices with at least one solid
// sample, whose numbers are in `which`.
template <int kSpread>
void find_batch(const Work& work, const Slice& slice, std::size_t first, std::size_t count, Batch& batch);
template <int kSpread, bool kCounted>
bool find_values(const Work& work, std::size_t count, Batch& batch);
template <int kSpread, bool kCounted>
std::size_t list_samples(const Work& work, std::size_t count, Batch& batch);
void add_up(const Work& work, const Batch& batch, std::span<const std::uint32_t> which, float* occlusion);

template <int kSpread>
void count_samples(const Work& work, std::size_t count, Batch& batch, float* occlusion) {
  const std::size_t listed = list_samples<kSpread, true>(work, count, batch);
  if (find_values<kSpread, true>(work, listed, batch)) {
    for (std::size_t v = 0; v < count; ++v) batch.whole[v] += std::popcount(solid_bits(batch, v));
  }
  for (std::size_t v = 0; v < count; ++v) occlusion[v] = solid_share(kSamples - batch.whole[v]);
}

template <int kSpread>
void weigh_samples(const Work& work, std::size_t count, Batch& batch, float* occlusion) {
  const std::size_t listed = list_samples<kSpread, false>(work, count, batch);
  std::fill_n(occlusion, count, occlusion_of_sum({}, work.occlusion));
  if (!find_values<kSpread, false>(work, listed, batch)) return;
  std::uint32_t dark[kBatch];
  std::size_t size = 0;
  for (std::size_t v = 0; v < count; ++v) {
    dark[size] = static_cast<std::uint32_t>(v);
    size += solid_bits(batch, v) != 0 ? 1 : 0;
  }
  add_up(work, batch, std::span(dark).first(size), occlusion);
}

template <int kSpread>
void occlude_by_lists(Work& work, const Slice& slice, std::size_t count, float* occlusion) {
  find_cells_around<kSpread>(work, slice.z);
  Batch batch;
  for (std::size_t first = 0; first < count; first += kBatch) {
    const std::size_t size = std::min<std::size_t>(kBatch, count - first);
    find_batch<kSpread>(work, slice, first, size, batch);
    if (work.occlusion.method == SmoothOcclusion::SolidShare) {
      count_samples<kSpread>(work, size, batch, occlusion + first);
    } else {
      weigh_samples<kSpread>(work, size, batch, occlusion + first);
    }
  }
}

void occlude_by_lists(Work& work, const Slice& slice, std::size_t count, float* occlusion) {
  const float spread = work.occlusion.spread;
  if (spread == 2.0F) return occlude_by_lists<2>(work, slice, count, occlusion);
  if (spread == 1.0F) return occlude_by_lists<1>(work, slice, count, occlusion);
  occlude_by_lists<0>(work, slice, count, occlusion);
}

}  // namespace
}  // namespace quoin::smooth
