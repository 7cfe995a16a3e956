// Tests if one short ray is blocked, in sixteen lanes of AVX-512. All crossings are computed at once, so there are no
// dependent steps and the result decides no branch. The results equal those of trace/kernel/single.inl. Crossings near
// an edge or near the ray's end, where rounding may decide, are doubtful; then the walk decides.
//
//   lane       | 0 | 1 | 2 | 3 | 4 | 5 | 6 | 7 | 8 | 9 |10 |11 |12 |13 |14 |15 |
//   crossing   | planes of x   | planes of y       | planes of z ...      |start|
//   t          by the formula of every walk                                 0
//   place      origin + t * direction in 65,536ths of a voxel; along the crossed axis, the middle of the voxel beyond
//
// The ray is mirrored to go forward along every axis, and its places are relative to the corner of its brick. On an
// axis that is not mirrored, places 0 to 15 are in the brick and 16 to 31 in the next one. On a mirrored axis, -16 to
// -1 (in five bits 16 to 31) are in the brick and 0 to 15 in the next one. Three tables spread the places into the
// brick (one of eight), half word and bit.

#pragma once

#include <array>
#include <cmath>
#include <cstdint>

#include "trace/kernel/lockstep.inl"
#include "trace/kernel/ray_lanes_avx512.h"
#include "trace/kernel/single.inl"

namespace quoin::trace {
namespace {

// The maximum of |x| + |y| + |z| for a short ray, in voxels. With one more crossing on each axis there are at most
// fourteen crossings, and the last lane is left for the start.
constexpr float kShortRayReach = 11.0F;
constexpr int kStartLane = 15;
constexpr float kPlaceUnit = 65536.0F;
// Places nearer to an edge than this are uncertain because of rounding. Places are shifted up by this amount, so that
// one bit test finds both sides. Rounding moves them by less than one unit.
constexpr int kNearEdge = 8;
// Longer or shorter directions use other methods, which scale them.
constexpr float kLeastDirection = 0x1p-20F;
constexpr float kGreatestDirection = 0x1p20F;
// The direction may be this much longer than any of its components.
constexpr float kShortRayRatio = 2048.0F;
constexpr float kLeastMoving = 0x1p-100F;

struct ShortRayTables {
  // The spread bits of places, as in trace/kernel/window.inl, of five bits per axis.
  alignas(64) std::int32_t spread[3][32];
  // The axis of each lane, and four times the number of its plane, by the number of crossed planes of x and of y.
  alignas(16) std::uint8_t lanes[16][16][16];
  // For each set of mirrored axes: the spread bits to flip. Along x, the brick bits are not flipped, because bricks
  // come in pairs along x, the lower one first. Also flips the highest bit of the half word, as place_in_run requires.
  std::int32_t flips[8];
  // For x mirrored or not, and each set of axes whose next brick is outside the table: the bricks inside.
  std::uint8_t inside[2][8];
};

constexpr ShortRayTables make_short_ray_tables() {
  ShortRayTables tables{};
  constexpr std::array<int, 3> kCellShift = {6, 10, 8};
  constexpr std::array<std::int32_t, 3> kFlip = {0x00C3, 0x2C0C, 0x4330};
  for (int c = 0; c < 32; ++c) {
    for (int axis = 0; axis < 3; ++axis) {
      tables.spread[axis][c] =
          (c & 3) << (2 * axis) | (c >> 2 & 3) << kCellShift[static_cast<std::size_t>(axis)] | (c >> 4) << (12 + axis);
    }
  }
  for (int x = 0; x < 16; ++x) {
    for (int y = 0; y < 16; ++y) {
      for (int i = 0; i < kStartLane; ++i) {
        const int axis = i < x ? 0 : i < x + y ? 1 : 2;
        const int number = i - (axis == 0 ? 0 : axis == 1 ? x : x + y);
        tables.lanes[x][y][i] = static_cast<std::uint8_t>(axis | number << 2);
      }
      tables.lanes[x][y][kStartLane] = 3;
    }
  }
  for (int octant = 0; octant < 8; ++octant) {
    tables.flips[octant] = 0x800;
    for (int axis = 0; axis < 3; ++axis) {
      if ((octant >> axis & 1) != 0) tables.flips[octant] ^= kFlip[static_cast<std::size_t>(axis)];
    }
  }
  for (int outside = 0; outside < 8; ++outside) {
    for (int brick = 0; brick < 8; ++brick) {
      for (int mirrored = 0; mirrored < 2; ++mirrored) {
        const bool is_inside = ((brick ^ mirrored) & outside) == 0;
        tables.inside[mirrored][outside] |= static_cast<std::uint8_t>((is_inside ? 1 : 0) << brick);
      }
    }
  }
  return tables;
}

alignas(64) constexpr ShortRayTables kShortRay = make_short_ray_tables();

inline __m128i load4(const void* from) {
  return _mm_loadu_si128(static_cast<const __m128i*>(from));
}

// A mirrored ray, relative to the corner of the brick in which it starts. Lane 3 represents the start: its plane is 0
// and its inverse 1.
struct ShortRay {
  __m128 origin;
  __m128 size;       // absolute values of the direction
  __m128 cell;       // the nearer corner of its start voxel
  __m128i brick;     // not mirrored
  __m128i backward;  // -1 along axes that are mirrored
  __m128 limit;      // max_t
  int octant = 0;    // bits of the mirrored axes
  __m128i crossed;   // maximum number of planes that it may cross
};

// Returns false if the ray needs another method. `length`: |x| + |y| + |z| of the direction. Requires: it is short.
inline bool set_up(const TreeView& tree, const Ray& ray, double max_t, double length, ShortRay& out) {
  static_assert(sizeof(Ray) == 6 * sizeof(double));
  const __m128 d = _mm256_cvtpd_ps(_mm256_loadu_pd(&ray.origin.z));  // followed by the direction
  const __m128 direction = _mm_blend_ps(_mm_permute_ps(d, 0x39), _mm_setzero_ps(), 8);
  const __m128 sign_bit = _mm_set1_ps(-0.0F);
  const __m128 size = _mm_andnot_ps(sign_bit, direction);
  // As in every walk, axes with a smaller component count as having no motion: arithmetic with subnormal numbers is
  // slow.
  const unsigned is_moving = _mm_cmp_ps_mask(size, _mm_set1_ps(kLeastMoving), _CMP_GE_OQ);
  out.size = _mm_maskz_mov_ps(static_cast<__mmask8>(is_moving), size);
  // Rounding may move the crossings of a slow axis past many crossings of another axis.
  const __m128 least = _mm_set1_ps(static_cast<float>(length) * (1.0F / kShortRayRatio));
  const unsigned is_creeping = _mm_cmp_ps_mask(size, least, _CMP_LT_OQ) & is_moving;
  out.limit = _mm_set1_ps(static_cast<float>(max_t));
  const __m128 reach = _mm_mul_ps(out.size, out.limit);
  const unsigned is_usual = _mm_cmp_ps_mask(out.size, _mm_set1_ps(kLeastDirection), _CMP_GE_OQ);
  const unsigned is_long = _mm_cmp_ps_mask(out.size, _mm_set1_ps(kGreatestDirection), _CMP_GT_OQ);
  const __m256d position = _mm256_sub_pd(_mm256_loadu_pd(&ray.origin.x), _mm256_load_pd(tree.corner));
  const __m128i own = _mm256_cvttpd_epi32(_mm256_floor_pd(position));
  out.brick = _mm_srai_epi32(own, 4);
  const unsigned outside = _mm_cmpge_epu32_mask(out.brick, load4(&tree.brick_sizes)) & 7U;
  if ((outside | is_long | is_creeping) != 0 || is_usual == 0) [[unlikely]]
    return false;
  // Positions round as in every walk: from a multiple of 64, and below the end of the voxel.
  const __m256d base = _mm256_cvtepi32_pd(_mm_and_si128(own, _mm_set1_epi32(~63)));
  const __m128 whole = _mm_cvtepi32_ps(_mm_and_si128(own, _mm_set1_epi32(63)));
  const __m128 rest =
      _mm_min_ps(_mm256_cvtpd_ps(_mm256_sub_pd(position, base)), _mm_add_ps(whole, _mm_set1_ps(1.0F - 0x1p-17F)));
  // Relative to the brick's corner; this subtraction is exact.
  const __m128 in_brick = _mm_sub_ps(rest, _mm_cvtepi32_ps(_mm_and_si128(own, _mm_set1_epi32(48))));
  out.backward = _mm_srai_epi32(_mm_castps_si128(direction), 31);
  out.octant = _mm_movemask_ps(direction);
  out.origin = _mm_blend_ps(_mm_xor_ps(in_brick, _mm_and_ps(direction, sign_bit)), _mm_setzero_ps(), 8);
  out.cell = _mm_cvtepi32_ps(_mm_xor_si128(_mm_and_si128(own, _mm_set1_epi32(15)), out.backward));
  out.crossed = _mm_cvttps_epi32(_mm_add_ps(reach, _mm_set1_ps(1.0F + kSlack)));
  return true;
}

// Returns the eight bricks from the ray's brick on, by x, y and z; bricks outside the table are empty.
inline __m256i bricks_of(const TreeView& tree, const ShortRay& ray) {
  const __m128i sizes = load4(&tree.brick_sizes);
  const __m128i strides = _mm_setr_epi32(1, tree.brick_strides.y, tree.brick_strides.z, 0);
  const __m128i next = _mm_add_epi32(ray.brick, _mm_or_si128(ray.backward, _mm_set1_epi32(1)));
  const unsigned outside = _mm_cmpge_epu32_mask(next, sizes) & 7U;
  const __mmask8 inside = kShortRay.inside[ray.octant & 1][outside];
  // Bricks outside are read from the row of the ray's own brick instead.
  const __m128i there = _mm_mask_mov_epi32(next, static_cast<__mmask8>(outside), ray.brick);
  const __m256i both = _mm256_mullo_epi32(_mm256_inserti128_si256(_mm256_castsi128_si256(ray.brick), there, 1),
                                          _mm256_broadcastsi128_si256(strides));
  // In pairs along x, the lower one first: four rows of y and z.
  const auto row_of = [&](__m256i which) { return _mm256_castsi256_si128(_mm256_permutevar8x32_epi32(both, which)); };
  const __m128i y = row_of(_mm256_setr_epi32(1, 5, 1, 5, 0, 0, 0, 0));
  const __m128i z = row_of(_mm256_setr_epi32(2, 2, 6, 6, 0, 0, 0, 0));
  const __m128i low = _mm_broadcastd_epi32(_mm_add_epi32(ray.brick, ray.backward));
  const __m256i pairs = _mm256_i32gather_epi64(reinterpret_cast<const long long*>(tree.bricks),
                                               _mm_add_epi32(_mm_add_epi32(y, z), low), sizeof(BrickCode));
  return _mm256_maskz_mov_epi32(inside, pairs);
}

struct Blocked {
  bool is_sure = false;
  bool is_doubtful = false;
};

// Requires: the ray is short.
inline Blocked any_at_once(const TreeView& tree, const Ray& ray, double max_t, double length) {
  QUOIN_ASSERT(max_t >= 0.0 && max_t * length <= kShortRayReach, "a short ray");
  ShortRay own;
  if (!set_up(tree, ray, max_t, length, own)) return {false, true};
  const __m128 one = _mm_set1_ps(1.0F);
  const __m128 first = _mm_maskz_add_ps(7, own.cell, one);
  const __m128 inverses = _mm_div_ps(one, _mm_blend_ps(own.size, one, 8));
  const auto counts = static_cast<std::uint64_t>(_mm_cvtsi128_si64(own.crossed));
  const __m512i lane = _mm512_cvtepu8_epi32(load4(kShortRay.lanes[counts & 15U][counts >> 32 & 15U]));
  const auto of_axis = [lane](__m128 v) { return _mm512_permutexvar_ps(lane, _mm512_broadcast_f32x4(v)); };
  const __m512 plane = _mm512_add_ps(of_axis(first), _mm512_cvtepi32_ps(_mm512_srli_epi32(lane, 2)));
  const __m512 inverse = of_axis(inverses);
  const __m512 t = _mm512_mul_ps(_mm512_sub_ps(plane, of_axis(own.origin)), inverse);
  // An upper bound of the rounding error of a crossing.
  const __m512 doubt = _mm512_mul_ps(inverse, _mm512_set1_ps(kDoubt));
  const __m512 limit = _mm512_broadcastss_ps(own.limit);
  const __mmask16 maybe = _mm512_cmp_ps_mask(t, _mm512_add_ps(limit, doubt), _CMP_LT_OQ);
  const __mmask16 sure = _mm512_cmp_ps_mask(t, _mm512_sub_ps(limit, doubt), _CMP_LT_OQ) | 1U << kStartLane;
  // Places, shifted up by kNearEdge except on the crossed axis and at the start, where they are exact.
  const __m128 unit = _mm_set1_ps(kPlaceUnit), half = _mm_set1_ps(0.5F * kPlaceUnit);
  const __m512 from =
      _mm512_broadcast_f32x4(_mm_add_ps(_mm_mul_ps(own.origin, unit), _mm_set1_ps(static_cast<float>(kNearEdge))));
  const __m512 speed = _mm512_broadcast_f32x4(_mm_mul_ps(own.size, unit));
  const __m512 middle = _mm512_broadcast_f32x4(_mm_add_ps(_mm_mul_ps(own.cell, unit), half));
  const __m512 beyond = _mm512_add_ps(_mm512_mul_ps(plane, _mm512_set1_ps(kPlaceUnit)), _mm512_broadcastss_ps(half));
  const __m512i axis = _mm512_and_si512(lane, _mm512_set1_epi32(3));
  __mmask16 clear_of_edges = 0xFFFF;  // lanes with a place that is near no edge
  const auto spread = [&]<int kAxis>() {
    constexpr int kAll = kAxis * 0x55;
    const __m512 start = _mm512_mask_permute_ps(_mm512_permute_ps(from, kAll), 1U << kStartLane, middle, kAll);
    const __m512 along = _mm512_add_ps(_mm512_mul_ps(t, _mm512_permute_ps(speed, kAll)), start);
    const __mmask16 is_crossed = _mm512_cmpeq_epi32_mask(axis, _mm512_set1_epi32(kAxis));
    const __m512i place = _mm512_cvtps_epi32(_mm512_mask_mov_ps(along, is_crossed, beyond));
    clear_of_edges =
        _mm512_mask_test_epi32_mask(clear_of_edges, place, _mm512_set1_epi32(0xFFFF & ~(2 * kNearEdge - 1)));
    return from_32(kShortRay.spread[kAxis], I{_mm512_srli_epi32(place, 16)}).v;
  };
  const __m512i x = spread.template operator()<0>();
  const __m512i y = spread.template operator()<1>();
  const __m512i z = spread.template operator()<2>();
  const I code = {
      _mm512_xor_si512(_mm512_ternarylogic_epi32(x, y, z, 0xFE), _mm512_set1_epi32(kShortRay.flips[own.octant]))};
  const I brick = from_16(I{_mm512_castsi256_si512(bricks_of(tree, own))}, shift_right<12>(code));
  // Like half_of; the code's highest bit is already flipped.
  const I in_run = add_saturated_bytes(shift_left<20>(code), shift_left<28>(brick));
  const I at = (brick & all(~15)) + shift_right_signed<25>(in_run);
  const I word = {_mm512_mask_i32gather_epi32(_mm512_setzero_si512(), maybe, at.v, tree.words, 4)};
  const unsigned met = maybe & bits(test_bit(word, code));
  const unsigned clean = met & sure & clear_of_edges;
  const unsigned doubtful = (met & ~sure) | (maybe & ~clear_of_edges);
  // All bits are set if no lane is clean.
  const auto none = static_cast<unsigned>(static_cast<int>(clean - 1) >> 31);
  return {clean != 0, (doubtful & none) != 0};
}

// Like any_single.
inline bool any_short_single(const TreeView& tree, const Ray& ray, double max_t, bool& unfinished) {
  // Tested first, since most rays are longer.
  const double length = std::abs(ray.direction.x) + std::abs(ray.direction.y) + std::abs(ray.direction.z);
  if (!(max_t * length <= kShortRayReach && max_t >= 0.0)) {
    return any_single<PathTracer>(tree, ray, max_t, unfinished);
  }
  const Blocked blocked = any_at_once(tree, ray, max_t, length);
  unfinished = false;
  // No branch on the hit itself, which is unpredictable.
  if (blocked.is_doubtful) [[unlikely]]
    return any_single<PathTracer>(tree, ray, max_t, unfinished);
  return blocked.is_sure;
}

}  // namespace
}  // namespace quoin::trace
