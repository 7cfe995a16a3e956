// Traces one ray with sets of units, on processors with BMI2. The ray is mirrored to go forward along every axis, then
// walks from chunk to chunk. It uses the arithmetic of the walk in trace/kernel/ray_kernel.cpp and returns the same
// bits: negating both a plane and an origin leaves their distance unchanged.
//
//   chunk        bricks passed  &  occupied bricks             ->  lowest bit: the next brick
//     brick        cells passed   &  occupied cells              ->  lowest bit: the next cell
//       cell         voxels passed  &  occupied voxels             ->  lowest bit: the hit
//
// A ray that starts within the bounds begins at the bottom: in its own cell, then its brick, then its chunk.
//
// The units of a block that the ray passes are computed for all 64 at once, as bits:
//
//   a block: 4^3 units          bit  x + 4 y + 16 z of a word
//     of a chunk   bricks        z = 0              z = 1
//     of a brick   cells         | 12 13 14 15 |    | 28 29 30 31 |
//     of a cell    voxels      y |  8  9 10 11 |    | 24 25 26 27 |  ...
//                                |  4  5  6  7 |    | 20 21 22 23 |
//                                |  0  1  2  3 |    | 16 17 18 19 |
//                                  x
//
// Rays are mirrored to go forward along every axis, so the ray passes units in the order of their bits. Three intervals
// on a line that overlap pairwise have a common point (Helly). The ray therefore passes the units whose intervals
// overlap for x and y, x and z, y and z. Crossings at the same t are ordered by axis.

#pragma once

#include <immintrin.h>

#include "trace/kernel/ray_numbers.inl"

namespace quoin::trace {
namespace {

struct alignas(64) UnitTables {
  float corner[64][4];
  std::uint64_t from[64];  // units that are not before this one on any axis
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
  QUOIN_ASSERT(unit >= 0 && unit < 64, "one of the block's 64 units");
  F4 corner;
  std::memcpy(&corner, kUnits.corner[unit], sizeof corner);
  return corner;
}

// Returns the mask that, XORed with a unit's index, gives the index of its mirror image.
inline int flip_of(int octant) {
  return (octant & 1) * 3 + (octant & 2) * 6 + (octant & 4) * 12;
}

// Tables that mirror the bits of blocks: a byte shuffle, then a table look-up for each half of a byte.
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

// The edge length of a chunk, and the value of 1 / direction for an axis without motion.
constexpr float kChunkSize = 64.0F;
constexpr float kStillInverse = 1e37F;

// A tiny shift in t. It orders the planes of a ray's start, which the ray never crosses, before all others.
constexpr float kNudge = 1e-30F;

inline F4 mirrored_planes(F4 planes, I4 backward) {
  constexpr std::int32_t kSign = std::numeric_limits<std::int32_t>::min();
  return reinterpret_cast<F4>(reinterpret_cast<I4>(planes) ^ (backward & kSign));
}

#ifdef QUOIN_KERNEL_AVX512

// Tables for sixteen lanes: one lane per plane, then one per pair of units along two axes.
struct alignas(64) PathTables {
  std::int32_t axis[16];        // five planes of x, of y, of z
  float number[16];             // the plane's number
  float unit[64][16];           // the plane's number plus four times the unit's coordinate
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
  // Shifts the planes of the ray's start along its forward axes. The ray never crosses these planes.
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
  // Products and sums of integers are exact.
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
  // Returns the overlapping pairs of units of two axes; axis `a` comes first at ties.
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
  float unit[4][4][8];  // lower planes of units of 1, 4, 16 and 64 voxels, repeated, by the block's coordinate
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

// The times of crossing the lower and the upper planes of the four units along an axis, repeated.
struct Times {
  __m256 lower, upper;
};

// Units 0 and 1, or 2 and 3, each in four lanes.
inline Times rows(const Times& t, bool is_second) {
  const __m256i which =
      is_second ? _mm256_setr_epi32(2, 2, 2, 2, 3, 3, 3, 3) : _mm256_setr_epi32(0, 0, 0, 0, 1, 1, 1, 1);
  return {_mm256_permutevar_ps(t.lower, which), _mm256_permutevar_ps(t.upper, which)};
}

// Returns the overlapping units of two axes. Axis `a` comes first at ties, and kOrder is the comparison for the other.
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

// For eight lanes: two rows of four pairs each.
class Paths {
 public:
  // The lower planes of a block, the same in all lanes.
  struct Block {
    __m256 x, y, z;
  };

  Paths(F4 origin, F4 inverse, float end)
      : origin_(block(origin)), inverse_(block(inverse)), end_(_mm256_set1_ps(end)) {}
  // Shifts the planes of the ray's start along its forward axes. The ray never crosses these planes.
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

#endif

struct PathRay {
  F4 origin;
  F4 inverse;
  F4 far_t;
  F4 chunk;     // the lower planes of its start chunk
  I4 backward;  // axes that were mirrored; masks, like the next
  I4 forward;
  I4 base;
  I4 own;  // its start voxel, relative to `base`, not mirrored
  float exit_t;
  bool is_inside;  // it starts within the bounds
  bool is_cut;
  bool is_moved;
  bool is_on_plane;  // starts on a plane behind it that it never crossed, within the bounds or on their boundary
};

// The box of a ray, by its mirrored planes.
struct PathBox {
  F4 low;
  F4 high;
};

inline PathBox box_of(const TreeView& tree, PathRay& ray, F4 origin, F4 direction, float max_t, float greatest) {
  I4 low_voxel;
  I4 high_voxel;
  std::memcpy(&low_voxel, tree.low_voxel, sizeof low_voxel);
  std::memcpy(&high_voxel, tree.high_voxel, sizeof high_voxel);
  F4 low = __builtin_convertvector(low_voxel - ray.base, F4);
  F4 high = __builtin_convertvector(high_voxel - ray.base, F4);
  ray.is_cut = false;
  // Infinite rays leave a small world before they exceed their range.
  if (!(tree.is_small && max_t > kReach / 0x1p-20F)) {
    const float furthest = kReach / greatest;
    const F4 bound = mirrored_planes(ray.backward ? low : high, ray.backward);
    ray.is_cut = furthest < max_t && furthest < least3((bound - ray.origin) * ray.inverse);
    const F4 end = origin + std::min(max_t, furthest) * direction;
    low = max4(low, floor4(min4(origin, end) - kSlack));
    high = min4(high, floor4(max4(origin, end) + kSlack) + 1.0F);
  }
  return {mirrored_planes(ray.backward ? high : low, ray.backward),
          mirrored_planes(ray.backward ? low : high, ray.backward)};
}

// Returns the chunk that a ray enters at `t` through a plane of `axis`. The position gives a first guess. Comparing
// crossings corrects it, since rounding can put a position on the wrong side of a nearby plane.
inline F4 chunk_entered(const PathRay& ray, const PathBox& box, F4 speed, float t, int axis) {
  const F4 first = floor4(box.low * (1.0F / kChunkSize)) * kChunkSize;
  const F4 last = floor4((box.high - 1.0F) * (1.0F / kChunkSize)) * kChunkSize;
  const F4 position = ray.origin + t * speed;
  F4 at = max4(min4(floor4(position * (1.0F / kChunkSize)) * kChunkSize, last), first);
  const F4 past = position - at;
  const I4 axes = {0, 1, 2, 3};
  if ((mask3((past < 0.01F) | (past > kChunkSize - 0.01F)) & ~(1 << axis)) != 0) {
    const F4 now = all4(t);
    const F4 ahead_t = (at + kChunkSize - ray.origin) * ray.inverse;
    const F4 behind_t = (at - ray.origin) * ray.inverse;
    const I4 is_short = (ahead_t < now) | ((ahead_t == now) & (axes < axis));
    // The ray was never outside its start chunk.
    const I4 was_inside = (at == ray.origin) & ray.forward & (ray.is_moved ? I4{} : ~I4{});
    const I4 is_far = ((now < behind_t) | ((behind_t == now) & (axes > axis))) & ~was_inside & ~is_short;
    at = at + (is_short ? all4(kChunkSize) : all4(0.0F)) - (is_far ? all4(kChunkSize) : all4(0.0F));
    at = max4(min4(at, last), first);
  }
  return axes == axis ? first : at;
}

inline bool starts_on_plane(const PathRay& ray) {
  return mask3(ray.forward & (__builtin_convertvector(ray.own, F4) == ray.origin)) != 0;
}

// Computes the times when a ray enters and leaves its box.
inline SetUp clip_path(PathRay& ray, const PathBox& box, F4 speed, int moved) {
  const F4 origin = ray.origin;
  const I4 axes = {0, 1, 2, 3};
  const I4 entered = axes == moved;
  const I4 is_low = origin < box.low;
  const I4 past = (box.high < origin) | (~ray.backward & (box.high == origin));
  const I4 still = ~(ray.forward | ray.backward);
  if (mask3((past & ~entered) | (still & is_low)) != 0) return SetUp::Misses;
  ray.far_t = (box.high - origin) * ray.inverse;
  ray.exit_t = least3(ray.far_t);
  ray.is_moved = moved >= 0;
  const I4 before = is_low | (ray.backward & (origin == box.low)) | entered;
  ray.is_inside = mask3(before) == 0;
  ray.is_on_plane = ray.is_inside && starts_on_plane(ray);
  if (ray.is_inside) {
    ray.chunk = ray.backward ? all4(-kChunkSize) : all4(0.0F);
    return SetUp::Ready;
  }
  // The ray enters through the last plane; at a tie, through the plane of the later axis.
  const F4 near_t = before ? (box.low - origin) * ray.inverse : all4(-1.0F);
  const float t = greatest3(near_t);
  const int axis = 31 - std::countl_zero(static_cast<std::uint32_t>(mask3(near_t == all4(t))));
  const F4 now = all4(t);
  // The ray passes an edge of its box. It leaves before it enters if the axis of its exit comes first.
  if (mask3((ray.far_t < now) | ((ray.far_t == now) & (axes < axis))) != 0) return SetUp::Misses;
  ray.is_on_plane = t == 0.0F && !ray.is_moved && starts_on_plane(ray);
  ray.chunk = chunk_entered(ray, box, speed, t, axis);
  return SetUp::Ready;
}

inline SetUp set_up_path(const TreeView& tree, const Ray& ray, double max_t, PathRay& out) {
  RayNumbers numbers = read_ray(tree, ray);
  D4& p = numbers.position;
  const F4 d = numbers.direction;
  const F4 size = numbers.size;
  const float greatest = numbers.greatest;
  F4 low;
  F4 high;
  std::memcpy(&low, tree.low, sizeof low);
  std::memcpy(&high, tree.high, sizeof high);
  auto limit = static_cast<float>(max_t);
  if (mask3(size <= all4(0x1p20F)) != 7 || !(greatest >= 0x1p-20F) || !(limit >= 0.0F)) return SetUp::Unusual;
  const F4 rough = __builtin_convertvector(p, F4);
  const I4 leaves = ((high < rough) & (d >= 0.0F)) | ((rough < low) & (d <= 0.0F));
  if (mask3(leaves) != 0) return SetUp::Misses;
  int moved = -1;
  if (mask3((low - kNearby <= rough) & (rough <= high + kNearby)) != 7) {
    if (!bring_near(tree, ray, max_t, p, limit, moved)) return SetUp::Misses;
  }
  const D4 base = floor4(p * (1.0 / 64.0)) * 64.0;
  const F4 whole = __builtin_convertvector(floor4(p) - base, F4);
  const F4 origin = min4(__builtin_convertvector(p - base, F4), whole + (1.0F - 0x1p-17F));
  const I4 still = size < all4(0x1p-100F);
  out.base = __builtin_convertvector(base, I4);
  out.own = __builtin_convertvector(whole, I4);
  out.backward = (d < 0.0F) & ~still;
  out.forward = (d > 0.0F) & ~still;
  // A ray never crosses a plane of an axis without motion.
  out.origin = still ? whole + 0.5F : mirrored_planes(origin, out.backward);
  const F4 inverse = 1.0F / (still ? all4(1.0F) : size);
  out.inverse = still ? all4(kStillInverse) : inverse;
  const PathBox box = box_of(tree, out, origin, still ? all4(0.0F) : d, limit, greatest);
  return clip_path(out, box, still ? all4(0.0F) : size, moved);
}

class PathWalk {
 public:
  PathWalk(const TreeView& tree, const PathRay& ray)
      : chunk_(Paths::block(ray.chunk)),
        paths_(ray.origin, ray.inverse, ray.exit_t * 1.001F + 1e-6F),
        mirrored_(mask3(ray.backward)),
        tree_(tree),
        ray_(ray),
        flip_(flip_of(mask3(ray.backward))) {
    if (ray.is_on_plane) paths_.nudge(ray.forward);
    const F4 upper = ray.chunk + kChunkSize;
    const F4 t = (upper - ray.origin) * ray.inverse;
    const F4 native = mirrored_planes(ray.backward ? upper : ray.chunk, ray.backward);
    const I4 place = (__builtin_convertvector(native, I4) + ray.base) >> 6;
    I4 strides;
    std::memcpy(&strides, tree.chunk_strides, sizeof strides);
    const I4 steps = (strides ^ ray.backward) - ray.backward;
    plane_[0] = upper[0], plane_[1] = upper[1], plane_[2] = upper[2];
    t_[0] = t[0], t_[1] = t[1], t_[2] = t[2];
    stride_[0] = steps[0], stride_[1] = steps[1], stride_[2] = steps[2];
    index_ = place[0] + place[1] * strides[1] + place[2] * strides[2];
  }

  template <Ask kAsk>
  [[gnu::always_inline]] SingleHit find() {
    SingleHit found{false, ray_.is_cut, -1, IVec3{0}};
    walk([&](int brick, int cell, std::uint64_t met) __attribute__((always_inline)) {
      found = hit<kAsk>(brick, cell, met);
      return true;
    });
    return found;
  }

  /// Calls `meet(brick, cell, voxels)` for the occupied voxels that the ray passes, one cell at a time, until it
  /// returns true.
  template <class Meet>
  [[gnu::always_inline]] void walk(Meet&& meet) {
    std::uint64_t allowed = ~std::uint64_t{0};
    std::uint64_t bricks = 0;
    std::uint64_t cells = 0;
    int brick = 0;
    auto block = chunk_;
    if (ray_.is_inside) {
      // Start in the ray's own voxel: most hits are near the start.
      const Own own = own_units();
      brick = own.brick;
      block = Paths::brick_of(chunk_, brick);
      if (is_set(tree_.chunks[index_].bricks, brick)) {
        if (is_set(node().cells[static_cast<std::size_t>(brick ^ flip_)], own.cell)) {
          const std::uint64_t met = voxels_of(block, brick, own.cell) & kUnits.from[own.voxel];
          if (met != 0 && meet(brick, own.cell, met)) return;
        }
        cells = cells_of(brick) & kUnits.from[own.cell] & ~(std::uint64_t{1} << own.cell);
      }
      allowed = kUnits.from[brick] & ~(std::uint64_t{1} << brick);
    }
    for (bool is_known = false;; is_known = true) {
      for (; cells != 0; cells &= cells - 1) {
        const int cell = std::countr_zero(cells);
        const std::uint64_t met = voxels_of(block, brick, cell);
        if (met != 0 && meet(brick, cell, met)) return;
      }
      while (bricks == 0) {
        if (is_known && !advance()) return;
        is_known = true;
        bricks = bricks_of_chunk() & allowed;
        allowed = ~std::uint64_t{0};
      }
      brick = std::countr_zero(bricks);
      bricks &= bricks - 1;
      cells = cells_of(brick);
      block = Paths::brick_of(chunk_, brick);
    }
  }

  /// Returns the mirrored planes below a cell of a brick of the current chunk.
  [[nodiscard]] F4 corner_of_cell(int brick, int cell) const {
    const F4 lower = F4{plane_[0], plane_[1], plane_[2], 0.0F} - kChunkSize;
    return lower + corner_of(brick) * 16.0F + corner_of(cell) * 4.0F;
  }
  /// Returns true if the cell is beyond the range of single precision. The caller then traces the ray in double.
  [[nodiscard]] bool is_too_far(F4 in_cell) const {
    return ray_.is_cut && greatest3((in_cell - ray_.origin) * ray_.inverse) > ray_.exit_t;
  }
  /// Returns the voxel, relative to the tables' origin, with these mirrored planes below it.
  [[nodiscard]] I4 native_voxel(F4 voxel) const {
    const F4 native = mirrored_planes(ray_.backward ? voxel + 1.0F : voxel, ray_.backward);
    return __builtin_convertvector(native, I4) + ray_.base;
  }

 private:
  // The start units of a ray, mirrored.
  struct Own {
    int brick, cell, voxel;
  };
  [[nodiscard]] Own own_units() const {
    const I4 own = ray_.own ^ (ray_.backward & 63);
    return {(own[0] >> 4) + (own[1] >> 4) * 4 + (own[2] >> 4) * 16,
            (own[0] >> 2 & 3) + (own[1] & 12) + (own[2] & 12) * 4, (own[0] & 3) + (own[1] & 3) * 4 + (own[2] & 3) * 16};
  }
  [[nodiscard]] bool is_set(std::uint64_t word, int unit) const { return (word >> (unit ^ flip_) & 1U) != 0; }
  [[nodiscard, gnu::always_inline]] std::uint64_t bits_of_bricks() const {
    return mirrored_(&tree_.chunks[index_].bricks);
  }
  [[nodiscard]] const ChunkNode& node() const { return *tree_.chunks[index_].node; }
  [[nodiscard, gnu::always_inline]] std::uint64_t bricks_of_chunk() const {
    return tree_.chunks[index_].bricks == 0 ? 0 : paths_.bricks(chunk_) & bits_of_bricks();
  }
  [[nodiscard, gnu::always_inline]] std::uint64_t cells_of(int brick) const {
    return paths_.cells(chunk_, brick) & mirrored_(&node().cells[static_cast<std::size_t>(brick ^ flip_)]);
  }
  [[nodiscard, gnu::always_inline]] std::uint64_t voxels_of(const Paths::Block& block, int brick, int cell) const {
    const BrickWords words(tree_.lines, node().bricks[static_cast<std::size_t>(brick ^ flip_)]);
    return paths_.voxels(block, cell) & mirrored_(&words[static_cast<std::size_t>(cell ^ flip_)]);
  }

  // Moves to the next chunk. Returns false if the ray has left its box.
  [[gnu::always_inline]] bool advance() {
    if (t_[0] <= t_[1] && t_[0] <= t_[2]) return cross<0>();
    return t_[1] <= t_[2] ? cross<1>() : cross<2>();
  }
  template <int kAxis>
  [[gnu::always_inline]] bool cross() {
    const float now = t_[kAxis];
    plane_[kAxis] += kChunkSize;
    t_[kAxis] = (plane_[kAxis] - ray_.origin[kAxis]) * ray_.inverse[kAxis];
    index_ += stride_[kAxis];
    chunk_ = Paths::next_chunk<kAxis>(chunk_);
    if (now < ray_.exit_t) return true;
    // At a tie, the exit axis may come later.
    const int exit_axis = std::countr_zero(static_cast<std::uint32_t>(mask3(ray_.far_t == all4(ray_.exit_t))));
    return now == ray_.exit_t && kAxis < exit_axis;
  }

  template <Ask kAsk>
  [[gnu::always_inline]] SingleHit hit(int brick, int cell, std::uint64_t voxels) const {
    const F4 in_cell = corner_of_cell(brick, cell);
    if (is_too_far(in_cell)) return {false, true, -1, IVec3{0}};
    if (kAsk == Ask::Whether) return {true, false, -1, IVec3{0}};
    const F4 voxel = in_cell + corner_of(std::countr_zero(voxels));
    const F4 nudge = ray_.is_on_plane ? (ray_.forward ? all4(kNudge) : all4(0.0F)) : all4(0.0F);
    // The ray entered through the last of the lower planes; at a tie, the plane of the later axis.
    const F4 t = (voxel - ray_.origin) * ray_.inverse - nudge;
    const float last = greatest3(t);
    const int axis = last < 0.0F ? -1 : t[2] == last ? 2 : t[1] == last ? 1 : 0;
    const I4 at = native_voxel(voxel);
    return {true, false, axis, IVec3{at[0], at[1], at[2]}};
  }

  Paths::Block chunk_;
  Paths paths_;
  Mirror mirrored_;
  const TreeView& tree_;
  const PathRay& ray_;
  int flip_;  // from a mirrored unit to the unit
  int index_;
  float plane_[3];  // exit planes of the chunk
  float t_[3];
  int stride_[3];
};

struct PathTracer {
  template <Ask kAsk>
  [[gnu::always_inline]] static SingleHit trace(const TreeView& tree, const Ray& ray, double max_t) {
    PathRay path;
    const SetUp ready = set_up_path(tree, ray, max_t, path);
    if (ready != SetUp::Ready) return {false, ready == SetUp::Unusual, -1, IVec3{0}};
    return PathWalk(tree, path).find<kAsk>();
  }
};

}  // namespace
}  // namespace quoin::trace
