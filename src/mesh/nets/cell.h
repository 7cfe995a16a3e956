#pragma once

// One cell of Surface Nets: its corners, its edges with their crossings, and its vertex. Shared by density fields and
// arrays. Templates compute a single number (float) or a register of lanes, in one order of operations without
// contraction, so every kernel gives the same bits. Kernels inline everything that they do not call with lanes.
//
//   corners   x + 2 y + 4 z
//   edges     4 * axis + du + 2 dv of the edge's start, where u and v are the next two axes

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <utility>

#include <quoin/core/assert.h>
#include <quoin/core/vec.h>

namespace quoin::smooth {

inline IVec3 unit_axis(int axis) {
  QUOIN_ASSERT(axis >= 0 && axis < 3, "0 <= axis < 3");
  IVec3 unit{0};
  unit[axis] = 1;
  return unit;
}

/// Returns the offset of a cell's corner from its first corner, in cells.
inline IVec3 corner_place(int corner) {
  QUOIN_ASSERT(corner >= 0 && corner < 8, "0 <= corner < 8");
  return {corner & 1, corner >> 1 & 1, corner >> 2};
}

inline int corner_at(IVec3 place) {
  return place.x + 2 * place.y + 4 * place.z;
}
inline bool is_solid_corner(std::uint32_t solid, int corner) {
  return (solid >> corner & 1U) != 0;
}

inline constexpr std::size_t kEdges = 12;

/// Returns the edge along an axis that starts at a corner.
inline std::size_t edge_at(int axis, IVec3 start) {
  return static_cast<std::size_t>(4 * axis + start[(axis + 1) % 3] + 2 * start[(axis + 2) % 3]);
}

/// Returns the first corner of an edge.
[[gnu::always_inline]] constexpr std::size_t edge_start(std::size_t edge) {
  const std::size_t axis = edge / 4;
  return (edge & 1U) << (axis + 1) % 3 | (edge >> 1 & 1U) << (axis + 2) % 3;
}

/// Returns the second corner of an edge.
[[gnu::always_inline]] constexpr std::size_t edge_end(std::size_t edge) {
  return edge_start(edge) + (std::size_t{1} << edge / 4);
}

/// Densities of the corners.
using Corners = std::array<float, 8>;

/// Returns the solid corners as bits. A corner is solid below 0; -0 and 0 are air.
inline std::uint32_t solid_corners(const Corners& d) {
  std::uint32_t solid = 0;
  for (std::size_t i = 0; i < 8; ++i) solid |= static_cast<std::uint32_t>(d[i] < 0.0F) << i;
  return solid;
}

// The operations of lanes (core/lanes, mesh/nets/cell_lanes.inl) for single numbers.

/// Repeats a number in every lane.
template <class F>
F all_of(float value);
template <>
inline float all_of<float>(float value) {
  return value;
}
inline float select(bool condition, float a, float b) {
  return condition ? a : b;
}
[[gnu::always_inline]] inline std::uint32_t select(bool condition, std::uint32_t a, std::uint32_t b) {
  return condition ? a : b;
}
/// Returns 0 where the condition is false, without a branch: crossed edges are unpredictable.
inline float only(bool condition, float a) {
  return std::bit_cast<float>(std::bit_cast<std::uint32_t>(a) & (0U - std::uint32_t{condition}));
}
inline bool signs_differ(float a, float b) {
  return (a < 0.0F) != (b < 0.0F);
}
/// Returns 1 / sqrt(x) within a few percent.
inline float guess_of_root(float x) {
  return std::bit_cast<float>(0x5F37'59DFU - (std::bit_cast<std::uint32_t>(x) >> 1));
}
template <class T, std::size_t kSize>
T look_up(const std::array<T, kSize>& table, std::uint32_t index) {
  return table[index];
}
/// Returns a byte of a number.
template <int kByte>
std::uint32_t byte_of(std::uint32_t bits) {
  return bits >> (8 * kByte) & 0xFFU;
}
inline float to_float(std::uint32_t small) {
  return static_cast<float>(static_cast<std::int32_t>(small));
}

/// The type of vectors of numbers.
template <class F>
struct Lanes3 {
  F x, y, z;
};
template <class F>
using VectorOf = std::conditional_t<std::is_same_v<F, float>, Vec3, Lanes3<F>>;

/// The type of the numbers in an array of corners.
template <class D>
using NumberOf = std::remove_cvref_t<decltype(std::declval<D>()[0])>;

/// Interpolates between four values at the corners of a unit square: first along u, then along v.
template <class F>
F bilinear(F v00, F v10, F v01, F v11, F u, F v) {
  const F a = v00 + u * (v10 - v00);
  const F b = v01 + u * (v11 - v01);
  return a + v * (b - a);
}

/// Returns the gradient of the trilinear field at a point of the cell.
template <class D, class V>
V trilinear_gradient(const D& d, V f) {
  return {bilinear(d[1] - d[0], d[3] - d[2], d[5] - d[4], d[7] - d[6], f.y, f.z),
          bilinear(d[2] - d[0], d[3] - d[1], d[6] - d[4], d[7] - d[5], f.x, f.z),
          bilinear(d[4] - d[0], d[5] - d[1], d[6] - d[2], d[7] - d[3], f.x, f.y)};
}

/// Gradients with a smaller square have no direction.
inline constexpr float kLeastSquaredGradient = 1e-30F;

/// Normalizes a gradient with multiplications only, accurate to about 1e-7. Returns (0, 1, 0) if it has no direction.
template <class V>
V unit_normal(V g) {
  using F = std::remove_cvref_t<decltype(g.x)>;
  const F q = (g.x * g.x + g.y * g.y) + g.z * g.z;
  const F half = all_of<F>(0.5F) * q;
  F r = guess_of_root(q);
  for (int i = 0; i < 3; ++i) r = r * (all_of<F>(1.5F) - (half * r) * r);
  const auto has_direction = all_of<F>(kLeastSquaredGradient) <= q;
  return {only(has_direction, g.x * r), select(has_direction, g.y * r, all_of<F>(1.0F)), only(has_direction, g.z * r)};
}

/// Rounds a number from 0 to 1 to a multiple of 1/65,536.
template <class F>
F snap(F f) {
  return (f + all_of<F>(128.0F)) - all_of<F>(128.0F);
}

/// 1 / n for n = 0 to 12 crossings.
inline constexpr std::array<float, 16> kReciprocals = {
    0.0F,        1.0F,        1.0F / 2.0F,  1.0F / 3.0F,  1.0F / 4.0F,  1.0F / 5.0F, 1.0F / 6.0F, 1.0F / 7.0F,
    1.0F / 8.0F, 1.0F / 9.0F, 1.0F / 10.0F, 1.0F / 11.0F, 1.0F / 12.0F, 0.0F,        0.0F,        0.0F};

/// The number of crossed edges by solid corners, a byte each: at the high end of x, y and z, and in total.
inline constexpr auto kCrossedEdges = [] {
  std::array<std::uint32_t, 256> counts{};
  for (std::uint32_t solid = 0; solid < 256; ++solid) {
    for (std::size_t edge = 0; edge < kEdges; ++edge) {
      const std::size_t start = edge_start(edge);
      if ((solid >> start & 1U) == (solid >> edge_end(edge) & 1U)) continue;
      for (std::size_t axis = 0; axis < 3; ++axis) counts[solid] += (start >> axis & 1U) << 8 * axis;
      counts[solid] += 1U << 24;
    }
  }
  return counts;
}();

/// The vertex of a cell.
template <class V>
struct VertexOf {
  V fraction;  ///< 0 to 1 within the cell, not rounded; used for normals
  V snapped;   ///< rounded to 1/65,536, so that sums with integers are exact; used for positions and occlusion
  V normal;    ///< unit, into the air
};
using CellVertex = VertexOf<Vec3>;

template <class V>
VertexOf<V> vertex_at(V fraction, V normal) {
  return {fraction, {snap(fraction.x), snap(fraction.y), snap(fraction.z)}, normal};
}

// A field computes the parts that depend on the range of densities:
//
//   F sum_of_crossings(d, axis)    the sum of the fractions where the four edges along an axis are crossed
//   V normal_of(gradient)

/// Returns the mean of the crossings of a cell that the surface crosses.
template <class Field, class D, class I>
VectorOf<NumberOf<D>> mean_of_crossings(const Field& field, const D& d, I solid) {
  const I counts = look_up(kCrossedEdges, solid);
  const auto inverse = look_up(kReciprocals, byte_of<3>(counts));
  return {(field.sum_of_crossings(d, 0) + to_float(byte_of<0>(counts))) * inverse,
          (field.sum_of_crossings(d, 1) + to_float(byte_of<1>(counts))) * inverse,
          (field.sum_of_crossings(d, 2) + to_float(byte_of<2>(counts))) * inverse};
}

/// Returns the vertex of a cell that the surface crosses: the mean of its crossings, with the gradient there.
template <class Field, class D, class I>
VertexOf<VectorOf<NumberOf<D>>> cell_vertex(const Field& field, const D& d, I solid) {
  const auto fraction = mean_of_crossings(field, d, solid);
  return vertex_at(fraction, field.normal_of(trilinear_gradient(d, fraction)));
}

// The four cells around an edge, counter-clockwise as seen from the end of its axis. Bits 0 and 1: the cell is before
// the edge in u and in v, so they are also du + 2 dv of the edge in the cell.
inline constexpr std::array<unsigned, 4> kCellsAround = {3, 2, 0, 1};

/// Returns the cells around an edge along `axis` that starts at `p`.
inline std::array<IVec3, 4> cells_around(IVec3 p, int axis) {
  const IVec3 u = unit_axis((axis + 1) % 3);
  const IVec3 v = unit_axis((axis + 2) % 3);
  return {p - u - v, p - v, p, p - u};
}

/// The corners of a quad's triangles: (a, b, c) and (a, c, d).
template <class T>
struct TrianglePair {
  T a, b, c, d;
};

/// Splits the quad of the cells around an edge. The triangles face along the edge's axis where `faces_along` is true.
/// The diagonal ends at corner 1 where `from_second` is true, otherwise at corner 0.
template <class T, class Condition>
[[gnu::always_inline]] inline TrianglePair<T> split_quad(const T& q0, const T& q1, const T& q2, const T& q3,
                                                         Condition faces_along, Condition from_second) {
  const T second = select(faces_along, q1, q3);
  const T fourth = select(faces_along, q3, q1);
  return {select(from_second, second, q0), select(from_second, q2, second), select(from_second, fourth, q2),
          select(from_second, q0, fourth)};
}

}  // namespace quoin::smooth
