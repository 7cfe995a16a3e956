#pragma once

// The arithmetic of one cell with densities of any size, for mesh/nets/cell.h.
//
// Each crossing has its own division. The chunk kernels divide once for four crossings, which is safe for half
// densities. Here densities may have any size, and a product of four would overflow or underflow.

#include <cmath>
#include <cstddef>
#include <type_traits>

#include <quoin/core/vec.h>

#include "mesh/array/array_kernel.h"
#include "mesh/nets/cell.h"

namespace quoin::array {

using smooth::all_of;
using smooth::edge_end;
using smooth::edge_start;
using smooth::NumberOf;
using smooth::only;
using smooth::select;
using smooth::signs_differ;
using smooth::unit_normal;

// NaN counts as air, at the greatest distance from the surface of all corners.
template <class D>
void make_finite(D& d) {
  using F = NumberOf<D>;
  using std::abs;
  const F far = all_of<F>(kFarthest);
  const F near = all_of<F>(-kFarthest);
  F most = all_of<F>(0.0F);
  for (int i = 0; i < 8; ++i) {
    d[i] = select(far < d[i], far, d[i]);
    d[i] = select(d[i] < near, near, d[i]);
    const F size = abs(d[i]);
    most = select(most < size, size, most);
  }
  for (int i = 0; i < 8; ++i) d[i] = select(d[i] == d[i], d[i], most);
}

// Returns the crossing of an edge between densities of different signs, as a fraction of the edge.
template <class F>
F crossing_of(F a, F b) {
  const F zero = all_of<F>(0.0F);
  const F t = select(a == zero, all_of<F>(kLeastFraction), a / (a - b));
  return select(b == zero, all_of<F>(1.0F - kLeastFraction), t);
}

// Scales the vector so that its square is a finite number, then normalizes it.
template <class V>
V unit_of_any(V g) {
  using F = std::remove_cvref_t<decltype(g.x)>;
  using std::abs;
  const F least = all_of<F>(kLeastGradient);
  F most = abs(g.x);
  most = select(most < abs(g.y), abs(g.y), most);
  most = select(most < abs(g.z), abs(g.z), most);
  const F inverse = all_of<F>(1.0F) / select(most < least, least, most);
  return unit_normal(V{g.x * inverse, g.y * inverse, g.z * inverse});
}

// The field of an array for cell_vertex.
struct ArrayField {
  const float* gradient_scale = nullptr;

  template <class D>
  [[nodiscard]] static NumberOf<D> sum_of_crossings(const D& d, int axis) {
    using F = NumberOf<D>;
    F t[4];
    for (std::size_t i = 0; i < 4; ++i) {
      const std::size_t edge = 4 * static_cast<std::size_t>(axis) + i;
      const F a = d[edge_start(edge)];
      const F b = d[edge_end(edge)];
      t[i] = only(signs_differ(a, b), crossing_of(a, b));
    }
    return (t[0] + t[1]) + (t[2] + t[3]);
  }
  template <class V>
  [[nodiscard]] V normal_of(V g) const {
    using F = std::remove_cvref_t<decltype(g.x)>;
    const float* const scale = gradient_scale;
    return unit_of_any(V{g.x * all_of<F>(scale[0]), g.y * all_of<F>(scale[1]), g.z * all_of<F>(scale[2])});
  }
};

}  // namespace quoin::array
