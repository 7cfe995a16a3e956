// Converts runs to quads, one row at a time, for AVX-512. Compressing moves select the runs that end in a row and pack
// their parts. Then sixteen quads at a time are assembled.
//
//   Parts       | first | first | ...     one byte each: the run's first cell
//               | last  | last  | ...     its last cell
//               | rows  | rows  | ...     its rows before this one
//               | corners ...           the eight bits of their occlusion
//   places      | 64 plane + row | ...    two bytes each

#pragma once

#include <cstdint>

#include <immintrin.h>

#include <quoin/core/assert.h>

#include "mesh/blocky/blocky_mesher.h"
#include "mesh/blocky/runs.inl"

namespace quoin::blocky {
namespace {

// Lists the rows with runs in the listed groups. Returns the number of quads that end in them.
QUOIN_STAGE std::size_t list_rows(int groups, const Batch& b, std::uint16_t* rows, std::size_t& row_count) {
  const __m128i eight = _mm_set_epi16(7, 6, 5, 4, 3, 2, 1, 0);
  __m512i quads = _mm512_setzero_si512();
  std::uint16_t* out = rows;
  for (int i = 0; i < groups; ++i) {
    const int at = b.groups[i];
    const auto has_runs = static_cast<__mmask8>(lanes_with_bits(load(b.ends + at)));
    const __m128i words = _mm_add_epi16(eight, _mm_set1_epi16(static_cast<short>(at)));
    _mm_storeu_si128(reinterpret_cast<__m128i*>(out), _mm_maskz_compress_epi16(has_runs, words));
    out += __builtin_popcount(has_runs);
    quads = _mm512_add_epi64(quads, _mm512_popcnt_epi64(bits_of(load(b.closes + at))));
  }
  row_count = static_cast<std::size_t>(out - rows);
  return static_cast<std::size_t>(_mm512_reduce_add_epi64(quads));
}

// Constants of the occlusion computation for all rows: for each bit of a cell's occlusion (two per corner), the
// neighbours that determine it.
template <bool kUAlongBits>
struct CornerLanes {
  // Corners (bit, row) in a quad's order: (0,0) (1,0) (1,1) (0,1), or with the axes exchanged.
  static constexpr __mmask8 kAfter = kUAlongBits ? 0b0011'1100 : 0b1111'0000;
  static constexpr __mmask8 kNextRow = kUAlongBits ? 0b1111'0000 : 0b0011'1100;
};

QUOIN_INLINE __m512i broadcast(const std::uint64_t* p) {
  return _mm512_set1_epi64(static_cast<long long>(*p));
}

// Returns the row before or the row after, as each lane needs it.
template <bool kUAlongBits>
QUOIN_INLINE __m512i rows_beside(const std::uint64_t* row) {
  return _mm512_mask_broadcastq_epi64(broadcast(row - 1), CornerLanes<kUAlongBits>::kNextRow,
                                      _mm_loadl_epi64(reinterpret_cast<const __m128i*>(row + 1)));
}

// Returns the cell before or after, as each lane needs it. A rotation by 1 or by 63 moves it into place. The end of the
// row that the rotation also moves is replaced first.
template <bool kUAlongBits>
QUOIN_INLINE __m512i cells_beside(__m512i row, __m512i ends) {
  constexpr __mmask8 kAfter = CornerLanes<kUAlongBits>::kAfter;
  const __m512i rotation = _mm512_mask_set1_epi64(_mm512_set1_epi64(1), kAfter, 63);
  const __m512i brought = _mm512_mask_set1_epi64(_mm512_set1_epi64(INT64_MIN), kAfter, 1);
  return _mm512_rolv_epi64(_mm512_ternarylogic_epi64(brought, ends, row, 0xCA), rotation);
}

// Computes the eight bits of occlusion of all 64 cells of a row, in the layout of a quad.
template <bool kUAlongBits, bool kRowEnds>
QUOIN_INLINE __m512i occlusion_of_row(const std::uint64_t* front, const std::uint64_t* ends) {
  const __m512i none = _mm512_setzero_si512();
  const __m512i side2 = rows_beside<kUAlongBits>(front);
  const __m512i side1 = cells_beside<kUAlongBits>(broadcast(front), kRowEnds ? broadcast(ends) : none);
  const __m512i corner = cells_beside<kUAlongBits>(side2, kRowEnds ? rows_beside<kUAlongBits>(ends) : none);
  constexpr __mmask8 kHighBits = 0b1010'1010;
  __m512i planes = _mm512_mask_ternarylogic_epi64(side1, kHighBits, side2, corner, 0xE8);
  planes = _mm512_mask_ternarylogic_epi64(planes, static_cast<__mmask8>(~kHighBits), side2, corner, 0xD6);
  // Selects byte i of each plane, the last plane first, and then transposes the bits: one byte per cell.
  alignas(64) static constexpr auto kTurned = [] {
    std::array<std::uint8_t, 64> bytes{};
    for (std::size_t i = 0; i < 64; ++i) bytes[i] = static_cast<std::uint8_t>((7 - i % 8) * 8 + i / 8);
    return bytes;
  }();
  const __m512i turned = _mm512_permutexvar_epi8(_mm512_load_si512(kTurned.data()), planes);
  return _mm512_gf2p8affine_epi64_epi8(_mm512_set1_epi64(0x8040'2010'0804'0201), turned, 0);
}

// Stores at least `count` bytes: most rows have few.
QUOIN_INLINE void append(std::uint8_t* to, __m512i bytes, std::int64_t count) {
  _mm_storeu_si128(reinterpret_cast<__m128i*>(to), _mm512_castsi512_si128(bytes));
  if (__builtin_expect(count > 16, 0)) _mm512_storeu_si512(to, bytes);
}

// Appends the same number `count` times.
QUOIN_INLINE void append(std::uint16_t* to, __m512i numbers, std::int64_t count) {
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(to), _mm512_castsi512_si256(numbers));
  if (__builtin_expect(count > 16, 0)) {
    _mm512_storeu_si512(to, numbers);
    _mm512_storeu_si512(to + 32, numbers);
  }
}

// Writes the parts of all quads that end in the listed rows.
template <bool kOcclusion, bool kUAlongBits, bool kRowEnds>
QUOIN_STAGE void take_apart(const Pass& pass, int first_plane, std::size_t rows, Scratch& s) {
  const Batch& b = s.batch;
  Parts& parts = s.parts;
  alignas(64) static constexpr auto kColumns = [] {
    std::array<std::uint8_t, 64> columns{};
    for (std::size_t i = 0; i < 64; ++i) columns[i] = static_cast<std::uint8_t>(i);
    return columns;
  }();
  const __m512i columns = _mm512_load_si512(kColumns.data());
  const __m512i one = _mm512_set1_epi8(1);
  const int front = word_index(first_plane + pass.side, 0);
  const std::uint64_t* opaque = pass.view->opaque.words + front;
  const std::uint64_t* row_ends = pass.view->ends.words + front;
  __m512i heights = _mm512_setzero_si512();  // rows so far of the run that ends in a column
  std::uint8_t* out = parts.bytes[0];
  std::uint16_t* places = parts.places;
  for (std::size_t i = 0; i < rows; ++i) {
    const std::size_t at = parts.rows[i];
    const std::uint64_t ends = b.ends[at];
    const std::uint64_t closes = b.closes[at];
    const __m512i last = _mm512_maskz_compress_epi8(closes, columns);
    const __m512i first = _mm512_maskz_compress_epi8(_pdep_u64(_pext_u64(closes, ends), b.starts[at]), columns);
    const std::int64_t count = __builtin_popcountll(closes);
    append(out + Parts::kFirst * kBatchQuads, first, count);
    append(out + Parts::kLast * kBatchQuads, last, count);
    append(out + Parts::kRowsBefore * kBatchQuads, _mm512_permutexvar_epi8(last, heights), count);
    heights = _mm512_maskz_add_epi8(ends ^ closes, heights, one);
    if constexpr (kOcclusion) {
      const __m512i occlusion = occlusion_of_row<kUAlongBits, kRowEnds>(opaque + at, row_ends + at);
      append(out + Parts::kOcclusion * kBatchQuads, _mm512_permutexvar_epi8(last, occlusion), count);
    }
    append(places, _mm512_set1_epi32(static_cast<int>(s.occlusion.numbers[at])), count);
    out += count;
    places += count;
  }
}

// Returns the types of sixteen quads, shifted as in the upper half of a quad, from the bit planes of the palette index.
template <int kPlanes>
QUOIN_INLINE __m512i types_of(const Scratch& s, __m512i positions) {
  // A layer in halves of words: 2 * word_index(z, y) + x / 32.
  const __m512i half = _mm512_add_epi32(
      _mm512_and_si512(_mm512_srli_epi32(positions, 5), _mm512_set1_epi32(0x1FFF)),
      _mm512_and_si512(_mm512_srli_epi32(positions, 12 - 1 - 3), _mm512_set1_epi32(63 * 2 * (kRowStride - 64))));
  __m512i index = _mm512_setzero_si512();
  for (int k = 0; k < kPlanes; ++k) {
    const __m512i halves = _mm512_i32gather_epi32(half, s.planes[k].words + word_index(0, 0), 4);
    const __m512i bit = _mm512_rolv_epi32(_mm512_rorv_epi32(halves, positions), _mm512_set1_epi32(k));
    index = _mm512_ternarylogic_epi32(index, bit, _mm512_set1_epi32(1 << k), 0xF8);
  }
  return _mm512_permutexvar_epi32(index, _mm512_loadu_si512(s.narrow_palette));
}

QUOIN_INLINE __m512i sixteen_bytes(const std::uint8_t* p) {
  return _mm512_cvtepu8_epi32(_mm_loadu_si128(reinterpret_cast<const __m128i*>(p)));
}

QUOIN_INLINE __m512i or3(__m512i a, __m512i b, __m512i c) {
  return _mm512_ternarylogic_epi32(a, b, c, 0xFE);
}

// Assembles quads from their parts.
template <int kDirection, bool kOcclusion, int kPlanes>
QUOIN_STAGE void put_together(int first_plane, std::uint64_t one_type, std::size_t quads, const Scratch& s,
                              std::uint64_t* out) {
  using L = Layout<kDirection>;
  const Parts& parts = s.parts;
  const __m512i plane = _mm512_set1_epi32(first_plane << (6 * L::kAxis));
  const __m512i upper =
      _mm512_set1_epi32(static_cast<int>(((std::uint64_t{kDirection} << Quad::kDirectionShift) | one_type) >> 32));
  const __m512i flips = _mm512_broadcast_i32x8(_mm256_loadu_si256(reinterpret_cast<const __m256i*>(s.occlusion.flips)));
  const __m512i low_half = _mm512_set_epi32(23, 7, 22, 6, 21, 5, 20, 4, 19, 3, 18, 2, 17, 1, 16, 0);
  const __m512i high_half = _mm512_add_epi32(low_half, _mm512_set1_epi32(8));
  for (std::size_t i = 0; i < quads; i += 16) {
    const __m512i number =
        _mm512_cvtepu16_epi32(_mm256_loadu_si256(reinterpret_cast<const __m256i*>(parts.places + i)));
    const __m512i first = sixteen_bytes(parts.bytes[Parts::kFirst] + i);
    const __m512i rows_before = sixteen_bytes(parts.bytes[Parts::kRowsBefore] + i);
    const __m512i row = _mm512_sub_epi32(_mm512_and_si512(number, _mm512_set1_epi32(63)), rows_before);
    const __m512i planes = _mm512_slli_epi32(_mm512_srli_epi32(number, 6), 6 * L::kAxis);
    const __m512i width = _mm512_sub_epi32(sixteen_bytes(parts.bytes[Parts::kLast] + i), first);
    __m512i low = or3(_mm512_slli_epi32(row, 6 * L::kRowAxis), _mm512_slli_epi32(first, 6 * L::kBitAxis),
                      _mm512_add_epi32(planes, plane));
    __m512i high = upper;
    if constexpr (kPlanes > 0) high = _mm512_or_si512(high, types_of<kPlanes>(s, low));
    low = or3(low, _mm512_slli_epi32(width, L::kWidthShift), _mm512_slli_epi32(rows_before, L::kHeightShift));
    if constexpr (kOcclusion) {
      const __m512i occlusion = sixteen_bytes(parts.bytes[Parts::kOcclusion] + i);
      low = _mm512_or_si512(low, _mm512_slli_epi32(occlusion, Quad::kOcclusionShift));
      const __m512i flip =
          _mm512_rorv_epi32(_mm512_permutexvar_epi32(_mm512_srli_epi32(occlusion, 5), flips), occlusion);
      high = _mm512_ternarylogic_epi32(high, flip, _mm512_set1_epi32(1 << (Quad::kFlipShift - 32)), 0xF8);
      high = _mm512_or_si512(high, _mm512_srli_epi32(occlusion, 32 - Quad::kOcclusionShift));
    }
    _mm512_storeu_si512(out + i, _mm512_permutex2var_epi32(low, low_half, high));
    _mm512_storeu_si512(out + i + 8, _mm512_permutex2var_epi32(low, high_half, high));
  }
}

// Adds the types of quads in chunks with 8 or 16 bits per voxel.
template <int kLogBits>
void add_types(const Scratch& s, std::uint64_t* quads, std::size_t count) {
  constexpr std::uint64_t kMask = (std::uint64_t{1} << (1 << kLogBits)) - 1;
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint64_t bit = (quads[i] & 63) << kLogBits;
    const std::uint64_t index = s.rows[quads[i] >> 6 & 0xFFF][bit >> 6] >> (bit & 63) & kMask;
    quads[i] |= kLogBits == 4 ? index << Quad::kTypeShift : s.palette[index];
  }
}

// Appends the quads of a batch to the buffer.
template <int kDirection, bool kOcclusion>
void emit_batch(const Pass& pass, int first_plane, int groups, const TypeSource& types, Scratch& s, QuadBuffer& quads) {
  constexpr bool kUAlongBits = Layout<kDirection>::kUAlongBits;
  std::size_t rows = 0;
  const std::size_t count = list_rows(groups, s.batch, s.parts.rows, rows);
  QUOIN_ASSERT(rows <= std::size_t{kBatchPlanes} * 64 && count + 64 <= kBatchQuads, "room for the batch");
  const auto take = [&](auto row_ends) {
    take_apart<kOcclusion, kUAlongBits, kOcclusion && row_ends>(pass, first_plane, rows, s);
  };
  pass.row_ends ? take(std::true_type{}) : take(std::false_type{});
  std::uint64_t* out = grow_quads(quads, s.quads, count + 16);
  s.quads += count;
  switch (types.planes) {
    case 1:
      return put_together<kDirection, kOcclusion, 1>(first_plane, 0, count, s, out);
    case 2:
      return put_together<kDirection, kOcclusion, 2>(first_plane, 0, count, s, out);
    case 3:
      return put_together<kDirection, kOcclusion, 3>(first_plane, 0, count, s, out);
    case 4:
      return put_together<kDirection, kOcclusion, 4>(first_plane, 0, count, s, out);
    default:
      put_together<kDirection, kOcclusion, 0>(first_plane, types.one, count, s, out);
  }
  if (types.log_bits == 3) add_types<3>(s, out, count);
  if (types.log_bits == 4) add_types<4>(s, out, count);
}

}  // namespace
}  // namespace quoin::blocky
