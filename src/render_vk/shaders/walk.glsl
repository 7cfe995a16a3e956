// One ray's way through one tree, in a single loop: an iteration either goes down to the place of the node in which the
// ray stands, or over the largest aligned block around it that is known to be empty, and up to the lowest ancestor
// that holds both ends of that step.
//
// The plane P of an axis is crossed at t = (P - origin) * (1 / direction), in single precision, and crossings are
// ordered by t, at ties by axis: the definition of docs/decisions/011, so that the processor's kernels meet the same
// voxels. `origin` is relative to a multiple of 64 voxels next to the ray's start.

const int kLevels = 15;
const float kNever = 1e37;

ivec3 ray_base;
vec3 ray_origin;
vec3 ray_direction;
vec3 ray_inverse;
vec3 ray_sign;
bvec3 ray_forward;
bvec3 ray_still;
bool ray_is_moved;
ivec3 walk_low;  // the tree's bounds
ivec3 walk_high;
float walk_exit_t;
// Where it stands: the voxel, when it came there, and through which axis; -1 where it started.
ivec3 walk_voxel;
float walk_t;
int walk_axis;
uvec4 walk_node;
int walk_level;
uvec4 walk_stack[kLevels];

bvec3 both(bvec3 a, bvec3 b) {
  return bvec3(a.x && b.x, a.y && b.y, a.z && b.z);
}
bvec3 either(bvec3 a, bvec3 b) {
  return bvec3(a.x || b.x, a.y || b.y, a.z || b.z);
}

// The coordinates, from ray_base, just after the crossing of `axis` at `t`, within `low` to `high`; that of `axis`
// itself means nothing.
ivec3 coordinates_after(float t, int axis, ivec3 low, ivec3 high) {
  precise vec3 position = ray_origin + t * ray_direction;
  vec3 at = clamp(floor(position), vec3(low), vec3(high));
  vec3 past = position - at;
  // Rounding can put a position on the wrong side of a plane only next to it.
  vec3 near = 0.01 + abs(position) * 1e-6;
  bvec3 is_close = either(lessThan(past, near), greaterThan(past, 1.0 - near));
  bvec3 is_other = notEqual(ivec3(0, 1, 2), ivec3(axis));
  // The last clamp is for numbers beyond 2^24, which rounding moves by more than one.
  if (!any(both(is_close, is_other))) return clamp(ivec3(at), low, high);
  vec3 ahead = mix(at, at + 1.0, ray_forward);
  vec3 behind = mix(at + 1.0, at, ray_forward);
  precise vec3 ahead_t = (ahead - ray_origin) * ray_inverse;
  precise vec3 behind_t = (behind - ray_origin) * ray_inverse;
  vec3 now = vec3(t);
  bvec3 goes_first = lessThan(ivec3(0, 1, 2), ivec3(axis));
  bvec3 moves = not(ray_still);
  bvec3 is_short =
      both(either(lessThan(ahead_t, now), both(equal(ahead_t, now), goes_first)), moves);
  bvec3 started_in = ray_is_moved ? lessThan(behind, ray_origin) : lessThanEqual(behind, ray_origin);
  bvec3 was_inside = both(ray_forward, started_in);
  bvec3 comes_later = axis < 0 ? bvec3(false) : greaterThan(ivec3(0, 1, 2), ivec3(axis));
  bvec3 is_far = both(both(either(lessThan(now, behind_t), both(equal(behind_t, now), comes_later)), moves),
                      both(not(was_inside), not(is_short)));
  at += mix(vec3(0.0), ray_sign, is_short) - mix(vec3(0.0), ray_sign, is_far);
  return clamp(ivec3(at), low, high);
}

// Puts a ray at its start, or where it enters the tree's bounds; false when it misses them.
//
// `moved`: the axis of the bounds' plane to which it was moved before; -1 for a ray that starts where it is.
bool start_walk(Tree tree, ivec3 base, vec3 origin, vec3 direction, float max_t, int moved) {
  if (any(greaterThanEqual(tree.low.xyz, tree.high.xyz))) return false;
  ivec3 whole = ivec3(clamp(floor(origin), vec3(-1e9), vec3(1e9)));
  ivec3 shift = whole & ~63;
  ray_base = base + shift;
  ray_origin = min(origin - vec3(shift), vec3(whole - shift) + (1.0 - 1.0 / 131072.0));
  ray_still = lessThan(abs(direction), vec3(1e-30));
  ray_direction = mix(direction, vec3(0.0), ray_still);
  ray_inverse = 1.0 / mix(direction, vec3(1.0), ray_still);
  ray_forward = greaterThan(ray_direction, vec3(0.0));
  ray_sign = mix(vec3(-1.0), vec3(1.0), ray_forward);
  walk_low = tree.low.xyz;
  walk_high = tree.high.xyz;
  vec3 low = vec3(walk_low - ray_base);
  vec3 high = vec3(walk_high - ray_base);
  bvec3 is_low = lessThan(ray_origin, low);
  bvec3 is_high = lessThanEqual(high, ray_origin);
  bvec3 backward = not(ray_forward);
  bvec3 before = both(either(both(ray_forward, is_low), both(backward, is_high)), not(ray_still));
  bvec3 entered = equal(ivec3(0, 1, 2), ivec3(moved));
  before = either(before, entered);
  bvec3 past = both(either(both(ray_forward, is_high), both(backward, is_low)), not(entered));
  past = either(past, both(ray_still, is_high));
  ray_is_moved = moved >= 0;
  if (any(past)) return false;
  precise vec3 near_t = (mix(high, low, ray_forward) - ray_origin) * ray_inverse;
  near_t = mix(vec3(-1.0), near_t, before);
  precise vec3 far_t = (mix(low, high, ray_forward) - ray_origin) * ray_inverse;
  far_t = mix(far_t, vec3(kNever), ray_still);
  walk_exit_t = min(min(far_t.x, far_t.y), far_t.z);
  walk_t = max(max(near_t.x, near_t.y), near_t.z);
  walk_axis = walk_t < 0.0 ? -1 : near_t.z == walk_t ? 2 : near_t.y == walk_t ? 1 : 0;
  walk_t = max(walk_t, 0.0);
  // Through an edge: it has left before it enters if the axis on which it leaves goes first.
  bvec3 first = both(equal(far_t, vec3(walk_t)), lessThan(ivec3(0, 1, 2), ivec3(walk_axis)));
  if (any(either(lessThan(far_t, vec3(walk_t)), first)) || walk_t > max_t) return false;
  ivec3 at = ivec3(floor(ray_origin));
  if (walk_axis >= 0) {
    at = coordinates_after(walk_t, walk_axis, walk_low - ray_base, walk_high - ray_base - 1);
    at[walk_axis] = ray_forward[walk_axis] ? walk_low[walk_axis] - ray_base[walk_axis]
                                           : walk_high[walk_axis] - ray_base[walk_axis] - 1;
  }
  walk_voxel = at + ray_base;
  walk_node = tree.root;
  walk_level = tree.low.w;
  return true;
}

// Leaves the aligned block of edge 2^shift around the voxel; false when the ray then has left the bounds or is past
// max_t.
bool leave_block(int shift, float max_t) {
  ivec3 from = walk_voxel;
  ivec3 low = ((from >> shift) << shift) - ray_base;
  int size = 1 << shift;
  precise vec3 t = (vec3(mix(low, low + size, ray_forward)) - ray_origin) * ray_inverse;
  t = mix(t, vec3(kNever), ray_still);
  int axis = t.x <= t.y && t.x <= t.z ? 0 : t.y <= t.z ? 1 : 2;
  walk_axis = axis;
  walk_t = t[axis];
  if (!(walk_t <= min(walk_exit_t, max_t))) return false;
  if (shift > 0) walk_voxel = coordinates_after(walk_t, axis, low, low + size - 1) + ray_base;
  walk_voxel[axis] = low[axis] + (ray_forward[axis] ? size : -1) + ray_base[axis];
  if (any(lessThan(walk_voxel, walk_low)) || any(greaterThanEqual(walk_voxel, walk_high))) return false;
  ivec3 changed = walk_voxel ^ from;
  int ancestor = findMSB(changed.x | changed.y | changed.z) >> 1;
  if (ancestor > walk_level) {
    walk_level = ancestor;
    walk_node = walk_stack[ancestor];
  }
  return true;
}

// Goes on, from where the walk stands, to the first occupied voxel; false when there is none up to max_t.
bool find_voxel(float max_t) {
  for (;;) {
    int shift = 2 * walk_level;
    ivec3 place = (walk_voxel >> shift) & 3;
    uint index = uint(place.x + 4 * place.y + 16 * place.z);
    uint bits = index < 32 ? walk_node.x : walk_node.y;
    uint bit = 1u << (index & 31);
    if ((bits & bit) == 0) {
      if (!leave_block(shift, max_t)) return false;
      continue;
    }
    // Words of voxels and what is full have no children.
    if ((walk_node.z & 1) != 0) return true;
    uint child = bitCount(bits & (bit - 1)) + (index < 32 ? 0 : bitCount(walk_node.x));
    uvec2 children = walk_node.zw;
    walk_stack[walk_level] = walk_node;
    --walk_level;
    walk_node = walk_level > 0 ? Nodes(children).at[child] : uvec4(Words(children).at[child], 1, 0);
  }
}

// The type of the voxel that was found.
uint type_found() {
  uvec2 children = walk_level == 2 ? walk_node.zw : walk_stack[2].zw;
  // A chunk's record: types, storage, then the tree's bricks.
  uvec4 record = Nodes(uvec2(children.x & ~31u, children.y)).at[0];
  uint bits = record.z;
  if (bits == 0) return record.w;
  Numbers types = Numbers(record.xy);
  ivec3 at = walk_voxel & 63;
  uint slab = types.at[(at.z >> 2) * 16 + (at.y >> 2)];
  uint index = slab & 0x7FFFFFFF;
  if (index == slab) {
    uint row = slab * 16 + uint((at.z & 3) * 4 + (at.y & 3));
    uint first = uint(at.x) * bits;
    index = types.at[record.w + row * bits * 2 + (first >> 5)] >> (first & 31) & ((1u << bits) - 1);
  }
  return bits == 16 ? index : types.at[256 + (index >> 1)] >> (16 * (index & 1)) & 0xFFFF;
}

// The face through which the ray entered the voxel; where it starts inside, the one that looks most against it.
uint face_found() {
  int axis = walk_axis;
  if (axis < 0) {
    vec3 size = abs(ray_direction);
    axis = size.y > size.x ? 1 : 0;
    if (size.z > size[axis]) axis = 2;
  }
  return uint(2 * axis + (ray_forward[axis] ? 1 : 0));
}

// Whether a tree holds a voxel.
bool holds(Tree tree, ivec3 voxel) {
  if (any(lessThan(voxel, tree.low.xyz)) || any(greaterThanEqual(voxel, tree.high.xyz))) return false;
  uvec4 node = tree.root;
  for (int level = tree.low.w;; --level) {
    ivec3 place = (voxel >> (2 * level)) & 3;
    uint index = uint(place.x + 4 * place.y + 16 * place.z);
    uint bits = index < 32 ? node.x : node.y;
    uint bit = 1u << (index & 31);
    if ((bits & bit) == 0) return false;
    if ((node.z & 1) != 0) return true;
    uint child = bitCount(bits & (bit - 1)) + (index < 32 ? 0 : bitCount(node.x));
    node = level > 1 ? Nodes(node.zw).at[child] : uvec4(Words(node.zw).at[child], 1, 0);
  }
}
