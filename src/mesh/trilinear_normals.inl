// Unit gradients of trilinear cells, one register of lanes at a time. The arithmetic equals smooth/cell.h, step for
// step.

#pragma once

#ifdef QUOIN_KERNEL_AVX512
#include "mesh/smooth/lanes_avx512.h"
#else
#include "mesh/smooth/lanes_avx2.h"
#endif

#include "mesh/smooth/cell.h"

namespace quoin::smooth {
namespace {

struct Lanes3 {
  F x, y, z;
};

inline F bilinear(F v00, F v10, F v01, F v11, F u, F v) {
  const F a = v00 + u * (v10 - v00);
  const F b = v01 + u * (v11 - v01);
  return a + v * (b - a);
}

inline Lanes3 unit_normals(Lanes3 g) {
  const F q = (g.x * g.x + g.y * g.y) + g.z * g.z;
  const F half = all(0.5F) * q;
  F r = as_float(all(0x5F3759DF) - shift_right<1>(as_int(q)));
  for (int i = 0; i < 3; ++i) r = r * (all(1.5F) - (half * r) * r);
  const Mask none = q < all(kLeastSquaredGradient);
  const F zero = all(0.0F);
  return {select(none, zero, g.x * r), select(none, all(1.0F), g.y * r), select(none, zero, g.z * r)};
}

inline Lanes3 gradient_at(const F* d, Lanes3 f) {
  return {bilinear(d[1] - d[0], d[3] - d[2], d[5] - d[4], d[7] - d[6], f.y, f.z),
          bilinear(d[2] - d[0], d[3] - d[1], d[6] - d[4], d[7] - d[5], f.x, f.z),
          bilinear(d[4] - d[0], d[5] - d[1], d[6] - d[2], d[7] - d[3], f.x, f.y)};
}

inline Lanes3 normals_at(const F* d, Lanes3 f) {
  return unit_normals(gradient_at(d, f));
}

inline F snapped(F f) {
  return (f + all(128.0F)) - all(128.0F);
}

}  // namespace
}  // namespace quoin::smooth
