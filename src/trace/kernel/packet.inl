// What packets of rays come to: the walks' voxels and faces, and their distances in double precision; and whether short
// rays that start near each other are blocked: occlusion rays. These all lie in a window of 4^3 bricks, whose indices
// are kept beside the lanes, and walk from voxel to voxel without cells in between.
//
//   a place in the window     bit | 17 16 | 15 14 | 13 12 | 11 10 | 9 8 | 7 6 | 5 4 | 3 2 | 1 0 |
//                                 |   z       y       x   |   z     y     x   |  z     y     x  |
//                                 | brick                 | cell of the brick | voxel of the cell |
//
// The upper six bits are the brick, the next seven the half word in it, and the lowest five the bit.

#pragma once

#ifndef QUOIN_KERNEL_AVX512
#include "trace/kernel/beam.inl"
#endif
#include "trace/kernel/lockstep.inl"
#include "trace/kernel/single.inl"

namespace quoin::trace {
namespace {

// What is known of the lanes that were asked about.
struct LaneHits {
  std::uint32_t hit = 0;
  std::uint32_t starts_inside = 0;
  std::uint32_t unfinished = 0;                  // went further than a kernel goes: to be traced in double precision
  RayPacket::Lanes<std::int32_t> x{}, y{}, z{};  // voxels, from the tables' origin
  RayPacket::Lanes<std::int32_t> axis{};         // of the face
};

template <Ask kAsk>
inline Met trace(const TreeView& tree, Lanes& lanes, F t, const Crossing& entered) {
  Met met{mask_of(0), mask_of(0), all(0), all(0), all(0), all(0)};
#ifndef QUOIN_KERNEL_AVX512  // lockstep in AVX-512 serves packets of every kind as well as beams would, or better
  lanes.live = trace_beam(tree, lanes, t, entered, met);
  if (!any(lanes.live)) return met;
#endif
  return trace_apart<kAsk>(tree, lanes, t, entered, met);
}

inline void keep(const Met& met, int first, LaneHits& out) {
  out.hit |= bits(met.hit) << first;
  out.starts_inside |= bits(met.inside) << first;
  store(out.x.data() + first, met.x);
  store(out.y.data() + first, met.y);
  store(out.z.data() + first, met.z);
  store(out.axis.data() + first, met.axis);
}

inline void trace_packet(const TreeView& tree, const RayPacket& rays, LaneHits& out) {
  for (int first = 0; first < RayPacket::kSize; first += kWidth) {
    const std::uint32_t wanted = rays.active >> first & kAllLanes;
    if (wanted == 0) continue;
    F t;
    Crossing entered;
    Lanes lanes = set_up(tree, rays, first, wanted, t, entered);
    if (any(lanes.live)) keep(trace<Ask::Where>(tree, lanes, t, entered), first, out);
    out.unfinished |= bits(lanes.unfinished) << first;
  }
  out.unfinished &= ~out.hit;
}

// Lanes in double precision, as many as a register holds.
using Doubles = double __attribute__((vector_size(kDoubles * 8)));
using Longs = std::int64_t __attribute__((vector_size(kDoubles * 8)));
using Ints = std::int32_t __attribute__((vector_size(kDoubles * 4)));

template <class Vector, class T>
inline Vector lanes_at(const RayPacket::Lanes<T>& from, std::size_t first) {
  Vector out;
  std::memcpy(&out, from.data() + first, sizeof out);
  return out;
}

// The distances of the faces met by the lanes from `first` on, in double precision, and which way rays go through them,
// 1 where forward; returns the lanes within reach.
inline std::uint32_t measure_some(const TreeView& tree, const RayPacket& rays, const LaneHits& lanes, std::size_t first,
                                  RayPacket::Lanes<double>& t, RayPacket::Lanes<std::int32_t>& forward) {
  const Longs axis = __builtin_convertvector(lanes_at<Ints>(lanes.axis, first), Longs);
  const Longs is_x = axis == 0;
  const Longs is_y = axis == 1;
  const auto of_axis = [&](const auto& x, const auto& y, const auto& z) {
    const auto y_or_z = is_y ? lanes_at<Doubles>(y, first) : lanes_at<Doubles>(z, first);
    return is_x ? lanes_at<Doubles>(x, first) : y_or_z;
  };
  const auto to_grid = [&](const RayPacket::Lanes<std::int32_t>& at, double origin) {
    return __builtin_convertvector(lanes_at<Ints>(at, first), Doubles) + origin;
  };
  const Doubles y_or_z = is_y ? to_grid(lanes.y, tree.origin.y) : to_grid(lanes.z, tree.origin.z);
  const Doubles lower = is_x ? to_grid(lanes.x, tree.origin.x) : y_or_z;
  const Doubles direction = of_axis(rays.direction_x, rays.direction_y, rays.direction_z);
  const Longs is_forward = direction > 0.0;
  const Doubles plane = lower + (is_forward ? Doubles{} : Doubles{} + 1.0);
  const Doubles distance = (plane - of_axis(rays.origin_x, rays.origin_y, rays.origin_z)) * (1.0 / direction);
  Longs lane;
  for (std::size_t i = 0; i < kDoubles; ++i) lane[i] = std::int64_t{1} << i;
  const Longs inside = (lane & static_cast<std::int64_t>(lanes.starts_inside >> first)) != 0;
  const Doubles result = inside ? Doubles{} : distance;
  std::memcpy(t.data() + first, &result, sizeof result);
  const Ints ones = __builtin_convertvector(-is_forward, Ints);
  std::memcpy(forward.data() + first, &ones, sizeof ones);
  const Longs within = lane & (result <= lanes_at<Doubles>(rays.max_t, first));
  std::int64_t bits = 0;
  for (std::size_t i = 0; i < kDoubles; ++i) bits |= within[i];
  return static_cast<std::uint32_t>(bits) << first;
}

inline std::uint32_t measure(const TreeView& tree, const RayPacket& rays, const LaneHits& lanes,
                             RayPacket::Lanes<double>& t, RayPacket::Lanes<std::int32_t>& forward) {
  std::uint32_t within = 0;
  for (std::size_t first = 0; first < RayPacket::kSize; first += kDoubles) {
    within |= measure_some(tree, rays, lanes, first, t, forward);
  }
  return within & lanes.hit;
}

inline void trace_first(const TreeView& tree, const RayPacket& rays, PacketHits& hits, std::uint32_t& unfinished) {
  LaneHits lanes;
  trace_packet(tree, rays, lanes);
  unfinished = lanes.unfinished;
  if (lanes.hit == 0) {
    hits.hit = hits.starts_inside = 0;
    return;
  }
  RayPacket::Lanes<std::int32_t> forward;
  hits.hit = measure(tree, rays, lanes, hits.t, forward);
  hits.starts_inside = lanes.starts_inside & hits.hit;
  const IVec3 corner(tree.origin);
  for (std::size_t i = 0; i < RayPacket::kSize; ++i) {
    hits.x[i] = lanes.x[i] + corner.x;
    hits.y[i] = lanes.y[i] + corner.y;
    hits.z[i] = lanes.z[i] + corner.z;
    hits.face[i] = static_cast<Direction>(2 * lanes.axis[i] + forward[i]);
  }
}

constexpr int kAxisBits = 3 | 3 << 6 | 3 << 12;
constexpr int kWindow = 64;
// In voxels, along any axis; what goes further mostly leaves the window.
constexpr float kShortReach = 22.0F;
// A component of a direction that is smaller than the greatest by more than this leaves its axis out of what is said of
// the others.
constexpr float kShortRatio = 2048.0F;

inline I spread(I coordinate) {
  return (coordinate & all(3)) + shift_left<4>(coordinate & all(12)) + shift_left<8>(coordinate & all(48));
}

// How one axis steps through spread numbers.
struct SpreadStep {
  I fill;
  I add;
};

template <int kShift>
inline SpreadStep spread_step(const Axis& axis) {
  return {select(axis.forward, all(~(kAxisBits << kShift)), all(0)),
          select(axis.forward, all(1 << kShift), all(-(1 << kShift)))};
}

// Rays where they start, in a window.
struct ShortRays {
  Lanes lanes;
  Planes planes;  // that they cross next
  I code;         // the place
  F max_t;
  F doubt;        // how much later or earlier they may cross any plane
  Mask doubtful;  // may cross a plane of an axis of which no more than this can be said
};

// Where a window begins along an axis for rays that start near `position`; -1 for none.
inline int place_window(double position, int bricks) {
  if (!(position >= 0.0 && position < bricks * 16)) return -1;
  return std::clamp((static_cast<int>(position) - 24) & ~15, 0, bricks * 16 - kWindow);
}

// Sets up one axis; returns the lanes that stay within the window along it.
template <int kShift>
inline Mask start_in_window(ShortRays& rays, Axis& axis, F& plane, const double* position, double corner, F direction,
                            int origin) {
  F whole;
  axis = make_axis(position, corner, direction, whole);
  plane = select(axis.still, all(kNever), add_if(axis.forward, whole, all(1.0F)));
  const I at = to_int(whole) + axis.base - all(origin);
  rays.code = rays.code + shift_left<kShift>(spread(at));
  const F reach = abs(axis.direction) * rays.max_t;
  const I margin = to_int(reach) + all(2);
  const I from = at - margin;
  // Starts too far away for whole numbers come out as any, but not as these.
  const Mask is_near = equals(at & all(~(kWindow - 1)), 0);
  return is_near & (reach <= all(kShortReach)) & (all(-1) < from) & (from + margin + margin < all(kWindow));
}

// What a ray's crossings of one axis leave in doubt.
inline void doubt_axis(const Axis& axis, F plane, F greatest, ShortRays& rays) {
  const F doubt = select(axis.still, all(0.0F), all(kDoubt) * abs(axis.inverse));
  const Mask is_tiny = all(kDoubt * kShortRatio) < doubt * greatest;
  rays.doubt = max(rays.doubt, select(is_tiny, all(0.0F), doubt));
  rays.doubtful = rays.doubtful | (is_tiny & (crossing_t(axis, plane) <= rays.max_t + doubt));
}

// False where one of the rays has to go another way.
inline bool set_up_short(const TreeView& tree, const Rays& rays, Mask wanted, const IVec3& origin, ShortRays& out) {
  const F dx = narrow(rays.directions[0]);
  const F dy = narrow(rays.directions[1]);
  const F dz = narrow(rays.directions[2]);
  const F greatest = max(max(abs(dx), abs(dy)), abs(dz));
  Lanes& lanes = out.lanes;
  out.max_t = narrow(rays.max_t);
  out.code = all(0);
  // A limit just below zero may have become one.
  const Mask is_negative = test(as_int(out.max_t), all(std::numeric_limits<std::int32_t>::min()));
  const Mask usual = ~is_negative & (all(0.0F) <= out.max_t) & (all(0x1p-20F) <= greatest) & (greatest <= all(0x1p20F));
  const Mask fits = start_in_window<0>(out, lanes.x, out.planes.x, rays.origins[0], tree.origin.x, dx, origin.x) &
                    start_in_window<2>(out, lanes.y, out.planes.y, rays.origins[1], tree.origin.y, dy, origin.y) &
                    start_in_window<4>(out, lanes.z, out.planes.z, rays.origins[2], tree.origin.z, dz, origin.z);
  if (any(wanted & ~(usual & fits))) return false;
  out.doubt = all(0.0F);
  out.doubtful = mask_of(0);
  doubt_axis(lanes.x, out.planes.x, greatest, out);
  doubt_axis(lanes.y, out.planes.y, greatest, out);
  doubt_axis(lanes.z, out.planes.z, greatest, out);
  lanes.live = wanted & ~out.doubtful;
  out.doubtful = out.doubtful & wanted;
  return true;
}

// Returns the lanes that met a voxel; `doubtful` has those of which only double precision can tell.
inline Mask walk_short(const TreeView& tree, const IVec3& origin, ShortRays& rays) {
  const BrickWindow window(tree, origin);
  const Lanes& lanes = rays.lanes;
  const SpreadStep sx = spread_step<0>(lanes.x);
  const SpreadStep sy = spread_step<2>(lanes.y);
  const SpreadStep sz = spread_step<4>(lanes.z);
  const Planes one = steps_of(lanes, 1.0F);
  const F sure_t = rays.max_t - rays.doubt;
  const F last_t = rays.max_t + rays.doubt;
  Mask walking = lanes.live;
  Mask hit = mask_of(0);
  Mask unsure = mask_of(0);
  for (;;) {
    const I half = shift_left<7>(window.brick(shift_right<12>(rays.code))) + (shift_right<5>(rays.code) & all(127));
    const Mask met = walking & test_bit(gather(tree.words, half), rays.code);
    hit = hit | met;
    rays.doubtful = rays.doubtful | (met & unsure);
    walking = walking & ~met;
    Crossing crossing;
    const F now = first_of(crossings(lanes, rays.planes), crossing);
    step_over(crossing, one, rays.planes);
    const I bits_of_axis = crossed(crossing, all(kAxisBits), all(kAxisBits << 2), all(kAxisBits << 4));
    const I filled = (rays.code & bits_of_axis) | crossed(crossing, sx.fill, sy.fill, sz.fill);
    const I moved = filled + crossed(crossing, sx.add, sy.add, sz.add);
    rays.code = merge(bits_of_axis, moved, rays.code);
    unsure = sure_t <= now;
    walking = walking & (now <= last_t);
    if (!any(walking)) return hit;
  }
}

// Traces short rays; false when it cannot.
inline bool trace_short(const TreeView& tree, const RayPacket& packet, int first, std::uint32_t wanted,
                        std::uint32_t& blocked, std::uint32_t& doubtful) {
  const auto lane = static_cast<std::size_t>(first + std::countr_zero(wanted));
  const Ray ray = packet.ray(static_cast<int>(lane));
  const DVec3 reach = glm::abs(ray.direction) * packet.max_t[lane];
  if (!(std::max(std::max(reach.x, reach.y), reach.z) <= kShortReach)) return false;
  const DVec3 start = ray.origin - tree.origin;
  const IVec3 origin{place_window(start.x, tree.brick_sizes.x), place_window(start.y, tree.brick_sizes.y),
                     place_window(start.z, tree.brick_sizes.z)};
  if ((origin.x | origin.y | origin.z) < 0) return false;
  ShortRays rays;
  if (!set_up_short(tree, lanes_from(packet, first), mask_of(wanted), origin, rays)) return false;
  blocked |= bits(walk_short(tree, origin, rays)) << first;
  doubtful |= bits(rays.doubtful) << first;
  return true;
}

// Which rays are blocked: short ones in a window, others as they are.
inline std::uint32_t trace_any(const TreeView& tree, const RayPacket& rays, std::uint32_t& unfinished) {
  LaneHits others;
  std::uint32_t blocked = 0;
  std::uint32_t doubtful = 0;
  for (int first = 0; first < RayPacket::kSize; first += kWidth) {
    const std::uint32_t wanted = rays.active >> first & kAllLanes;
    if (wanted == 0 || trace_short(tree, rays, first, wanted, blocked, doubtful)) continue;
    F t;
    Crossing entered;
    Lanes lanes = set_up(tree, rays, first, wanted, t, entered);
    others.unfinished |= bits(lanes.unfinished) << first;
    if (!any(lanes.live)) continue;
    if (any(lanes.live & (narrow(rays.max_t.data() + first) < all(kEndless)))) {
      keep(trace<Ask::Where>(tree, lanes, t, entered), first, others);
    } else {
      blocked |= bits(trace<Ask::Whether>(tree, lanes, t, entered).hit) << first;
    }
  }
  unfinished = others.unfinished & ~(others.hit | blocked);
  if (others.hit != 0) {
    RayPacket::Lanes<double> t;
    RayPacket::Lanes<std::int32_t> forward;
    blocked |= measure(tree, rays, others, t, forward);
  }
  // Short rays are never left unfinished.
  for (; doubtful != 0; doubtful &= doubtful - 1) {
    const int lane = std::countr_zero(doubtful);
    RayHit hit;
    bool is_unfinished = false;
    const bool is_blocked =
        first_single<PathTracer>(tree, rays.ray(lane), rays.max_t[static_cast<std::size_t>(lane)], hit, is_unfinished);
    blocked = (blocked & ~(1U << lane)) | std::uint32_t{is_blocked} << lane;
  }
  return blocked;
}

}  // namespace
}  // namespace quoin::trace
