// The walk of `kWidth` rays in lockstep; see trace/tree_view.h for what it promises. Included once for each instruction
// set, within its namespace, after the lanes' types.
//
// Two loops take turns. The first goes from cell to cell (4^3 voxels) until every lane has found an occupied one or has
// left; the second goes from voxel to voxel through the cells found, each held in registers. Lanes that are done keep
// walking, over harmless addresses, so that no step waits for the last look-up; what counts is recorded under masks.
// A lane's answer depends on its own ray only.

// Further than any crossing; adding a step to it changes nothing.
constexpr float kNever = 1e37F;
// How far a lane goes, along its greatest component, before single precision would no longer do.
constexpr float kReach = 2048.0F;
// How far beyond the bounds a ray may start without being moved to them first.
constexpr float kNearby = 64.0F;
// More than rounding can move the end of a ray, in voxels.
constexpr float kSlack = 0.02F;

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

// The least of three, and which it is: the first axis at a tie.
inline F first_of(const Planes& t, Crossing& which) {
  const F least = min(min(t.x, t.y), t.z);
  which.x = t.x == least;
  which.y = (t.y == least) & ~which.x;
  which.z = ~(which.x | which.y);
  return least;
}

// Where a ray starts, in voxels from the tables' origin.
struct Move {
  double position[3];
  double max_t;
  int entered = -1;  // the axis of the bounds' plane to which it was moved
};

struct Starts {
  alignas(64) double position[3][kWidth];
  alignas(64) double max_t[kWidth];
  alignas(64) std::int32_t entered[kWidth];
};

// Moves one ray that starts far away to where it enters the bounds; false when it misses them.
inline bool move_to_bounds(const TreeView& tree, const double direction[3], Move& ray) {
  double enter_t = -1.0;
  int enter_axis = -1;
  for (int axis = 0; axis < 3; ++axis) {
    const double p = ray.position[axis];
    const double d = direction[axis];
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
  if (!(enter_t <= ray.max_t)) return false;
  for (int axis = 0; axis < 3; ++axis) {
    const double plane = direction[axis] > 0.0 ? tree.box.min[axis] : tree.box.max[axis];
    const double p = axis == enter_axis ? plane : ray.position[axis] + enter_t * direction[axis];
    // The others are inside by now, or never will be.
    if (!(p >= tree.box.min[axis] - 1e-3 && p <= tree.box.max[axis] + 1e-3)) return false;
    ray.position[axis] = p;
  }
  ray.max_t -= enter_t;
  ray.entered = enter_axis;
  return true;
}

// Answers where a lane enters through a plane of this axis; -1 when it starts between its planes.
inline F clip(Axis& axis, F low, F high, F reach, Mask entered, Mask& live, F& bounds_exit) {
  const F end = axis.origin + reach * axis.direction;
  const F far_before = select(axis.forward, high, low);
  low = max(low, floor(min(axis.origin, end) - all(kSlack)));
  high = min(high, floor(max(axis.origin, end) + all(kSlack)) + all(1.0F));
  const F far = select(axis.forward, high, low);
  bounds_exit = min(bounds_exit, select(axis.still, all(kNever), crossing_t(axis, far_before)));
  const Mask is_low = axis.origin < low;
  const Mask is_high = high <= axis.origin;
  const Mask before = (((axis.forward & is_low) | (~axis.forward & is_high)) & ~axis.still) | entered;
  const Mask past = ((axis.forward & is_high) | (~axis.forward & is_low)) & ~entered;
  live = live & ~past & ~(axis.still & is_high);
  axis.far_t = select(axis.still, all(kNever), crossing_t(axis, far));
  axis.low = low;
  axis.high = high;
  return select(before, crossing_t(axis, select(axis.forward, low, high)), all(-1.0F));
}

inline Axis make_axis(const double* position, F direction) {
  Axis axis;
  F whole;
  split(position, axis.base, axis.origin, whole);
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

// The coordinate, in units of `kSize` voxels, just after the crossing at `t`: a guess by position, corrected by
// comparing crossings, since rounding can put a position on the wrong side of a plane. `ties_before`: lanes whose
// crossing was of a later axis, so that planes of this one at the same t were crossed before; `ties_after`: of an
// earlier axis.
template <int kSize>
inline F coordinate_after(const Axis& axis, F t, F low, F high, Mask ties_before, Mask ties_after) {
  constexpr auto kEdge = static_cast<float>(kSize);
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

// Clips the lanes to where they can meet anything, and finds where they enter.
inline Lanes set_up(const TreeView& tree, const RayPacket& rays, int first, std::uint32_t wanted, F& t,
                    Crossing& entered) {
  Starts starts;
  Lanes lanes;
  const double* directions[3] = {rays.direction_x.data() + first, rays.direction_y.data() + first,
                                 rays.direction_z.data() + first};
  const double* origins[3] = {rays.origin_x.data() + first, rays.origin_y.data() + first, rays.origin_z.data() + first};
  for (int axis = 0; axis < 3; ++axis) {
    for (int i = 0; i < kWidth; ++i) starts.position[axis][i] = origins[axis][i] - tree.origin[axis];
  }
  for (int i = 0; i < kWidth; ++i) {
    starts.max_t[i] = rays.max_t[static_cast<std::size_t>(first + i)];
    starts.entered[i] = -1;
  }
  const F d[3] = {narrow(directions[0]), narrow(directions[1]), narrow(directions[2])};
  const F greatest = max(max(abs(d[0]), abs(d[1])), abs(d[2]));
  const Mask usual = (abs(d[0]) <= all(0x1p20F)) & (abs(d[1]) <= all(0x1p20F)) & (abs(d[2]) <= all(0x1p20F)) &
                     (all(0x1p-20F) <= greatest) & (all(0.0F) <= narrow(starts.max_t));
  lanes.live = mask_of(wanted) & usual;
  lanes.unfinished = mask_of(wanted) & ~usual;
  Mask nearby = lanes.live;
  for (int axis = 0; axis < 3; ++axis) {
    const F p = narrow(starts.position[axis]);
    nearby = nearby & (all(static_cast<float>(tree.box.min[axis]) - kNearby) <= p) &
             (p <= all(static_cast<float>(tree.box.max[axis]) + kNearby));
  }
  std::uint32_t far_lanes = bits(lanes.live & ~nearby);
  std::uint32_t missing = 0;
  for (; far_lanes != 0; far_lanes &= far_lanes - 1) {
    const int lane = std::countr_zero(far_lanes);
    const double direction[3] = {directions[0][lane], directions[1][lane], directions[2][lane]};
    Move ray{{starts.position[0][lane], starts.position[1][lane], starts.position[2][lane]}, starts.max_t[lane], -1};
    if (!move_to_bounds(tree, direction, ray)) missing |= 1U << lane;
    for (int axis = 0; axis < 3; ++axis) starts.position[axis][lane] = ray.position[axis];
    starts.max_t[lane] = ray.max_t;
    starts.entered[lane] = ray.entered;
  }
  lanes.live = lanes.live & ~mask_of(missing);

  lanes.x = make_axis(starts.position[0], d[0]);
  lanes.y = make_axis(starts.position[1], d[1]);
  lanes.z = make_axis(starts.position[2], d[2]);
  const F furthest = all(kReach) / greatest;
  const F max_t = narrow(starts.max_t);
  const F reach = min(max_t, furthest);
  const I moved = load(starts.entered);
  F bounds_exit = all(kNever);
  const auto limit = [&](Axis& axis, int index) {
    const F low = to_bound(tree.box.min[index], axis.base);
    const F high = to_bound(tree.box.max[index], axis.base);
    axis.moved = ~equals(moved, -1);
    return clip(axis, low, high, reach, equals(moved, index), lanes.live, bounds_exit);
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
  lanes.unfinished = lanes.unfinished | (lanes.live & (furthest < max_t) & (furthest < bounds_exit));
  lanes.exit_t = min(min(lanes.x.far_t, lanes.y.far_t), lanes.z.far_t);
  return lanes;
}

// The cell at which an axis stands just after entering.
inline F first_cell(const Axis& axis, F t, Mask entered, Mask ties_before, Mask ties_after) {
  const F low = floor(axis.low * all(0.25F));
  const F high = floor((axis.high - all(1.0F)) * all(0.25F));
  const F at = coordinate_after<4>(axis, t, low, high, ties_before, ties_after);
  return select(entered, select(axis.forward, low, high), at);
}

// The plane through which an axis leaves the unit whose lower plane is `lower`.
inline F exit_plane(const Axis& axis, F lower, float size) {
  return select(axis.still, all(kNever), add_if(axis.forward, lower, all(size)));
}

// A walk through voxels of the cells in which lanes stand.
struct VoxelWalk {
  I low_half;
  I high_half;
  I code;  // x + 4 y + 16 z, and 256 times x + 8 y + 64 z, whose bits 2, 5 and 8 tell that it has left
  Planes planes;
};

inline F first_voxel(const Axis& axis, F t, F lower, Mask entered, Mask ties_before, Mask ties_after) {
  const F upper = lower + all(3.0F);
  const F at = coordinate_after<1>(axis, t, lower, upper, ties_before, ties_after);
  return select(entered, select(axis.forward, lower, upper), at);
}

constexpr int kCodeX = 1 + 256;
constexpr int kCodeY = 4 + 256 * 8;
constexpr int kCodeZ = 16 + 256 * 64;
constexpr int kLeft = 256 * (4 + 4 * 8 + 4 * 64);

inline VoxelWalk enter_cells(const TreeView& tree, const Lanes& lanes, Mask which, const Planes& lower, F t,
                             const Crossing& entered) {
  const F vx = first_voxel(lanes.x, t, lower.x, entered.x, entered.y | entered.z, mask_of(0));
  const F vy = first_voxel(lanes.y, t, lower.y, entered.y, entered.z, entered.x);
  const F vz = first_voxel(lanes.z, t, lower.z, entered.z, mask_of(0), entered.x | entered.y);
  VoxelWalk walk;
  walk.planes = {exit_plane(lanes.x, vx, 1.0F), exit_plane(lanes.y, vy, 1.0F), exit_plane(lanes.z, vz, 1.0F)};
  walk.code =
      to_int(vx - lower.x) * all(kCodeX) + to_int(vy - lower.y) * all(kCodeY) + to_int(vz - lower.z) * all(kCodeZ);
  const I cx = shift_right<2>(to_int(lower.x) + lanes.x.base);
  const I cy = shift_right<2>(to_int(lower.y) + lanes.y.base);
  const I cz = shift_right<2>(to_int(lower.z) + lanes.z.base);
  const I brick = shift_right<2>(cx) + shift_right<2>(cy) * all(tree.brick_strides.y) +
                  shift_right<2>(cz) * all(tree.brick_strides.z);
  const I index = gather(tree.bricks, select(which, brick, all(0)));
  const I cell = (cx & all(3)) + shift_left<2>(cy & all(3)) + shift_left<4>(cz & all(3));
  const I half = shift_left<7>(index) + shift_left<1>(cell);
  walk.low_half = gather(tree.words, half);
  walk.high_half = gather(tree.words, half + all(1));
  return walk;
}

inline I code_step(const Axis& axis, int step) {
  return select(axis.forward, all(step), all(-step));
}

// Walks until each lane of `walking` has met a voxel, whose code and axis it leaves, or has left its cell.
inline Mask find_voxels(const Lanes& lanes, VoxelWalk& walk, Mask walking, Crossing& crossing, I& code) {
  const I step_x = code_step(lanes.x, kCodeX);
  const I step_y = code_step(lanes.y, kCodeY);
  const I step_z = code_step(lanes.z, kCodeZ);
  const F one_x = select(lanes.x.forward, all(1.0F), all(-1.0F));
  const F one_y = select(lanes.y.forward, all(1.0F), all(-1.0F));
  const F one_z = select(lanes.z.forward, all(1.0F), all(-1.0F));
  Crossing last = crossing;
  Mask hit = mask_of(0);
  for (;;) {
    const I half = select(test(walk.code, all(32)), walk.high_half, walk.low_half);
    const Mask met = test_bit(half, walk.code) & walking;
    hit = hit | met;
    code = select(met, walk.code, code);
    crossing.x = (crossing.x & ~met) | (last.x & met);
    crossing.y = (crossing.y & ~met) | (last.y & met);
    crossing.z = (crossing.z & ~met) | (last.z & met);
    walking = walking & ~met;
    const Planes t = crossings(lanes, walk.planes);
    first_of(t, last);
    walk.planes.x = add_if(last.x, walk.planes.x, one_x);
    walk.planes.y = add_if(last.y, walk.planes.y, one_y);
    walk.planes.z = add_if(last.z, walk.planes.z, one_z);
    walk.code = add_if(last.z, add_if(last.y, add_if(last.x, walk.code, step_x), step_y), step_z);
    walking = walking & ~test(walk.code, all(kLeft));
    if (!any(walking)) return hit;
  }
}

// A walk from cell to cell.
struct CellWalk {
  Planes planes;  // through which each axis leaves its cell
  F t;            // of the last crossing
  Crossing crossing;
  I index;  // into the table's bits
};

inline Planes lower_planes(const Lanes& lanes, const Planes& planes) {
  const auto lower = [](const Axis& axis, F plane) {
    const F moving = add_if(axis.forward, plane, all(-4.0F));
    return select(axis.still, floor(axis.origin * all(0.25F)) * all(4.0F), moving);
  };
  return {lower(lanes.x, planes.x), lower(lanes.y, planes.y), lower(lanes.z, planes.z)};
}

inline CellWalk enter_box(const TreeView& tree, const Lanes& lanes, F t, const Crossing& entered) {
  const F cx = first_cell(lanes.x, t, entered.x, entered.y | entered.z, mask_of(0));
  const F cy = first_cell(lanes.y, t, entered.y, entered.z, entered.x);
  const F cz = first_cell(lanes.z, t, entered.z, mask_of(0), entered.x | entered.y);
  CellWalk walk;
  const F four = all(4.0F);
  walk.planes = {exit_plane(lanes.x, cx * four, 4.0F), exit_plane(lanes.y, cy * four, 4.0F),
                 exit_plane(lanes.z, cz * four, 4.0F)};
  walk.t = t;
  walk.crossing = entered;
  const auto place = [](F cell, const Axis& axis) { return to_int(cell) + shift_right_signed<2>(axis.base); };
  walk.index = all(tree.first_cell) + place(cx, lanes.x) + place(cy, lanes.y) * all(tree.cell_strides.y) +
               place(cz, lanes.z) * all(tree.cell_strides.z);
  return walk;
}

inline Mask is_occupied(const TreeView& tree, I index) {
  const I word = min_unsigned(shift_right<5>(index), all(static_cast<int>(tree.last_cell_word)));
  return test_bit(gather(tree.cells, word), index);
}

inline CellWalk select(Mask m, const CellWalk& a, const CellWalk& b) {
  const auto choose = [m](Mask p, Mask q) { return (p & m) | (q & ~m); };
  return {{select(m, a.planes.x, b.planes.x), select(m, a.planes.y, b.planes.y), select(m, a.planes.z, b.planes.z)},
          select(m, a.t, b.t),
          {choose(a.crossing.x, b.crossing.x), choose(a.crossing.y, b.crossing.y), choose(a.crossing.z, b.crossing.z)},
          select(m, a.index, b.index)};
}

// Walks until each lane of `walking` stands in an occupied cell, where `at` then holds it, or has left its box.
// Answers the lanes that found one.
inline Mask find_cells(const TreeView& tree, const Lanes& lanes, CellWalk& at, Mask walking) {
  const I step_x = code_step(lanes.x, tree.cell_strides.x);
  const I step_y = code_step(lanes.y, tree.cell_strides.y);
  const I step_z = code_step(lanes.z, tree.cell_strides.z);
  const F four_x = select(lanes.x.forward, all(4.0F), all(-4.0F));
  const F four_y = select(lanes.y.forward, all(4.0F), all(-4.0F));
  const F four_z = select(lanes.z.forward, all(4.0F), all(-4.0F));
  CellWalk walk = at;
  Mask found_any = mask_of(0);
  while (any(walking)) {
    walk.t = first_of(crossings(lanes, walk.planes), walk.crossing);
    walk.planes.x = add_if(walk.crossing.x, walk.planes.x, four_x);
    walk.planes.y = add_if(walk.crossing.y, walk.planes.y, four_y);
    walk.planes.z = add_if(walk.crossing.z, walk.planes.z, four_z);
    walk.index =
        add_if(walk.crossing.z, add_if(walk.crossing.y, add_if(walk.crossing.x, walk.index, step_x), step_y), step_z);
    walking = walking & (walk.t <= lanes.exit_t);
    const Mask found = walking & is_occupied(tree, walk.index);
    at = select(found, walk, at);
    found_any = found_any | found;
    walking = walking & ~found;
  }
  return found_any;
}

// Where lanes met a voxel.
struct Met {
  Mask hit;
  Mask inside;
  I x, y, z;
  I axis;
};

inline Met trace(const TreeView& tree, Lanes& lanes, F t, const Crossing& entered) {
  Met met{mask_of(0), mask_of(0), all(0), all(0), all(0), all(0)};
  CellWalk cells = enter_box(tree, lanes, t, entered);
  Mask searching = lanes.live;
  Mask found = searching & is_occupied(tree, cells.index);
  for (;;) {
    found = found | find_cells(tree, lanes, cells, searching & ~found);
    if (!any(found)) return met;
    const Planes lower = lower_planes(lanes, cells.planes);
    VoxelWalk voxels = enter_cells(tree, lanes, found, lower, cells.t, cells.crossing);
    Crossing crossing = cells.crossing;
    I code = all(0);
    const Mask hit = find_voxels(lanes, voxels, found, crossing, code);
    const auto put = [hit](I& to, const Axis& axis, F low, I within) {
      to = select(hit, to_int(low) + axis.base + within, to);
    };
    put(met.x, lanes.x, lower.x, code & all(3));
    put(met.y, lanes.y, lower.y, shift_right<2>(code) & all(3));
    put(met.z, lanes.z, lower.z, shift_right<4>(code) & all(3));
    met.axis = select(hit, select(crossing.y, all(1), select(crossing.z, all(2), all(0))), met.axis);
    met.inside = met.inside | (hit & ~(crossing.x | crossing.y | crossing.z));
    met.hit = met.hit | hit;
    searching = found & ~hit;
    found = mask_of(0);
  }
}

inline void keep(const Met& met, int first, LaneHits& out) {
  out.hit |= bits(met.hit) << first;
  out.starts_inside |= bits(met.inside) << first;
  store(out.x.data() + first, met.x);
  store(out.y.data() + first, met.y);
  store(out.z.data() + first, met.z);
  store(out.axis.data() + first, met.axis);
}

constexpr std::uint32_t kAllLanes = (std::uint32_t{1} << kWidth) - 1U;

inline void trace_packet(const TreeView& tree, const RayPacket& rays, LaneHits& out) {
  for (int first = 0; first < RayPacket::kSize; first += kWidth) {
    const std::uint32_t wanted = rays.active >> first & kAllLanes;
    if (wanted == 0) continue;
    F t;
    Crossing entered;
    Lanes lanes = set_up(tree, rays, first, wanted, t, entered);
    if (any(lanes.live)) keep(trace(tree, lanes, t, entered), first, out);
    out.unfinished |= bits(lanes.unfinished) << first;
  }
  out.unfinished &= ~out.hit;
}

// The distances of the faces met, in double precision, and which of them lie within reach.
inline std::uint32_t measure(const TreeView& tree, const RayPacket& rays, const LaneHits& lanes, double* t) {
  alignas(64) std::int64_t is_within[RayPacket::kSize];
  for (std::size_t i = 0; i < RayPacket::kSize; ++i) {
    const bool is_x = lanes.axis[i] == 0;
    const bool is_y = lanes.axis[i] == 1;
    const double direction = is_x ? rays.direction_x[i] : is_y ? rays.direction_y[i] : rays.direction_z[i];
    const double origin = is_x ? rays.origin_x[i] : is_y ? rays.origin_y[i] : rays.origin_z[i];
    const double corner = is_x ? tree.origin.x : is_y ? tree.origin.y : tree.origin.z;
    const std::int32_t voxel = is_x ? lanes.x[i] : is_y ? lanes.y[i] : lanes.z[i];
    const double plane = voxel + corner + (direction > 0.0 ? 0.0 : 1.0);
    const double inside = (lanes.starts_inside >> i & 1U) != 0 ? 0.0 : 1.0;
    const double distance = (plane - origin) * (1.0 / direction);
    t[i] = inside != 0.0 ? distance : 0.0;
    is_within[i] = t[i] <= rays.max_t[i] ? 1 : 0;
  }
  std::uint32_t within = 0;
  for (std::size_t i = 0; i < RayPacket::kSize; ++i) within |= static_cast<std::uint32_t>(is_within[i]) << i;
  return within & lanes.hit;
}

inline void trace_first(const TreeView& tree, const RayPacket& rays, PacketHits& hits, std::uint32_t& unfinished) {
  LaneHits lanes;
  trace_packet(tree, rays, lanes);
  hits.hit = measure(tree, rays, lanes, hits.t.data());
  hits.starts_inside = lanes.starts_inside & hits.hit;
  for (std::size_t i = 0; i < RayPacket::kSize; ++i) {
    hits.x[i] = lanes.x[i] + static_cast<std::int32_t>(tree.origin.x);
    hits.y[i] = lanes.y[i] + static_cast<std::int32_t>(tree.origin.y);
    hits.z[i] = lanes.z[i] + static_cast<std::int32_t>(tree.origin.z);
    const double d = lanes.axis[i] == 0   ? rays.direction_x[i]
                     : lanes.axis[i] == 1 ? rays.direction_y[i]
                                          : rays.direction_z[i];
    hits.face[i] = static_cast<Direction>(2 * lanes.axis[i] + (d > 0.0 ? 1 : 0));
  }
  unfinished = lanes.unfinished;
}
