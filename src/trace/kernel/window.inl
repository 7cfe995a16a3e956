// Short rays that start near each other, as occlusion rays do. They all lie in a window of 4^3 bricks. Registers hold
// the brick indices of the window, and the rays walk from voxel to voxel without a test of 4^3 cells first.
//
//   a place in the window     bit | 17 16 | 15 14 | 13 12 | 11 10 | 9 8 | 7 6 | 5 4 | 3 2 | 1 0 |
//                                 |   z       y       x   |   y     z     x   |  z     y     x  |
//                                 | brick                 | cell of the brick | voxel of the cell |
//
// The upper six bits are the brick, the next seven the half word in it, and the lowest five the bit.

#pragma once

#include "trace/kernel/lockstep.inl"

namespace quoin::trace {
namespace {

// Copies a packet and puts an ordinary ray into its inactive lanes: subnormal numbers there would be slow.
inline RayPacket fill_inactive(const RayPacket& rays) {
  RayPacket filled;
  filled.active = rays.active;
  const auto fill = [&](const RayPacket::Lanes<double>& from, double other, RayPacket::Lanes<double>& to) {
    for (std::size_t first = 0; first < RayPacket::kSize; first += kDoubles) {
      const Longs is_active = (lane_bits() & static_cast<std::int64_t>(rays.active >> first)) != 0;
      const Doubles numbers = is_active ? some<Doubles>(from.data() + first) : Doubles{} + other;
      std::memcpy(to.data() + first, &numbers, sizeof numbers);
    }
  };
  fill(rays.origin_x, 0.0, filled.origin_x);
  fill(rays.origin_y, 0.0, filled.origin_y);
  fill(rays.origin_z, 0.0, filled.origin_z);
  fill(rays.direction_x, 1.0, filled.direction_x);
  fill(rays.direction_y, 1.0, filled.direction_y);
  fill(rays.direction_z, 1.0, filled.direction_z);
  fill(rays.max_t, 0.0, filled.max_t);
  return filled;
}

// Prefetches the packet that follows in memory, if there is one. Reading it takes a fifth of its time otherwise.
inline void fetch_next(const RayPacket& rays) {
  const auto* const next = reinterpret_cast<const char*>(&rays) + sizeof rays;
  for (std::size_t i = 0; i < sizeof rays; i += 64) __builtin_prefetch(next + i);
}

inline bool is_full(const RayPacket& rays) {
  constexpr std::uint32_t kAll = (1U << RayPacket::kSize) - 1;
  return (rays.active & kAll) == kAll;
}

// Calls `trace` with the packet, its inactive lanes filled, and prefetches the next packet.
template <class Trace>
[[gnu::always_inline]] inline auto trace_filled(const RayPacket& rays, Trace&& trace) {
  fetch_next(rays);
  return is_full(rays) ? trace(rays) : trace(fill_inactive(rays));
}

// A place in a window, from the lowest bits: x, y, z of the voxel in its cell; x, z, y of the cell in its brick, in
// storage order; x, y, z of the brick.
constexpr int kAxisBits[3] = {3 | 3 << 6 | 3 << 12, 3 << 2 | 3 << 10 | 3 << 14, 3 << 4 | 3 << 8 | 3 << 16};
constexpr int kWindow = 64;
// In voxels, along any axis. Most longer rays leave the window.
constexpr float kShortReach = 22.0F;
// An axis with a direction component smaller than the greatest by more than this factor does not count in `doubt`.
constexpr float kShortRatio = 2048.0F;

template <int kAxis>
inline I spread(I coordinate) {
  constexpr int kInCell = 2 * kAxis;
  constexpr int kCell = kAxis == 0 ? 4 : kAxis == 1 ? 8 : 6;
  return shift_left<kInCell>(coordinate & all(3)) + shift_left<kCell>(coordinate & all(12)) +
         shift_left<8 + kInCell>(coordinate & all(48));
}

// The step of one axis in spread numbers.
struct SpreadStep {
  I fill;
  I add;
};

template <int kAxis>
inline SpreadStep spread_step(const Axis& axis) {
  constexpr int kOne = 1 << (2 * kAxis);
  return {select(axis.forward, all(~kAxisBits[kAxis]), all(0)), select(axis.forward, all(kOne), all(-kOne))};
}

// The start state of rays in a window.
struct ShortRays {
  Lanes lanes;
  Planes planes;  // the next planes to cross
  I code;         // the place
  F max_t;
  F doubt;        // bound of the error of the times when they cross planes
  Mask doubtful;  // `doubt` is no bound for them; only double precision can decide
};

// Returns the lower end of a window along an axis for rays that start near `position`; may lie outside the table.
inline int place_window(double position) {
  return (static_cast<int>(position) - 24) & ~15;
}

// Sets up one axis. Returns the lanes that stay within the window along it.
template <int kAxis>
inline Mask start_in_window(ShortRays& rays, Axis& axis, F& plane, const double* position, double corner, F direction,
                            int origin) {
  F whole;
  axis = make_axis(position, corner, direction, whole);
  plane = select(axis.still, all(kNever), add_if(axis.forward, whole, all(1.0F)));
  const I at = to_int(whole) + axis.base - all(origin);
  rays.code = rays.code + spread<kAxis>(at);
  const F reach = abs(axis.direction) * rays.max_t;
  const I margin = to_int(reach) + all(2);
  const I from = at - margin;
  // Distant starts give arbitrary integers, but not integers in this range. NaN and infinity fail the comparison.
  const Mask is_near = equals(at & all(~(kWindow - 1)), 0) & (whole <= all(kChunkSize));
  return is_near & (reach <= all(kShortReach)) & (all(-1) < from) & (from + margin + margin < all(kWindow));
}

// Bounds the error of the times when rays cross planes of one axis.
inline void doubt_axis(const Axis& axis, F plane, F greatest, ShortRays& rays) {
  const F doubt = select(axis.still, all(0.0F), all(kDoubt) * abs(axis.inverse));
  const Mask is_tiny = all(kDoubt * kShortRatio) < doubt * greatest;
  rays.doubt = max(rays.doubt, select(is_tiny, all(0.0F), doubt));
  rays.doubtful = rays.doubtful | (is_tiny & (crossing_t(axis, plane) <= rays.max_t + doubt));
}

// Returns the rays that stay within the window.
inline std::uint32_t set_up_short(const TreeView& tree, const Rays& rays, Mask wanted, const IVec3& origin,
                                  ShortRays& out) {
  const F dx = narrow(rays.directions[0]);
  const F dy = narrow(rays.directions[1]);
  const F dz = narrow(rays.directions[2]);
  const F greatest = max(max(abs(dx), abs(dy)), abs(dz));
  Lanes& lanes = out.lanes;
  lanes.reach_scale = greatest;
  out.max_t = narrow(rays.max_t);
  out.code = all(0);
  // A limit just below zero may have been rounded to zero.
  const Mask is_negative = test(as_int(out.max_t), all(std::numeric_limits<std::int32_t>::min()));
  const Mask usual = ~is_negative & (all(0.0F) <= out.max_t) & (all(0x1p-20F) <= greatest) & (greatest <= all(0x1p20F));
  const Mask fits = start_in_window<0>(out, lanes.x, out.planes.x, rays.origins[0], tree.origin.x, dx, origin.x) &
                    start_in_window<1>(out, lanes.y, out.planes.y, rays.origins[1], tree.origin.y, dy, origin.y) &
                    start_in_window<2>(out, lanes.z, out.planes.z, rays.origins[2], tree.origin.z, dz, origin.z);
  const Mask here = wanted & usual & fits;
  out.doubt = all(0.0F);
  out.doubtful = mask_of(0);
  doubt_axis(lanes.x, out.planes.x, greatest, out);
  doubt_axis(lanes.y, out.planes.y, greatest, out);
  doubt_axis(lanes.z, out.planes.z, greatest, out);
  lanes.live = here & ~out.doubtful;
  out.doubtful = out.doubtful & here;
  return bits(here);
}

// Walks rays to their ends through the voxels of a window. Calls `meet(met, unsure)` at each step. The lanes of `met`
// are in occupied voxels, with places in `rays.code`; lanes of `unsure` may have ended before. `meet` returns the
// lanes that stop.
template <class Meet>
[[gnu::always_inline]] inline void walk_window(const TreeView& tree, const IVec3& origin, ShortRays& rays,
                                               Meet&& meet) {
  const BrickWindow window(tree, origin);
  const Lanes& lanes = rays.lanes;
  const SpreadStep sx = spread_step<0>(lanes.x);
  const SpreadStep sy = spread_step<1>(lanes.y);
  const SpreadStep sz = spread_step<2>(lanes.z);
  const Planes one = steps_of(lanes, 1.0F);
  const F sure_t = rays.max_t - rays.doubt;
  const F last_t = rays.max_t + rays.doubt;
  Mask walking = lanes.live;
  Mask unsure = mask_of(0);
  for (;;) {
    const I half = half_of(window.brick(shift_right<12>(rays.code)), shift_left<20>(rays.code));
    const Mask met = walking & test_bit(gather(tree.words, half), rays.code);
    walking = walking & ~meet(met, unsure);
    Crossing crossing;
    const F now = first_of(crossings(lanes, rays.planes), crossing);
    step_over(crossing, one, rays.planes);
    const I bits_of_axis = crossed(crossing, all(kAxisBits[0]), all(kAxisBits[1]), all(kAxisBits[2]));
    const I filled = (rays.code & bits_of_axis) | crossed(crossing, sx.fill, sy.fill, sz.fill);
    const I moved = filled + crossed(crossing, sx.add, sy.add, sz.add);
    rays.code = merge(bits_of_axis, moved, rays.code);
    unsure = sure_t <= now;
    walking = walking & (now <= last_t);
    if (!any(walking)) return;
  }
}

// Returns the lanes that hit a voxel. Only double precision can decide for those that it adds to `doubtful`.
inline Mask walk_short(const TreeView& tree, const IVec3& origin, ShortRays& rays) {
  Mask hit = mask_of(0);
  walk_window(tree, origin, rays, [&](Mask met, Mask unsure) {
    hit = hit | met;
    rays.doubtful = rays.doubtful | (met & unsure);
    return met;
  });
  return hit;
}

// The coordinate of a place in its window.
template <int kAxis>
inline I gathered(I place) {
  constexpr int kInCell = 2 * kAxis;
  constexpr int kCell = kAxis == 0 ? 4 : kAxis == 1 ? 8 : 6;
  return (shift_right<kInCell>(place) & all(3)) + (shift_right<kCell>(place) & all(12)) +
         (shift_right<8 + kInCell>(place) & all(48));
}

// Walks short rays, one window at a time, with `walk(origin, rays)`; a window begins at `origin`. Returns the remaining
// rays.
template <class Walk>
[[gnu::always_inline]] inline std::uint32_t trace_short(const TreeView& tree, const RayPacket& packet, int first,
                                                        std::uint32_t wanted, Walk&& walk) {
  constexpr int kMostWindows = 3;
  for (int i = 0; i < kMostWindows && wanted != 0; ++i) {
    const auto lane = static_cast<std::size_t>(first + std::countr_zero(wanted));
    const Ray ray = packet.ray(static_cast<int>(lane));
    const DVec3 reach = glm::abs(ray.direction) * packet.max_t[lane];
    if (!(std::max(std::max(reach.x, reach.y), reach.z) <= kShortReach)) return wanted;
    const DVec3 start = ray.origin - tree.origin;
    const IVec3 size = tree.brick_sizes * 16;
    const auto is_in = [](double at, int end) { return at >= 0.0 && at < end; };
    if (!(is_in(start.x, size.x) && is_in(start.y, size.y) && is_in(start.z, size.z))) return wanted;
    const IVec3 origin{place_window(start.x), place_window(start.y), place_window(start.z)};
    ShortRays rays;
    const std::uint32_t here = set_up_short(tree, lanes_from(packet, first), mask_of(wanted), origin, rays);
    // Packets with few rays in a common window do not benefit from it.
    if (2 * std::popcount(here) < std::popcount(wanted)) return wanted;
    walk(origin, rays);
    wanted &= ~here;
  }
  return wanted;
}

}  // namespace
}  // namespace quoin::trace
