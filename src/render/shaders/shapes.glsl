// The shapes of voxels; matches scene/tracer/shape_rays.h on the CPU, in single precision. Included by walk.glsl.
//
// The record of a chunk that shapes touch is a tree of these voxels. Its words of 4^3 voxels have a number each: where
// the list of the word begins in the record, in numbers. A list has for each of its voxels, in the order of the word's
// bits, where the voxel's shapes begin in the list. A shape takes two numbers: kShapeType, kShapePlace and flags, and
// the index of its model.
//
// A model in the table of vectors:
//
//   0      number of boxes; index of the first side; number of the first free side (fluids), and how many there are
//   1      index of the corners of free sides, four vectors each; the sides of the voxel that are covered wholly, a bit
//          per direction
//   then   boxes, kBoxVectors each: lower corner, w: the place of its turn in the model, or 0; upper corner; the
//          numbers of its sides, 16 bits each, kNoSide for those that are not drawn
//   then   turns, four vectors each: origin, and the rows of the matrix
//   then   sides, kSideVectors each: plane; texture coordinates rightwards and downwards as functions of the position;
//          address of the texels, flags, square of the texture's sides per voxel; tint, w: the side's emission

const uint kBoxVectors = 3;
const uint kSideVectors = 5;
const uint kNoSide = 0xFFFF;
const uint kCutoutAlpha = 128;  // texels are visible from here on

// Parts and flags of a shape in a list.
const uint kShapeType = 0xFFFF;
const uint kShapePlace = 16;  // bits: x + 3 y + 9 z of the shape's voxel, from the one below the cell on each axis
const uint kShapeIsLast = 1u << 21;
const uint kShapeIsOpaque = 1u << 22;  // its material

// Flags of a side; bits 0 to 3 are log2 of the texels per side.
const uint kSideHides = 1u << 4;     // the background, wherever it is
const uint kSideIsCutout = 1u << 5;  // or where texels are visible
const uint kSideHasLook = 1u << 6;
const uint kSideHasTexels = 1u << 7;
const uint kSideIsGlass = 1u << 8;
const uint kSideIsOnVoxel = 1u << 9;   // it lies on a side of the voxel
const uint kSideIsTilted = 1u << 10;
const uint kSideIsLamp = 1u << 11;  // of path tracing
const uint kSideDirection = 12;  // bits: the direction nearest to its normal

// A side in points and bodies: its index in the table; with this flag, seen from behind.
const uint kFromBehind = 0x80000000u;

// A side at or beyond the boundary between two cells counts for both: room for rounding, in voxels; and by distance.
const float kBetweenCells = 1e-5;
const float kRoundingByT = 2.4e-7;

vec4 shape_vector(uint i) {
  return Vectors(frame().shape_models).at[i];
}
uvec4 shape_numbers(uint i) {
  return floatBitsToUint(Vectors(frame().shape_models).at[i]);
}
uint side_index(uint side) {
  return side & ~kFromBehind;
}
uint side_flags(uint side) {
  return shape_numbers(side_index(side) + 3).z;
}
// Returns the unit normal of a side, towards its viewer.
vec3 side_normal(uint side) {
  vec3 normal = shape_vector(side_index(side)).xyz;
  return (side & kFromBehind) != 0 ? -normal : normal;
}
// Returns the direction nearest to that normal.
uint side_direction(uint side) {
  uint direction = side_flags(side) >> kSideDirection & 7;
  return (side & kFromBehind) != 0 ? direction ^ 1 : direction;
}
bool is_tilted(uint side) {
  return (side_flags(side) & kSideIsTilted) != 0;
}
// Returns the side of the voxel that a side lies on and faces; -1 if there is none.
int side_of_voxel(uint side) {
  bool faces_out = (side_flags(side) & kSideIsOnVoxel) != 0 && (side & kFromBehind) == 0 && !is_tilted(side);
  return faces_out ? int(side_direction(side)) : -1;
}

// Returns the texture coordinates of a point of a side, 0 to 1 within the texture.
vec2 side_place(uint side, vec3 point) {
  vec4 right = shape_vector(side_index(side) + 1);
  vec4 down = shape_vector(side_index(side) + 2);
  return vec2(dot(right.xyz, point) + right.w, dot(down.xyz, point) + down.w);
}
// Returns a texel, 8 bits each of red, green, blue, alpha. `log_size`: of the mipmap level.
uint side_texel(uint side, vec3 point, int log_size) {
  uvec4 what = shape_numbers(side_index(side) + 3);
  int last = int(what.z & 15);
  float size = float(1u << log_size);
  uvec2 at = min(uvec2(max(vec2(0.0), side_place(side, point) * size)), uvec2(size - 1.0));
  uint begin = ((4u << 2 * last) - (4u << 2 * log_size)) / 3;
  return Numbers(what.xy).at[begin + (at.y << log_size) + at.x];
}
uint side_texel(uint side, vec3 point) {
  return side_texel(side, point, int(side_flags(side) & 15));
}

Tree no_tree() {
  return Tree(uvec4(0), ivec4(0, 0, 0, 2), ivec4(0));
}
ShapeTrees shape_trees(int grid) {
  if (uint(grid) >= frame().shaped_grids) return ShapeTrees(no_tree(), no_tree());
  return ShapeGrids(frame().shape_grids).at[grid];
}

// A ray on its way through the shapes of one cell, in steps of one box or free side. Distances count from its entry
// into the cell.
struct ShapeRay {
  Numbers list;
  uint next;    // of the list: the next shape
  ivec3 cell;
  vec3 entry;   // into the cell, from its lower corner
  float begin;  // t of the entry
  float size;   // up to the exit
  float room;   // for rounding
  uint shape;   // the first number of the present one; 0 before the first
  uint model;
  vec3 origin;  // of the distances, from the shape's voxel
  uint box;     // the next one; then come free sides, twice each
  uint boxes;
  uint steps;   // of the shape
  float after;  // t of the end of the last way through free sides
};

// The way of a ray through a box, or through a fluid. A plate has no length.
struct ShapeSpan {
  float enter_t;
  float exit_t;
  uint enter_side;  // an index, or kNoSide
  uint exit_side;
  vec3 exit_normal;  // outward, unit
};

// Returns the walk's ray in the voxel found, which shapes touch, before the first of them.
ShapeRay shapes_found() {
  uvec4 brick = walk_stack[1];
  uint child = child_of(brick, index_in(walk_voxel, 1));
  uint words = bitCount(brick.x) + bitCount(brick.y);
  uint from = Numbers(address_after(brick.zw, 8 * words)).at[child];
  ShapeRay ray;
  ray.list = Numbers(address_after(record_found(), 4 * from));
  ray.next = ray.list.at[child_of(walk_node, index_in(walk_voxel, 0))];
  ray.cell = walk_voxel;
  ray.begin = walk_t;
  ray.entry = ray_origin + walk_t * ray_direction - vec3(walk_voxel - ray_base);
  vec3 last = (mix(vec3(0.0), vec3(1.0), ray_forward) - ray.entry) * ray_inverse;
  last = mix(last, vec3(kNever), ray_still);
  ray.size = max(min(min(last.x, last.y), last.z), 0.0);
  vec3 speed = abs(ray_direction);
  ray.room = kBetweenCells / max(max(speed.x, speed.y), speed.z) + kRoundingByT * walk_t;
  ray.shape = 0;
  ray.box = ray.boxes = ray.steps = 0;
  return ray;
}

// Begins with the next shape of the list.
void open_shape(inout ShapeRay ray) {
  ray.shape = ray.list.at[ray.next];
  ray.model = ray.list.at[ray.next + 1];
  ray.next += 2;
  int place = int(ray.shape >> kShapePlace & 31);
  ray.origin = ray.entry - vec3(ivec3(place % 3, place / 3 % 3, place / 9) - 1);
  uvec4 head = shape_numbers(ray.model);
  ray.box = 0;
  ray.boxes = head.x;
  ray.steps = head.x + 2 * head.w;
  ray.after = -kNever;
}
ivec3 shape_voxel(ShapeRay ray) {
  int place = int(ray.shape >> kShapePlace & 31);
  return ray.cell + ivec3(place % 3, place / 3 % 3, place / 9) - 1;
}

uint side_of_box(uint first, uvec4 sides, uint side) {
  uint number = sides[side >> 1] >> (16 * (side & 1)) & 0xFFFF;
  return number == kNoSide ? kNoSide : first + kSideVectors * number;
}

// Finds the way through a box. Returns false if there is none.
bool cross_box(ShapeRay ray, uint number, inout ShapeSpan span) {
  uint at = ray.model + 2 + kBoxVectors * number;
  vec4 low = shape_vector(at);
  vec3 high = shape_vector(at + 1).xyz;
  vec3 origin = ray.origin;
  vec3 direction = ray_direction;
  uint turn = floatBitsToUint(low.w);
  mat3 rows = mat3(1.0);
  if (turn != 0) {
    rows = mat3(shape_vector(ray.model + turn + 1).xyz, shape_vector(ray.model + turn + 2).xyz,
                shape_vector(ray.model + turn + 3).xyz);
    origin = (origin - shape_vector(ray.model + turn).xyz) * rows;
    direction = direction * rows;
  }
  bvec3 still = equal(direction, vec3(0.0));
  bvec3 forward = greaterThan(direction, vec3(0.0));
  bvec3 is_outside = either(either(lessThan(origin, low.xyz), greaterThan(origin, high)), equal(low.xyz, high));
  vec3 inverse = 1.0 / mix(direction, vec3(1.0), still);
  precise vec3 near = (mix(high, low.xyz, forward) - origin) * inverse;
  precise vec3 far = (mix(low.xyz, high, forward) - origin) * inverse;
  near = mix(near, vec3(-kNever), still);
  far = mix(far, vec3(kNever), still);
  span.enter_t = max(max(near.x, near.y), near.z);
  span.exit_t = min(min(far.x, far.y), far.z);
  // If a ray crosses several planes at once, the last one counts, as for voxels.
  int enter_axis = near.z == span.enter_t ? 2 : near.y == span.enter_t ? 1 : 0;
  int exit_axis = far.x == span.exit_t ? 0 : far.y == span.exit_t ? 1 : 2;
  bool is_upper = direction[exit_axis] > 0.0;
  uvec4 sides = shape_numbers(at + 2);
  uint first = shape_numbers(ray.model).y;
  span.enter_side = side_of_box(first, sides, uint(2 * enter_axis) + (direction[enter_axis] < 0.0 ? 0 : 1));
  span.exit_side = side_of_box(first, sides, uint(2 * exit_axis) + (is_upper ? 0 : 1));
  span.exit_normal = (is_upper ? 1.0 : -1.0) * normalize(rows[exit_axis]);
  float end = span.exit_t + ray.begin;
  bool is_met = span.enter_t < span.exit_t ? end > 0.0 : span.enter_t == span.exit_t && enter_axis == exit_axis;
  return is_met && end >= 0.0 && !any(both(still, is_outside));
}

// Finds where the ray crosses a free side. Neighbouring sides agree about their common edge, except that both may
// contain it.
bool cross_free_side(ShapeRay ray, uint side, uint corners, out float t, out bool enters) {
  vec3 normal = shape_vector(side).xyz;
  bool is_left = true;
  bool is_right = true;
  for (uint i = 0; i < 4; ++i) {
    precise vec3 from = shape_vector(corners + i).xyz - ray.origin;
    precise vec3 to = shape_vector(corners + (i + 1 & 3)).xyz - ray.origin;
    precise vec3 across = vec3(from.y * to.z - from.z * to.y, from.z * to.x - from.x * to.z,
                               from.x * to.y - from.y * to.x);
    precise float volume = dot(ray_direction, across);
    is_left = is_left && volume >= 0.0;
    is_right = is_right && volume <= 0.0;
  }
  float along = dot(normal, ray_direction);
  enters = along < 0.0;
  t = dot(normal, shape_vector(corners).xyz - ray.origin) / along;
  return is_left != is_right && along != 0.0;
}

// Looks at a free side. All are looked at twice for a way through their closed surface: to find the first one that the
// ray enters, and the next one that it leaves. Returns true if that completes a way.
bool cross_fluid(inout ShapeRay ray, inout ShapeSpan span) {
  uvec4 head = shape_numbers(ray.model);
  uint step = ray.box - ray.boxes;
  bool is_begin = step < head.w;
  uint number = is_begin ? step : step - head.w;
  if (step == 0) span.enter_t = span.exit_t = kNever;
  uint side = head.y + kSideVectors * (head.z + number);
  float t;
  bool enters;
  bool is_crossed = cross_free_side(ray, side, shape_numbers(ray.model + 1).x + 4 * number, t, enters);
  if (is_crossed && is_begin && enters && t > ray.after && t < span.enter_t) {
    span.enter_t = t;
    span.enter_side = side;
  }
  if (is_crossed && !is_begin && !enters && t >= span.enter_t && t < span.exit_t) {
    span.exit_t = t;
    span.exit_side = side;
    span.exit_normal = shape_vector(side).xyz;
  }
  ++ray.box;
  bool is_done = ray.box == ray.steps && span.exit_t < kNever;
  if (is_done) {
    ray.after = span.exit_t;
    ray.box = ray.boxes;
  }
  return is_done && span.exit_t + ray.begin > 0.0 && span.exit_t > span.enter_t;
}

// Returns true if there are shapes, boxes or free sides left.
bool has_more(ShapeRay ray) {
  return ray.box < ray.steps || (ray.shape & kShapeIsLast) == 0;
}
// Looks at the next shape, box or free side. Returns true if that completes a way through a shape. Keep `span` for the
// next step.
bool step_in_shapes(inout ShapeRay ray, inout ShapeSpan span) {
  bool is_found = false;
  if (ray.box >= ray.steps) {
    open_shape(ray);
  } else if (ray.box < ray.boxes) {
    is_found = cross_box(ray, ray.box, span);
    ++ray.box;
  } else {
    is_found = cross_fluid(ray, span);
  }
  return is_found;
}

// Returns true if the ray's origin lies behind the beginning of a way. A ray that was moved to the bounds of the shapes
// began before them.
bool starts_inside(ShapeRay ray, ShapeSpan span) {
  return !ray_is_moved && span.enter_t + ray.begin < 0.0;
}

// The first visible part of a shape that a ray meets.
struct ShapeMet {
  float t;
  uint side;  // undefined if the ray starts inside
  ivec3 voxel;
  uint type;
  bool starts_inside;
};
ShapeMet shape_met;

// Returns true if the ray, up to `end`, meets a side in the cell that is drawn and visible.
bool is_side_visible(ShapeRay ray, uint side, float t, float end) {
  bool is_there = side != kNoSide && t >= -ray.room && t <= end && (ray_is_moved || t + ray.begin >= 0.0);
  bool is_visible = false;
  if (is_there) {
    uint flags = side_flags(side);
    is_visible = (flags & kSideHides) != 0;
    if ((flags & kSideIsCutout) != 0) {
      is_visible = side_texel(side, ray.origin + t * ray_direction) >> 24 >= kCutoutAlpha;
    }
  }
  return is_visible;
}

// Finds the first visible part of the shapes in the voxel found.
bool meet_shapes(float max_t) {
  ShapeRay ray = shapes_found();
  float end = min(ray.size + ray.room, max_t - ray.begin);
  shape_met.t = kNever;
  ShapeSpan span;
  while (has_more(ray)) {
    bool is_found = step_in_shapes(ray, span);
    bool is_inside = is_found && starts_inside(ray, span) && (ray.shape & kShapeIsOpaque) != 0;
    bool is_met = is_inside && ray.begin <= ray.room;
    float t = is_inside ? -ray.begin : span.enter_t;
    uint side = span.enter_side;
    // Both sides of a plate are at one place: the ray meets the side that it looks at.
    bool has_behind = span.enter_t < span.exit_t || span.enter_side == kNoSide;
    for (int i = 0; i < 2 && is_found && !is_inside && !is_met; ++i) {
      bool is_behind = i == 1;
      t = is_behind ? span.exit_t : span.enter_t;
      side = is_behind ? span.exit_side : span.enter_side;
      is_met = (!is_behind || has_behind) && is_side_visible(ray, side, t, end);
      if (is_behind) side |= kFromBehind;
    }
    if (is_met && ray.begin + t < shape_met.t) {
      shape_met = ShapeMet(ray.begin + t, side, shape_voxel(ray), ray.shape & kShapeType, is_inside);
    }
  }
  return shape_met.t < kNever;
}
