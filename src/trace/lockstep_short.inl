// Whether short rays that start near each other are blocked: occlusion rays. They all lie in a window of 4^3 bricks,
// whose indices are kept beside the lanes, and walk from voxel to voxel without cells in between.
//
// A place in the window is one number of 18 bits, x in bits 0, 1, 6, 7, 12, 13 and so on, so that its upper six bits
// are the brick, the next seven the half word in it, and the lowest five the bit.

constexpr int kAxisBits = 3 | 3 << 6 | 3 << 12;
constexpr int kWindow = 64;

struct ShortRays {
  Mask hit;
  Mask doubtful;  // met a voxel so near their end that only double precision can tell
};

inline I spread(I coordinate) {
  return (coordinate & all(3)) + shift_left<4>(coordinate & all(12)) + shift_left<8>(coordinate & all(48));
}

// One axis of the window: its lower end for all lanes, or none where they lie too far apart.
inline bool place_window(const Axis& axis, Mask live, int bricks, int& origin) {
  alignas(64) std::int32_t lows[kWidth];
  const I low = to_int(axis.low) + axis.base;
  store(lows, low);
  const int first = lows[std::countr_zero(bits(live))];
  origin = std::min(std::max((first - 20) & ~15, 0), bricks * 16 - kWindow);
  const F from = to_float(all(origin) - axis.base);
  return !any(live & ((axis.low < from) | (from + all(static_cast<float>(kWindow)) < axis.high)));
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

// The plane through which an axis leaves the unit whose lower plane is `lower`.
inline F exit_plane(const Axis& axis, F lower, float size) {
  return select(axis.still, all(kNever), add_if(axis.forward, lower, all(size)));
}

// The voxel at which an axis stands just after entering a box, whose first and last voxels these are.
inline F first_voxel(const Axis& axis, F t, F lower, F upper, Mask entered, Mask ties_before, Mask ties_after) {
  const F at = coordinate_after<1>(axis, t, lower, upper, ties_before, ties_after);
  return select(entered, select(axis.forward, lower, upper), at);
}

inline ShortRays any_short(const TreeView& tree, const Lanes& lanes, const IVec3& origin, F t, const Crossing& entered,
                           F max_t) {
  const BrickWindow window(tree, origin);
  const F one_voxel = all(1.0F);
  const F vx =
      first_voxel(lanes.x, t, lanes.x.low, lanes.x.high - one_voxel, entered.x, entered.y | entered.z, mask_of(0));
  const F vy = first_voxel(lanes.y, t, lanes.y.low, lanes.y.high - one_voxel, entered.y, entered.z, entered.x);
  const F vz =
      first_voxel(lanes.z, t, lanes.z.low, lanes.z.high - one_voxel, entered.z, mask_of(0), entered.x | entered.y);
  const Planes one = steps_of(lanes, 1.0F);
  Planes planes = {exit_plane(lanes.x, vx, 1.0F), exit_plane(lanes.y, vy, 1.0F), exit_plane(lanes.z, vz, 1.0F)};
  I code = spread(to_int(vx) + lanes.x.base - all(origin.x)) +
           shift_left<2>(spread(to_int(vy) + lanes.y.base - all(origin.y))) +
           shift_left<4>(spread(to_int(vz) + lanes.z.base - all(origin.z)));
  const SpreadStep sx = spread_step<0>(lanes.x);
  const SpreadStep sy = spread_step<2>(lanes.y);
  const SpreadStep sz = spread_step<4>(lanes.z);
  // Crossings up to here are surely within reach.
  const F sure_x = max_t - all(0.01F) * abs(lanes.x.inverse);
  const F sure_y = max_t - all(0.01F) * abs(lanes.y.inverse);
  const F sure_z = max_t - all(0.01F) * abs(lanes.z.inverse);
  Mask walking = lanes.live;
  ShortRays out{mask_of(0), mask_of(0)};
  const auto is_unsure = [&](const Crossing& last, F at) { return crossed(last, sure_x, sure_y, sure_z) < at; };
  Mask unsure = (entered.x | entered.y | entered.z) & is_unsure(entered, t);
  for (;;) {
    const I half = shift_left<7>(window.brick(shift_right<12>(code))) + (shift_right<5>(code) & all(127));
    const Mask met = walking & test_bit(gather(tree.words, half), code);
    out.hit = out.hit | met;
    out.doubtful = out.doubtful | (met & unsure);
    walking = walking & ~met;
    Crossing crossing;
    const F now = first_of(crossings(lanes, planes), crossing);
    step_over(crossing, one, planes);
    const I bits_of_axis = crossed(crossing, all(kAxisBits), all(kAxisBits << 2), all(kAxisBits << 4));
    const I filled = or_of(code & bits_of_axis, crossed(crossing, sx.fill, sy.fill, sz.fill));
    const I moved = filled + crossed(crossing, sx.add, sy.add, sz.add);
    code = merge(bits_of_axis, moved, code);
    unsure = is_unsure(crossing, now);
    walking = walking & (now < crossed(crossing, lanes.x.far_t, lanes.y.far_t, lanes.z.far_t));
    if (!any(walking)) return out;
  }
}

// Which rays are blocked: short ones in a window, others as they are.
inline std::uint32_t trace_any(const TreeView& tree, const RayPacket& rays, std::uint32_t& unfinished) {
  LaneHits others;
  std::uint32_t blocked = 0;
  std::uint32_t doubtful = 0;
  for (int first = 0; first < RayPacket::kSize; first += kWidth) {
    const std::uint32_t wanted = rays.active >> first & kAllLanes;
    if (wanted == 0) continue;
    F t;
    Crossing entered;
    Lanes lanes = set_up(tree, rays, first, wanted, t, entered);
    others.unfinished |= bits(lanes.unfinished) << first;
    if (!any(lanes.live)) continue;
    IVec3 origin;
    if (any(lanes.x.moved & lanes.live) || !place_window(lanes.x, lanes.live, tree.brick_sizes.x, origin.x) ||
        !place_window(lanes.y, lanes.live, tree.brick_sizes.y, origin.y) ||
        !place_window(lanes.z, lanes.live, tree.brick_sizes.z, origin.z)) {
      if (any(lanes.live & (narrow(rays.max_t.data() + first) < all(kEndless)))) {
        keep(trace<Ask::Where>(tree, lanes, t, entered), first, others);
      } else {
        blocked |= bits(trace<Ask::Whether>(tree, lanes, t, entered).hit) << first;
      }
      continue;
    }
    const ShortRays found = any_short(tree, lanes, origin, t, entered, narrow(rays.max_t.data() + first));
    blocked |= bits(found.hit) << first;
    doubtful |= bits(found.doubtful) << first;
  }
  unfinished = others.unfinished & ~(others.hit | blocked);
  if (others.hit != 0) {
    RayPacket::Lanes<double> t;
    RayPacket::Lanes<std::int32_t> forward;
    blocked |= measure(tree, rays, others, t, forward);
  }
  for (; doubtful != 0; doubtful &= doubtful - 1) {
    const int lane = std::countr_zero(doubtful);
    RayHit hit;
    bool is_unfinished = false;
    const bool is_blocked =
        first_single(tree, rays.ray(lane), rays.max_t[static_cast<std::size_t>(lane)], hit, is_unfinished);
    if (!is_blocked) blocked &= ~(1U << lane);
  }
  return blocked;
}
