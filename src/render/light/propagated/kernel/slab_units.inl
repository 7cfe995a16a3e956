// Included by the kernel of each instruction set: slabs as units that differ from row to row (SlabUnits).
//
//   row  by Gray's code     fresh  units
//     0  00000000 000ff000     10  000ff000
//     1  00000000 000ff000     00
//     2  00000001 00fff000     11  00fff000 00000001
//
// (the right half has the lower x). The wide kernels process as many rows at a time as a register holds. When they
// read, rows without units take those of the row above: by one row, then by two, then by four.

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include <quoin/core/assert.h>

#ifdef QUOIN_KERNEL_AVX2
#include "core/lanes/lanes.h"
#endif
#include "render/light/propagated/kernel/light_kernel.h"

namespace quoin::propagated {
namespace {

#ifdef QUOIN_KERNEL_AVX2

using Units = lanes::I;
constexpr std::size_t kRows = lanes::kWidth / 2;  // of a register

inline Units none() {
  return lanes::all(0);
}
inline Units load_rows(const std::uint64_t* from) {
  return lanes::load(reinterpret_cast<const std::int32_t*>(from));
}
inline void store_rows(Units rows, std::uint64_t* to) {
  lanes::store(reinterpret_cast<std::int32_t*>(to), rows);
}
inline Units select(unsigned which, Units a, Units b) {
  return lanes::select(lanes::mask_of(which), a, b);
}

#ifdef QUOIN_KERNEL_AVX512

// Moves each row by kBy rows; the first rows come from the end of `before`.
template <int kBy>
inline Units moved(Units rows, Units before) {
  return {_mm512_alignr_epi64(rows.v, before.v, 8 - kBy)};
}
// Bit i: unit i differs.
inline unsigned differing(Units a, Units b) {
  return _mm512_cmpneq_epi32_mask(a.v, b.v);
}
inline void store_some(Units units, unsigned which, std::uint32_t* to) {
  _mm512_storeu_si512(to, _mm512_maskz_compress_epi32(static_cast<__mmask16>(which), units.v));
}
// 0 in the others.
inline Units load_some(const std::uint32_t* from, unsigned which) {
  return {_mm512_maskz_expandloadu_epi32(static_cast<__mmask16>(which), from)};
}
// Copies its last row to all rows.
inline Units last_row(Units rows) {
  return {_mm512_permutex_epi64(_mm512_shuffle_i64x2(rows.v, rows.v, 0xFF), 0xFF)};
}

#else

// Permutations that compact a subset of eight units, and their inverses.
struct Orders {
  std::array<std::array<std::uint8_t, 8>, 256> together{};
  std::array<std::array<std::uint8_t, 8>, 256> spread{};
};
constexpr Orders make_orders() {
  Orders orders;
  for (std::size_t which = 0; which < 256; ++which) {
    std::size_t count = 0;
    for (std::size_t i = 0; i < 8; ++i) {
      if ((which >> i & 1U) == 0) continue;
      orders.together[which][count] = static_cast<std::uint8_t>(i);
      orders.spread[which][i] = static_cast<std::uint8_t>(count++);
    }
  }
  return orders;
}
constexpr Orders kOrders = make_orders();

inline __m256i order(const std::array<std::uint8_t, 8>& of) {
  return _mm256_cvtepu8_epi32(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(of.data())));
}
template <int kBy>
inline Units moved(Units rows, Units before) {
  const __m256i middle = _mm256_permute2x128_si256(before.v, rows.v, 0x21);  // the upper half before, the lower half
  return {kBy == 1 ? _mm256_alignr_epi8(rows.v, middle, 8) : middle};
}
inline unsigned differing(Units a, Units b) {
  const int same = _mm256_movemask_ps(_mm256_castsi256_ps(_mm256_cmpeq_epi32(a.v, b.v)));
  return ~static_cast<unsigned>(same) & 255U;
}
inline void store_some(Units units, unsigned which, std::uint32_t* to) {
  const __m256i packed = _mm256_permutevar8x32_epi32(units.v, order(kOrders.together[which]));
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(to), packed);
}
inline Units load_some(const std::uint32_t* from, unsigned which) {
  const auto lanes_of = [](unsigned bits) { return _mm256_castps_si256(lanes::mask_of(bits).v); };
  const __m256i packed =
      _mm256_maskload_epi32(reinterpret_cast<const int*>(from), lanes_of((1U << std::popcount(which)) - 1));
  return {_mm256_and_si256(_mm256_permutevar8x32_epi32(packed, order(kOrders.spread[which])), lanes_of(which))};
}
inline Units last_row(Units rows) {
  return {_mm256_permute4x64_epi64(rows.v, 0xFF)};
}

#endif

#else

constexpr std::size_t kRows = 1;
using Units = std::uint64_t;

inline Units none() {
  return 0;
}
inline Units load_rows(const std::uint64_t* from) {
  return *from;
}
inline void store_rows(Units rows, std::uint64_t* to) {
  *to = rows;
}
template <int kBy>
inline Units moved(Units, Units before) {
  return before;
}
inline unsigned differing(Units a, Units b) {
  const Units other = a ^ b;
  return static_cast<unsigned>(static_cast<std::uint32_t>(other) != 0) | static_cast<unsigned>(other >> 32 != 0) << 1;
}
inline void store_some(Units units, unsigned which, std::uint32_t* to) {
  const auto low = static_cast<std::uint32_t>(units);
  const auto high = static_cast<std::uint32_t>(units >> 32);
  to[0] = (which & 1U) != 0 ? low : high;
  to[1] = high;
}
inline Units load_some(const std::uint32_t* from, unsigned which) {
  Units units = (which & 1U) != 0 ? *from++ : 0;
  if ((which & 2U) != 0) units |= Units{*from} << 32;
  return units;
}
inline Units last_row(Units rows) {
  return rows;
}
inline Units select(unsigned which, Units a, Units b) {
  constexpr std::array<Units, 4> kHalves = {0, 0xFFFF'FFFFU, ~Units{0xFFFF'FFFFU}, ~Units{0}};
  return (a & kHalves[which]) | (b & ~kHalves[which]);
}

#endif

constexpr unsigned kAllUnits = (1U << (2 * kRows)) - 1;

// Fills unknown rows from the row kBy before them.
template <int kBy>
inline void fall(Units& rows, unsigned& known) {
  rows = select(known, rows, moved<kBy>(rows, none()));
  known = (known | known << (2 * kBy)) & kAllUnits;
}

SlabUnits pack_slab(const std::uint64_t* planes, SlabUnitsRoom& units) {
  SlabUnits made;
  std::uint32_t* next = units.data();
  for (std::size_t plane = 0; plane < kPlanes; ++plane) {
    made.first[plane] = static_cast<std::uint8_t>(next - units.data());
    made.fresh[plane] = 0;
    Units last = none();
    for (std::size_t row = 0; row < kSlabWords; row += kRows) {
      const std::uint64_t* from = planes + plane * kSlabWords + row;
      Units rows = load_rows(from);
      if (plane + 1 < kPlanes) rows = rows ^ load_rows(from + kSlabWords);
      const unsigned fresh = differing(rows, moved<1>(rows, last));
      store_some(rows, fresh, next);
      next += std::popcount(fresh);
      made.fresh[plane] |= fresh << (2 * row);
      last = rows;
    }
  }
  QUOIN_ASSERT(next <= units.data() + 2 * kPlanes * kSlabWords, "two units per row and plane");
  made.first[kPlanes] = static_cast<std::uint8_t>(next - units.data());
  return made;
}

// Starts at the last plane, which is the same in both codes; the others need the next plane.
void unpack_slab(const SlabUnits& of, const std::uint32_t* units, std::uint64_t* planes) {
  for (std::size_t plane = kPlanes; plane-- > 0;) {
    const std::uint32_t* next = units + of.first[plane];
    Units last = none();
    for (std::size_t row = 0; row < kSlabWords; row += kRows) {
      unsigned known = of.fresh[plane] >> (2 * row) & kAllUnits;
      Units rows = load_some(next, known);
      next += std::popcount(known);
      if constexpr (kRows > 1) fall<1>(rows, known);
      if constexpr (kRows > 1) fall<2>(rows, known);
      if constexpr (kRows > 4) fall<4>(rows, known);
      if (row > 0) rows = select(known, rows, last_row(last));
      last = rows;
      std::uint64_t* to = planes + plane * kSlabWords + row;
      store_rows(plane + 1 < kPlanes ? rows ^ load_rows(to + kSlabWords) : rows, to);
    }
  }
}

// Returns the last stored unit of a half up to a row.
inline std::uint64_t unit_of(std::uint32_t fresh, const std::uint32_t* units, std::size_t row, unsigned half) {
  constexpr std::uint32_t kLowHalves = 0x5555'5555;
  const std::uint32_t so_far = fresh & kLowHalves << half & ((std::uint32_t{2} << (2 * row + half)) - 1);
  if (so_far == 0) return 0;
  const std::uint32_t before = (std::uint32_t{1} << (31 - std::countl_zero(so_far))) - 1;
  return units[std::popcount(fresh & before)];
}

void unpack_row(const SlabUnits& of, const std::uint32_t* units, std::size_t row, std::uint64_t* planes) {
  QUOIN_ASSERT(row < kSlabWords, "one of the slab's rows");
  std::uint64_t above = 0;
  for (std::size_t plane = kPlanes; plane-- > 0;) {
    const std::uint32_t* own = units + of.first[plane];
    above ^= unit_of(of.fresh[plane], own, row, 0) | unit_of(of.fresh[plane], own, row, 1) << 32;
    planes[plane] = above;
  }
}

}  // namespace
}  // namespace quoin::propagated
