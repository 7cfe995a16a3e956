// What a ray comes to in one cell between the samples of a field, in double: the same operations, in the same order,
// for every kernel.
//
//   corners d000 .. d111, by x + 2 y + 4 z        along the ray, p = entry + s * way, 0 <= s <= 1:
//
//        d011-------d111                          f(s) = c0 + c1 s + c2 s^2 + c3 s^3
//       / |        / |                                 = the Bezier curve of b0, b1, b2, b3,
//     d010--+----d110|       y  z
//      |  d001----|--d101    | /                  which lies between the least and the greatest of the four: where none
//     d000-------d100        |/__ x               is negative, no point of the ray is.

#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <utility>

#ifdef QUOIN_KERNEL_AVX2
#include <immintrin.h>
#endif

#include <quoin/trace/ray.h>

#include "grid/density/density_storage.h"

namespace quoin::trace {
namespace {

using CellD2 = double __attribute__((vector_size(16)));
using CellD4 = double __attribute__((vector_size(32)));
using CellI4 = std::int64_t __attribute__((vector_size(32)));
using CellF4 = float __attribute__((vector_size(16)));
using CellF8 = float __attribute__((vector_size(32)));

/// The densities of a cell's corners, by x + 2 y + 4 z.
struct Corners {
  CellF8 density;
};

/// Those of pairs of halves that are neither infinite nor NaN, one a row along x.
inline CellF8 floats_from_halves(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
  // As float_from_half: the product moves the exponent, and makes subnormals normal.
#ifdef QUOIN_KERNEL_AVX2
  // From registers: what is stored in parts must not be loaded as a whole at once.
  const __m128i pairs =
      _mm_setr_epi32(static_cast<int>(a), static_cast<int>(b), static_cast<int>(c), static_cast<int>(d));
  const __m256i wide = _mm256_cvtepu16_epi32(pairs);
  const __m256i magnitude = _mm256_slli_epi32(_mm256_and_si256(wide, _mm256_set1_epi32(0x7FFF)), 13);
  const __m256i sign = _mm256_slli_epi32(_mm256_and_si256(wide, _mm256_set1_epi32(0x8000)), 16);
  const __m256 size = _mm256_mul_ps(_mm256_castsi256_ps(magnitude), _mm256_set1_ps(0x1p+112F));
  return reinterpret_cast<CellF8>(_mm256_or_ps(size, _mm256_castsi256_ps(sign)));
#else
  using U32 = std::uint32_t __attribute__((vector_size(32)));
  const U32 wide = {a & 0xFFFFU, a >> 16, b & 0xFFFFU, b >> 16, c & 0xFFFFU, c >> 16, d & 0xFFFFU, d >> 16};
  const CellF8 magnitude = reinterpret_cast<CellF8>((wide & 0x7FFFU) << 13) * 0x1p+112F;
  return reinterpret_cast<CellF8>(reinterpret_cast<U32>(magnitude) | (wide & 0x8000U) << 16);
#endif
}

/// The densities of samples x and x + 1 of a row, as halves.
inline std::uint32_t pair_of(const DensityStorage& chunk, int x, int y, int z) {
  const std::uint32_t slab = chunk.slabs[static_cast<std::size_t>((z >> 2) * 16 + (y >> 2))];
  if ((slab & ChunkStorage::kUniformSlab) != 0) return (slab & 0xFFFFU) * 0x1'0001U;
  const int row = (z & 3) * 4 + (y & 3);
  const Half* const at =
      chunk.values.data() + (std::size_t{slab} * 16 + static_cast<std::size_t>(row)) * kChunkEdge + x;
  std::uint32_t pair;
  std::memcpy(&pair, at, sizeof pair);
  return pair;
}

/// Of a cell whose corners are all of one chunk; `x`, `y` and `z` below 63.
inline Corners corners_within(const DensityStorage& chunk, int x, int y, int z) {
  return {floats_from_halves(pair_of(chunk, x, y, z), pair_of(chunk, x, y + 1, z), pair_of(chunk, x, y, z + 1),
                             pair_of(chunk, x, y + 1, z + 1))};
}

/// A ray as cells see it.
struct CellRay {
  CellD4 origin;
  CellD4 direction;
  CellD4 inverse;   // huge where it stands still, so that it never leaves
  CellI4 backward;  // axes, as masks
  double max_t;
};

inline CellRay cell_ray(const Ray& ray, double max_t) {
  CellRay out;
  for (int axis = 0; axis < 3; ++axis) {
    const double d = ray.direction[axis];
    out.origin[axis] = ray.origin[axis];
    out.direction[axis] = d;
    out.inverse[axis] = d != 0.0 ? 1.0 / d : 1e300;
    out.backward[axis] = d < 0.0 ? -1 : 0;
  }
  out.origin[3] = out.direction[3] = out.inverse[3] = 0.0;
  out.backward[3] = 0;
  out.max_t = max_t;
  return out;
}

/// The ray's stretch in a cell.
struct CellSpan {
  double t_in;
  double t_out;
};

inline CellSpan span_in(const CellRay& ray, CellD4 cell) {
  const CellD4 above = cell + 1.0;
  const CellD4 first = ((ray.backward ? above : cell) - ray.origin) * ray.inverse;
  const CellD4 last = ((ray.backward ? cell : above) - ray.origin) * ray.inverse;
  const double t_in = std::max(std::max(first[0], first[1]), std::max(first[2], 0.0));
  // Rounding may have it leave before it came.
  return {t_in, std::max(std::min(std::min(last[0], last[1]), last[2]), t_in)};
}

/// The cubic of a cell along a ray, in powers of s.
struct CellCubic {
  double c0, c1, c2, c3;
  [[nodiscard]] double operator()(double s) const { return ((c3 * s + c2) * s + c1) * s + c0; }
  [[nodiscard]] double slope(double s) const { return (3.0 * c3 * s + 2.0 * c2) * s + c1; }
};

/// `entry` is a point in the cell, 0 to 1 on each axis, and `way` leads from it to where the ray leaves the cell. The
/// eight corners become four functions of s along z, these two along y, and these one.
inline CellCubic cubic_of(const Corners& corners, CellD4 entry, CellD4 way) {
  const CellF8 d = corners.density;
  const CellD4 low = __builtin_convertvector(__builtin_shufflevector(d, d, 0, 1, 2, 3), CellD4);
  const CellD4 rise = __builtin_convertvector(__builtin_shufflevector(d, d, 4, 5, 6, 7), CellD4) - low;
  const CellD4 z0 = low + rise * entry[2];
  const CellD4 z1 = rise * way[2];
  const CellD2 low0 = __builtin_shufflevector(z0, z0, 0, 1);
  const CellD2 rise0 = __builtin_shufflevector(z0, z0, 2, 3) - low0;
  const CellD2 low1 = __builtin_shufflevector(z1, z1, 0, 1);
  const CellD2 rise1 = __builtin_shufflevector(z1, z1, 2, 3) - low1;
  const CellD2 y0 = low0 + rise0 * entry[1];
  const CellD2 y1 = low1 + rise1 * entry[1] + rise0 * way[1];
  const CellD2 y2 = rise1 * way[1];
  const double x0 = y0[1] - y0[0];
  const double x1 = y1[1] - y1[0];
  const double x2 = y2[1] - y2[0];
  return {y0[0] + x0 * entry[0], y1[0] + x1 * entry[0] + x0 * way[0], y2[0] + x2 * entry[0] + x1 * way[0], x2 * way[0]};
}

/// The root of `f` between `low`, where it is not negative, and `high`, where it is, of which there is one.
inline double root_between(const CellCubic& f, double low, double high) {
  const double f_low = f(low);
  const double f_high = f(high);
  // Newton's steps from the chord's root, kept within what is left of the bracket.
  double s = low + (high - low) * (f_low / (f_low - f_high));
  for (int i = 0; i < 60; ++i) {
    const double value = f(s);
    if (value < 0.0) {
      high = s;
    } else {
      low = s;
    }
    if (!(high - low > 1e-15)) break;
    double next = s - value / f.slope(s);
    // Also where the slope is 0.
    if (!(next > low && next < high)) next = 0.5 * (low + high);
    if (std::abs(next - s) <= 1e-13) return next;
    s = next;
  }
  return s;
}

/// Where the cubic first becomes negative for 0 <= s <= 1; a negative number where it never does. Asked whether alone,
/// any number that is not negative says that it does.
template <bool kAsksWhere>
inline double first_negative(const CellCubic& f) {
  if (f.c0 < 0.0) return 0.0;
  const double b1 = f.c0 + f.c1 * (1.0 / 3.0);
  const double b2 = f.c0 + (2.0 * f.c1 + f.c2) * (1.0 / 3.0);
  const double b3 = f.c0 + f.c1 + f.c2 + f.c3;
  if (std::min(std::min(b1, b2), b3) >= 0.0) return -1.0;
  if (!kAsksWhere && b3 < 0.0) return 1.0;
  // One change of sign among the four: one root.
  if (b3 < 0.0 && !(b1 < 0.0 && b2 >= 0.0)) return root_between(f, 0.0, 1.0);
  // Between its extremes the curve only falls or only rises.
  const double a = 3.0 * f.c3;
  const double b = 2.0 * f.c2;
  const double discriminant = b * b - 4.0 * a * f.c1;
  double low = 0.0;
  if (discriminant > 0.0) {
    // Without the difference of two numbers that are nearly alike.
    const double q = -0.5 * (b + std::copysign(std::sqrt(discriminant), b));
    double extremes[2] = {q / a, f.c1 / q};
    if (!(extremes[0] <= extremes[1])) std::swap(extremes[0], extremes[1]);
    for (const double extreme : extremes) {
      if (!(extreme > low && extreme < 1.0)) continue;
      if (f(extreme) < 0.0) return kAsksWhere ? root_between(f, low, extreme) : 1.0;
      low = extreme;
    }
  }
  return b3 < 0.0 ? root_between(f, low, 1.0) : -1.0;
}

/// Where the ray first comes to a negative density in a cell, in t; a negative number where it does not, or only beyond
/// its end. `cell`: its least corner.
template <bool kAsksWhere>
inline double meet_cell(const CellRay& ray, CellD4 cell, const CellSpan& span, const Corners& corners) {
  const double length = std::min(span.t_out, ray.max_t) - span.t_in;
  if (length < 0.0) return -1.0;
  CellD4 entry = ray.origin + ray.direction * span.t_in - cell;
  const CellD4 none = {};
  entry = entry < none ? none : entry;
  entry = entry > none + 1.0 ? none + 1.0 : entry;
  const double s = first_negative<kAsksWhere>(cubic_of(corners, entry, ray.direction * length));
  return s < 0.0 ? -1.0 : span.t_in + s * length;
}

}  // namespace
}  // namespace quoin::trace
