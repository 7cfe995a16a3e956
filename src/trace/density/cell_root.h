#pragma once

// Where the trilinear field of a cell, along a ray, first becomes negative.
//
//   corners d000 .. d111, by x + 2 y + 4 z        along the ray, p = entry + s * way, 0 <= s <= 1:
//
//        d011-------d111                          f(s) = c0 + c1 s + c2 s^2 + c3 s^3
//       / |        / |                                 = the Bezier curve of b0, b1, b2, b3,
//     d010--+----d110|       y  z
//      |  d001----|--d101    | /                  which lies between the least and the greatest of
//     d000-------d100        |/__ x               the four: where none is negative, no point of the ray is.

#include <algorithm>
#include <array>
#include <cmath>

#include <quoin/core/vec.h>

namespace quoin::trace {

/// Densities of a cell's corners, by x + 2 y + 4 z.
using CellCorners = std::array<float, 8>;

/// The cubic of a cell along a ray, in powers of s.
struct CellCubic {
  double c0, c1, c2, c3;

  [[nodiscard]] double operator()(double s) const { return ((c3 * s + c2) * s + c1) * s + c0; }
  [[nodiscard]] double slope(double s) const { return (3.0 * c3 * s + 2.0 * c2) * s + c1; }
};

/// `entry` is a point in the cell, 0 to 1 on each axis, and `way` leads from it to where the ray leaves the cell.
inline CellCubic cubic_of(const CellCorners& corners, const DVec3& entry, const DVec3& way) {
  const auto d = [&](std::size_t i) { return static_cast<double>(corners[i]); };
  // f = k + kx x + ky y + kz z + kxy x y + kxz x z + kyz y z + kxyz x y z
  const double kx = d(1) - d(0);
  const double ky = d(2) - d(0);
  const double kz = d(4) - d(0);
  const double kxy = d(3) - d(2) - kx;
  const double kxz = d(5) - d(4) - kx;
  const double kyz = d(6) - d(4) - ky;
  const double kxyz = (d(7) - d(6)) - (d(5) - d(4)) - kxy;
  const double x = entry.x;
  const double y = entry.y;
  const double z = entry.z;
  const double gx = kx + kxy * y + (kxz + kxyz * y) * z;
  const double gy = ky + kxy * x + (kyz + kxyz * x) * z;
  const double gz = kz + kxz * x + (kyz + kxyz * x) * y;
  CellCubic f;
  f.c0 = d(0) + kx * x + (ky + kxy * x) * y + (kz + kxz * x + (kyz + kxyz * x) * y) * z;
  f.c1 = gx * way.x + gy * way.y + gz * way.z;
  f.c2 = (kxy + kxyz * z) * way.x * way.y + (kxz + kxyz * y) * way.x * way.z + (kyz + kxyz * x) * way.y * way.z;
  f.c3 = kxyz * way.x * way.y * way.z;
  return f;
}

/// The gradient of a cell's field, in densities a sample.
inline DVec3 gradient_of(const CellCorners& corners, const DVec3& at) {
  const auto d = [&](std::size_t i) { return static_cast<double>(corners[i]); };
  const auto mix = [](double a, double b, double t) { return a + t * (b - a); };
  const auto bilinear = [&](double v00, double v10, double v01, double v11, double u, double v) {
    return mix(mix(v00, v10, u), mix(v01, v11, u), v);
  };
  return {bilinear(d(1) - d(0), d(3) - d(2), d(5) - d(4), d(7) - d(6), at.y, at.z),
          bilinear(d(2) - d(0), d(3) - d(1), d(6) - d(4), d(7) - d(5), at.x, at.z),
          bilinear(d(4) - d(0), d(5) - d(1), d(6) - d(2), d(7) - d(3), at.x, at.y)};
}

/// What is asked of a cell.
enum class CellAsk { Whether, Where };

/// The root of `f` between `low`, where it is not negative, and `high`, where it is, and between which it only falls.
inline double root_between(const CellCubic& f, double low, double high) {
  double f_low = f(low);
  double f_high = f(high);
  // Newton's steps from the chord's root, kept within the bracket; each halves it at least every other time.
  double s = low + (high - low) * (f_low / (f_low - f_high));
  for (int i = 0; i < 60; ++i) {
    const double value = f(s);
    if (value < 0.0) {
      high = s;
    } else {
      low = s;
    }
    if (!(high - low > 1e-15)) break;
    const double slope = f.slope(s);
    double next = s - value / slope;
    // Also where the slope is 0.
    if (!(next > low && next < high)) next = 0.5 * (low + high);
    if (std::abs(next - s) <= 1e-13) return next;
    s = next;
  }
  return s;
}

/// Where the cubic first becomes negative for 0 <= s <= 1; a negative number where it never does. With
/// CellAsk::Whether any number that is not negative says that it does.
template <CellAsk kAsk>
double first_negative(const CellCubic& f) {
  if (f.c0 < 0.0) return 0.0;
  const double b1 = f.c0 + f.c1 * (1.0 / 3.0);
  const double b2 = f.c0 + (2.0 * f.c1 + f.c2) * (1.0 / 3.0);
  const double b3 = f.c0 + f.c1 + f.c2 + f.c3;
  if (std::min(std::min(b1, b2), b3) >= 0.0) return -1.0;
  if (kAsk == CellAsk::Whether && b3 < 0.0) return 1.0;
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
    double first = q / a;
    double second = f.c1 / q;
    if (!(first <= second)) std::swap(first, second);
    for (const double extreme : {first, second}) {
      if (!(extreme > low && extreme < 1.0)) continue;
      if (f(extreme) < 0.0) return kAsk == CellAsk::Whether ? 1.0 : root_between(f, low, extreme);
      low = extreme;
    }
  }
  return b3 < 0.0 ? root_between(f, low, 1.0) : -1.0;
}

}  // namespace quoin::trace
