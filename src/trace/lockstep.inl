// The walk of `kWidth` rays in lockstep; see trace/tree_view.h for what it promises. Included once for each instruction
// set, within its namespace, after trace/lockstep_setup.inl.
//
// Two loops take turns. The first goes from cell to cell (4^3 voxels) until every lane has found an occupied one or has
// left; the second goes from voxel to voxel through the cells found, each held in registers. Lanes that are done keep
// walking, over harmless addresses, so that no step waits for the last look-up; what counts is recorded under masks.
// A lane's answer depends on its own ray only.

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

// The voxel at which an axis stands just after entering a box, whose first and last voxels these are.
inline F first_voxel(const Axis& axis, F t, F lower, F upper, Mask entered, Mask ties_before, Mask ties_after) {
  const F at = coordinate_after<1>(axis, t, lower, upper, ties_before, ties_after);
  return select(entered, select(axis.forward, lower, upper), at);
}

inline VoxelWalk enter_cells(const TreeView& tree, const Lanes& lanes, Mask which, const Planes& lower, F t,
                             const Crossing& entered) {
  const F last = all(3.0F);
  const F vx = first_voxel(lanes.x, t, lower.x, lower.x + last, entered.x, entered.y | entered.z, mask_of(0));
  const F vy = first_voxel(lanes.y, t, lower.y, lower.y + last, entered.y, entered.z, entered.x);
  const F vz = first_voxel(lanes.z, t, lower.z, lower.z + last, entered.z, mask_of(0), entered.x | entered.y);
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
  const Planes one = steps_of(lanes, 1.0F);
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
    step_over(last, one, walk.planes);
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
  const Planes four = steps_of(lanes, 4.0F);
  CellWalk walk = at;
  Mask found_any = mask_of(0);
  while (any(walking)) {
    walk.t = first_of(crossings(lanes, walk.planes), walk.crossing);
    step_over(walk.crossing, four, walk.planes);
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

inline Met trace_apart(const TreeView& tree, Lanes& lanes, F t, const Crossing& entered, Met met) {
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
