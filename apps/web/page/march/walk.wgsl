// Walks a ray through a tree in a single loop: src/render/shaders/walk.glsl documents each part. Crossings are
// ordered by t, ties by axis, so that the CPU kernels visit the same voxels.

const kLevels = 15;
const kAxes = vec3i(0, 1, 2);

var<private> ray_base: vec3i;
var<private> ray_origin: vec3f;
var<private> ray_direction: vec3f;
var<private> ray_inverse: vec3f;
var<private> ray_sign: vec3f;
var<private> ray_forward: vec3<bool>;
var<private> ray_still: vec3<bool>;
var<private> ray_is_moved: bool;
var<private> walk_low: vec3i;  // the tree's bounds
var<private> walk_high: vec3i;
var<private> walk_exit_t: f32;
// The current voxel, its entry t, and the entry axis; -1 at the start.
var<private> walk_voxel: vec3i;
var<private> walk_t: f32;
var<private> walk_axis: i32;
var<private> walk_node: vec4u;
var<private> walk_level: i32;
var<private> walk_stack: array<vec4u, kLevels>;

// The slot of a voxel in its node of a level.
fn index_in(voxel: vec3i, level: i32) -> u32 {
  let place = (voxel >> vec3u(2u * u32(level))) & vec3i(3);
  return u32(place.x + 4 * place.y + 16 * place.z);
}
// Returns whether a node's slot is occupied, and the number of its child.
fn has_child(node: vec4u, index: u32) -> bool {
  return (select(node.y, node.x, index < 32u) & (1u << (index & 31u))) != 0u;
}
fn child_of(node: vec4u, index: u32) -> u32 {
  let before = (1u << (index & 31u)) - 1u;
  if (index < 32u) {
    return countOneBits(node.x & before);
  }
  return countOneBits(node.x) + countOneBits(node.y & before);
}

// The coordinates, relative to ray_base, just after the crossing of `axis` at `t`, within `low` to `high`. The
// coordinate of `axis` itself is meaningless.
fn coordinates_after(t: f32, axis: i32, low: vec3i, high: vec3i) -> vec3i {
  let position = ray_origin + t * ray_direction;
  var at = clamp(floor(position), vec3f(low), vec3f(high));
  let past = position - at;
  // Rounding can put a position on the wrong side of a plane only next to it.
  let near = 0.01 + abs(position) * 1e-6;
  let is_close = (past < near) | (past > 1.0 - near);
  if (!any(is_close & (kAxes != vec3i(axis)))) {
    return clamp(vec3i(at), low, high);
  }
  let ahead = select(at, at + 1.0, ray_forward);
  let behind = select(at + 1.0, at, ray_forward);
  let ahead_t = (ahead - ray_origin) * ray_inverse;
  let behind_t = (behind - ray_origin) * ray_inverse;
  let now = vec3f(t);
  let moves = !ray_still;
  let is_short = ((ahead_t < now) | ((ahead_t == now) & (kAxes < vec3i(axis)))) & moves;
  let started_in = select(behind <= ray_origin, behind < ray_origin, vec3<bool>(ray_is_moved));
  let was_inside = ray_forward & started_in;
  let comes_later = (kAxes > vec3i(axis)) & vec3<bool>(axis >= 0);
  let is_far = ((now < behind_t) | ((behind_t == now) & comes_later)) & moves & !was_inside & !is_short;
  at += select(vec3f(), ray_sign, is_short) - select(vec3f(), ray_sign, is_far);
  return clamp(vec3i(at), low, high);
}

// The walk's ray, relative to the block of 64 voxels around the ray's origin.
fn set_ray(base: vec3i, origin: vec3f, direction: vec3f) {
  let whole = vec3i(clamp(floor(origin), vec3f(-1e9), vec3f(1e9)));
  let shift = whole & vec3i(~63);
  ray_base = base + shift;
  ray_origin = min(origin - vec3f(shift), vec3f(whole - shift) + (1.0 - 1.0 / 131072.0));
  ray_still = abs(direction) < vec3f(1e-30);
  ray_direction = select(direction, vec3f(), ray_still);
  ray_inverse = 1.0 / select(direction, vec3f(1.0), ray_still);
  ray_forward = ray_direction > vec3f();
  ray_sign = select(vec3f(-1.0), vec3f(1.0), ray_forward);
}

// Starts a walk at the ray's start or its entry into the tree's bounds; false if it misses them. `moved`: the axis of
// the bounds' plane that the ray was moved to before; -1 for an unmoved ray.
fn start_walk(tree: Tree, base: vec3i, origin: vec3f, direction: vec3f, max_t: f32, moved: i32) -> bool {
  if (any(tree.low.xyz >= tree.high.xyz)) {
    return false;
  }
  set_ray(base, origin, direction);
  walk_low = tree.low.xyz;
  walk_high = tree.high.xyz;
  let low = vec3f(walk_low - ray_base);
  let high = vec3f(walk_high - ray_base);
  let is_low = ray_origin < low;
  let is_high = high <= ray_origin;
  let entered = kAxes == vec3i(moved);
  let before = (((ray_forward & is_low) | (!ray_forward & is_high)) & !ray_still) | entered;
  let past = (((ray_forward & is_high) | (!ray_forward & is_low)) & !entered) | (ray_still & is_high);
  ray_is_moved = moved >= 0;
  if (any(past)) {
    return false;
  }
  let near_t = select(vec3f(-1.0), (select(high, low, ray_forward) - ray_origin) * ray_inverse, before);
  let far_t = select((select(low, high, ray_forward) - ray_origin) * ray_inverse, vec3f(kNever), ray_still);
  walk_exit_t = min(min(far_t.x, far_t.y), far_t.z);
  walk_t = max(max(near_t.x, near_t.y), near_t.z);
  walk_axis = select(select(select(0, 1, near_t.y == walk_t), 2, near_t.z == walk_t), -1, walk_t < 0.0);
  walk_t = max(walk_t, 0.0);
  // Through an edge: the ray leaves before it enters if the exit axis comes first.
  let first = (far_t == vec3f(walk_t)) & (kAxes < vec3i(walk_axis));
  if (any((far_t < vec3f(walk_t)) | first) || walk_t > max_t) {
    return false;
  }
  var at = vec3i(floor(ray_origin));
  if (walk_axis >= 0) {
    at = coordinates_after(walk_t, walk_axis, walk_low - ray_base, walk_high - ray_base - 1);
    at[walk_axis] = select(walk_high[walk_axis] - 1, walk_low[walk_axis], ray_forward[walk_axis]) - ray_base[walk_axis];
  }
  walk_voxel = at + ray_base;
  walk_node = tree.root;
  walk_level = tree.low.w;
  return true;
}

// Leaves the aligned block of edge 2^shift around the voxel; false if the ray has then left the bounds or is past
// max_t.
fn leave_block(shift: u32, max_t: f32) -> bool {
  let before = walk_voxel;
  let low = ((before >> vec3u(shift)) << vec3u(shift)) - ray_base;
  let size = 1 << shift;
  let crossed = (vec3f(select(low, low + size, ray_forward)) - ray_origin) * ray_inverse;
  let t = select(crossed, vec3f(kNever), ray_still);
  let axis = select(select(2, 1, t.y <= t.z), 0, t.x <= t.y && t.x <= t.z);
  walk_axis = axis;
  walk_t = t[axis];
  if (!(walk_t <= min(walk_exit_t, max_t))) {
    return false;
  }
  if (shift > 0u) {
    walk_voxel = coordinates_after(walk_t, axis, low, low + size - 1) + ray_base;
  }
  walk_voxel[axis] = low[axis] + select(-1, size, ray_forward[axis]) + ray_base[axis];
  if (any(walk_voxel < walk_low) || any(walk_voxel >= walk_high)) {
    return false;
  }
  let changed = walk_voxel ^ before;
  let ancestor = i32(firstLeadingBit(u32(changed.x | changed.y | changed.z)) >> 1u);
  if (ancestor > walk_level) {
    walk_level = ancestor;
    walk_node = walk_stack[ancestor];
  }
  return true;
}

// Continues the walk to the first occupied voxel; false if there is none up to max_t.
fn find_voxel(max_t: f32) -> bool {
  loop {
    let index = index_in(walk_voxel, walk_level);
    if (!has_child(walk_node, index)) {
      if (!leave_block(2u * u32(walk_level), max_t)) {
        break;
      }
      continue;
    }
    // Words of voxels and full nodes have no children.
    if ((walk_node.z & 1u) != 0u) {
      return true;
    }
    let child = child_of(walk_node, index);
    let children = walk_node.z;
    walk_stack[walk_level] = walk_node;
    walk_level -= 1;
    if (walk_level > 0) {
      walk_node = nodes[(children >> 4u) + child];
    } else {
      let word = (children >> 2u) + 2u * child;
      walk_node = vec4u(words[word], words[word + 1u], 1u, 0u);
    }
  }
  return false;
}

// The address of a chunk's record: types, storage, then the tree's bricks.
fn record_of(chunk: vec4u) -> u32 {
  return chunk.z & ~31u;
}
fn record_found() -> u32 {
  if (walk_level == 2) {
    return record_of(walk_node);
  }
  return record_of(walk_stack[2]);
}

// The type of a chunk's voxel or sample.
fn type_in(address: u32, at: vec3i) -> u32 {
  let record = nodes[address >> 4u];
  let bits = record.z;
  if (bits == 0u) {
    return record.w;
  }
  let types = record.x >> 2u;
  let slab = words[types + u32((at.z >> 2u) * 16 + (at.y >> 2u))];
  var index = slab & 0x7FFFFFFFu;
  if (index == slab) {
    let row = slab * 16u + u32((at.z & 3) * 4 + (at.y & 3));
    let first = u32(at.x) * bits;
    index = (words[types + record.w + row * bits * 2u + (first >> 5u)] >> (first & 31u)) & ((1u << bits) - 1u);
  }
  if (bits == 16u) {
    return index;
  }
  return (words[types + 256u + (index >> 1u)] >> (16u * (index & 1u))) & 0xFFFFu;
}
fn type_found() -> u32 {
  return type_in(record_found(), walk_voxel & vec3i(63));
}

// The voxel face that the ray entered through; if it starts inside, the face most opposed to its direction.
fn face_found() -> u32 {
  var axis = walk_axis;
  if (axis < 0) {
    let size = abs(ray_direction);
    axis = select(0, 1, size.y > size.x);
    if (size.z > size[axis]) {
      axis = 2;
    }
  }
  return u32(2 * axis) + select(0u, 1u, ray_forward[axis]);
}
