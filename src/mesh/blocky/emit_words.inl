// Converts runs to quads, one run at a time.
//
//   Row      | ends | starts | closes | place | front |      a row that has runs, with its five words
//   quad     | type | occlusion, flip | size v | size u | place, direction |      64 bits; see quoin/mesh/quad.h

#pragma once

#include <cstdint>

#include <quoin/core/assert.h>

#include "mesh/blocky/blocky_mesher.h"
#include "mesh/blocky/runs.inl"

namespace quoin::blocky {
namespace {

// Packs the rows with runs of the listed groups. Returns the number of runs.
template <int kDirection>
QUOIN_STAGE std::size_t list_rows(const Pass& pass, int first_plane, int groups, const TypeSource& types, Scratch& s) {
  using L = Layout<kDirection>;
  Batch& b = s.batch;
  const std::uint64_t* places = s.occlusion.places[L::kAxis];
  const std::uint64_t base = (std::uint64_t{kDirection} << Quad::kDirectionShift) + types.one +
                             (static_cast<std::uint64_t>(first_plane) << (6 * L::kAxis));
  const std::uint64_t* front = pass.view->opaque.words + word_index(first_plane + L::kFrame.sign, 0);
  Row* out = b.rows;
  std::int64_t runs = 0;
  for (int i = 0; i < groups; ++i) {
    const int at = b.groups[i];
    const Words columns[4] = {load(b.ends + at), load(b.starts + at), load(b.closes + at), load(places + at) + base};
    Words rows[4];
    transpose_words(columns, rows);
    // All four rows are written; the next row overwrites a row without runs.
    for (int k = 0; k < 4; ++k) {
      const std::uint64_t ends = b.ends[at + k];
      store(&out->ends, rows[k]);
      out->front = front + at + k;
      out += ends != 0;
      runs += __builtin_popcountll(ends);
    }
  }
  QUOIN_ASSERT(out - b.rows <= kBatchPlanes * 64, "room for the rows of a batch");
  out->ends = out->starts = 0;
  return static_cast<std::size_t>(runs);
}

// Returns the bits of the 9 voxels in front of the first or last cell of a row, in the order of the occlusion tables.
__attribute__((noinline)) std::uint64_t bits_in_front_at_end(const Pass& pass, const std::uint64_t* front,
                                                             bool is_first) {
  const std::int64_t word = front - pass.view->opaque.words;
  std::uint64_t bits = 0;
  for (int row = 1; row >= -1; --row) {
    const std::uint64_t ends = pass.row_ends ? pass.view->ends.words[word + row] : 0;
    const std::uint64_t before = ends >> 63;
    const std::uint64_t after = ends & 1;
    bits = bits << 3 | (is_first ? (front[row] << 1 | before) & 7 : front[row] >> 62 | after << 2);
  }
  return bits;
}

QUOIN_INLINE std::uint64_t bits_in_front(const Pass& pass, const std::uint64_t* front, std::uint64_t cell) {
  const std::uint64_t shift = cell - 1;
  if (__builtin_expect(shift >= 62, 0)) return bits_in_front_at_end(pass, front, cell == 0);
  return (front[-1] >> shift & 7) + (front[0] >> shift & 7) * 8 + (front[1] >> shift & 7) * 64;
}

// Removes the lowest bits of both words. If none are left, continues with the next row, without a branch.
QUOIN_INLINE void next_run(std::uint64_t& starts, std::uint64_t& ends, const Row*& row) {
  const Row* next = row + 1;
  starts &= starts - 1;
#ifdef QUOIN_KERNEL_AVX2
  // Compilers turn this into a branch, which is mispredicted in every other row.
  asm("blsr %[ends], %[ends]\n\t"
      "cmovz %[next_starts], %[starts]\n\t"
      "cmovz %[next_ends], %[ends]\n\t"
      "cmovz %[next], %[row]"
      : [starts] "+&r"(starts), [ends] "+&r"(ends), [row] "+r"(row)
      : [next_starts] "m"(next->starts), [next_ends] "m"(next->ends), [next] "r"(next)
      : "cc");
#else
  ends &= ends - 1;
  const auto done = static_cast<std::uint64_t>(ends == 0);
  starts |= next->starts & (std::uint64_t{0} - done);
  ends |= next->ends & (std::uint64_t{0} - done);
  row += done;
#endif
}

// Returns the type of a cell of a row, shifted to its position in a quad. `place` holds the row's plane and number.
template <int kDirection, int kLogBits>
QUOIN_INLINE std::uint64_t type_of(const Scratch& s, std::uint64_t place, std::uint64_t cell) {
  using L = Layout<kDirection>;
  if constexpr (kLogBits == kOneType) {
    return 0;
  } else {
    // Bits 6 to 17 of a quad number its voxel's row; in the x view the cell is the z in that number.
    const std::uint64_t row = (place >> 6 & 0xFFF) + (L::kAxis == 0 ? cell << 6 : 0);
    const std::uint64_t x = L::kAxis == 0 ? place & 63 : cell;
    const std::uint64_t bit = x << kLogBits;
    constexpr std::uint64_t kMask = (std::uint64_t{1} << (1 << kLogBits)) - 1;
    const std::uint64_t index = s.rows[row][bit >> 6] >> static_cast<unsigned>(bit & 63) & kMask;
    return kLogBits == 4 ? index << Quad::kTypeShift : s.palette[index];
  }
}

// Converts the runs of a batch to quads, in one flat loop. A run that ends here becomes a quad; a run that grows only
// counts a row.
template <int kDirection, bool kOcclusion, int kLogBits>
QUOIN_STAGE std::uint64_t* emit(const Pass& pass, std::size_t runs, Scratch& s, std::uint64_t* out) {
  using L = Layout<kDirection>;
  // Each additional row lowers the start and increases the height.
  constexpr std::uint64_t kPerRow = (std::uint64_t{1} << L::kHeightShift) - (std::uint64_t{1} << (6 * L::kRowAxis));
  const Row* row = s.batch.rows;
  std::uint64_t starts = row->starts;
  std::uint64_t ends = row->ends;
  for (; runs != 0; --runs) {
    const std::uint64_t first = lowest_bit(starts);
    const std::uint64_t last = lowest_bit(ends);
    const std::uint64_t closes = row->closes >> last & 1;
    const std::uint64_t rows_before = s.batch.rows_before[last];
    s.batch.rows_before[last] = (rows_before + kPerRow) & (closes - 1);
    std::uint64_t quad = row->place + rows_before + (first << (6 * L::kBitAxis)) + ((last - first) << L::kWidthShift);
    if constexpr (kOcclusion) {
      const std::uint64_t around = bits_in_front(pass, row->front, last);
      quad |= L::kUAlongBits ? s.occlusion.u_along_bits[around] : s.occlusion.u_along_rows[around];
    }
    *out = quad | type_of<kDirection, kLogBits>(s, row->place, last);
    out += closes;
    next_run(starts, ends, row);
  }
  return out;
}

template <int kDirection, bool kOcclusion>
std::uint64_t* emit(const Pass& pass, int log_bits, std::size_t runs, Scratch& s, std::uint64_t* out) {
  switch (log_bits) {
    case kOneType:
      return emit<kDirection, kOcclusion, kOneType>(pass, runs, s, out);
    case 0:
      return emit<kDirection, kOcclusion, 0>(pass, runs, s, out);
    case 1:
      return emit<kDirection, kOcclusion, 1>(pass, runs, s, out);
    case 2:
      return emit<kDirection, kOcclusion, 2>(pass, runs, s, out);
    case 3:
      return emit<kDirection, kOcclusion, 3>(pass, runs, s, out);
    default:
      QUOIN_ASSERT(log_bits == 4, "1, 2, 4, 8 or 16 bits per voxel");
      return emit<kDirection, kOcclusion, 4>(pass, runs, s, out);
  }
}

// Appends the quads of a batch to the buffer.
template <int kDirection, bool kOcclusion>
void emit_batch(const Pass& pass, int first_plane, int groups, const TypeSource& types, Scratch& s, QuadBuffer& quads) {
  const std::size_t runs = list_rows<kDirection>(pass, first_plane, groups, types, s);
  std::uint64_t* begin = grow_quads(quads, s.quads, runs + 1);
  const std::uint64_t* end = emit<kDirection, kOcclusion>(pass, types.log_bits, runs, s, begin);
  QUOIN_ASSERT(static_cast<std::size_t>(end - begin) <= runs, "no more quads than runs");
  s.quads += static_cast<std::size_t>(end - begin);
}

}  // namespace
}  // namespace quoin::blocky
