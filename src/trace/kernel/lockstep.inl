// Walks `kWidth` rays in lockstep, one per lane. Each ray is clipped to the box in which hits are possible. Two loops
// then alternate. The first walks over cells (4^3 voxels) until every lane has found an occupied cell or has left. The
// second walks over the voxels of these cells, each held in registers. Finished lanes keep walking over harmless
// addresses, so that no step waits for the last look-up; masks select the results to record. A lane's result depends on
// its own ray only.
//
//   lanes       |  0  |  1  |  2  | ...        Axis: origin, inverse, base (a multiple of 64), the box, by x, y, z
//   cells       |  .  |  X  |  .  | ...        first loop: one bit of the flat table each, until all are X or gone
//   voxels      |     | .X  |     | ...        second loop: two halves of the cell's word in registers
//
// The position of a lane determines the plane that it crossed last: the latest of the three planes through which it
// entered its unit. Walks therefore do not store it.

#pragma once

#ifdef QUOIN_KERNEL_AVX512
#include "trace/kernel/ray_lanes_avx512.h"
#else
#include "trace/kernel/ray_lanes_avx2.h"
#endif
#include "trace/kernel/ray_numbers.inl"

namespace quoin::trace {
namespace {

constexpr std::uint32_t kAllLanes = (std::uint32_t{1} << kWidth) - 1U;

// Lanes in double precision, as many as fit in a register.
using Doubles = double __attribute__((vector_size(kDoubles * 8)));
using Longs = std::int64_t __attribute__((vector_size(kDoubles * 8)));
using Ints = std::int32_t __attribute__((vector_size(kDoubles * 4)));

// Bits 1, 2, 4 ... by lane.
inline Longs lane_bits() {
  Longs lane;
  for (std::size_t i = 0; i < kDoubles; ++i) lane[i] = std::int64_t{1} << i;
  return lane;
}

struct Axis {
  F origin;  // relative to `base`
  F direction;
  F inverse;
  I base;  // voxels from the tables' origin, a multiple of 64
  Mask forward;
  Mask still;  // the direction has no such component
  Mask moved;  // the ray was moved to `origin` from its start
  F low;       // the box in which the lane moves
  F high;
  F far_t;  // t where the ray leaves that box along this axis
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

// Advances the planes that were crossed.
inline void step_over(const Crossing& crossing, const Planes& steps, Planes& planes) {
  planes.x = add_if(crossing.x, planes.x, steps.x);
  planes.y = add_if(crossing.y, planes.y, steps.y);
  planes.z = add_if(crossing.z, planes.z, steps.z);
}

// Selects, in each lane, the number of the crossed axis.
template <class Number>
inline Number crossed(const Crossing& crossing, Number x, Number y, Number z) {
  return select(crossing.x, x, select(crossing.y, y, z));
}

// Returns the minimum of three and its axis: the first axis at a tie.
inline F first_of(const Planes& t, Crossing& which) {
  const F y_or_z = min(t.y, t.z);
  which.x = t.x <= y_or_z;
  which.y = (t.y <= t.z) & ~which.x;
  which.z = ~(which.x | which.y);
  return min(t.x, y_or_z);
}

inline int count(Mask lanes) {
  return std::popcount(bits(lanes));
}

// The start positions of the rays.
struct Starts {
  alignas(64) double position[3][kWidth];
  alignas(64) double max_t[kWidth];
  alignas(64) std::int32_t entered[kWidth];
};

// Cuts an axis' box to the range that the lanes reach until `reach`. Returns the times when they leave the whole box.
inline F limit_reach(Axis& axis, F reach) {
  const F bounds_exit = crossing_t(axis, select(axis.forward, axis.high, axis.low));
  const F end = axis.origin + reach * axis.direction;
  axis.low = max(axis.low, floor(min(axis.origin, end) - all(kSlack)));
  axis.high = min(axis.high, floor(max(axis.origin, end) + all(kSlack)) + all(1.0F));
  return select(axis.still, all(kNever), bounds_exit);
}

// Returns the time of a lane's entry through a plane of this axis; -1 if it starts between its planes.
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

// `whole` is the lane's start voxel.
inline Axis make_axis(const double* position, double corner, F direction, F& whole) {
  Axis axis;
  split(position, corner, axis.base, axis.origin, whole);
  // Keeps the origin within its start voxel, for any rounding.
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

// Returns the coordinate, in cells, just after the crossing at `t`. The position gives a first guess. Comparing
// crossings corrects it, since rounding can put a position on the wrong side of a plane. `ties_before`: lanes that
// crossed a plane of a later axis, so planes of this axis at the same t were crossed before. `ties_after`: lanes that
// crossed a plane of an earlier axis.
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
  // The ray was never outside its start unit.
  const Mask was_inside = axis.forward & ((behind < axis.origin) | ((behind == axis.origin) & ~axis.moved));
  const Mask is_far = ((t < behind_t) | ((behind_t == t) & ties_after)) & ~axis.still & ~was_inside & ~is_short;
  const F one = select(axis.forward, all(1.0F), all(-1.0F));
  at = add_if(is_short, at, one);
  return add_if(is_far, at, all(0.0F) - one);
}

// A view of one coordinate of the packet's lanes, starting at lane `first`.
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

// Loads lanes from memory.
template <class Vector>
inline Vector some(const void* from) {
  Vector out;
  std::memcpy(&out, from, sizeof out);
  return out;
}

// Moves the lanes of `far_lanes`, starting at lane `first`, to their entry into the bounds, as move_to_bounds does.
// Lanes that miss the bounds get a negative `max_t`.
inline void move_some_to_bounds(const TreeView& tree, const Rays& rays, std::uint32_t far_lanes, std::size_t first,
                                Starts& starts) {
  const Longs is_far = (lane_bits() & static_cast<std::int64_t>(far_lanes >> first)) != 0;
  Doubles enter_t = Doubles{} - 1.0;
  Longs enter_axis = Longs{} - 1;
  Longs missing{};
  for (int axis = 0; axis < 3; ++axis) {
    const auto low = static_cast<double>(tree.box.min[axis]);
    const auto high = static_cast<double>(tree.box.max[axis]);
    const Doubles p = some<Doubles>(starts.position[axis] + first);
    const Doubles d = some<Doubles>(rays.directions[axis] + first);
    const Longs is_low = p < low;
    const Longs is_out = is_low | ~(p < high);  // also true for NaN, which misses
    missing |= is_out & ~(is_low ? d > 0.0 : d < 0.0);
    missing |= ~(is_low | (p >= low));  // NaN
    const Doubles plane = is_low ? Doubles{} + low : Doubles{} + high;
    const Doubles t = (plane - p) * (1.0 / d);
    const Longs is_later = is_out & (t >= enter_t);
    enter_t = is_later ? t : enter_t;
    enter_axis = is_later ? Longs{} + axis : enter_axis;
  }
  const Longs enters = is_far & (enter_axis >= 0);
  const Doubles max_t = some<Doubles>(starts.max_t + first);
  // Not exact: the distance of the face decides at the end, and rounds differently.
  missing |= enters & ~(enter_t <= max_t * 1.000001);
  for (int axis = 0; axis < 3; ++axis) {
    const auto low = static_cast<double>(tree.box.min[axis]);
    const auto high = static_cast<double>(tree.box.max[axis]);
    const Doubles p = some<Doubles>(starts.position[axis] + first);
    const Doubles d = some<Doubles>(rays.directions[axis] + first);
    const Doubles plane = d > 0.0 ? Doubles{} + low : Doubles{} + high;
    const Doubles at = enter_axis == axis ? plane : p + enter_t * d;
    // On the other axes, the ray is inside by now or never will be.
    missing |= enters & ~((at >= low - 1e-3) & (at <= high + 1e-3));
    const Doubles moved = enters ? at : p;
    std::memcpy(starts.position[axis] + first, &moved, sizeof moved);
  }
  const Doubles rest = max_t - enter_t;
  const Doubles left = enters ? (rest < 0.0 ? Doubles{} : rest) : max_t;
  const Doubles limit = is_far & missing ? Doubles{} - 1.0 : left;
  std::memcpy(starts.max_t + first, &limit, sizeof limit);
  const Ints entered = __builtin_convertvector(enters ? enter_axis : Longs{} - 1, Ints);
  std::memcpy(starts.entered + first, &entered, sizeof entered);
}

// Selects the lanes that a kernel can trace, and finds their start positions; the others become `unfinished`.
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
  const std::uint32_t far_lanes = bits(lanes.live & ~nearby);
  if (far_lanes == 0) return;
  for (std::size_t some_first = 0; some_first < kWidth; some_first += kDoubles)
    move_some_to_bounds(tree, rays, far_lanes, some_first, starts);
  lanes.live = lanes.live & (all(0.0F) <= narrow(starts.max_t));
}

// Clips the lanes to the box in which hits are possible, and finds their entries.
inline Lanes set_up(const TreeView& tree, const RayPacket& packet, int first, std::uint32_t wanted, F& t,
                    Crossing& entered) {
  Starts starts;
  Lanes lanes;
  const Rays rays = lanes_from(packet, first);
  find_starts(tree, rays, wanted, starts, lanes);
  if (!any(lanes.live)) return lanes;
  const F max_t = narrow(starts.max_t);
  const F furthest = all(kReach) / lanes.reach_scale;
  // Infinite rays leave a small world before they exceed their range.
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
  // The ray passes an edge of its box. It leaves before it enters if the axis of its exit comes first.
  const Mask left = (lanes.x.far_t < t) | (lanes.y.far_t < t) | (lanes.z.far_t < t) |
                    ((lanes.x.far_t == t) & (entered.y | entered.z)) | ((lanes.y.far_t == t) & entered.z);
  lanes.live = lanes.live & ~left;
  if (is_limited) lanes.unfinished = lanes.unfinished | (lanes.live & (furthest < max_t) & (furthest < bounds_exit));
  lanes.exit_t = min(min(lanes.x.far_t, lanes.y.far_t), lanes.z.far_t);
  return lanes;
}

// The state of a walk along one axis: the time of the next plane crossing, and the plane after that with its time.
struct Next {
  F t;
  F after;
  F after_t;  // computed ahead: no step waits for it
};

struct Nexts {
  Next x, y, z;
};

inline Next next_planes(const Axis& axis, F after, F step) {
  return {crossing_t(axis, after - step), after, crossing_t(axis, after)};
}

inline void cross_if(Mask crossed, const Axis& axis, F step, Next& next) {
  next.t = select(crossed, next.after_t, next.t);
  next.after = add_if(crossed, next.after, step);
  next.after_t = crossing_t(axis, next.after);
}

// Goes through the next plane of each lane; returns when.
inline F cross_next(const Lanes& lanes, const Planes& steps, Nexts& nexts, Crossing& crossing) {
  const F t = first_of({nexts.x.t, nexts.y.t, nexts.z.t}, crossing);
  cross_if(crossing.x, lanes.x, steps.x, nexts.x);
  cross_if(crossing.y, lanes.y, steps.y, nexts.y);
  cross_if(crossing.z, lanes.z, steps.z, nexts.z);
  return t;
}

// The change of an index with each plane crossing, per axis and lane.
struct Strides {
  I x, y, z;
};

inline Strides strides_of(const Lanes& lanes, int x, int y, int z) {
  const auto stride = [](const Axis& axis, int step) { return select(axis.forward, all(step), all(-step)); };
  return {stride(lanes.x, x), stride(lanes.y, y), stride(lanes.z, z)};
}

inline I stepped(I index, const Crossing& crossing, const Strides& strides) {
  return add_if(crossing.z, add_if(crossing.y, add_if(crossing.x, index, strides.x), strides.y), strides.z);
}

// A walk over cells.
struct CellWalk {
  Planes after;  // as in Next
  I index;       // into the table's bits
};

// Returns the cell coordinate of a lane on one axis just after it enters its box.
inline F first_cell(const Axis& axis, F t, Mask entered, Mask ties_before, Mask ties_after) {
  const F low = floor(axis.low * all(0.25F));
  const F high = floor((axis.high - all(1.0F)) * all(0.25F));
  const F at = coordinate_after(axis, t, low, high, ties_before, ties_after);
  return select(entered, select(axis.forward, low, high), at);
}

inline Planes first_cells(const Lanes& lanes, F t, const Crossing& entered) {
  // Most packets start in their boxes.
  if (!any(lanes.live & (entered.x | entered.y | entered.z))) {
    const auto at_start = [](const Axis& axis) { return floor(axis.origin * all(0.25F)); };
    return {at_start(lanes.x), at_start(lanes.y), at_start(lanes.z)};
  }
  return {first_cell(lanes.x, t, entered.x, entered.y | entered.z, mask_of(0)),
          first_cell(lanes.y, t, entered.y, entered.z, entered.x),
          first_cell(lanes.z, t, entered.z, mask_of(0), entered.x | entered.y)};
}

inline CellWalk enter_box(const TreeView& tree, const Lanes& lanes, F t, const Crossing& entered) {
  const Planes cells = first_cells(lanes, t, entered);
  const auto after = [](const Axis& axis, F cell) {
    const F corner = cell * all(4.0F);
    return select(axis.still, all(kNever), select(axis.forward, corner + all(8.0F), corner - all(4.0F)));
  };
  const auto place = [](const Axis& axis, F cell) { return to_int(cell) + shift_right_signed<2>(axis.base); };
  return {{after(lanes.x, cells.x), after(lanes.y, cells.y), after(lanes.z, cells.z)},
          all(tree.first_cell) + place(lanes.x, cells.x) + place(lanes.y, cells.y) * all(tree.cell_strides.y) +
              place(lanes.z, cells.z) * all(tree.cell_strides.z)};
}

inline Mask is_occupied(const TreeView& tree, I index) {
  const I word = min_unsigned(shift_right<5>(index), all(static_cast<int>(tree.last_cell_word)));
  return test_bit(gather(tree.cells, word), index);
}

// Walks until fewer than `few` lanes of `walking` are left, which neither are in an occupied cell nor have left their
// box; `walking` becomes these lanes. Stores their positions and the occupied cells in `at`. Returns the lanes that
// found a cell. Requires: few > 0.
[[gnu::always_inline]] inline Mask find_some_cells(const TreeView& tree, const Lanes& lanes, CellWalk& at,
                                                   Mask& walking, int few) {
  const Strides strides = strides_of(lanes, tree.cell_strides.x, tree.cell_strides.y, tree.cell_strides.z);
  const Planes four = steps_of(lanes, 4.0F);
  Nexts nexts = {next_planes(lanes.x, at.after.x, four.x), next_planes(lanes.y, at.after.y, four.y),
                 next_planes(lanes.z, at.after.z, four.z)};
  I index = at.index;
  Mask found_any = mask_of(0);
  while (count(walking) >= few) {
    Crossing crossing;
    const F t = cross_next(lanes, four, nexts, crossing);
    index = stepped(index, crossing, strides);
    walking = walking & (t <= lanes.exit_t);
    const Mask found = walking & is_occupied(tree, index);
    at.after.x = select(found, nexts.x.after, at.after.x);
    at.after.y = select(found, nexts.y.after, at.after.y);
    at.after.z = select(found, nexts.z.after, at.after.z);
    at.index = select(found, index, at.index);
    found_any = found_any | found;
    walking = walking & ~found;
  }
  if (few > 1) {
    at.after.x = select(walking, nexts.x.after, at.after.x);
    at.after.y = select(walking, nexts.y.after, at.after.y);
    at.after.z = select(walking, nexts.z.after, at.after.z);
    at.index = select(walking, index, at.index);
  }
  return found_any;
}

// Walks until each lane of `walking` is in an occupied cell or has left its box. Stores the occupied cells in `at`.
// Returns the lanes that found a cell.
inline Mask find_cells(const TreeView& tree, const Lanes& lanes, CellWalk& at, Mask walking) {
  return find_some_cells(tree, lanes, at, walking, 1);
}

// Returns the time when a lane crossed this plane; a negative number if it never did.
inline F entry_t(const Axis& axis, F plane) {
  const F t = crossing_t(axis, plane);
  const Mask never = axis.still | ((t == all(0.0F)) & axis.forward & ~axis.moved);
  return select(never, all(-1.0F), t);
}

// Returns the time when each lane entered the unit with these entry planes, and the axis that it entered through. The
// time may be before the lane's start.
inline F last_entry(const Lanes& lanes, const Planes& entries, Crossing& entered) {
  const F tx = entry_t(lanes.x, entries.x);
  const F ty = entry_t(lanes.y, entries.y);
  const F tz = entry_t(lanes.z, entries.z);
  const F last = max(max(tx, ty), tz);
  entered.z = tz == last;
  entered.y = (ty == last) & ~entered.z;
  entered.x = ~(entered.z | entered.y);
  return last;
}

// A walk over the voxels of the lanes' current cells.
struct VoxelWalk {
  I low_half;
  I high_half;
  I code;  // x + 4 y + 16 z, plus 256 times x + 8 y + 64 z; bits 2, 5 and 8 of the latter: has left
  Nexts nexts;
};

// Advances from the entry plane of a cell to the voxel at `t`, across the planes within the cell that are crossed
// before `t`; in the lanes of `ties`, also the planes crossed at `t`.
inline Next enter_cell(const Axis& axis, F entry, F t, F before_t, Mask ties, F one, I stride, I& code) {
  const F until = select(ties, t, before_t);
  const F second = entry + one;
  const F third = second + one;
  const F fourth = third + one;
  const F second_t = crossing_t(axis, second);
  const F third_t = crossing_t(axis, third);
  const F fourth_t = crossing_t(axis, fourth);
  const F exit_t = crossing_t(axis, fourth + one);
  const Mask in_second = second_t <= until;
  const Mask in_third = third_t <= until;
  const Mask in_fourth = fourth_t <= until;
  code = add_if(in_fourth, add_if(in_third, add_if(in_second, code, stride), stride), stride);
  Next next;
  next.t = select(in_fourth, exit_t, select(in_third, fourth_t, select(in_second, third_t, second_t)));
  next.after = add_if(in_fourth, add_if(in_third, add_if(in_second, third, one), one), one);
  next.after_t = crossing_t(axis, next.after);
  return next;
}

// Returns the coordinate of the cell with this entry plane.
inline I cell_of(const Axis& axis, F entry) {
  const F moving = add_if(~axis.forward, entry, all(-4.0F));
  return shift_right_signed<2>(to_int(select(axis.still, floor(axis.origin), moving)) + axis.base);
}

struct Cells {
  I x, y, z;
};

// Returns the position in the brick's run (TreeView::lines) of the word at a place in the brick. The highest byte of
// `place` holds the place as a signed number from -128 on. The addition of the shift saturates in that byte.
inline I place_in_run(I brick, I place) {
  return add_saturated_bytes(place + all(std::numeric_limits<std::int32_t>::min()), shift_left<28>(brick));
}
// Returns the index in TreeView::words of the half word that holds a voxel. The highest bits of `place` are the
// number of the half word within its brick, of 128.
inline I half_of(I brick, I place) {
  return (brick & all(~15)) + shift_right_signed<25>(place_in_run(brick, place));
}

inline void read_words(const TreeView& tree, const Cells& cells, Mask which, VoxelWalk& walk) {
  const I brick = shift_right<2>(cells.x) + shift_right<2>(cells.y) * all(tree.brick_strides.y) +
                  shift_right<2>(cells.z) * all(tree.brick_strides.z);
  const I index = gather(tree.bricks, select(which, brick, all(0)));
  const I place = shift_left<26>(cells.x & all(3)) + shift_left<28>(cells.z & all(3)) + shift_left<30>(cells.y);
  const I half = (index & all(~15)) + shift_left<1>(shift_right_signed<26>(place_in_run(index, place)));
  gather_words(tree.words, half, walk.low_half, walk.high_half);
}

// Returns the code of a lane's position in its cell before it crosses any plane of the cell.
inline I code_at_entry(const Axis& axis, int stride) {
  const I still = (to_int(floor(axis.origin)) & all(3)) * all(stride);
  return select(axis.still, still, select(axis.forward, all(0), all(3 * stride)));
}

struct VoxelSteps {
  Planes one;
  Strides strides;
  I first_code;
};

inline VoxelSteps voxel_steps(const Lanes& lanes) {
  return {steps_of(lanes, 1.0F), strides_of(lanes, kCodeX, kCodeY, kCodeZ),
          code_at_entry(lanes.x, kCodeX) + code_at_entry(lanes.y, kCodeY) + code_at_entry(lanes.z, kCodeZ)};
}

inline VoxelWalk enter_cells(const Lanes& lanes, const Planes& entries, const VoxelSteps& steps) {
  Crossing entered;
  const F last = last_entry(lanes, entries, entered);
  const F t = max(last, all(0.0F));
  // At a tie, planes of earlier axes are crossed first. The planes of a ray's start come before all others.
  const Mask is_start = t == all(0.0F);
  const Mask is_inside = last < all(0.0F);
  const auto ties = [&](const Axis& axis, Mask earlier) {
    return (earlier & ~is_inside) | (is_start & axis.forward & ~axis.moved);
  };
  const F before_t = just_below(t);
  VoxelWalk walk;
  walk.code = steps.first_code;
  walk.nexts.x = enter_cell(lanes.x, entries.x, t, before_t, ties(lanes.x, entered.y | entered.z), steps.one.x,
                            steps.strides.x, walk.code);
  walk.nexts.y =
      enter_cell(lanes.y, entries.y, t, before_t, ties(lanes.y, entered.z), steps.one.y, steps.strides.y, walk.code);
  walk.nexts.z =
      enter_cell(lanes.z, entries.z, t, before_t, ties(lanes.z, mask_of(0)), steps.one.z, steps.strides.z, walk.code);
  return walk;
}

// Enters the lanes' current cells, whose words are read for the lanes of `found`. Returns the cells.
[[gnu::always_inline]] inline Cells enter_voxels(const TreeView& tree, const Lanes& lanes, const VoxelSteps& steps,
                                                 const Planes& after, Mask found, VoxelWalk& voxels) {
  const Planes eight = steps_of(lanes, 8.0F);
  const Planes entries = {after.x - eight.x, after.y - eight.y, after.z - eight.z};
  const Cells at = {cell_of(lanes.x, entries.x), cell_of(lanes.y, entries.y), cell_of(lanes.z, entries.z)};
  voxels = enter_cells(lanes, entries, steps);
  read_words(tree, at, found, voxels);
  return at;
}

// Walks each lane of `walking` through the voxels of its cell. Calls `meet(met)` at each step with the lanes in
// occupied voxels; it returns the lanes that stop.
template <class Meet>
[[gnu::always_inline]] inline void walk_voxels(const Lanes& lanes, const VoxelSteps& steps, VoxelWalk& walk,
                                               Mask walking, Meet&& meet) {
  for (;;) {
    const I half = select(test(walk.code, all(32)), walk.high_half, walk.low_half);
    walking = walking & ~meet(test_bit(half, walk.code) & walking);
    Crossing crossing;
    cross_next(lanes, steps.one, walk.nexts, crossing);
    walk.code = stepped(walk.code, crossing, steps.strides);
    walking = walking & ~test(walk.code, all(kLeft));
    if (!any(walking)) return;
  }
}

// Walks until each lane of `walking` has hit a voxel or has left its cell. Stores the code of each hit in `code`.
template <Ask kAsk>
inline Mask find_voxels(const Lanes& lanes, const VoxelSteps& steps, VoxelWalk& walk, Mask walking, I& code) {
  Mask hit = mask_of(0);
  walk_voxels(lanes, steps, walk, walking, [&](Mask met) {
    hit = hit | met;
    if (kAsk == Ask::Where) code = select(met, walk.code, code);
    return met;
  });
  return hit;
}

// The voxels and faces that lanes hit.
struct Met {
  Mask hit;
  Mask inside;
  I x, y, z;
  I axis;
};

// Finds the faces through which lanes entered the voxels that they hit.
inline void find_faces(const Lanes& lanes, Mask hit, Met& met) {
  const auto entry = [](const Axis& axis, I voxel) {
    return add_if(~axis.forward, to_float(voxel - axis.base), all(1.0F));
  };
  Crossing entered;
  const F last = last_entry(lanes, {entry(lanes.x, met.x), entry(lanes.y, met.y), entry(lanes.z, met.z)}, entered);
  met.inside = met.inside | (hit & (last < all(0.0F)));
  met.axis = select(hit, crossed(entered, all(0), all(1), all(2)), met.axis);
}

// Walks the lanes from cell to cell. `meet(cells, voxels, found)` walks over the voxels of the current cells of the
// lanes of `found`, and returns the finished lanes. Returns all finished lanes.
template <class Meet>
[[gnu::always_inline]] inline Mask walk_apart(const TreeView& tree, const Lanes& lanes, const VoxelSteps& steps, F t,
                                              const Crossing& entered, Meet&& meet) {
  CellWalk cells = enter_box(tree, lanes, t, entered);
  Mask searching = lanes.live;
  Mask found = searching & is_occupied(tree, cells.index);
  Mask done = mask_of(0);
  for (;;) {
    found = found | find_cells(tree, lanes, cells, searching & ~found);
    if (!any(found)) return done;
    VoxelWalk voxels;
    const Cells at = enter_voxels(tree, lanes, steps, cells.after, found, voxels);
    const Mask met = meet(at, voxels, found);
    done = done | met;
    searching = found & ~met;
    found = mask_of(0);
  }
}

inline Cells voxels_at(const Cells& cells, I code) {
  return {shift_left<2>(cells.x) + (code & all(3)), shift_left<2>(cells.y) + (shift_right<2>(code) & all(3)),
          shift_left<2>(cells.z) + (shift_right<4>(code) & all(3))};
}

// Traces each lane on its own. With Ask::Whether, the hit positions stay unset.
template <Ask kAsk>
inline Met trace_apart(const TreeView& tree, Lanes& lanes, F t, const Crossing& entered, Met met) {
  const VoxelSteps steps = voxel_steps(lanes);
  const Mask hit_any = walk_apart(tree, lanes, steps, t, entered, [&](const Cells& at, VoxelWalk& voxels, Mask found) {
    I code = all(0);
    const Mask hit = find_voxels<kAsk>(lanes, steps, voxels, found, code);
    if (kAsk == Ask::Where) {
      const Cells voxel = voxels_at(at, code);
      met.x = select(hit, voxel.x, met.x);
      met.y = select(hit, voxel.y, met.y);
      met.z = select(hit, voxel.z, met.z);
    }
    return hit;
  });
  met.hit = met.hit | hit_any;
  if (kAsk == Ask::Where && any(hit_any)) find_faces(lanes, hit_any, met);
  return met;
}

}  // namespace
}  // namespace quoin::trace
