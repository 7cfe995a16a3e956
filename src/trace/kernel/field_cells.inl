// Tests several cells of a field at once. In single precision it finds the few cells in which the field can become
// negative along a ray. Those are then tested in double (trace/kernel/cell_cubic.inl), so rounding here costs time
// only.
//
//   x, y, z      | 0 | 1 | ... | 7 |    the cells; eight, or with AVX-512 also sixteen
//   corners      | 0 | 1 | ... | 7 |    four times: gathered from rows of halves, two of a row at once
//   the cubic    | 0 | 1 | ... | 7 |    along one ray, or one ray per lane, in a slightly extended interval

#pragma once

#include <algorithm>
#include <bit>
#include <cstring>
#include <limits>

#include <immintrin.h>

#include "core/lanes/lanes_avx2.h"
#include "core/lanes/words.h"
#include "grid/density/density_storage.h"
#include "trace/kernel/cell_cubic.inl"
#include "trace/kernel/lockstep.inl"
#include "trace/kernel/ray_kernel.h"

namespace quoin::trace {
namespace {

// Vectors with this number of lanes, as types that do not depend on the number (GCC 12 omits the attribute there).
template <int kLanes>
struct Vectors;
template <>
struct Vectors<8> {
  using Floats = float __attribute__((vector_size(32)));
  using Int32s = std::int32_t __attribute__((vector_size(32)));
};
template <>
struct Vectors<16> {
  using Floats = float __attribute__((vector_size(64)));
  using Int32s = std::int32_t __attribute__((vector_size(64)));
};
template <int kLanes>
using Floats = typename Vectors<kLanes>::Floats;
template <int kLanes>
using Int32s = typename Vectors<kLanes>::Int32s;
using I8 = Int32s<8>;

// Extends a ray's interval at each plane of a cell, in cells: more than the rounding error along the ray, up to kReach.
constexpr float kStretch = 1e-3F;
// Bounds of the rounding error of a field's values, as a share of the difference between corners: at the ray's start,
// and for each cell that the ray has passed since.
constexpr float kDoubtHere = 1e-4F;
constexpr float kDoubtFurther = 2e-6F;

// Returns bit i for each lane i of a mask.
inline std::uint32_t bits_of(I8 mask) {
  return lanes_avx2::bits({reinterpret_cast<__m256>(mask)});
}

// Gathers entries of a table, `kBytes` apart, in the lanes of the mask; other lanes get `others`.
template <int kBytes>
inline I8 gather_some(const void* table, I8 at, I8 mask, I8 others) {
  return reinterpret_cast<I8>(_mm256_mask_i32gather_epi32(reinterpret_cast<__m256i>(others),
                                                          static_cast<const int*>(table), reinterpret_cast<__m256i>(at),
                                                          reinterpret_cast<__m256i>(mask), kBytes));
}

// Returns a mask of the first `count` lanes.
inline I8 first_lanes(Vectors<8>, int count) {
  return I8{0, 1, 2, 3, 4, 5, 6, 7} < count;
}

// Broadcasts one lane's number to all lanes.
inline I8 of_lane(I8 numbers, int lane) {
  return reinterpret_cast<I8>(_mm256_permutevar8x32_epi32(reinterpret_cast<__m256i>(numbers), _mm256_set1_epi32(lane)));
}

// Looks up entries in a table of eight, and of sixteen.
inline I8 from_8(const std::int32_t* table, I8 at) {
  const __m256i entries = _mm256_load_si256(reinterpret_cast<const __m256i*>(table));
  return reinterpret_cast<I8>(_mm256_permutevar8x32_epi32(entries, reinterpret_cast<__m256i>(at)));
}
inline I8 from_16(const std::int32_t* table, I8 at) {
  return (at & 8) != 0 ? from_8(table + 8, at) : from_8(table, at);
}

#ifdef QUOIN_KERNEL_AVX512
constexpr int kCellsAtOnce = 16;

inline std::uint32_t bits_of(Int32s<16> mask) {
  const I lanes = {reinterpret_cast<__m512i>(mask)};
  return bits(test(lanes, lanes));
}
template <int kBytes>
inline Int32s<16> gather_some(const void* table, Int32s<16> at, Int32s<16> mask, Int32s<16> others) {
  return reinterpret_cast<Int32s<16>>(_mm512_mask_i32gather_epi32(reinterpret_cast<__m512i>(others),
                                                                  static_cast<__mmask16>(bits_of(mask)),
                                                                  reinterpret_cast<__m512i>(at), table, kBytes));
}
inline Int32s<16> first_lanes(Vectors<16>, int count) {
  return Int32s<16>{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15} < count;
}
inline Int32s<16> of_lane(Int32s<16> numbers, int lane) {
  return reinterpret_cast<Int32s<16>>(
      _mm512_permutexvar_epi32(_mm512_set1_epi32(lane), reinterpret_cast<__m512i>(numbers)));
}
// Returns the numbers of the lanes of a mask, without gaps, then 0.
inline Int32s<16> lane_numbers(Vectors<16>, std::uint32_t mask) {
  const __m512i all = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
  return reinterpret_cast<Int32s<16>>(_mm512_maskz_compress_epi32(static_cast<__mmask16>(mask), all));
}
inline Doubles gather_doubles(const double* table, Ints at) {
  return reinterpret_cast<Doubles>(_mm512_mask_i32gather_pd(_mm512_setzero_pd(), static_cast<__mmask8>(each_lane()),
                                                            reinterpret_cast<__m256i>(at), table, sizeof(double)));
}
inline Int32s<16> from_16(const std::int32_t* table, Int32s<16> at) {
  return reinterpret_cast<Int32s<16>>(
      _mm512_permutexvar_epi32(reinterpret_cast<__m512i>(at), _mm512_load_si512(table)));
}
#else
constexpr int kCellsAtOnce = 8;

inline I8 lane_numbers(Vectors<8>, std::uint32_t mask) {
  return reinterpret_cast<I8>(half::lane_numbers(mask));
}
inline Doubles gather_doubles(const double* table, Ints at) {
  const auto each = reinterpret_cast<__m256d>(Longs{} == 0);
  return reinterpret_cast<Doubles>(
      _mm256_mask_i32gather_pd(_mm256_setzero_pd(), table, reinterpret_cast<__m128i>(at), each, sizeof(double)));
}
#endif

// Converts halves in bits 16 to 31 that are neither infinite nor NaN. Like float_from_half: the multiplication moves
// the exponent and normalizes subnormal numbers.
template <int kLanes>
inline Floats<kLanes> floats_from_halves(Int32s<kLanes> high) {
  using Signed = Int32s<kLanes>;
  using Values = Floats<kLanes>;
  const auto magnitude = reinterpret_cast<Signed>(reinterpret_cast<Values>((high & 0x7FFF'0000) >> 3) * 0x1p+112F);
  return reinterpret_cast<Values>(magnitude | (high & std::numeric_limits<std::int32_t>::min()));
}

// Returns the densities of samples x and x + 1 in rows of a chunk, as halves, the first in the lower bits; `x` is below
// 63. Lanes outside the mask keep `others`.
template <class Places>
inline Places pairs_of(const DensityStorage& chunk, Places x, Places y, Places z, Places mask, Places others) {
  const Places slab = gather_some<4>(chunk.slabs.data(), (z >> 2) * 16 + (y >> 2), mask, Places{});
  const Places is_uniform = slab < 0;
  const Places row = (slab << 4) + (z & 3) * 4 + (y & 3);  // the shift drops a uniform slab's sign bit
  const Places known = is_uniform ? slab << 16 | (slab & 0xFFFF) : others;
  return gather_some<sizeof(Half)>(chunk.values.data(), row * kChunkEdge + x, mask & ~is_uniform, known);
}

/// Caches the chunks of look-ups in a field, up to 2^3 neighbours.
class NearChunks {
 public:
  NearChunks() { std::fill_n(at_[0], 8, std::numeric_limits<int>::min()); }  // no chunk is there

  /// Returns null if the chunk is missing or uniform.
  const DensityStorage* find(const FieldView& field, int x, int y, int z) {
    const int i = (x & 1) + 2 * (y & 1) + 4 * (z & 1);
    if (x != at_[0][i] || y != at_[1][i] || z != at_[2][i]) {
      at_[0][i] = x, at_[1][i] = y, at_[2][i] = z;
      chunks_[i] = field.find(*field.grid, x, y, z);
    }
    return chunks_[i];
  }

 private:
  int at_[3][8];
  const DensityStorage* chunks_[8];
};

/// The densities of the corners of several cells, as stored: two halves of a row, the first in the lower bits, by row
/// y + 2 z and cell.
template <int kLanes>
struct CornerPairs {
  alignas(64) std::int32_t rows[4][kLanes];

  [[nodiscard]] Int32s<kLanes> row(int row) const {
    Int32s<kLanes> pairs;
    std::memcpy(&pairs, rows[row], sizeof pairs);
    return pairs;
  }
};

/// Reads the corners of any cell.
template <int kLanes>
inline void read_cell(const FieldView& field, NearChunks& chunks, const int (&at)[3], int lane,
                      CornerPairs<kLanes>& corners) {
  const auto pair_of = [](std::uint32_t first, std::uint32_t second) {
    return static_cast<std::int32_t>(first | second << 16);
  };
  const int x = at[0] & 63;
  for (int row = 0; row < 4; ++row) {
    const int y = at[1] + (row & 1);
    const int z = at[2] + (row >> 1);
    const DensityStorage* const chunk = chunks.find(field, at[0] >> 6, y >> 6, z >> 6);
    const DensityStorage* const next = x < 63 ? chunk : chunks.find(field, (at[0] + 1) >> 6, y >> 6, z >> 6);
    if (chunk == nullptr || next == nullptr) {
      float densities[8];
      field.read(*field.grid, at[0], at[1], at[2], densities);
      for (int i = 0; i < 4; ++i) {  // exact
        corners.rows[i][lane] = pair_of(half_from_float(densities[2 * i]), half_from_float(densities[2 * i + 1]));
      }
      return;
    }
    const std::size_t slab = ChunkStorage::slab_index(y & 63, z & 63);
    const int in_slab = ChunkStorage::row_in_slab(y & 63, z & 63);
    const auto density = [&](const DensityStorage& of, int i) -> Half {
      const std::uint32_t entry = of.slabs[slab];
      return DensityStorage::is_mixed(entry) ? of.row(entry, in_slab)[i & 63] : static_cast<Half>(entry);
    };
    corners.rows[row][lane] = pair_of(density(*chunk, x), density(*next, x + 1));
  }
}

/// Reads the corners of the cells at `at`, in the lanes of `wanted`. Requires: lane 0 is wanted.
template <int kLanes>
[[gnu::always_inline]] inline void read_cells(const FieldView& field, NearChunks& chunks, const Int32s<kLanes> (&at)[3],
                                              Int32s<kLanes> wanted, CornerPairs<kLanes>& corners) {
  using Places = Int32s<kLanes>;
  Places chunk[3];
  Places cell[3];
  Places is_within = wanted;
  for (int axis = 0; axis < 3; ++axis) {
    chunk[axis] = at[axis] >> 6;
    cell[axis] = at[axis] & 63;
    is_within &= cell[axis] < 63;
  }
  std::uint32_t left = bits_of(is_within);
  std::uint32_t separate =
      bits_of(wanted) & ~left;  // cells with corners in several chunks, or in a chunk without storage
  Places pairs[4] = {};
  // Returns the lanes in the chunk of `lane`.
  const auto read_chunk_of = [&](int lane) {
    Places here = is_within;
    for (const Places& at_axis : chunk) here &= at_axis == of_lane(at_axis, lane);
    const std::uint32_t those = bits_of(here);
    const DensityStorage* const storage = chunks.find(field, chunk[0][lane], chunk[1][lane], chunk[2][lane]);
    if (storage == nullptr) {
      separate |= those;
      return those;
    }
    for (int row = 0; row < 4; ++row) {
      pairs[row] = pairs_of(*storage, cell[0], cell[1] + (row & 1), cell[2] + (row >> 1), here, pairs[row]);
    }
    return those;
  };
  left &= ~read_chunk_of(0);
  // There is usually one chunk.
  while (left != 0) left &= ~read_chunk_of(std::countr_zero(left));
  for (int row = 0; row < 4; ++row) std::memcpy(corners.rows[row], &pairs[row], sizeof pairs[row]);
  for (; separate != 0; separate &= separate - 1) {
    const int lane = std::countr_zero(separate);
    read_cell(field, chunks, {at[0][lane], at[1][lane], at[2][lane]}, lane, corners);
  }
}

/// A ray in single precision, or several rays in lanes, relative to a position near its start; by axis.
template <class Number>
struct NearRay {
  Number origin[3];
  Number direction[3];
  Number inverse[3];  // huge for an axis without motion
  Number size;        // the direction's greatest component
};

inline float magnitude(float number) {
  return std::abs(number);
}
template <class Numbers>
inline Numbers magnitude(Numbers numbers) {
  return greatest(numbers, -numbers);
}

/// Returns the cells in which the field may become negative along the ray, given their corners. `place`: the cells,
/// relative to the ray's origin of coordinates.
template <int kLanes, class Number>
inline Int32s<kLanes> may_be_negative(const NearRay<Number>& ray, const Floats<kLanes> (&corners)[8],
                                      const Int32s<kLanes> (&place)[3]) {
  using Values = Floats<kLanes>;
  Values t_in = {};
  Values t_out = Values{} + std::numeric_limits<float>::max();
  Values start[3];
  for (int axis = 0; axis < 3; ++axis) {
    const auto lower = __builtin_convertvector(place[axis], Values);
    start[axis] = ray.origin[axis] - lower;
    // The times at the middle plane and, from there, at the planes of the cell, each moved outwards.
    const Values middle = (0.5F - start[axis]) * ray.inverse[axis];
    const Number half = (0.5F + kStretch) * magnitude(ray.inverse[axis]);
    t_in = greatest(t_in, middle - half);
    t_out = least(t_out, middle + half);
  }
  const Values length = greatest(t_out - t_in, Values{});
  Values entry[3];
  Values way[3];
  for (int axis = 0; axis < 3; ++axis) {
    entry[axis] = start[axis] + ray.direction[axis] * t_in;
    way[axis] = ray.direction[axis] * length;
  }
  Values low = corners[0];
  Values high = corners[0];
  for (int i = 1; i < 8; ++i) low = least(low, corners[i]), high = greatest(high, corners[i]);
  const CellCubic<Values> field = cubic_of(corners, entry, way);
  const Values doubt = (high - low) * (t_in * ray.size * kDoubtFurther + kDoubtHere);
  // The negated comparison includes NaN among the candidates.
  return ~(least(curve_of<float>(field).low(), field.c0) > doubt);
}

/// Returns true if the field becomes negative along the ray in the cell that `hit` names, with its corners. Sets
/// `hit.t`.
template <bool kAsksWhere>
inline bool meets(const CellRay& ray, FieldHit& hit) {
  const double cell[3] = {static_cast<double>(hit.x), static_cast<double>(hit.y), static_cast<double>(hit.z)};
  hit.t = meet_cell<kAsksWhere>(ray, cell, span_in(ray, cell), hit.corners);
  return hit.t >= 0.0;
}

/// Cells to test in double, with their corners.
template <int kLanes>
struct Candidates {
  std::uint32_t lanes = 0;
  Int32s<kLanes> at[3];
  alignas(64) float corners[8][kLanes];

  void describe(int lane, FieldHit& hit) const {
    hit.x = at[0][lane], hit.y = at[1][lane], hit.z = at[2][lane];
    for (int i = 0; i < 8; ++i) hit.corners[i] = corners[i][lane];
  }
};

/// Finds the cells, among the first `count`, that must be tested in double. `base`: the ray's origin of coordinates, in
/// the field.
template <int kLanes, class Number, class Base>
[[gnu::always_inline]] inline void screen(const CornerPairs<kLanes>& stored, const NearRay<Number>& ray,
                                          const Base (&base)[3], int count, Candidates<kLanes>& cells) {
  Floats<kLanes> corners[8];
  for (int row = 0; row < 4; ++row) {
    corners[2 * row] = floats_from_halves<kLanes>(stored.row(row) << 16);
    corners[2 * row + 1] = floats_from_halves<kLanes>(stored.row(row));
  }
  const Int32s<kLanes> place[3] = {cells.at[0] - base[0], cells.at[1] - base[1], cells.at[2] - base[2]};
  cells.lanes = bits_of(may_be_negative<kLanes>(ray, corners, place) & first_lanes(Vectors<kLanes>{}, count));
  if (cells.lanes != 0) std::memcpy(cells.corners, corners, sizeof corners);
}

// Tests several cells at once in double, with the same operations in the same order as for one cell
// (trace/kernel/cell_cubic.inl).

/// Results of the test in double, before roots are found.
struct Meetings {
  Longs met;       // the field becomes negative
  Longs has_root;  // the cubic has one root, not yet known; in other lanes the root is `s`
  CellCubic<Doubles> field;
  Doubles s;
  Doubles t_in;  // the ray's interval in the cell
  Doubles length;
};

/// Like meet_cell, without the root. Without `kAsksWhere`, `has_root` is false.
template <bool kAsksWhere>
inline Meetings meet_cells(const CellRayOf<Doubles>& ray, const Doubles (&cell)[3], const Doubles (&corners)[8]) {
  const CellSpan<Doubles> span = span_in(ray, cell);
  const Doubles length = least(span.t_out, ray.max_t) - span.t_in;
  const CellCubic<Doubles> f = cubic_along(ray, cell, span.t_in, length, corners);
  const CellCurve<Doubles> curve = curve_of<double>(f);
  const Longs is_in = ~(length < 0.0);
  const Longs starts_negative = is_in & (f.c0 < 0.0);
  const Longs is_open = is_in & ~starts_negative & ~(curve.low() >= 0.0);
  Longs is_simple = is_open & (curve.b3 < 0.0);
  if (kAsksWhere) is_simple &= ~((curve.b1 < 0.0) & (curve.b2 >= 0.0));
  // Compilers write zeros to memory first if this is one initializer.
  Meetings out;
  out.met = starts_negative | is_simple;
  out.has_root = kAsksWhere ? is_simple : Longs{};
  out.field = f;
  out.s = Doubles{};
  out.t_in = span.t_in;
  out.length = length;
  // Only a few lanes.
  for (std::uint32_t left = words::lanes_with_bits(is_open & ~is_simple); left != 0; left &= left - 1) {
    const int i = std::countr_zero(left);
    out.s[i] = first_negative<kAsksWhere>(CellCubic<double>{f.c0[i], f.c1[i], f.c2[i], f.c3[i]});
    out.met[i] = out.s[i] >= 0.0 ? -1 : 0;
  }
  return out;
}

/// Finds roots in (0, 1) like root_between, for several registers at once, in the lanes of `wanted`. Their divisions
/// overlap. Results in other lanes are unspecified.
template <int kCount>
inline void find_roots(const CellCubic<Doubles> (&f)[kCount], Longs (&wanted)[kCount], Doubles (&s)[kCount]) {
  Doubles low[kCount];
  Doubles high[kCount];
  for (int k = 0; k < kCount; ++k) {
    low[k] = Doubles{};
    high[k] = Doubles{} + 1.0;
    const Doubles f_low = f[k](low[k]);
    const Doubles f_high = f[k](high[k]);
    s[k] = low[k] + (high[k] - low[k]) * (f_low / (f_low - f_high));
  }
  for (int i = 0; i < 60; ++i) {
    Longs any_wanted = {};
    for (int k = 0; k < kCount; ++k) {
      const Doubles value = f[k](s[k]);
      const Longs is_beyond = value < 0.0;
      high[k] = is_beyond ? s[k] : high[k];
      low[k] = is_beyond ? low[k] : s[k];
      wanted[k] &= high[k] - low[k] > 1e-15;
      Doubles next = s[k] - value / f[k].slope(s[k]);
      next = ((next > low[k]) & (next < high[k])) ? next : 0.5 * (low[k] + high[k]);
      const Doubles change = next - s[k];
      s[k] = wanted[k] ? next : s[k];
      wanted[k] &= ~((change <= 1e-13) & (change >= -1e-13));
      any_wanted |= wanted[k];
    }
    if (!words::any(any_wanted)) break;
  }
}

}  // namespace
}  // namespace quoin::trace
