// Whether short rays that start near each other are blocked: occlusion rays. They all lie in a window of 4^3 bricks,
// whose indices are kept beside the lanes, and walk from voxel to voxel without cells in between.
//
// A place in the window is one number of 18 bits, x in bits 0, 1, 6, 7, 12, 13 and so on, so that its upper six bits
// are the brick, the next seven the half word in it, and the lowest five the bit.

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

// Sets up one axis; answers the lanes that stay within the window along it.
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
  const Mask is_negative = test(as_bits(out.max_t), all(std::numeric_limits<std::int32_t>::min()));
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

// Answers the lanes that met a voxel; `doubtful` has those of which only double precision can tell.
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
    const I filled = or_of(rays.code & bits_of_axis, crossed(crossing, sx.fill, sy.fill, sz.fill));
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
        first_single(tree, rays.ray(lane), rays.max_t[static_cast<std::size_t>(lane)], hit, is_unfinished);
    blocked = (blocked & ~(1U << lane)) | std::uint32_t{is_blocked} << lane;
  }
  return blocked;
}
