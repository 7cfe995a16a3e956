// Which units of a block a mirrored ray, or any ray of a beam, passes: all 64 at once, as bits. For processors with
// BMI2.
//
//   a block: 4^3 units          bit  x + 4 y + 16 z of a word
//     of a chunk   bricks        z = 0              z = 1
//     of a brick   cells         | 12 13 14 15 |    | 28 29 30 31 |
//     of a cell    voxels      y |  8  9 10 11 |    | 24 25 26 27 |  ...
//                                |  4  5  6  7 |    | 20 21 22 23 |
//                                |  0  1  2  3 |    | 16 17 18 19 |
//                                  x
//
// Rays are mirrored so that they go forward along every axis; then the order of the bits is that in which they are
// passed. Three intervals of a line that overlap two by two have a point in common (Helly), so the units passed are
// those whose x and y, x and z, y and z overlap. Crossings at the same t are ordered by axis.

#pragma once

#include <immintrin.h>

#include "trace/kernel/numbers.inl"

namespace quoin::trace {
namespace {

struct alignas(64) UnitTables {
  float corner[64][4];
  std::uint64_t from[64];  // units that are nowhere before this one
};

constexpr UnitTables make_unit_tables() {
  UnitTables tables{};
  for (int i = 0; i < 64; ++i) {
    for (int axis = 0; axis < 3; ++axis) tables.corner[i][axis] = static_cast<float>(i >> (2 * axis) & 3);
    for (int j = 0; j < 64; ++j) {
      const bool is_from = (j & 3) >= (i & 3) && (j & 12) >= (i & 12) && (j & 48) >= (i & 48);
      if (is_from) tables.from[i] |= std::uint64_t{1} << j;
    }
  }
  return tables;
}

constexpr UnitTables kUnits = make_unit_tables();

inline F4 corner_of(int unit) {
  F4 corner;
  std::memcpy(&corner, kUnits.corner[unit], sizeof corner);
  return corner;
}

// What turns the index of a unit into that of the unit that it is mirrored to.
inline int flip_of(int octant) {
  return (octant & 1) * 3 + (octant & 2) * 6 + (octant & 4) * 12;
}

// How the bits of blocks are mirrored: bytes change places, then each half of a byte is looked up.
struct alignas(16) MirrorTables {
  std::uint8_t bytes[8][16];
  std::uint8_t low[8][16];
  std::uint8_t high[8][16];
};

constexpr MirrorTables make_mirror_tables() {
  MirrorTables tables{};
  for (int octant = 0; octant < 8; ++octant) {
    const bool x = (octant & 1) != 0;
    const bool y = (octant & 2) != 0;
    const bool z = (octant & 4) != 0;
    for (int i = 0; i < 16; ++i) {
      tables.bytes[octant][i] = static_cast<std::uint8_t>(i < 8 ? i ^ (y ? 1 : 0) ^ (z ? 6 : 0) : 0x80);
      const int row = x ? (i & 1) << 3 | (i & 2) << 1 | (i & 4) >> 1 | i >> 3 : i;
      tables.low[octant][i] = static_cast<std::uint8_t>(y ? row << 4 : row);
      tables.high[octant][i] = static_cast<std::uint8_t>(y ? row : row << 4);
    }
  }
  return tables;
}

constexpr MirrorTables kMirrors = make_mirror_tables();

// Mirrors the 64 bits of blocks along the axes of an octant.
class Mirror {
 public:
  explicit Mirror(int octant)
      : bytes_(row(kMirrors.bytes[octant])), low_(row(kMirrors.low[octant])), high_(row(kMirrors.high[octant])) {}
  std::uint64_t operator()(const void* word) const {
    const __m128i v = _mm_shuffle_epi8(_mm_loadl_epi64(static_cast<const __m128i*>(word)), bytes_);
    const __m128i halves = _mm_set1_epi8(15);
    const __m128i low = _mm_shuffle_epi8(low_, _mm_and_si128(v, halves));
    const __m128i high = _mm_shuffle_epi8(high_, _mm_and_si128(_mm_srli_epi16(v, 4), halves));
    return static_cast<std::uint64_t>(_mm_cvtsi128_si64(_mm_or_si128(low, high)));
  }

 private:
  static __m128i row(const std::uint8_t* at) { return _mm_load_si128(reinterpret_cast<const __m128i*>(at)); }

  __m128i bytes_;
  __m128i low_;
  __m128i high_;
};

// The edge of a chunk, and what an axis that stands still has for 1 / direction.
constexpr float kChunkSize = 64.0F;
constexpr float kStillInverse = 1e37F;

// Just below zero: puts planes on which a ray starts, and which it therefore never crosses, before all others.
constexpr float kNudge = 1e-30F;

inline F4 mirrored_planes(F4 planes, I4 backward) {
  constexpr std::int32_t kSign = std::numeric_limits<std::int32_t>::min();
  return reinterpret_cast<F4>(reinterpret_cast<I4>(planes) ^ (backward & kSign));
}

#ifdef QUOIN_KERNEL_AVX512

// In sixteen lanes: one for each plane, then one for each pair of units along two axes.
struct alignas(64) PathTables {
  std::int32_t axis[16];        // five planes of x, of y, of z
  float number[16];             // of the plane
  float unit[64][16];           // the same, plus four times where a unit lies
  std::int32_t pattern[8][16];  // pairs: lower and upper planes of x, y (first), y, z (second)
};

constexpr PathTables make_path_tables() {
  PathTables tables{};
  for (int i = 0; i < 16; ++i) {
    const int axis = i < 5 ? 0 : i < 10 ? 1 : 2;
    const int number = i < 15 ? i % 5 : 0;
    tables.axis[i] = axis;
    tables.number[i] = static_cast<float>(number);
    for (int unit = 0; unit < 64; ++unit)
      tables.unit[unit][i] = static_cast<float>(number + 4 * (unit >> (2 * axis) & 3));
    for (int upper = 0; upper < 2; ++upper) {
      tables.pattern[0 + upper][i] = (i & 3) + upper;
      tables.pattern[2 + upper][i] = 5 + (i & 3) + upper;
      tables.pattern[4 + upper][i] = 5 + (i >> 2) + upper;
      tables.pattern[6 + upper][i] = 10 + (i >> 2) + upper;
    }
  }
  return tables;
}

constexpr PathTables kPath = make_path_tables();

class Paths {
 public:
  // The lower planes of a block.
  using Block = __m512;

  Paths(F4 origin, F4 inverse, float end)
      : origin_(block(origin)), inverse_(block(inverse)), end_(_mm512_set1_ps(end)) {}
  // Planes behind which the ray starts, and which it never crosses, along axes that it goes forward.
  void nudge(I4 forward) {
    nudges_ = true;
    nudge_ = block(forward ? all4(kNudge) : all4(0.0F));
  }
  static Block block(F4 lower) {
    return _mm512_permutexvar_ps(_mm512_load_si512(kPath.axis),
                                 _mm512_castps128_ps512(reinterpret_cast<__m128>(lower)));
  }
  template <int kAxis>
  static Block next_chunk(Block chunk) {
    return _mm512_mask_add_ps(chunk, 0x1F << (5 * kAxis), chunk, _mm512_set1_ps(kChunkSize));
  }
  static Block brick_of(Block chunk, int brick) {
    const __m512 lower = _mm512_sub_ps(_mm512_load_ps(kPath.unit[brick]), _mm512_load_ps(kPath.number));
    return _mm512_fmadd_ps(lower, _mm512_set1_ps(4.0F), chunk);
  }
  // Products and sums of whole numbers: nothing is rounded.
  [[nodiscard]] std::uint64_t bricks(Block chunk) const {
    return through(_mm512_fmadd_ps(_mm512_load_ps(kPath.number), _mm512_set1_ps(16.0F), chunk));
  }
  [[nodiscard]] std::uint64_t cells(Block chunk, int brick) const {
    return through(_mm512_fmadd_ps(_mm512_load_ps(kPath.unit[brick]), _mm512_set1_ps(4.0F), chunk));
  }
  [[nodiscard]] std::uint64_t voxels(Block brick, int cell) const {
    return through(_mm512_add_ps(brick, _mm512_load_ps(kPath.unit[cell])));
  }

 private:
  static __m512 pairs(int pattern, __m512 t) {
    return _mm512_permutexvar_ps(_mm512_load_si512(kPath.pattern[pattern]), t);
  }
  // Pairs of units of two axes, of which `a` goes first, that overlap.
  static std::uint32_t overlaps(__m512 a_lower, __m512 a_upper, __m512 b_lower, __m512 b_upper) {
    const __mmask16 is_before_end = _mm512_cmp_ps_mask(a_lower, b_upper, _CMP_LE_OQ);
    return _mm512_mask_cmp_ps_mask(is_before_end, b_lower, a_upper, _CMP_LT_OQ);
  }
  [[nodiscard]] std::uint64_t through(__m512 planes) const {
    __m512 t = _mm512_mul_ps(_mm512_sub_ps(planes, origin_), inverse_);
    if (nudges_) [[unlikely]]
      t = _mm512_sub_ps(t, nudge_);
    const __m512 until = _mm512_min_ps(t, end_);
    const __m512 x_lower = pairs(0, t);
    const __m512 x_upper = pairs(1, until);
    const __m512 z_lower = pairs(6, t);
    const __m512 z_upper = pairs(7, until);
    const std::uint64_t xy = overlaps(x_lower, x_upper, pairs(4, t), pairs(5, until));
    const std::uint64_t xz = overlaps(x_lower, x_upper, z_lower, z_upper);
    const std::uint64_t yz = overlaps(pairs(2, t), pairs(3, until), z_lower, z_upper);
    return xy * 0x0001'0001'0001'0001U & _pdep_u64(xz, 0x000F'000F'000F'000FU) * 0x1111U &
           _pdep_u64(yz, 0x1111'1111'1111'1111U) * 15U;
  }

  __m512 origin_;
  __m512 inverse_;
  __m512 end_;
  __m512 nudge_;
  bool nudges_ = false;
};

#else

struct alignas(32) PlaneTables {
  float unit[4][4][8];  // lower planes of units of 1, 4, 16 and 64 voxels, twice, by where the block lies along an axis
};

constexpr PlaneTables make_plane_tables() {
  PlaneTables tables{};
  for (int level = 0; level < 4; ++level) {
    for (int at = 0; at < 4; ++at) {
      for (int i = 0; i < 8; ++i) tables.unit[level][at][i] = static_cast<float>(((i & 3) + 4 * at) << (2 * level));
    }
  }
  return tables;
}

constexpr PlaneTables kPlanes = make_plane_tables();

// When the lower and the upper planes of the four units along an axis are crossed, twice.
struct Times {
  __m256 lower, upper;
};

// Units 0 and 1, or 2 and 3, each in four lanes.
inline Times rows(const Times& t, bool is_second) {
  const __m256i which =
      is_second ? _mm256_setr_epi32(2, 2, 2, 2, 3, 3, 3, 3) : _mm256_setr_epi32(0, 0, 0, 0, 1, 1, 1, 1);
  return {_mm256_permutevar_ps(t.lower, which), _mm256_permutevar_ps(t.upper, which)};
}

// Of two axes, of which `a` goes first; kOrder says what counts at a tie.
template <int kOrder>
inline __m256 overlaps(const Times& a, const Times& b) {
  return _mm256_and_ps(_mm256_cmp_ps(a.lower, b.upper, _CMP_LE_OQ), _mm256_cmp_ps(b.lower, a.upper, kOrder));
}

// Two layers of z, 32 bits: bytes x + 4 y, from pairs (x, z) and (y, z).
template <int kOrder>
inline std::uint64_t layers(const Times& x, const Times& y, const Times& z) {
  const __m256i xz = _mm256_castps_si256(overlaps<kOrder>(x, z));
  const __m256i words = _mm256_packs_epi32(xz, xz);
  const __m256i yz = _mm256_castps_si256(overlaps<kOrder>(y, z));
  return static_cast<std::uint32_t>(_mm256_movemask_epi8(_mm256_and_si256(_mm256_packs_epi16(words, words), yz)));
}

template <int kOrder>
inline std::uint64_t units_passed(const Times& x, const Times& y, const Times& z) {
  const int low = _mm256_movemask_ps(overlaps<kOrder>(x, rows(y, false)));
  const int high = _mm256_movemask_ps(overlaps<kOrder>(x, rows(y, true)));
  const std::uint64_t xy = static_cast<std::uint64_t>(low | high << 8) * 0x0001'0001'0001'0001U;
  return xy & (layers<kOrder>(x, y, rows(z, false)) | layers<kOrder>(x, y, rows(z, true)) << 32);
}

// In eight lanes: two rows of four pairs each.
class Paths {
 public:
  // The lower planes of a block, the same in all lanes.
  struct Block {
    __m256 x, y, z;
  };

  Paths(F4 origin, F4 inverse, float end)
      : origin_(block(origin)), inverse_(block(inverse)), end_(_mm256_set1_ps(end)) {}
  // Planes behind which the ray starts, and which it never crosses, along axes that it goes forward.
  void nudge(I4 forward) {
    nudges_ = true;
    nudge_ = block(forward ? all4(kNudge) : all4(0.0F));
  }
  static Block block(F4 lower) {
    const auto v = reinterpret_cast<__m128>(lower);
    return {_mm256_broadcastss_ps(v), _mm256_broadcastss_ps(_mm_movehdup_ps(v)),
            _mm256_broadcastss_ps(_mm_movehl_ps(v, v))};
  }
  template <int kAxis>
  static Block next_chunk(Block chunk) {
    __m256& plane = kAxis == 0 ? chunk.x : kAxis == 1 ? chunk.y : chunk.z;
    plane = _mm256_add_ps(plane, _mm256_set1_ps(kChunkSize));
    return chunk;
  }
  static Block brick_of(const Block& chunk, int brick) {
    const auto lower = [](int at) { return _mm256_broadcast_ss(kPlanes.unit[1][at]); };
    return {_mm256_add_ps(chunk.x, lower(brick & 3)), _mm256_add_ps(chunk.y, lower(brick >> 2 & 3)),
            _mm256_add_ps(chunk.z, lower(brick >> 4))};
  }
  [[nodiscard]] std::uint64_t bricks(const Block& chunk) const { return through<2>(chunk, 0); }
  [[nodiscard]] std::uint64_t cells(const Block& chunk, int brick) const { return through<1>(chunk, brick); }
  [[nodiscard]] std::uint64_t voxels(const Block& brick, int cell) const { return through<0>(brick, cell); }

 private:
  template <int kLevel>
  [[nodiscard]] Times times(__m256 block, int at, __m256 origin, __m256 inverse, const __m256& nudge) const {
    const __m256 lower = _mm256_add_ps(block, _mm256_load_ps(kPlanes.unit[kLevel][at]));
    const __m256 upper = _mm256_add_ps(lower, _mm256_set1_ps(1 << (2 * kLevel)));
    Times t = {_mm256_mul_ps(_mm256_sub_ps(lower, origin), inverse),
               _mm256_mul_ps(_mm256_sub_ps(upper, origin), inverse)};
    if (nudges_) [[unlikely]]
      t = {_mm256_sub_ps(t.lower, nudge), _mm256_sub_ps(t.upper, nudge)};
    return {t.lower, _mm256_min_ps(t.upper, end_)};
  }
  template <int kLevel>
  [[nodiscard]] std::uint64_t through(const Block& block, int at) const {
    const Times x = times<kLevel>(block.x, at & 3, origin_.x, inverse_.x, nudge_.x);
    const Times y = times<kLevel>(block.y, at >> 2 & 3, origin_.y, inverse_.y, nudge_.y);
    const Times z = times<kLevel>(block.z, at >> 4, origin_.z, inverse_.z, nudge_.z);
    return units_passed<_CMP_LT_OQ>(x, y, z);
  }

  Block origin_;
  Block inverse_;
  __m256 end_;
  Block nudge_;
  bool nudges_ = false;
};

// Several rays that go the same way.
struct Beam {
  F4 least_origin, greatest_origin;
  F4 least_inverse, greatest_inverse;
  float end;  // no ray goes further
};

// As Paths, but with the earliest and the latest time at which any of the rays crosses a plane. Rounding keeps the
// order of products and differences, so these times bound those of every ray.
class BeamPaths {
 public:
  explicit BeamPaths(const Beam& beam) : end_(_mm256_set1_ps(beam.end)) {
    for (int axis = 0; axis < 3; ++axis) {
      axes_[axis] = {_mm256_set1_ps(beam.least_origin[axis]), _mm256_set1_ps(beam.greatest_origin[axis]),
                     _mm256_set1_ps(beam.least_inverse[axis]), _mm256_set1_ps(beam.greatest_inverse[axis])};
    }
  }
  // The units of 4^kLevel voxels of the block with these lower planes.
  template <int kLevel>
  [[nodiscard]] std::uint64_t units(F4 block) const {
    const Times x = times<kLevel>(block[0], axes_[0]);
    const Times y = times<kLevel>(block[1], axes_[1]);
    const Times z = times<kLevel>(block[2], axes_[2]);
    return units_passed<_CMP_LE_OQ>(x, y, z);
  }

 private:
  struct Bounds {
    __m256 least_origin, greatest_origin, least_inverse, greatest_inverse;
  };
  template <int kLevel>
  [[nodiscard]] Times times(float block, const Bounds& axis) const {
    const __m256 lower = _mm256_add_ps(_mm256_set1_ps(block), _mm256_load_ps(kPlanes.unit[kLevel][0]));
    const __m256 upper = _mm256_add_ps(lower, _mm256_set1_ps(1 << (2 * kLevel)));
    const __m256 to_lower = _mm256_sub_ps(lower, axis.greatest_origin);
    const __m256 to_upper = _mm256_sub_ps(upper, axis.least_origin);
    const __m256 first =
        _mm256_min_ps(_mm256_mul_ps(to_lower, axis.least_inverse), _mm256_mul_ps(to_lower, axis.greatest_inverse));
    const __m256 last =
        _mm256_max_ps(_mm256_mul_ps(to_upper, axis.least_inverse), _mm256_mul_ps(to_upper, axis.greatest_inverse));
    return {_mm256_max_ps(first, _mm256_setzero_ps()), _mm256_min_ps(last, end_)};
  }
  Bounds axes_[3];
  __m256 end_;
};

#endif

}  // namespace
}  // namespace quoin::trace
