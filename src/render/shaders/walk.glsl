// Walks one ray through one tree, in a single loop. An iteration either descends to the child at the ray's position, or
// steps over the largest aligned block around it that is known to be empty, and ascends to the lowest ancestor that
// contains both ends of that step.
//
// A ray crosses the plane P of an axis at t = (P - origin) * (1 / direction), in single precision. Crossings are
// ordered by t, ties by axis, as defined in docs/decisions/011, so that the CPU kernels meet the same voxels. `origin`
// is relative to a multiple of 64 voxels near the ray's start.

// Returns the index of a voxel's child in the node of a level that contains it.
uint index_in(ivec3 voxel, int level) {
  ivec3 place = (voxel >> (2 * level)) & 3;
  return uint(place.x + 4 * place.y + 16 * place.z);
}

// `has_child` returns true if a node has a child at an index; `child_of` returns that child's number.
bool has_child(uvec4 node, uint index) {
  return ((index < 32 ? node.x : node.y) & (1u << (index & 31))) != 0;
}
uint child_of(uvec4 node, uint index) {
  uint before = (1u << (index & 31)) - 1;
  return index < 32 ? bitCount(node.x & before) : bitCount(node.x) + bitCount(node.y & before);
}

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
// The walk's position: the voxel, t at the entry, and the axis that the ray crossed there; -1 at the start.
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

// Returns the coordinates, relative to ray_base, just after the crossing of `axis` at `t`, clamped to `low` and `high`;
// the coordinate of `axis` itself is undefined.
ivec3 coordinates_after(float t, int axis, ivec3 low, ivec3 high) {
  precise vec3 position = ray_origin + t * ray_direction;
  vec3 at = clamp(floor(position), vec3(low), vec3(high));
  vec3 past = position - at;
  // Rounding can put a position on the wrong side of a plane only next to it.
  vec3 near = 0.01 + abs(position) * 1e-6;
  bvec3 is_close = either(lessThan(past, near), greaterThan(past, 1.0 - near));
  bvec3 is_other = notEqual(ivec3(0, 1, 2), ivec3(axis));
  // The last clamp handles numbers beyond 2^24, where rounding can move them by more than one.
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

// Sets the walk's ray, relative to the 64-voxel block at the ray's origin.
void set_ray(ivec3 base, vec3 origin, vec3 direction) {
  ivec3 whole = ivec3(clamp(floor(origin), vec3(-1e9), vec3(1e9)));
  ivec3 shift = whole & ~63;
  ray_base = base + shift;
  ray_origin = min(origin - vec3(shift), vec3(whole - shift) + (1.0 - 1.0 / 131072.0));
  ray_still = lessThan(abs(direction), vec3(1e-30));
  ray_direction = mix(direction, vec3(0.0), ray_still);
  ray_inverse = 1.0 / mix(direction, vec3(1.0), ray_still);
  ray_forward = greaterThan(ray_direction, vec3(0.0));
  ray_sign = mix(vec3(-1.0), vec3(1.0), ray_forward);
}

// Starts a ray at its origin, or where it enters the tree's bounds; returns false if it misses them.
//
// `moved`: the axis of the bounds' plane that the ray was moved to before; -1 for a ray that starts at its origin.
bool start_walk(Tree tree, ivec3 base, vec3 origin, vec3 direction, float max_t, int moved) {
  if (any(greaterThanEqual(tree.low.xyz, tree.high.xyz))) return false;
  set_ray(base, origin, direction);
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
  // Through an edge: the ray exits before it enters if the exit axis comes first.
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

// Leaves the aligned block of edge 2^shift around the voxel. Returns false if the ray is then outside the bounds or
// past max_t.
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

// Continues from the walk's position to the first occupied voxel; returns false if there is none up to max_t.
bool find_voxel(float max_t) {
  for (;;) {
    uint index = index_in(walk_voxel, walk_level);
    if (!has_child(walk_node, index)) {
      if (!leave_block(2 * walk_level, max_t)) return false;
      continue;
    }
    // Words of voxels and full nodes have no children.
    if ((walk_node.z & 1) != 0) return true;
    uint child = child_of(walk_node, index);
    uvec2 children = walk_node.zw;
    walk_stack[walk_level] = walk_node;
    --walk_level;
    walk_node = walk_level > 0 ? Nodes(children).at[child] : uvec4(Words(children).at[child], 1, 0);
  }
}

// Returns the address of a chunk's record: types, storage, then the tree's bricks.
uvec2 record_of(uvec4 chunk) {
  return uvec2(chunk.z & ~31u, chunk.w);
}
uvec2 record_found() {
  return record_of(walk_level == 2 ? walk_node : walk_stack[2]);
}

// Returns the type of a chunk's voxel or sample.
uint type_in(uvec2 address, ivec3 at) {
  uvec4 record = Nodes(address).at[0];
  uint bits = record.z;
  if (bits == 0) return record.w;
  Numbers types = Numbers(record.xy);
  uint slab = types.at[(at.z >> 2) * 16 + (at.y >> 2)];
  uint index = slab & 0x7FFFFFFF;
  if (index == slab) {
    uint row = slab * 16 + uint((at.z & 3) * 4 + (at.y & 3));
    uint first = uint(at.x) * bits;
    index = types.at[record.w + row * bits * 2 + (first >> 5)] >> (first & 31) & ((1u << bits) - 1);
  }
  return bits == 16 ? index : types.at[256 + (index >> 1)] >> (16 * (index & 1)) & 0xFFFF;
}

// Returns the type of the voxel found.
uint type_found() {
  return type_in(record_found(), walk_voxel & 63);
}

// Returns the face where the ray entered the voxel; for a ray that starts inside, the face most opposed to its
// direction.
uint face_found() {
  int axis = walk_axis;
  if (axis < 0) {
    vec3 size = abs(ray_direction);
    axis = size.y > size.x ? 1 : 0;
    if (size.z > size[axis]) axis = 2;
  }
  return uint(2 * axis + (ray_forward[axis] ? 1 : 0));
}

// Returns true if a tree contains a voxel.
bool holds(Tree tree, ivec3 voxel) {
  if (any(lessThan(voxel, tree.low.xyz)) || any(greaterThanEqual(voxel, tree.high.xyz))) return false;
  uvec4 node = tree.root;
  for (int level = tree.low.w;; --level) {
    uint index = index_in(voxel, level);
    if (!has_child(node, index)) return false;
    if ((node.z & 1) != 0) return true;
    uint child = child_of(node, index);
    node = level > 1 ? Nodes(node.zw).at[child] : uvec4(Words(node.zw).at[child], 1, 0);
  }
}

// Density fields. Their trees hold the cells that touch the solid. In a cell the field along a ray is a cubic, whose
// first root is found as in trace/kernel/cell_cubic.inl on the CPU, here in single precision.

const int kBlockEdge = 7;

uvec2 address_after(uvec2 address, uint bytes) {
  uint carry;
  uint low = uaddCarry(address.x, bytes, carry);
  return uvec2(low, address.y + carry);
}

uvec2 address_before(uvec2 address, uint bytes) {
  return uvec2(address.x - bytes, address.y - (address.x < bytes ? 1 : 0));
}

// Returns a sample of a block, which holds the samples around a word's cells, from the one before its first corner on.
float sample_of(Numbers block, ivec3 at) {
  uint i = uint((at.z * kBlockEdge + at.y) * kBlockEdge + at.x);
  vec2 two = unpackHalf2x16(block.at[i >> 1]);
  return (i & 1) == 0 ? two.x : two.y;
}

// Gets the densities around a cell of a brick in a chunk with that record. Returns false if all of them are solid.
bool block_in(uvec4 brick, uvec2 record, ivec3 cell, out Numbers block) {
  uint child = child_of(brick, index_in(cell, 1));
  uint words = bitCount(brick.x) + bitCount(brick.y);
  uint from = Numbers(address_after(brick.zw, 8 * words)).at[child];
  block = Numbers(address_after(record, 4 * from));
  return from != 0;
}

// Gets the densities of the cell found. Returns false if all of them are solid, like their neighbours.
bool block_found(out Numbers block) {
  return walk_level == 0 && block_in(walk_stack[1], record_found(), walk_voxel, block);
}

// Evaluates a cubic in powers of s.
float value_at(vec4 f, float s) {
  return ((f.w * s + f.z) * s + f.y) * s + f.x;
}

// Returns the root between `low`, where the cubic is not negative, and `high`, where it is.
float root_between(vec4 f, float low, float high) {
  float f_low = value_at(f, low);
  float f_high = value_at(f, high);
  float s = low + (high - low) * (f_low / (f_low - f_high));
  for (int i = 0; i < 24; ++i) {
    float value = value_at(f, s);
    if (value < 0.0) {
      high = s;
    } else {
      low = s;
    }
    if (!(high - low > 1e-7)) break;
    float next = s - value / ((3.0 * f.w * s + 2.0 * f.z) * s + f.y);
    if (!(next > low && next < high)) next = 0.5 * (low + high);
    if (abs(next - s) <= 1e-6) return next;
    s = next;
  }
  return s;
}

// Returns the first s from 0 to 1 where a cubic becomes negative; a negative number if it never does.
float first_negative(vec4 f) {
  if (f.x < 0.0) return 0.0;
  float b1 = f.x + f.y * (1.0 / 3.0);
  float b2 = f.x + (2.0 * f.y + f.z) * (1.0 / 3.0);
  float b3 = f.x + f.y + f.z + f.w;
  if (min(min(b1, b2), b3) >= 0.0) return -1.0;
  if (b3 < 0.0 && !(b1 < 0.0 && b2 >= 0.0)) return root_between(f, 0.0, 1.0);
  // Between its extremes the curve is monotonic.
  float a = 3.0 * f.w;
  float b = 2.0 * f.z;
  float discriminant = b * b - 4.0 * a * f.y;
  float low = 0.0;
  if (discriminant > 0.0) {
    float q = -0.5 * (b + (b < 0.0 ? -1.0 : 1.0) * sqrt(discriminant));
    float one = a != 0.0 ? q / a : -1.0;
    float other = q != 0.0 ? f.y / q : -1.0;
    for (int i = 0; i < 2; ++i) {
      float extreme = i == 0 ? min(one, other) : max(one, other);
      if (!(extreme > low && extreme < 1.0)) continue;
      if (value_at(f, extreme) < 0.0) return root_between(f, low, extreme);
      low = extreme;
    }
  }
  return b3 < 0.0 ? root_between(f, low, 1.0) : -1.0;
}

float mixed_corners(vec4 low, vec4 high, vec3 at) {
  vec4 z = low + (high - low) * at.z;
  vec2 y = z.xy + (z.zw - z.xy) * at.y;
  return y.x + (y.y - y.x) * at.x;
}

// Gets a cell's corners, indexed by x + 2 y, at z and z + 1.
void corners_of(Numbers block, ivec3 first, out vec4 low, out vec4 high) {
  low = vec4(sample_of(block, first), sample_of(block, first + ivec3(1, 0, 0)),
             sample_of(block, first + ivec3(0, 1, 0)), sample_of(block, first + ivec3(1, 1, 0)));
  high = vec4(sample_of(block, first + ivec3(0, 0, 1)), sample_of(block, first + ivec3(1, 0, 1)),
              sample_of(block, first + ivec3(0, 1, 1)), sample_of(block, first + ivec3(1, 1, 1)));
}

// Returns the field of a cell along a ray, in powers of s. `entry`: a point in the cell, 0 to 1 on each axis; `way`:
// from there to the point at s = 1.
vec4 cubic_of(vec4 low, vec4 high, vec3 entry, vec3 way) {
  vec4 rise = high - low;
  vec4 z0 = low + rise * entry.z;
  vec4 z1 = rise * way.z;
  vec2 rise0 = z0.zw - z0.xy;
  vec2 rise1 = z1.zw - z1.xy;
  vec2 y0 = z0.xy + rise0 * entry.y;
  vec2 y1 = z1.xy + rise1 * entry.y + rise0 * way.y;
  vec2 y2 = rise1 * way.y;
  float x0 = y0.y - y0.x;
  float x1 = y1.y - y1.x;
  float x2 = y2.y - y2.x;
  return vec4(y0.x + x0 * entry.x, y1.x + x1 * entry.x + x0 * way.x, y2.x + x2 * entry.x + x1 * way.x, x2 * way.x);
}

// A hit on a field.
struct FieldHit {
  float t;
  vec3 inside;  // position in the cell
  bool starts_inside;
};

// Intersects the ray with the field in the cell found, up to `max_t`.
bool meet_cell(float max_t, out FieldHit hit) {
  hit.t = walk_t;
  hit.starts_inside = walk_axis < 0;
  vec3 cell = vec3(walk_voxel - ray_base);
  Numbers block;
  if (!block_found(block)) {
    hit.inside = clamp(ray_origin + walk_t * ray_direction - cell, vec3(0.0), vec3(1.0));
    return true;
  }
  vec3 first = (mix(cell + 1.0, cell, ray_forward) - ray_origin) * ray_inverse;
  vec3 last = (mix(cell, cell + 1.0, ray_forward) - ray_origin) * ray_inverse;
  first = mix(first, vec3(0.0), ray_still);
  last = mix(last, vec3(kNever), ray_still);
  float t_in = max(max(first.x, first.y), max(first.z, 0.0));
  float t_out = max(min(min(last.x, last.y), last.z), t_in);
  float size = min(t_out, max_t) - t_in;
  if (size < 0.0) return false;
  vec3 entry = clamp(ray_origin + t_in * ray_direction - cell, vec3(0.0), vec3(1.0));
  vec3 way = ray_direction * size;
  vec4 low;
  vec4 high;
  corners_of(block, (walk_voxel & 3) + 1, low, high);
  float s = first_negative(cubic_of(low, high, entry, way));
  if (s < 0.0) return false;
  hit.t = t_in + s * size;
  hit.inside = entry + s * way;
  hit.starts_inside = hit.t <= 0.0;
  return true;
}

#include "shapes.glsl"

// Like find_voxel; in the tree of a field, finds the first point with a negative density, and in that of shapes, the
// first visible part (shape_met). `t`: the distance along the ray.
bool find_content(int content, float max_t, out float t, out FieldHit hit) {
  while (find_voxel(max_t)) {
    t = walk_t;
    bool is_met = true;
    if (is_shape_content(content)) {
      is_met = meet_shapes(max_t);
      t = shape_met.t;
    } else if (is_field_content(content)) {
      is_met = meet_cell(max_t, hit);
      t = hit.t;
    }
    if (is_met) return true;
    if (!leave_block(0, max_t)) return false;
  }
  return false;
}

float field_in_block(Numbers block, vec3 at) {
  vec3 first = clamp(floor(at), vec3(0.0), vec3(float(kBlockEdge - 2)));
  vec4 low;
  vec4 high;
  corners_of(block, ivec3(first), low, high);
  return mixed_corners(low, high, at - first);
}

// Returns the gradient of a cell's field.
vec3 gradient_of(vec4 low, vec4 high, vec3 inside) {
  vec4 z = mix(low, high, inside.z);
  vec4 along_z = high - low;
  vec2 y = mix(z.xy, z.zw, inside.y);
  vec2 along_y = z.zw - z.xy;
  vec2 z_y = mix(along_z.xy, along_z.zw, inside.y);
  return vec3(y.y - y.x, mix(along_y.x, along_y.y, inside.x), mix(z_y.x, z_y.y, inside.x));
}

// Returns the lighting normal of a field in a cell, whose lowest corner is `first` of a block; matches
// trace/density/density_glass.h on the CPU. Unit, or 0.
vec3 normal_in(Numbers block, ivec3 first, vec3 inside) {
  vec3 at = vec3(first) + inside;
  vec4 low;
  vec4 high;
  corners_of(block, first, low, high);
  // The gradient of the cell alone.
  vec3 own = gradient_of(low, high, inside);
  float own_size = length(own);
  own = own_size > 0.0 ? own / own_size : vec3(0.0);
  vec3 gradient = vec3(0.0);
  for (int side = 0; side < 6; ++side) {
    float forward = (side & 1) == 0 ? 1.0 : -1.0;
    vec3 step = vec3(0.0);
    step[side >> 1] = forward;
    gradient[side >> 1] += forward * field_in_block(block, at + step);
  }
  float size = length(gradient);
  return dot(gradient, own) > 0.5 * size ? gradient / size : own;
}
vec3 normal_found(vec3 inside) {
  Numbers block;
  return block_found(block) ? normal_in(block, (walk_voxel & 3) + 1, inside) : vec3(0.0);
}

// Finds the node of the chunk of a voxel, or of a field's sample. Returns false if the tree has none.
bool find_chunk(Tree tree, ivec3 at, out uvec4 node) {
  if (any(lessThan(at, tree.low.xyz)) || any(greaterThanEqual(at, tree.high.xyz))) return false;
  node = tree.root;
  for (int level = tree.low.w; level > 2; --level) {
    if ((node.z & 1) != 0) break;
    uint index = index_in(at, level);
    if (!has_child(node, index)) return false;
    node = Nodes(node.zw).at[child_of(node, index)];
  }
  return true;
}

// Returns the type of a voxel, or of a field's sample; 0 if the tree has no chunk there.
uint type_at(Tree tree, ivec3 at) {
  uvec4 node;
  return find_chunk(tree, at, node) ? type_in(record_of(node), at & 63) : 0;
}

// Returns the material of the solid sample nearest to the hit.
uint material_found(Tree field, vec3 inside) {
  ivec3 nearest = ivec3(greaterThan(inside, vec3(0.5)));
  Numbers block;
  if (block_found(block)) {
    float least = kNever;
    for (int i = 0; i < 8; ++i) {
      ivec3 corner = ivec3(i & 1, i >> 1 & 1, i >> 2);
      vec3 away = vec3(corner) - inside;
      float far = dot(away, away);
      if (!(sample_of(block, (walk_voxel & 3) + 1 + corner) < 0.0) || !(far < least)) continue;
      least = far;
      nearest = corner;
    }
  }
  ivec3 at = walk_voxel + nearest;
  if (((at ^ walk_voxel) & ~63) == ivec3(0)) return type_in(record_found(), at & 63);
  // The next chunk owns the sample: its cell there touches it.
  return type_at(field, at);
}

// Encodes the zero vector; no unit vector has this word.
const uint kNoNormal = 0x80008000u;

// Packs a unit vector, or 0, for `normal_of`.
uint packed_normal(vec3 n) {
  float size = abs(n.x) + abs(n.y) + abs(n.z);
  if (!(size > 0.0)) return kNoNormal;
  vec2 at = n.xy / size;
  if (n.z < 0.0) at = (1.0 - abs(at.yx)) * vec2(at.x >= 0.0 ? 1.0 : -1.0, at.y >= 0.0 ? 1.0 : -1.0);
  return packSnorm2x16(at);
}
vec3 normal_of(uint word) {
  return word == kNoNormal ? vec3(0.0) : unit_vector(word);
}
