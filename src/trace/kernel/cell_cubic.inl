// Intersects a ray with one cell between the samples of a field, in double precision. Every kernel uses the same
// operations in the same order.
//
//   corners d000 .. d111, by x + 2 y + 4 z        along the ray, p = entry + s * way, 0 <= s <= 1:
//
//        d011-------d111                          f(s) = c0 + c1 s + c2 s^2 + c3 s^3
//       / |        / |                                 = the Bezier curve of b0, b1, b2, b3,
//     d010--+----d110|       y  z
//      |  d001----|--d101    | /                  which lies between the least and the greatest of the four: if none
//     d000-------d100        |/__ x               is negative, no point of the ray is negative.

#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <utility>

#include <quoin/core/assert.h>
#include <quoin/trace/ray.h>

namespace quoin::trace {
namespace {

/// A ray in the form that cell tests use, or several rays in lanes; by axis.
template <class V>
struct CellRayOf {
  V origin[3];
  V direction[3];
  V inverse[3];  // huge for an axis without motion, so that the ray never leaves along it
  V entry[3];    // the plane of the cell that the ray passes first: 0 or 1
  V exit[3];
  V max_t;
};
using CellRay = CellRayOf<double>;

inline CellRay cell_ray(const Ray& ray, double max_t) {
  CellRay out;
  for (int axis = 0; axis < 3; ++axis) {
    // As in the walks: such a slow axis counts as having no motion.
    const double d = std::abs(ray.direction[axis]) < 0x1p-100 ? 0.0 : ray.direction[axis];
    out.origin[axis] = ray.origin[axis];
    out.direction[axis] = d;
    out.inverse[axis] = d != 0.0 ? 1.0 / d : 1e300;
    out.entry[axis] = d < 0.0 ? 1.0 : 0.0;
    out.exit[axis] = d < 0.0 ? 0.0 : 1.0;
  }
  out.max_t = max_t;
  return out;
}

template <class V>
inline V least(V a, V b) {
  return b < a ? b : a;
}
template <class V>
inline V greatest(V a, V b) {
  return a < b ? b : a;
}

/// The ray's interval in a cell.
template <class V>
struct CellSpan {
  V t_in;
  V t_out;
};

/// `cell`: the lowest corner, by axis.
template <class V>
inline CellSpan<V> span_in(const CellRayOf<V>& ray, const V (&cell)[3]) {
  V first[3];
  V last[3];
  for (int axis = 0; axis < 3; ++axis) {
    first[axis] = (cell[axis] + ray.entry[axis] - ray.origin[axis]) * ray.inverse[axis];
    last[axis] = (cell[axis] + ray.exit[axis] - ray.origin[axis]) * ray.inverse[axis];
  }
  const V t_in = greatest(greatest(first[0], first[1]), greatest(first[2], V{}));
  // Rounding may put the exit before the entry.
  return {t_in, greatest(least(least(last[0], last[1]), last[2]), t_in)};
}

/// The cubic of a cell along a ray, in powers of s; for one cell, or for several in lanes.
template <class V>
struct CellCubic {
  V c0, c1, c2, c3;
  [[nodiscard]] V operator()(V s) const { return ((c3 * s + c2) * s + c1) * s + c0; }
  [[nodiscard]] V slope(V s) const { return (3.0 * c3 * s + 2.0 * c2) * s + c1; }
};

/// `entry` is a point in the cell, 0 to 1 on each axis, and `way` leads from it to the exit. The eight corners become
/// four functions of s along z, then two along y, then one.
template <class V>
inline CellCubic<V> cubic_of(const V (&corners)[8], const V (&entry)[3], const V (&way)[3]) {
  V z0[4];
  V z1[4];
  for (int i = 0; i < 4; ++i) {
    const V rise = corners[i + 4] - corners[i];
    z0[i] = corners[i] + rise * entry[2];
    z1[i] = rise * way[2];
  }
  V y0[2];
  V y1[2];
  V y2[2];
  for (int i = 0; i < 2; ++i) {
    const V rise0 = z0[i + 2] - z0[i];
    const V rise1 = z1[i + 2] - z1[i];
    y0[i] = z0[i] + rise0 * entry[1];
    y1[i] = z1[i] + rise1 * entry[1] + rise0 * way[1];
    y2[i] = rise1 * way[1];
  }
  const V x0 = y0[1] - y0[0];
  const V x1 = y1[1] - y1[0];
  const V x2 = y2[1] - y2[0];
  return {y0[0] + x0 * entry[0], y1[0] + x1 * entry[0] + x0 * way[0], y2[0] + x2 * entry[0] + x1 * way[0], x2 * way[0]};
}

/// The last three of the four control points of the Bezier curve; the first is c0.
template <class V>
struct CellCurve {
  V b1, b2, b3;
  [[nodiscard]] V low() const { return least(least(b1, b2), b3); }
};

template <class Number, class V>
inline CellCurve<V> curve_of(const CellCubic<V>& f) {
  const auto third = static_cast<Number>(1.0 / 3.0);
  // The last is f(1) to the bit, so that a root lies between 0 and 1 where it is negative.
  return {f.c0 + f.c1 * third, f.c0 + (f.c1 + f.c1 + f.c2) * third, ((f.c3 + f.c2) + f.c1) + f.c0};
}

/// Returns the only root of `f` between `low`, where `f` is not negative, and `high`, where it is negative.
inline double root_between(const CellCubic<double>& f, double low, double high) {
  QUOIN_ASSERT(low >= 0.0 && low <= high && high <= 1.0, "0 <= low <= high <= 1");
  const double f_low = f(low);
  const double f_high = f(high);
  // Newton's method, starting at the chord's root, within the current bracket.
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
    // This also covers a slope of 0.
    if (!(next > low && next < high)) next = 0.5 * (low + high);
    if (std::abs(next - s) <= 1e-13) return next;
    s = next;
  }
  return s;
}

/// Returns the first s in [0, 1] where the cubic becomes negative; a negative number if it never does. Without
/// `kAsksWhere`, returns any non-negative number if it does.
template <bool kAsksWhere>
inline double first_negative(const CellCubic<double>& f) {
  if (f.c0 < 0.0) return 0.0;
  const CellCurve<double> curve = curve_of<double>(f);
  if (curve.low() >= 0.0) return -1.0;
  const auto [b1, b2, b3] = curve;
  if (!kAsksWhere && b3 < 0.0) return 1.0;
  // One sign change among the four control points: one root.
  if (b3 < 0.0 && !(b1 < 0.0 && b2 >= 0.0)) return root_between(f, 0.0, 1.0);
  // Between its extremes, the curve is monotonic.
  const double a = 3.0 * f.c3;
  const double b = 2.0 * f.c2;
  const double discriminant = b * b - 4.0 * a * f.c1;
  double low = 0.0;
  if (discriminant > 0.0) {
    // Avoids the difference of two nearly equal numbers.
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

/// Returns the field of a cell along a ray, from its entry at `t_in` over `length`.
template <class V>
inline CellCubic<V> cubic_along(const CellRayOf<V>& ray, const V (&cell)[3], V t_in, V length, const V (&corners)[8]) {
  V entry[3];
  V way[3];
  for (int axis = 0; axis < 3; ++axis) {
    const V at = ray.origin[axis] + ray.direction[axis] * t_in - cell[axis];
    entry[axis] = least(greatest(at, V{}), V{} + 1.0);
    way[axis] = ray.direction[axis] * length;
  }
  return cubic_of(corners, entry, way);
}

/// Returns the first t where the ray meets a negative density in a cell; a negative number if it does not, or only
/// beyond its end.
template <bool kAsksWhere>
inline double meet_cell(const CellRay& ray, const double (&cell)[3], const CellSpan<double>& span,
                        const float (&corners)[8]) {
  const double length = least(span.t_out, ray.max_t) - span.t_in;
  if (length < 0.0) return -1.0;
  double density[8];
  std::copy_n(corners, 8, density);
  const double s = first_negative<kAsksWhere>(cubic_along(ray, cell, span.t_in, length, density));
  return s < 0.0 ? -1.0 : span.t_in + s * length;
}

}  // namespace
}  // namespace quoin::trace
