// The kernel for any processor: rays one by one.

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "trace/tree_view.h"

namespace quoin::trace {
namespace {

// The sign bits of the first three.
template <class I4>
inline int mask3(I4 a) {
  return (a[0] < 0 ? 1 : 0) | (a[1] < 0 ? 2 : 0) | (a[2] < 0 ? 4 : 0);
}

#include "trace/kernel_common.inl"

inline F4 floor_of(F4 a) {
  const F4 whole = __builtin_convertvector(__builtin_convertvector(a, I4), F4);
  return whole > a ? whole - 1.0F : whole;
}

#include "trace/single.inl"

template <Ask>
inline SingleHit trace_one(const TreeView& tree, const Ray& ray, double max_t) {
  return trace_single(tree, ray, max_t);
}

#include "trace/single_hit.inl"

void first_one_by_one(const TreeView& tree, const RayPacket& rays, PacketHits& hits, std::uint32_t& unfinished) {
  hits.hit = hits.starts_inside = unfinished = 0;
  for (std::uint32_t left = rays.active; left != 0; left &= left - 1) {
    const int lane = std::countr_zero(left);
    RayHit hit;
    bool is_unfinished = false;
    const double max_t = rays.max_t[static_cast<std::size_t>(lane)];
    if (first_single(tree, rays.ray(lane), max_t, hit, is_unfinished)) hits.set(lane, hit);
    unfinished |= std::uint32_t{is_unfinished} << lane;
  }
}

std::uint32_t any_one_by_one(const TreeView& tree, const RayPacket& rays, std::uint32_t& unfinished) {
  std::uint32_t blocked = unfinished = 0;
  for (std::uint32_t left = rays.active; left != 0; left &= left - 1) {
    const int lane = std::countr_zero(left);
    bool is_unfinished = false;
    const bool is_blocked = any_single(tree, rays.ray(lane), rays.max_t[static_cast<std::size_t>(lane)], is_unfinished);
    unfinished |= std::uint32_t{is_unfinished} << lane;
    blocked |= std::uint32_t{is_blocked} << lane;
  }
  return blocked;
}

}  // namespace

const Kernel kPlainKernel = {first_single, any_single, first_one_by_one, any_one_by_one};

}  // namespace quoin::trace
