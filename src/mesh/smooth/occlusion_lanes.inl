// Occlusion, one register of lanes at a time: the functions of listed.inl that vector kernels define, and the
// interpolation of all samples.

#pragma once

// Included first: the lists use the append functions of these lanes.
#include "mesh/smooth/vectors.inl"

#include "mesh/smooth/listed.inl"

namespace quoin::smooth {
namespace {

// The samples of vertices along an axis: cells, and fractions within them.
struct AxisLanes {
  I base[3];
  F fraction[3];
};

template <bool kWhole>
AxisLanes sample_axis(F place, F normal, F lift, const SmoothOcclusionOptions& options) {
  const F centre = place + ((normal * lift + all(kSnapOffset)) - all(kSnapOffset));
  AxisLanes axis;
  for (int i = 0; i < (kWhole ? 1 : 3); ++i) {
    const F at = kWhole ? centre : centre + all(static_cast<float>(i - 1) * options.spread);
    const F below = floor(at);
    axis.fraction[i] = at - below;
    axis.base[i] = to_int(below);
  }
  if (kWhole) axis.base[0] = axis.base[0] - all(static_cast<int>(options.spread));
  return axis;
}

template <int kSpread>
void find_batch(const Work& work, const Slice& slice, std::size_t first, std::size_t count, Batch& batch) {
  constexpr bool kWhole = kSpread != 0;
  for (std::size_t at = 0; at < count; at += kWidth) {
    F normal[3];
    for (int i = 0; i < 3; ++i) normal[i] = load(work.normals[i] + first + at);
    const F lift = all(work.occlusion.spread) * ((abs(normal[0]) + abs(normal[1])) + abs(normal[2])) + all(kLift);
    I lowest[3];
    for (int i = 0; i < 3; ++i) {
      const F place = load(work.fractions[i] + first + at);
      const AxisLanes axis = sample_axis<kWhole>(place, normal[i], lift, work.occlusion);
      lowest[i] = axis.base[0];
      store(batch.fraction[i][0] + at, axis.fraction[0]);
      for (int k = 0; k < (kWhole ? 0 : 3); ++k) {
        store(batch.fraction[i][k] + at, axis.fraction[k]);
        store(batch.steps[i][k] + at, axis.base[k] - axis.base[0]);
      }
    }
    const I place = load(work.places + first + at) & all(kPlaceMask);
    const I column = (place & all(kPlaceStride - 1)) + lowest[0] + all(kPointX - 1);
    const I row = shift_right<kPlaceShift>(place) + lowest[1] + all(kPointX - 1);
    const I z = lowest[2] + all(slice.z + kSliceBias);
    store(batch.column + at, column);
    store(batch.row + at, row);
    store(batch.slice + at, z);
    store(batch.lowest + at, row * all(kSampledStride) + column + shift_left<kSliceShift>(z));
  }
#ifndef QUOIN_KERNEL_AVX512
  for (std::size_t v = 0; kWhole && v < count; ++v) {
    for (std::size_t axis = 0; axis < 3; ++axis) batch.packed[v][axis] = batch.fraction[axis][0][v];
    batch.packed[v][3] = std::bit_cast<float>(batch.lowest[v]);
  }
#endif
}

// The offset of sample s from sample 0 for integer spreads, as in Batch::lowest, and 32 times its number along each
// axis.
template <int kSpread>
struct SampleTable {
  alignas(64) std::int32_t offset[32]{};
  alignas(64) std::int32_t number[3][32]{};
  constexpr SampleTable() {
    for (int s = 0; s < 32; ++s) {
      const std::array<int, 3> i = {s % 3, s / 3 % 3, s / 9};
      offset[s] = kSpread * (i[0] + i[1] * kSampledStride + (i[2] << kSliceShift));
      for (std::size_t axis = 0; axis < 3; ++axis) number[axis][s] = kBatch * i[axis];
    }
  }
};
template <int kSpread>
inline constexpr SampleTable<kSpread> kSampleTable{};

// The cells of sixteen (or eight) listed samples, and the samples' positions in them.
struct Listed {
  I place;
  F fraction[3];
};

template <int kSpread>
Listed listed_at(const Batch& batch, const std::uint16_t* codes) {
  const I code = load(codes);
  const I sample = code & all((1 << kCodeShift) - 1);
  const I vertex = shift_right<kCodeShift>(code);
  const SampleTable<kSpread>& table = kSampleTable<kSpread>;
  Listed listed;
  if constexpr (kSpread != 0) {
#ifdef QUOIN_KERNEL_AVX512
    const I lowest = look_up(batch.lowest, vertex);
    for (int axis = 0; axis < 3; ++axis) listed.fraction[axis] = look_up(batch.fraction[axis][0], vertex);
#else
    // One load per sample is faster than four gathers.
    std::int32_t at[kWidth];
    for (int i = 0; i < kWidth; ++i) at[i] = 4 * (codes[i] >> kCodeShift);
    F bits_of_lowest;
    load_four(&batch.packed[0][0], at, listed.fraction[0], listed.fraction[1], listed.fraction[2], bits_of_lowest);
    const I lowest = as_int(bits_of_lowest);
#endif
    listed.place = lowest + look_up(table.offset, sample);
  } else {
    listed.place = look_up(batch.lowest, vertex);
    I step[3];
    for (int axis = 0; axis < 3; ++axis) {
      const I at = look_up(table.number[axis], sample) + vertex;
      step[axis] = gather(batch.steps[axis][0], at);
      listed.fraction[axis] = gather(batch.fraction[axis][0], at);
    }
    listed.place = listed.place + step[0] + step[1] * all(kSampledStride) + shift_left<kSliceShift>(step[2]);
  }
  return listed;
}

// The eight corners of the listed samples' cells, by x + 2 y + 4 z.
struct SampledCorners {
  F d[8];
};

inline SampledCorners corners_of(const Work& work, I place) {
  const I in_slice = place & all((1 << kSliceShift) - 1);
  const I slice = shift_right<kSliceShift>(place) - all(kSliceBias);
  SampledCorners corners;
  for (int k = 0; k < 2; ++k) {
    const I from = ((slice + all(k)) & all(work.ring_mask)) * all(kSampledSlice) + in_slice;
    for (int j = 0; j < 2; ++j) {
      const I pair = gather_pairs(work.sampled.data() + j * kSampledStride, from);
      corners.d[2 * j + 4 * k] = low_half(pair);
      corners.d[2 * j + 4 * k + 1] = high_half(pair);
    }
  }
  return corners;
}

inline F solidity(F density, F solid, float deep) {
  return min(min(density, all(0.0F)) / min(solid, all(-deep)), all(1.0F));
}

template <int kSpread, bool kCounted>
bool find_values(const Work& work, std::size_t count, Batch& batch) {
  const bool is_soft = work.occlusion.method == SmoothOcclusion::SoftShare;
  const F unit = all(depth_unit(work.level));
  const F zero = all(0.0F);
  std::fill_n(batch.codes + count, kWidth, std::uint16_t{0});
  std::uint32_t any = 0;
  for (std::size_t i = 0; i < count; i += kWidth) {
    const Listed listed = listed_at<kSpread>(batch, batch.codes + i);
    SampledCorners corners = corners_of(work, listed.place);
    const F density = interpolated(corners.d, listed.fraction);
    const std::uint32_t solid = bits(density < zero);
    any |= solid;
    std::memcpy(batch.solid + i / 8, &solid, kWidth / 8);
    if constexpr (kCounted) continue;
    if (is_soft) {
      for (F& d : corners.d) d = min(d, zero);
      const F of_solid = interpolated(corners.d, listed.fraction);
      store(batch.values + i, solidity(density * unit, of_solid * unit, whole_depth(work.occlusion.spread)));
    } else {
      store(batch.values + i, min(density * unit, zero));
    }
  }
  return any != 0;
}

// occlusion_of_sum for the forms with power 2.
inline F occlusion_of_sum(F sum, F least, const SmoothOcclusionOptions& options) {
  if (options.method == SmoothOcclusion::SoftShare) return min(sum * all(1.0F / 27.0F), all(1.0F));
  const F minus_zero = all(-0.0F);
  const F ratio = (minus_zero - sum) / (all(27.0F) * max(minus_zero - least, all(options.spread)));
  const F base = ratio + all(options.offset);
  const F part = (all(1.0F) - base * base) / all(1.0F - options.offset * options.offset);
  return all(1.0F) - min(max(part, all(0.0F)), all(1.0F));
}

// The index in Work::cell_words of a vertex' first row in each slice, and the shift of its words.
struct FirstWords {
  alignas(64) std::int32_t word[3][kBatch];
  alignas(64) std::int32_t shift[kBatch];
};

template <int kSpread>
void find_first_words(const Work& work, std::size_t count, const Batch& batch, FirstWords& first) {
  for (std::size_t v = 0; v < count; v += kWidth) {
    const I column = load(batch.column + v);
    const I row = load(batch.row + v);
    const I z = load(batch.slice + v) - all(kSliceBias);
    const Mask is_second = all(kSecondWindow + kPointX - 1) < column;
    I slot = row;
    if constexpr (kRowStep<kSpread> == 2) slot = shift_right<1>(row) + (row & all(1)) * all(Work::kOddRows);
    slot = add_if(is_second, slot, all(Work::kSlots));
    store(first.shift + v, add_if(is_second, column, all(-kSecondWindow)));
    for (int k = 0; k < 3; ++k) {
      const I slice = (z + all(k * kSpread)) & all(work.ring_mask);
      store(first.word[k] + v, slot + slice * all(2 * Work::kSlots));
    }
  }
}

#ifdef QUOIN_KERNEL_AVX512

// Finds the words of a vertex' 27 cells. A register holds {listed, whole} of four rows, with the bits of three slices
// in the same words: sample s has a bit in 16-bit word 8 j or 8 j + 4.
template <int kSpread>
struct WordTable {
  static constexpr int kBitOfSlice[3] = {0, kSpread == 1 ? 3 : 1, 6};
  alignas(64) std::uint16_t listed[32]{};
  alignas(64) std::uint16_t whole[32]{};
  alignas(64) std::uint16_t bit[32]{};
  alignas(64) std::uint16_t sample[32]{};
  constexpr WordTable() {
    for (int s = 0; s < 32; ++s) {
      const int i = s % 3, j = s / 3 % 3, k = s / 9;
      sample[s] = static_cast<std::uint16_t>(s);
      listed[s] = static_cast<std::uint16_t>(8 * j);
      whole[s] = static_cast<std::uint16_t>(8 * j + 4);
      bit[s] = static_cast<std::uint16_t>(s < kSamples ? 1 << (kBitOfSlice[k] + kSpread * i) : 0);
    }
  }
  // The bits of slices 0, and of 0 and 1.
  static constexpr int kFirst = kSpread == 1 ? 0x07 : 0x15;
  static constexpr int kFirstTwo = 0x3F;
};
template <int kSpread>
inline constexpr WordTable<kSpread> kWordTable{};

template <int kSpread, bool kCounted>
std::size_t list_samples(const Work& work, std::size_t count, Batch& batch) {
  if constexpr (kSpread == 0) {
    const std::size_t listed = list_one_by_one<kSpread, kCounted>(work, count, batch);
    std::fill_n(batch.listed, count, 0);
    for (std::size_t i = 0; i < listed; ++i) batch.listed[batch.codes[i] >> kCodeShift] |= 1U << (batch.codes[i] & 31U);
    return listed;
  } else {
    using Table = WordTable<kSpread>;
    const Table& table = kWordTable<kSpread>;
    const __m512i listed_words = _mm512_load_si512(table.listed);
    const __m512i whole_words = _mm512_load_si512(table.whole);
    const __m512i bits = _mm512_load_si512(table.bit);
    const __m512i samples = _mm512_load_si512(table.sample);
    const CellWords* const words = work.cell_words.data();
    FirstWords at;
    find_first_words<kSpread>(work, count, batch, at);
    std::uint16_t* end = batch.codes;
    for (std::size_t v = 0; v < count; ++v) {
      __m512i of_slice[3];
      for (int k = 0; k < 3; ++k) {
        const __m128i shift = _mm_cvtsi32_si128(at.shift[v] - Table::kBitOfSlice[k]);
        of_slice[k] = _mm512_srl_epi64(_mm512_loadu_si512(words + at.word[k][v]), shift);
      }
      const __m512i two = _mm512_ternarylogic_epi64(_mm512_set1_epi64(Table::kFirst), of_slice[0], of_slice[1], 0xCA);
      const __m512i three = _mm512_ternarylogic_epi64(_mm512_set1_epi64(Table::kFirstTwo), two, of_slice[2], 0xCA);
      const __mmask32 listed = _mm512_test_epi16_mask(_mm512_permutexvar_epi16(listed_words, three), bits);
      const __m512i first = _mm512_set1_epi16(static_cast<short>(v << kCodeShift));
      _mm512_storeu_si512(end, _mm512_add_epi16(_mm512_maskz_compress_epi16(listed, samples), first));
      batch.listed[v] = listed;
      batch.first_code[v] = static_cast<std::int32_t>(end - batch.codes);
      if constexpr (kCounted) {
        const __mmask32 whole = _mm512_test_epi16_mask(_mm512_permutexvar_epi16(whole_words, three), bits);
        batch.whole[v] = std::popcount(std::uint32_t{whole});
      }
      end += std::popcount(std::uint32_t{listed});
    }
    return end_list(end, count, batch);
  }
}

// Sample s in lane s % 6 of group s / 6, from two registers of sixteen; 31 is always 0.
alignas(64) constexpr auto kGroups = [] {
  std::array<std::array<std::int32_t, 16>, 4> lanes{};
  for (int group = 1; group < 5; ++group) {
    for (int i = 0; i < 16; ++i) {
      const int sample = 6 * group + i;
      lanes[static_cast<std::size_t>(group - 1)][static_cast<std::size_t>(i)] =
          i < 6 && sample < kSamples ? sample : 31;
    }
  }
  return lanes;
}();

inline Sum sum_of(const Batch& batch, std::size_t v) {
  const float* const from = batch.values + batch.first_code[v];
  const std::uint32_t listed = batch.listed[v];
  const int low_count = std::popcount(listed & 0xFFFFU);
  const __m512 low = _mm512_maskz_expand_ps(static_cast<__mmask16>(listed), _mm512_loadu_ps(from));
  const __m512 high = _mm512_maskz_expand_ps(static_cast<__mmask16>(listed >> 16), _mm512_loadu_ps(from + low_count));
  __m512 sum = low;
  for (const auto& group : kGroups) {
    sum = _mm512_add_ps(sum, _mm512_permutex2var_ps(low, _mm512_load_si512(group.data()), high));
  }
  const __m256 six = _mm512_castps512_ps256(sum);
  const __m256 upper = _mm256_permutevar8x32_ps(six, _mm256_setr_epi32(3, 4, 5, 0, 0, 0, 0, 0));
  const __m128 three = _mm256_castps256_ps128(_mm256_add_ps(six, upper));
  const __m128 two = _mm_add_ss(three, _mm_movehdup_ps(three));
  return {_mm_cvtss_f32(_mm_add_ss(two, _mm_movehl_ps(three, three))), _mm512_reduce_min_ps(_mm512_min_ps(low, high))};
}

#else

// The sample of each bit of a vertex: samples of a row are `kSpread` bits apart, then follow the next row, then the
// next slice.
template <int kSpread>
constexpr int kBitsOfRow = 2 * kSpread + 1;
template <int kSpread>
constexpr auto kSampleOfBit = [] {
  std::array<std::uint16_t, 65> samples{};
  for (std::size_t s = 0; s < kSamples; ++s)
    samples[s / 3 * kBitsOfRow<kSpread> + s % 3 * kSpread] = static_cast<std::uint16_t>(s);
  return samples;
}();

template <int kSpread, bool kCounted>
std::size_t list_samples(const Work& work, std::size_t count, Batch& batch) {
  if constexpr (kSpread == 0) {
    return list_one_by_one<kSpread, kCounted>(work, count, batch);
  } else {
    constexpr int kRow = kBitsOfRow<kSpread>;
    constexpr int kThree = 1 | 1 << kSpread | 1 << 2 * kSpread;
    const __m256i three = _mm256_set1_epi64x(kThree);
    FirstWords at;
    find_first_words<kSpread>(work, count, batch, at);
    std::uint16_t* end = batch.codes;
    for (std::size_t v = 0; v < count; ++v) {
      const __m128i shift = _mm_cvtsi32_si128(at.shift[v]);
      __m256i two_rows = _mm256_setzero_si256();
      __m128i third_row = _mm_setzero_si128();
      for (int k = 0; k < 3; ++k) {
        const auto* const words = reinterpret_cast<const __m128i*>(work.cell_words.data() + at.word[k][v]);
        const __m256i a = _mm256_srl_epi64(_mm256_loadu_si256(reinterpret_cast<const __m256i*>(words)), shift);
        const __m128i b = _mm_srl_epi64(_mm_loadu_si128(words + 2), shift);
        const __m256i to = _mm256_setr_epi64x(3 * k * kRow, 3 * k * kRow, (3 * k + 1) * kRow, (3 * k + 1) * kRow);
        two_rows = _mm256_or_si256(two_rows, _mm256_sllv_epi64(_mm256_and_si256(a, three), to));
        third_row = _mm_or_si128(third_row,
                                 _mm_slli_epi64(_mm_and_si128(b, _mm256_castsi256_si128(three)), (3 * k + 2) * kRow));
      }
      const __m128i bits = _mm_or_si128(
          _mm_or_si128(_mm256_castsi256_si128(two_rows), _mm256_extracti128_si256(two_rows, 1)), third_row);
      batch.first_code[v] = static_cast<std::int32_t>(end - batch.codes);
      if constexpr (kCounted) batch.whole[v] = std::popcount(static_cast<std::uint64_t>(_mm_extract_epi64(bits, 1)));
      const auto first = static_cast<unsigned>(v << kCodeShift);
      auto left = static_cast<std::uint64_t>(_mm_cvtsi128_si64(bits));
      const int listed = std::popcount(left);
      // In steps of four: the end of a short loop is unpredictable. Later codes overwrite the excess ones.
      std::uint16_t* to = end;
      do {
        for (int i = 0; i < 4; ++i, left &= left - 1) {
          *to++ = static_cast<std::uint16_t>(first |
                                             kSampleOfBit<kSpread>[static_cast<std::size_t>(std::countr_zero(left))]);
        }
      } while (left != 0);
      end += listed;
    }
    return end_list(end, count, batch);
  }
}

#endif

void add_up(const Work& work, const Batch& batch, std::span<const std::uint32_t> which, float* occlusion) {
  const SmoothOcclusionOptions& options = work.occlusion;
  const bool is_soft = options.method == SmoothOcclusion::SoftShare;
  if (!is_soft && (options.method != SmoothOcclusion::Weighted || options.power != 2.0F)) {
    for (const std::uint32_t v : which) occlusion[v] = occlusion_of_sum(sum_of(batch, v), options);
    return;
  }
  alignas(64) float sums[kBatch + kWidth];
  alignas(64) float leasts[kBatch + kWidth];
  for (std::size_t i = 0; i < which.size(); ++i) {
    const Sum sum = sum_of(batch, which[i]);
    sums[i] = sum.sum;
    leasts[i] = sum.least;
  }
  for (std::size_t i = 0; i < which.size(); i += kWidth) {
    store(sums + i, occlusion_of_sum(load(sums + i), load(leasts + i), options));
  }
  for (std::size_t i = 0; i < which.size(); ++i) occlusion[which[i]] = sums[i];
}

// Occlusion for slices with many active cells and integer spreads, as many vertices at a time as a register has
// groups of eight lanes. All 27 samples of a vertex then share one fraction: six rows of points along x in each of six
// slices, interpolated along z, y and x in turn.
//
//   slices z, z + 1 -> one; rows y, y + 1 -> one: nine rows of eight points     | . . . . . . . . |
//   points 0, s, 2 s of two rows each, s is the spread                           | a a a b b b - - |

void decode_row(const Half* from, float* to, int count) {
  for (int i = 0; i < count; i += kWidth) store(to + i, load_halves(from + i));
}

void decode_part(const RowPart& part, int first, int count, float* to) {
  if (part.samples != nullptr) return decode_row(part.samples + first, to, count);
  alignas(64) Half same[kChunkEdge];
  std::fill_n(same, count, part.value);
  decode_row(same, to, count);
}

// Decodes the row of points (y, z), with sixteen points before and after; `to` points to x = 0.
void decode_points(const Work& work, int y, int z, float* to) {
  if (work.level == 0) {
    const std::array<RowPart, 3> parts = row_parts(work, y, z);
    decode_part(parts[0], kChunkEdge - kPointX, kPointX, to - kPointX);
    decode_part(parts[1], 0, kChunkEdge, to);
    decode_part(parts[2], 0, kPointX, to + kChunkEdge);
    return;
  }
  alignas(64) Half halves[kPlaceStride] = {};
  gather_row(work, y, z, halves + kPointX);
  const int count = work.n + 2 * kPointX;
  decode_row(halves, to - kPointX, count);
  // Exact: the unit is a power of two.
  const float unit = depth_unit(work.level);
  for (int i = 0; i < count; ++i) to[i - kPointX] *= unit;
}

void decode_slice(Work& work, int z) {
  const RowSet& needed = work.occlusion_rows[static_cast<std::size_t>(z + kWidestApron)];
  if (needed.empty()) return;
  const int slices = work.ring_mask + 1;
  const bool is_repeated = (z & work.ring_mask) < kRepeatedSlices;
  for (int y = work.cells.first - work.apron; y <= work.cells.last + work.apron; ++y) {
    if (!needed.has(y)) continue;
    float* const row = work.decoded_row(y, z);
    decode_points(work, y, z, row);
    if (!is_repeated) continue;
    std::memcpy(row - kPointX + std::ptrdiff_t{slices} * kDecodedSlice, row - kPointX, sizeof(float) * kDecodedStride);
  }
}

// Decodes all samples that the occlusion of vertices in slice z of cells reads.
void decode_around(Work& work, int z) {
  const int last = z + work.apron + 1;
  for (int next = std::max(work.next_slice, z - work.apron); next <= last; ++next) decode_slice(work, next);
  work.next_slice = last + 1;
}

// The sample grid of each vertex of a slice: the lowest point that it reads, and the fractions that its samples share.
struct Centres {
  alignas(64) std::int32_t offset[kWidth];
  alignas(64) std::int32_t z[kWidth];
  alignas(64) float fx[kWidth];
  alignas(64) float fy[kWidth];
  alignas(64) float fz[kWidth];
};

inline Centres find_centres(const Work& work, const Slice& slice, std::size_t first) {
  const F spread = all(work.occlusion.spread);
  const int whole = static_cast<int>(work.occlusion.spread);
  F n[3];
  for (int i = 0; i < 3; ++i) n[i] = load(work.normals[i] + first);
  const F lift = spread * ((abs(n[0]) + abs(n[1])) + abs(n[2])) + all(kLift);
  I base[3];
  F fraction[3];
  for (int i = 0; i < 3; ++i) {
    const F centre = load(work.fractions[i] + first) + ((n[i] * lift + all(kSnapOffset)) - all(kSnapOffset));
    const F below = floor(centre);
    fraction[i] = centre - below;
    base[i] = to_int(below) - all(whole);
  }
  const I place = load(work.places + first) & all(kPlaceMask);
  const I x = (place & all(kPlaceStride - 1)) + base[0];
  const I y = shift_right<kPlaceShift>(place) + base[1];
  Centres centres;
  store(centres.offset, (y + all(kWidestApron - 1)) * all(kDecodedStride) + x + all(kPointX - 1));
  store(centres.z, base[2] + all(slice.z));
  store(centres.fx, fraction[0]);
  store(centres.fy, fraction[1]);
  store(centres.fz, fraction[2]);
  return centres;
}

// The part of the points' densities to interpolate.
enum class Part { All, Solid };

template <Part kPart>
inline F part_of(F density) {
  return kPart == Part::All ? density : min(density, all(0.0F));
}

// The nine rows along x after interpolation along z and y, and one row of zeros.
struct NineRows {
  F v[10];
};

template <int kSpread, Part kPart>
inline NineRows rows_around(const Work& work, const Centres& centres, std::size_t lane) {
  const float* lowest[kVerticesAtOnce];
  for (std::size_t i = 0; i < kVerticesAtOnce; ++i) {
    lowest[i] = work.decoded.data() + (centres.z[lane + i] & work.ring_mask) * kDecodedSlice + centres.offset[lane + i];
  }
  const F fy = spread_out(centres.fy + lane);
  const F fz = spread_out(centres.fz + lane);
  NineRows rows;
  for (int k = 0; k < 3; ++k) {
    for (int j = 0; j < 3; ++j) {
      F along_z[2];
      for (int i = 0; i < 2; ++i) {
        const int at = k * kSpread * kDecodedSlice + (j * kSpread + i) * kDecodedStride;
        const F low = part_of<kPart>(load_rows(lowest, at));
        const F high = part_of<kPart>(load_rows(lowest, at + kDecodedSlice));
        along_z[i] = low + fz * (high - low);
      }
      rows.v[3 * k + j] = along_z[0] + fy * (along_z[1] - along_z[0]);
    }
  }
  rows.v[9] = all(0.0F);
  return rows;
}

// The samples of two rows, in the lowest six lanes of each vertex.
struct Samples {
  F v[5];
};

inline Samples samples_of(const NineRows& rows, F fx, const Thirds& low_lanes, const Thirds& high_lanes) {
  Samples samples;
  for (int i = 0; i < 5; ++i) {
    const F low = low_lanes(rows.v[2 * i], rows.v[2 * i + 1]);
    samples.v[i] = low + fx * (high_lanes(rows.v[2 * i], rows.v[2 * i + 1]) - low);
  }
  return samples;
}

inline void store_counted(const Samples& samples, float* out) {
  std::uint64_t open = 0;
  for (int i = 0; i < 4; ++i) open |= std::uint64_t{open_bits(samples.v[i])} << (16 * i);
  const std::uint32_t last = open_bits(samples.v[4]);
  for (int i = 0; i < kVerticesAtOnce; ++i) {
    const int count = std::popcount(open >> (8 * i) & 0x003F'003F'003F'003FU) + std::popcount(last >> (8 * i) & 0x07U);
    out[i] = solid_share(count);
  }
}

// Returns the sum of a vertex' six lanes, in the order of occlusion_of.
inline float sum_of_lanes(const float* s) {
  return ((s[0] + s[3]) + (s[1] + s[4])) + (s[2] + s[5]);
}

inline void store_soft(const Samples& samples, const Samples& solid, float spread, float* out) {
  const float deep = whole_depth(spread);
  F sum = all(0.0F);
  for (int i = 0; i < 5; ++i) sum = sum + solidity(samples.v[i], solid.v[i], deep);
  alignas(64) float sums[kWidth];
  store(sums, sum);
  for (int i = 0; i < kVerticesAtOnce; ++i) out[i] = soft_share(sum_of_lanes(sums + 8 * i));
}

inline void store_weighted(const Samples& samples, const SmoothOcclusionOptions& options, float* out) {
  const F zero = all(0.0F);
  F sum = zero;
  F least = zero;
  for (int i = 0; i < 5; ++i) {
    const F depth = min(samples.v[i], zero);
    sum = sum + depth;
    least = min(least, depth);
  }
  alignas(64) float sums[kWidth];
  alignas(64) float leasts[kWidth];
  store(sums, sum);
  store(leasts, least);
  for (int i = 0; i < kVerticesAtOnce; ++i) {
    const float* const s = sums + 8 * i;
    const float* const l = leasts + 8 * i;
    const float deepest = std::min({l[0], l[1], l[2], l[3], l[4], l[5]});
    out[i] = weighted_occlusion(sum_of_lanes(s), deepest, options);
  }
}

template <int kSpread>
void add_occlusion_of_spread(const Work& work, const Slice& slice, std::size_t count, float* occlusion) {
  const Thirds low_lanes(kSpread, 0);
  const Thirds high_lanes(kSpread, 1);
  const SmoothOcclusion method = work.occlusion.method;
  for (std::size_t first = 0; first < count; first += kWidth) {
    const Centres centres = find_centres(work, slice, first);
    const std::size_t lanes = std::min<std::size_t>(kWidth, count - first);
    for (std::size_t lane = 0; lane < lanes; lane += kVerticesAtOnce) {
      const F fx = spread_out(centres.fx + lane);
      const Samples samples =
          samples_of(rows_around<kSpread, Part::All>(work, centres, lane), fx, low_lanes, high_lanes);
      if (method == SmoothOcclusion::SolidShare) {
        store_counted(samples, occlusion + first + lane);
      } else if (method == SmoothOcclusion::SoftShare) {
        const NineRows solid = rows_around<kSpread, Part::Solid>(work, centres, lane);
        store_soft(samples, samples_of(solid, fx, low_lanes, high_lanes), work.occlusion.spread,
                   occlusion + first + lane);
      } else {
        store_weighted(samples, work.occlusion, occlusion + first + lane);
      }
    }
  }
}

void add_occlusion(Work& work, const Slice& slice, std::size_t count, float* occlusion) {
  if (count == 0) return;
  if (!work.is_dense) return occlude_by_lists(work, slice, count, occlusion);
  decode_around(work, slice.z);
  if (work.occlusion.spread == 1.0F) {
    add_occlusion_of_spread<1>(work, slice, count, occlusion);
  } else {
    add_occlusion_of_spread<2>(work, slice, count, occlusion);
  }
}

}  // namespace
}  // namespace quoin::smooth
