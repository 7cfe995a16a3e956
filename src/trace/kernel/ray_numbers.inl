// Shared code of the kernels for single rays and for packets: constants, vectors of four numbers, start positions of
// rays, and the results of a walk.
//
//   F4, I4, D4                  | x | y | z | - |
//   a ray's position            64 k + rest, k and rest by axis; only the rest, below 64, is ever a float
//
//   a voxel as walks count it   bit | 16 |15 14| 13 |12 11| 10 | 9 8 | 7 6 | 5 4 | 3 2 | 1 0 |
//                                   | left z   | left y   | left x   |     |  z  |  y  |  x  |
//
// The lower six bits are the position in the cell's word. A step out of the cell carries into a `left` bit.

#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>

#ifdef QUOIN_KERNEL_AVX2
#include <immintrin.h>
#endif

#include <quoin/core/assert.h>

#include "trace/kernel/ray_kernel.h"

namespace quoin::trace {
namespace {

// Beyond any crossing; adding a step does not change it.
constexpr float kNever = 1e37F;
constexpr float kEndless = std::numeric_limits<float>::infinity();
// The range of a lane along its greatest component. Single precision is not exact enough beyond it.
constexpr float kReach = 2048.0F;
// The maximum distance of a ray's start from the bounds. Rays from farther away are moved to the bounds first.
constexpr float kNearby = 64.0F;
// An upper bound of the rounding error of a ray's end, in voxels.
constexpr float kSlack = 0.02F;
// An upper bound of the rounding error of a short ray's crossing, in voxels along its axis: an origin below 64 by 2^-17
// at most, its distance to a plane by 2^-18, and products by 2^-22 of 22 voxels.
constexpr float kDoubt = 4e-5F;

// A voxel of a cell in kernels: x + 4 y + 16 z, plus 256 times x + 8 y + 64 z. Bits 2, 5 and 8 of the latter are set
// when a step has left the cell.
constexpr int kCodeX = 1 + 256;
constexpr int kCodeY = 4 + 256 * 8;
constexpr int kCodeZ = 16 + 256 * 64;
constexpr int kLeft = 256 * (4 + 4 * 8 + 4 * 64);

// Four numbers in a register: x, y, z and an unused one. The unused lane of divisors is 1, of positions 0: processors
// take a slow path for subnormal numbers, even in unused lanes.
using F4 = float __attribute__((vector_size(16)));
using I4 = std::int32_t __attribute__((vector_size(16)));
using D4 = double __attribute__((vector_size(32)));

#ifdef QUOIN_KERNEL_AVX2
// Returns the sign bits of the first three lanes.
inline int mask3(I4 a) {
  return _mm_movemask_ps(_mm_castsi128_ps(reinterpret_cast<__m128i>(a))) & 7;
}
inline F4 floor4(F4 a) {
  return reinterpret_cast<F4>(_mm_floor_ps(reinterpret_cast<__m128>(a)));
}
inline D4 floor4(D4 a) {
  return reinterpret_cast<D4>(_mm256_floor_pd(reinterpret_cast<__m256d>(a)));
}
#else
inline int mask3(I4 a) {
  return (a[0] < 0 ? 1 : 0) | (a[1] < 0 ? 2 : 0) | (a[2] < 0 ? 4 : 0);
}
inline F4 floor4(F4 a) {
  const F4 whole = __builtin_convertvector(__builtin_convertvector(a, I4), F4);
  return whole > a ? whole - 1.0F : whole;
}
#endif
inline F4 min4(F4 a, F4 b) {
  return a < b ? a : b;
}
inline F4 max4(F4 a, F4 b) {
  return a > b ? a : b;
}
inline F4 all4(float x) {
  return F4{x, x, x, x};
}
// Minimum and maximum of the first three lanes.
inline float least3(F4 a) {
  return std::min(std::min(a[0], a[1]), a[2]);
}
inline float greatest3(F4 a) {
  return std::max(std::max(a[0], a[1]), a[2]);
}

// The query of a single ray: the hit position, or only a yes or no.
enum class Ask : std::uint8_t { Where, Whether };

enum class SetUp : std::uint8_t { Ready, Misses, Unusual };

// A ray in registers.
struct RayNumbers {
  D4 position;  // from the tables' origin
  F4 direction;
  F4 size;  // absolute values of the components
  float greatest;
};

inline RayNumbers read_ray(const TreeView& tree, const Ray& ray) {
  static_assert(sizeof(Ray) == 6 * sizeof(double));
  D4 position;
  D4 direction;
  D4 corner;
  std::memcpy(&position, &ray.origin.x, sizeof position);
  std::memcpy(&direction, &ray.origin.z, sizeof direction);
  std::memcpy(&corner, tree.corner, sizeof corner);
  const F4 d = __builtin_convertvector(__builtin_shufflevector(direction, D4{1.0, 1.0, 1.0, 1.0}, 1, 2, 3, 4), F4);
  const F4 size = max4(d, -d);
  position = __builtin_shufflevector(position - corner, D4{}, 0, 1, 2, 4);  // its last lane held the direction's x
  return {position, d, size, greatest3(size)};
}

struct SingleHit {
  bool is_hit = false;
  bool is_unfinished = false;
  int axis = -1;  // axis of the face; -1 if the ray starts inside
  IVec3 voxel{0};
};

// The start of a ray, in voxels from the tables' origin.
struct Move {
  double position[3];
  double max_t;
  int entered = -1;  // axis of the bounds' plane that the ray was moved to; -1: not moved
};

// Moves one distant ray to its entry into the bounds. Returns false if it misses them.
inline bool move_to_bounds(const TreeView& tree, const double direction[3], Move& ray) {
  double enter_t = -1.0;
  int enter_axis = -1;
  for (int axis = 0; axis < 3; ++axis) {
    const double p = ray.position[axis];
    const double d = direction[axis];
    if (std::isnan(p)) return false;
    const bool is_low = p < tree.box.min[axis];
    if (!is_low && p < tree.box.max[axis]) continue;
    if (is_low ? !(d > 0.0) : !(d < 0.0)) return false;
    const double t = ((is_low ? tree.box.min[axis] : tree.box.max[axis]) - p) * (1.0 / d);
    if (t >= enter_t) {
      enter_t = t;
      enter_axis = axis;
    }
  }
  if (enter_axis < 0) return true;
  // Not exact: the distance of the face decides at the end, and rounds differently.
  if (!(enter_t <= ray.max_t * 1.000001)) return false;
  for (int axis = 0; axis < 3; ++axis) {
    const double plane = direction[axis] > 0.0 ? tree.box.min[axis] : tree.box.max[axis];
    const double p = axis == enter_axis ? plane : ray.position[axis] + enter_t * direction[axis];
    // On the other axes, the ray is inside by now or never will be.
    if (!(p >= tree.box.min[axis] - 1e-3 && p <= tree.box.max[axis] + 1e-3)) return false;
    ray.position[axis] = p;
  }
  ray.max_t = std::max(ray.max_t - enter_t, 0.0);
  ray.entered = enter_axis;
  return true;
}

// Moves the start of a distant ray to its entry into the bounds. Returns false if it misses them.
inline bool bring_near(const TreeView& tree, const Ray& ray, double max_t, D4& position, float& limit, int& moved) {
  const double direction[3] = {ray.direction.x, ray.direction.y, ray.direction.z};
  Move move{{position[0], position[1], position[2]}, max_t, -1};
  if (!move_to_bounds(tree, direction, move)) return false;
  position = D4{move.position[0], move.position[1], move.position[2], 0.0};
  limit = static_cast<float>(move.max_t);
  moved = move.entered;
  return true;
}

inline double distance_of(const TreeView& tree, const Ray& ray, const SingleHit& found) {
  QUOIN_ASSERT(found.is_hit && found.axis >= 0 && found.axis < 3, "a hit on a face");
  const double d = ray.direction[found.axis];
  const double plane = found.voxel[found.axis] + tree.origin[found.axis] + (d > 0.0 ? 0.0 : 1.0);
  return (plane - ray.origin[found.axis]) * (1.0 / d);
}

// Traces a single ray and computes the hit in double precision. `Tracer::trace<kAsk>` walks the ray; with Ask::Whether
// it may omit the position.
template <class Tracer>
inline bool first_single(const TreeView& tree, const Ray& ray, double max_t, RayHit& hit, bool& unfinished) {
  const SingleHit found = Tracer::template trace<Ask::Where>(tree, ray, max_t);
  unfinished = found.is_unfinished;
  if (!found.is_hit) return false;
  hit.voxel = found.voxel + IVec3(tree.origin);
  hit.starts_inside = found.axis < 0;
  hit.t = hit.starts_inside ? 0.0 : distance_of(tree, ray, found);
  if (!hit.starts_inside) hit.face = static_cast<Direction>(2 * found.axis + (ray.direction[found.axis] > 0.0 ? 1 : 0));
  return hit.t <= max_t;
}

// Returns true if the ray is blocked.
template <class Tracer>
inline bool any_single(const TreeView& tree, const Ray& ray, double max_t, bool& unfinished) {
  if (max_t == std::numeric_limits<double>::infinity()) {
    const SingleHit found = Tracer::template trace<Ask::Whether>(tree, ray, max_t);
    unfinished = found.is_unfinished;
    return found.is_hit;
  }
  const SingleHit found = Tracer::template trace<Ask::Where>(tree, ray, max_t);
  unfinished = found.is_unfinished;
  return found.is_hit && (found.axis < 0 ? 0.0 : distance_of(tree, ray, found)) <= max_t;
}

}  // namespace
}  // namespace quoin::trace
