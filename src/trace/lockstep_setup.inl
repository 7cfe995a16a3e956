// Setting up `kWidth` rays in lockstep; see trace/tree_view.h for what the kernels promise. Included once for each
// instruction set, within its namespace, after the lanes' types.

constexpr std::uint32_t kAllLanes = (std::uint32_t{1} << kWidth) - 1U;

struct Axis {
  F origin;  // relative to `base`
  F direction;
  F inverse;
  I base;  // voxels from the tables' origin, a multiple of 64
  Mask forward;
  Mask still;  // the direction has no such component
  Mask moved;  // the ray does not start at `origin`, but came there
  F low;       // the box in which the lane moves
  F high;
  F far_t;  // where it leaves that box along this axis
};

struct Lanes {
  Axis x, y, z;
  F exit_t;
  F reach_scale;  // the greatest component of the direction
  Mask live;
  Mask unfinished;
};

// The axis of each lane's last crossing: at most one is set.
struct Crossing {
  Mask x, y, z;
};

struct Planes {
  F x, y, z;
};

inline F crossing_t(const Axis& axis, F plane) {
  return (plane - axis.origin) * axis.inverse;
}

inline Planes crossings(const Lanes& lanes, const Planes& planes) {
  return {crossing_t(lanes.x, planes.x), crossing_t(lanes.y, planes.y), crossing_t(lanes.z, planes.z)};
}

// Steps of this size along each axis, forward or back.
inline Planes steps_of(const Lanes& lanes, float size) {
  return {select(lanes.x.forward, all(size), all(-size)), select(lanes.y.forward, all(size), all(-size)),
          select(lanes.z.forward, all(size), all(-size))};
}

// Moves on the planes that were crossed.
inline void step_over(const Crossing& crossing, const Planes& steps, Planes& planes) {
  planes.x = add_if(crossing.x, planes.x, steps.x);
  planes.y = add_if(crossing.y, planes.y, steps.y);
  planes.z = add_if(crossing.z, planes.z, steps.z);
}

// Each lane's number of the axis that it crossed.
template <class Number>
inline Number crossed(const Crossing& crossing, Number x, Number y, Number z) {
  return select(crossing.x, x, select(crossing.y, y, z));
}

// The least of three, and which it is: the first axis at a tie.
inline F first_of(const Planes& t, Crossing& which) {
  const F least = min(min(t.x, t.y), t.z);
  which.x = t.x == least;
  which.y = (t.y == least) & ~which.x;
  which.z = ~(which.x | which.y);
  return least;
}

// Where rays start.
struct Starts {
  alignas(64) double position[3][kWidth];
  alignas(64) double max_t[kWidth];
  alignas(64) std::int32_t entered[kWidth];
};

// Cuts an axis' box to what the lanes can come to until `reach`; answers when they would leave the whole box.
inline F limit_reach(Axis& axis, F reach) {
  const F bounds_exit = crossing_t(axis, select(axis.forward, axis.high, axis.low));
  const F end = axis.origin + reach * axis.direction;
  axis.low = max(axis.low, floor(min(axis.origin, end) - all(kSlack)));
  axis.high = min(axis.high, floor(max(axis.origin, end) + all(kSlack)) + all(1.0F));
  return select(axis.still, all(kNever), bounds_exit);
}

// Answers where a lane enters through a plane of this axis; -1 when it starts between its planes.
inline F clip(Axis& axis, Mask entered, Mask& live) {
  const F far = select(axis.forward, axis.high, axis.low);
  const Mask is_low = axis.origin < axis.low;
  const Mask is_high = axis.high <= axis.origin;
  const Mask before = (((axis.forward & is_low) | (~axis.forward & is_high)) & ~axis.still) | entered;
  const Mask past = ((axis.forward & is_high) | (~axis.forward & is_low)) & ~entered;
  live = live & ~past & ~(axis.still & is_high);
  axis.far_t = select(axis.still, all(kNever), crossing_t(axis, far));
  return select(before, crossing_t(axis, select(axis.forward, axis.low, axis.high)), all(-1.0F));
}

// `whole` is the voxel in which a lane starts.
inline Axis make_axis(const double* position, double corner, F direction, F& whole) {
  Axis axis;
  split(position, corner, axis.base, axis.origin, whole);
  // Stays within the voxel it starts in, however it rounds.
  axis.origin = min(axis.origin, whole + all(1.0F - 0x1p-17F));
  axis.still = abs(direction) < all(0x1p-100F);
  axis.direction = select(axis.still, all(0.0F), direction);
  axis.forward = all(0.0F) < axis.direction;
  axis.inverse = all(1.0F) / select(axis.still, all(1.0F), direction);
  return axis;
}

inline F to_bound(int bound, I base) {
  return to_float(all(bound) - base);
}

// The coordinate, in cells, just after the crossing at `t`: a guess by position, corrected by
// comparing crossings, since rounding can put a position on the wrong side of a plane. `ties_before`: lanes whose
// crossing was of a later axis, so that planes of this one at the same t were crossed before; `ties_after`: of an
// earlier axis.
inline F coordinate_after(const Axis& axis, F t, F low, F high, Mask ties_before, Mask ties_after) {
  constexpr float kEdge = 4.0F;
  const F position = axis.origin + t * axis.direction;
  F at = max(min(floor(position * all(1.0F / kEdge)), high), low);
  const F lower = at * all(kEdge);
  const F upper = lower + all(kEdge);
  const F ahead = select(axis.forward, upper, lower);
  const F behind = select(axis.forward, lower, upper);
  const F ahead_t = crossing_t(axis, ahead);
  const F behind_t = crossing_t(axis, behind);
  const Mask is_short = ((ahead_t < t) | ((ahead_t == t) & ties_before)) & ~axis.still;
  // It was never out of the unit in which it started.
  const Mask was_inside = axis.forward & ((behind < axis.origin) | ((behind == axis.origin) & ~axis.moved));
  const Mask is_far = ((t < behind_t) | ((behind_t == t) & ties_after)) & ~axis.still & ~was_inside & ~is_short;
  const F one = select(axis.forward, all(1.0F), all(-1.0F));
  at = add_if(is_short, at, one);
  return add_if(is_far, at, all(0.0F) - one);
}

// A view of one coordinate of the packet's lanes from `first` on.
struct Rays {
  const double* origins[3];
  const double* directions[3];
  const double* max_t;
};

inline Rays lanes_from(const RayPacket& rays, int first) {
  return {{rays.origin_x.data() + first, rays.origin_y.data() + first, rays.origin_z.data() + first},
          {rays.direction_x.data() + first, rays.direction_y.data() + first, rays.direction_z.data() + first},
          rays.max_t.data() + first};
}

// Moves the lanes of `far_lanes` to the bounds; answers those that miss them.
inline std::uint32_t move_all_to_bounds(const TreeView& tree, const Rays& rays, std::uint32_t far_lanes,
                                        Starts& starts) {
  std::uint32_t missing = 0;
  for (; far_lanes != 0; far_lanes &= far_lanes - 1) {
    const int lane = std::countr_zero(far_lanes);
    const double direction[3] = {rays.directions[0][lane], rays.directions[1][lane], rays.directions[2][lane]};
    Move ray{{starts.position[0][lane], starts.position[1][lane], starts.position[2][lane]}, starts.max_t[lane], -1};
    if (!move_to_bounds(tree, direction, ray)) missing |= 1U << lane;
    for (int axis = 0; axis < 3; ++axis) starts.position[axis][lane] = ray.position[axis];
    starts.max_t[lane] = ray.max_t;
    starts.entered[lane] = ray.entered;
  }
  return missing;
}

// Which lanes a kernel can serve, and where they start; the others are `unfinished`.
inline void find_starts(const TreeView& tree, const Rays& rays, std::uint32_t wanted, Starts& starts, Lanes& lanes) {
  for (int axis = 0; axis < 3; ++axis) {
    for (int i = 0; i < kWidth; ++i) starts.position[axis][i] = rays.origins[axis][i] - tree.origin[axis];
  }
  for (int i = 0; i < kWidth; ++i) {
    starts.max_t[i] = rays.max_t[i];
    starts.entered[i] = -1;
  }
  Mask usual = all(0.0F) <= narrow(starts.max_t);
  Mask nearby = mask_of(kAllLanes);
  Mask leaves = mask_of(0);
  F greatest = all(0.0F);
  for (int axis = 0; axis < 3; ++axis) {
    const F direction = narrow(rays.directions[axis]);
    const F size = abs(direction);
    usual = usual & (size <= all(0x1p20F));
    greatest = max(greatest, size);
    const F p = narrow(starts.position[axis]);
    const float low = tree.low[axis];
    const float high = tree.high[axis];
    nearby = nearby & (all(low - kNearby) <= p) & (p <= all(high + kNearby));
    leaves = leaves | ((all(high) < p) & (all(0.0F) <= direction)) | ((p < all(low)) & (direction <= all(0.0F)));
  }
  usual = usual & (all(0x1p-20F) <= greatest);
  lanes.live = mask_of(wanted) & usual & ~leaves;
  lanes.unfinished = mask_of(wanted) & ~usual;
  lanes.reach_scale = greatest;
  const std::uint32_t missing = move_all_to_bounds(tree, rays, bits(lanes.live & ~nearby), starts);
  lanes.live = lanes.live & ~mask_of(missing);
}

// Clips the lanes to where they can meet anything, and finds where they enter.
inline Lanes set_up(const TreeView& tree, const RayPacket& packet, int first, std::uint32_t wanted, F& t,
                    Crossing& entered) {
  Starts starts;
  Lanes lanes;
  const Rays rays = lanes_from(packet, first);
  find_starts(tree, rays, wanted, starts, lanes);
  if (!any(lanes.live)) return lanes;
  const F max_t = narrow(starts.max_t);
  const F furthest = all(kReach) / lanes.reach_scale;
  // Endless rays leave a small world before they reach further than they may.
  const bool is_limited = !tree.is_small || any(lanes.live & (max_t < all(kEndless)));
  const I moved = load(starts.entered);
  F bounds_exit = all(kNever);
  const auto limit = [&](Axis& axis, int index) {
    F whole;
    axis = make_axis(starts.position[index], 0.0, narrow(rays.directions[index]), whole);
    axis.moved = ~equals(moved, -1);
    axis.low = to_bound(tree.box.min[index], axis.base);
    axis.high = to_bound(tree.box.max[index], axis.base);
    if (is_limited) bounds_exit = min(bounds_exit, limit_reach(axis, min(max_t, furthest)));
    return clip(axis, equals(moved, index), lanes.live);
  };
  const F near_x = limit(lanes.x, 0);
  const F near_y = limit(lanes.y, 1);
  const F near_z = limit(lanes.z, 2);

  // Enters through the last plane; at a tie the later axis.
  const F enter_t = max(max(near_x, near_y), near_z);
  const Mask starts_outside = all(0.0F) <= enter_t;
  entered.z = (near_z == enter_t) & starts_outside;
  entered.y = (near_y == enter_t) & starts_outside & ~entered.z;
  entered.x = starts_outside & ~entered.z & ~entered.y;
  t = max(enter_t, all(0.0F));
  // Through an edge of its box: it has left before it enters if the axis on which it leaves goes first.
  const Mask left = (lanes.x.far_t < t) | (lanes.y.far_t < t) | (lanes.z.far_t < t) |
                    ((lanes.x.far_t == t) & (entered.y | entered.z)) | ((lanes.y.far_t == t) & entered.z);
  lanes.live = lanes.live & ~left;
  if (is_limited) lanes.unfinished = lanes.unfinished | (lanes.live & (furthest < max_t) & (furthest < bounds_exit));
  lanes.exit_t = min(min(lanes.x.far_t, lanes.y.far_t), lanes.z.far_t);
  return lanes;
}
