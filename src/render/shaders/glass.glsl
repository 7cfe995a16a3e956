// Glass bodies along a ray; matches render/light/glass_bodies.h on the CPU. They are kept in a list, nearest first.
// With KEEPS_BODIES there is one of kBodies for each pixel of the tile; with HOLDS_BODIES the invocation has one.

// Natural logarithm of the transmittance below which a body counts as closed.
const float kClosed = -11.0;
const float kDiagonal = 1.7320508;  // of a cube of 1
const float kLeastLogarithm = -1e30;  // of the transmittance of opaque bodies
const float kThinnest = 1e-9;         // length in voxels of a plate, which has none
// Lengths of t within which two bodies touch: the rounding of single precision.
const float kTouching = 4e-6;

uint type_of(Body body) {
  return kHasShapes || kHasCells ? body.what.x & kBodyType : body.what.x;
}
bool is_face(Body body) {
  return kHasCells && (body.what.x & kIsFace) != 0;
}

// Returns the index of a textured type's face.
uint face_of_cell(uint type, uint side) {
  return 6 * ((texture_entry(type) & kTextureNumber) - 1) + side;
}

// Returns the tint and emission of a body's texel.
vec4 tint_of_body(Body body) {
  if (kHasShapes && (body.what.z & kBeginsInShape) != 0) return shape_vector(side_index(body.what.y) + 4);
  uint side = is_face(body) ? body.what.y >> 3 : body.what.y;
  return TexturedFaces(frame().textured_faces).at[face_of_cell(type_of(body), side)].tint;
}

// Returns the surface of a body: that of its type, with the colour and alpha of its texel if it is textured.
Surface surface_of_body(Body body) {
  Surface surface = surface_of(type_of(body));
  if (!(kHasShapes || kHasCells) || (body.what.x & kIsTextured) == 0) return surface;
  vec4 texel = unpackUnorm4x8(floatBitsToUint(body.lengths.w));
  vec4 tint = tint_of_body(body);
  surface.colour = linear_from_srgb(texel.xyz) * tint.xyz;
  surface.emitted = surface.colour * tint.w;
  float open = 1.0 - texel.w;
  surface.log_clarity = max(log(open), kLeastLogarithm);
  surface.log_transmittance = max(log(open * (1.0 - texel.w * (1.0 - surface.colour))), vec3(kLeastLogarithm));
  return surface;
}

bool reaches(Body body, float t) {
  return t <= body.lengths.y + kTouching * max(1.0, body.lengths.y);
}
// Returns true if a body counts with its own length: bodies of fields, bodies that a ray starts in, and clouds.
bool has_own_length(Body body) {
#ifdef HAS_CLOUDS
  if (surface_of(type_of(body)).scattering > 0.0) return true;
#endif
  return (body.what.z & kHowItBegins) != 0;
}
// Returns the share of the light behind it that a face hides.
float cover_of_face(Body body) {
  return (body.what.z & kIsClosed) != 0 ? 1.0 : unpackUnorm4x8(floatBitsToUint(body.lengths.w)).w;
}
// Returns the transmittance of a body or face.
vec3 passed_by_body(Body body) {
  Surface surface = surface_of_body(body);
  if (!is_face(body)) return passed_by(surface, body.lengths.z, has_own_length(body));
  float cover = cover_of_face(body);
  return (1.0 - cover) * (1.0 - cover * (1.0 - surface.colour));
}
// Returns true if voxels of both types are one body of glass: equal types, or fluids of one kind.
bool joins(uint a, uint b) {
  return a == b || (kHasShapes && fluid_of(a) != 0 && fluid_of(a) == fluid_of(b));
}
bool continues(Body body, Body next) {
  return !is_face(body) && !is_face(next) && reaches(body, next.lengths.x) && joins(type_of(next), type_of(body));
}

struct BodyList {
  uvec2 address;
  uint first;
  uint room;  // 0: none is kept
  uint count;
  float dropped_t;  // start of the first body that did not fit
};

#ifdef HOLDS_BODIES
const uint kHeldBodies = 8;
Body held_bodies[kHeldBodies];

Body listed_body(BodyList list, uint i) {
  return held_bodies[i];
}
void list_body(BodyList list, uint i, Body body) {
  held_bodies[i] = body;
}
#else
Body listed_body(BodyList list, uint i) {
  return Bodies(list.address).at[list.first + i];
}
void list_body(BodyList list, uint i, Body body) {
  Bodies(list.address).at[list.first + i] = body;
}
#endif

// Inserts a body in order; if the list is full, removes and returns the farthest.
bool insert_body(inout BodyList list, Body body, out Body dropped) {
  dropped = body;
  if (list.room == 0) return true;
  bool is_full = list.count == list.room;
  if (is_full) {
    Body last = listed_body(list, list.room - 1);
    if (body.lengths.x >= last.lengths.x) return true;
    dropped = last;
  } else {
    ++list.count;
  }
  uint i = list.count - 1;
  for (; i > 0; --i) {
    Body before = listed_body(list, i - 1);
    bool is_first = before.voxel.w <= body.voxel.w;
    if (kHasCells) is_first = is_face(before) || (!is_face(body) && is_first);
    bool stays = before.lengths.x < body.lengths.x || (before.lengths.x == body.lengths.x && is_first);
    if (stays) break;
    list_body(list, i, before);
  }
  list_body(list, i, body);
  return is_full;
}

// Adds a body; if the list is full, keeps the transmittance of the bodies that did not fit.
void keep_body(inout BodyList list, Body body, float from_t, inout vec3 passed) {
  if (body.lengths.x < from_t) return;
  Body dropped;
  if (!insert_body(list, body, dropped)) return;
  list.dropped_t = min(list.dropped_t, dropped.lengths.x);
  passed *= passed_by_body(dropped);
}

// The bodies of one instance along a ray, in order.
struct BodyRun {
  Body body;  // the last one
  bool has_body;
  float clarity;
};

void end_as(inout Body body, Body next) {
  body.what.w = next.what.w;
  if (kHasFieldGlass || kHasShapes) body.what.z = (body.what.z & kBeginning) | (next.what.z & ~kBeginning);
}

void add_to_run(inout BodyRun run, Body next, float from_t, inout BodyList list, inout vec3 passed) {
  if (!(next.lengths.z > 0.0)) return;
  run.clarity += surface_of_body(next).log_clarity * next.lengths.z;
  if (run.has_body && continues(run.body, next)) {
    run.body.lengths.y = next.lengths.y;
    run.body.lengths.z += next.lengths.z;
    end_as(run.body, next);
    return;
  }
  if (run.has_body) keep_body(list, run.body, from_t, passed);
  run.body = next;
  run.has_body = true;
}

// The transparent part of a field; matches trace/density/density_glass.h on the CPU. Its tree holds the cells with a
// transparent corner. A word of 4^3 cells has either a single material, or the samples around it and the bodies of
// these corners.

const uint kOpaqueBody = 0xFFFF;  // no type's number
const int kBodiesEdge = 5;
const uint kBodiesBegin = 172;  // in a block, after its densities
const uint kIsUniform = 0x80000000u;

// A cell and its corners, indexed by x + 2 y, at z and z + 1: densities, and 0 for air, kOpaqueBody, or a transparent
// type.
struct GlassCell {
  Numbers block;
  ivec3 first;  // its lowest corner in the block
  vec4 low;
  vec4 high;
  uvec4 body_low;
  uvec4 body_high;
};

// Gets the block of the word found. Returns false if the word has a single type.
bool glass_block_found(out Numbers block, out uint type) {
  uvec4 brick = walk_stack[1];
  uint child = child_of(brick, index_in(walk_voxel, 1));
  uint words = bitCount(brick.x) + bitCount(brick.y);
  uint from = Numbers(address_after(brick.zw, 8 * words)).at[child];
  block = Numbers(address_after(record_found(), 4 * from));
  type = from & 0xFFFF;
  return (from & kIsUniform) == 0;
}

uint body_of(Numbers block, ivec3 at) {
  uint i = uint((at.z * kBodiesEdge + at.y) * kBodiesEdge + at.x);
  return block.at[kBodiesBegin + (i >> 1)] >> (16 * (i & 1)) & 0xFFFF;
}
uvec4 bodies_of(Numbers block, ivec3 at) {
  return uvec4(body_of(block, at), body_of(block, at + ivec3(1, 0, 0)), body_of(block, at + ivec3(0, 1, 0)),
               body_of(block, at + ivec3(1, 1, 0)));
}

GlassCell glass_cell(Numbers block, ivec3 voxel) {
  GlassCell cell;
  cell.block = block;
  cell.first = (voxel & 3) + 1;
  corners_of(block, cell.first, cell.low, cell.high);
  cell.body_low = bodies_of(block, voxel & 3);
  cell.body_high = bodies_of(block, (voxel & 3) + ivec3(0, 0, 1));
  return cell;
}

uint body_at_corner(GlassCell cell, int i) {
  return i < 4 ? cell.body_low[i] : cell.body_high[i - 4];
}
bool is_transparent(uint body) {
  return body != 0 && body != kOpaqueBody;
}

// Computes the field of one body: solid corners of other bodies are as far outside as they are inside their own.
void corners_of_body(GlassCell cell, uint body, out vec4 low, out vec4 high) {
  low = mix(abs(cell.low), cell.low, equal(cell.body_low, uvec4(body)));
  high = mix(abs(cell.high), cell.high, equal(cell.body_high, uvec4(body)));
}

// A ray in a cell, and the cubics of its crossings.
struct RayInGlass {
  vec3 entry;
  vec3 way;
  vec4 solid;
  vec4 opaque;
  bool has_air;
  bool has_opaque;
  bool has_several;  // several transparent types
  uint type;         // the first of these
};

vec4 cubic_of_body(GlassCell cell, RayInGlass ray, uint body) {
  vec4 low;
  vec4 high;
  corners_of_body(cell, body, low, high);
  return cubic_of(low, high, ray.entry, ray.way);
}

RayInGlass ray_in_glass(GlassCell cell, vec3 entry, vec3 way) {
  RayInGlass ray;
  ray.entry = entry;
  ray.way = way;
  ray.solid = cubic_of(cell.low, cell.high, entry, way);
  ray.has_air = ray.has_opaque = ray.has_several = false;
  ray.type = 0;
  for (int i = 0; i < 8; ++i) {
    uint body = body_at_corner(cell, i);
    ray.has_air = ray.has_air || body == 0;
    ray.has_opaque = ray.has_opaque || body == kOpaqueBody;
    if (!is_transparent(body)) continue;
    ray.has_several = ray.has_several || (ray.type != 0 && body != ray.type);
    ray.type = body;
  }
  ray.opaque = ray.has_opaque ? cubic_of_body(cell, ray, kOpaqueBody) : vec4(1.0, 0.0, 0.0, 0.0);
  return ray;
}

// Returns the first sign change of a cubic beyond `after`; 1 if there is none before.
float change_after(vec4 f, float after) {
  float a = 3.0 * f.w;
  float b = 2.0 * f.z;
  float discriminant = b * b - 4.0 * a * f.y;
  vec2 extremes = vec2(-1.0);
  if (discriminant > 0.0) {
    float q = -0.5 * (b + (b < 0.0 ? -1.0 : 1.0) * sqrt(discriminant));
    float one = a != 0.0 ? q / a : -1.0;
    float other = q != 0.0 ? f.y / q : -1.0;
    extremes = vec2(min(one, other), max(one, other));
  }
  float low = 0.0;
  for (int i = 0; i < 3; ++i) {
    float high = i == 0 ? extremes.x : i == 1 ? extremes.y : 1.0;
    if (!(high > low && high <= 1.0)) continue;
    bool falls = value_at(f, high) < 0.0;
    if ((value_at(f, low) < 0.0) != falls) {
      float s = root_between(falls ? f : -f, low, high);
      if (s > after) return s;
    }
    low = high;
  }
  return 1.0;
}

// Returns the ray's next transition from one body, or air, to another. One loop over the cubics for the three
// decisions: solid, opaque, and the nearer of two transparent types.
float next_change(GlassCell cell, RayInGlass ray, float after) {
  const int kSolid = -2;
  float next = 1.0;
  for (int i = kSolid; i < (ray.has_several ? 8 : 0); ++i) {
    for (int k = 0; k < max(i, 1); ++k) {
      vec4 f = ray.solid;
      if (i < 0) {
        if (!(i == kSolid ? ray.has_air : ray.has_opaque)) break;
        if (i != kSolid) f = ray.opaque;
      } else {
        uint one = body_at_corner(cell, i);
        uint other = body_at_corner(cell, k);
        if (!is_transparent(one)) break;
        if (!is_transparent(other) || other == one) continue;
        f = cubic_of_body(cell, ray, one) - cubic_of_body(cell, ray, other);
      }
      next = min(next, change_after(f, after));
    }
  }
  return next;
}

// Returns the transparent type at `s`; 0 if there is none.
uint glass_at(GlassCell cell, RayInGlass ray, float s) {
  if (!(value_at(ray.solid, s) < 0.0) || value_at(ray.opaque, s) < 0.0) return 0;
  if (!ray.has_several) return ray.type;
  uint nearest = 0;
  float least = kNever;
  for (int i = 0; i < 8; ++i) {
    uint body = body_at_corner(cell, i);
    if (!is_transparent(body)) continue;
    float own = value_at(cubic_of_body(cell, ray, body), s);
    if (own > least || (own == least && body >= nearest)) continue;
    least = own;
    nearest = body;
  }
  return nearest;
}

// Returns the normal of a body's surface in the cell, towards air (`other` is 0) or another transparent type.
vec3 glass_normal(GlassCell cell, vec3 inside, uint type, uint other) {
  if (other == 0) return normal_in(cell.block, cell.first, inside);
  vec4 low;
  vec4 high;
  vec4 other_low;
  vec4 other_high;
  corners_of_body(cell, type, low, high);
  corners_of_body(cell, other, other_low, other_high);
  vec3 gradient = gradient_of(low - other_low, high - other_high, inside);
  float size = length(gradient);
  return size > 0.0 ? gradient / size : vec3(0.0);
}

// A unit vector, or 0, in 28 bits: like unit_vector's word, but coarser.
const float kNormalSteps = 8191.0;
uint packed_in_28(vec3 n) {
  uint word = packed_normal(n);
  if (word == kNoNormal) return 0;
  uvec2 at = uvec2(round(unpackSnorm2x16(word) * kNormalSteps) + kNormalSteps) + 1;
  return at.x | at.y << 14;
}
vec3 normal_from_28(uint word) {
  if (word == 0) return vec3(0.0);
  vec2 at = vec2(uvec2(word & 0x3FFF, word >> 14) - 1) / kNormalSteps - 1.0;
  return unit_vector(packSnorm2x16(at));
}

// Sets the normals at both ends of a cell's body, from `begin` to `end` of the ray's path in it.
void put_normals(GlassCell cell, RayInGlass ray, float begin, float end, BodyRun run, inout Body body) {
  bool touches = run.has_body && reaches(run.body, body.lengths.x);
  bool is_entered = !touches || run.body.what.x != body.what.x;
  for (int side = 0; side < 2; ++side) {
    bool is_begin = side == 0;
    if (!(is_begin ? is_entered : ray.has_air)) continue;
    vec3 at = ray.entry + (is_begin ? begin : end) * ray.way;
    vec3 normal = glass_normal(cell, at, body.what.x, is_begin && touches ? run.body.what.x : 0);
    if (is_begin) {
      body.what.y = packed_normal(normal);
    } else {
      body.what.z |= packed_in_28(normal) << kExitNormal;
    }
  }
}

// Adds the bodies of a voxel, of a field's cell, or of a word of a single type, from `enter_t` to `exit_t`. `next`: a
// body with the shared properties set; `cell`: used if `is_mixed`.
void add_bodies(GlassCell cell, bool is_mixed, Body next, float enter_t, float exit_t, float ray_t, float voxels_a_t,
                float from_t, inout BodyRun run, inout BodyList list, inout vec3 passed) {
  float size = exit_t - enter_t;
  RayInGlass ray;
  if (is_mixed) {
    vec3 place = vec3(next.voxel.xyz - ray_base);
    vec3 entry = clamp(ray_origin + enter_t * ray_direction - place, vec3(0.0), vec3(1.0));
    ray = ray_in_glass(cell, entry, ray_direction * size);
  }
  uint how = next.what.z;
  float begin = 0.0;
  while (begin < 1.0) {
    float end = 1.0;
    if (is_mixed) {
      end = next_change(cell, ray, begin);
      next.what.x = glass_at(cell, ray, 0.5 * (begin + end));
      next.what.z = begin <= 0.0 ? how : how & ~kStartsInside;
    }
    if (next.what.x != 0) {
      float begin_t = begin <= 0.0 ? enter_t : enter_t + begin * size;
      float end_t = end >= 1.0 ? exit_t : enter_t + end * size;
      next.lengths = vec4(ray_t + begin_t, ray_t + end_t, (end_t - begin_t) * voxels_a_t, begin_t);
#if defined(KEEPS_BODIES) || defined(HOLDS_BODIES)
      if (is_mixed) put_normals(cell, ray, begin, end, run, next);
#endif
      add_to_run(run, next, from_t, list, passed);
    }
    begin = end;
  }
}

// Adds the glass of the shapes in a cell, in the order in which the ray enters its parts. `cell`: where the way through
// them begins; `exit_t`: where the ray leaves the cell. `next`: as in `add_bodies`; its face is that of a ray that
// starts inside.
void add_shapes(ShapeRay cell, Body next, float exit_t, float ray_t, float voxels_a_t, float from_t, inout BodyRun run,
                inout BodyList list, inout vec3 passed) {
  float size = exit_t - cell.begin;
  uint face = next.what.y;
  ShapeRay ray = cell;
  ShapeSpan span;
  // The part added last, and the one after it: the nearest, and the first of equally near ones.
  float last_t = -1.0;
  int last = -1;
  float nearest = kNever;
  int found = -1;
  int number = 0;
  for (bool goes_on = true; goes_on;) {
    bool is_part = step_in_shapes(ray, span);
    float begin = max(span.enter_t, 0.0);
    float end = min(span.exit_t, size);
    bool is_plate = span.enter_t == span.exit_t;
    bool is_inside = starts_inside(ray, span);
    bool is_next = begin < nearest && (begin > last_t || (begin == last_t && number > last));
    bool is_whole = is_plate ? begin == span.enter_t && end == span.exit_t : begin < end;
    bool is_taken = is_part && is_next && is_whole && (is_inside || span.enter_side != kNoSide);
    uint flags = kSideIsGlass;
    if (is_taken && !is_inside) flags = side_flags(span.enter_side);
    if (is_taken && (flags & kSideIsGlass) != 0) {
      nearest = begin;
      found = number;
      next.voxel.xyz = shape_voxel(ray);
      next.what.x = ray.shape & kShapeType;
      next.what.y = is_inside ? face : span.enter_side;
      next.what.z = kEndsInField | (is_inside ? kStartsInside : kBeginsInShape);
      next.lengths = vec4(ray_t + cell.begin + begin, ray_t + cell.begin + end,
                          is_plate ? kThinnest : (end - begin) * voxels_a_t, cell.begin + begin);
      if ((flags & kSideHasTexels) != 0) {
        next.what.x |= kIsTextured;
        next.lengths.w = uintBitsToFloat(side_texel(span.enter_side, ray.origin + span.enter_t * ray_direction));
      }
#if defined(KEEPS_BODIES) || defined(HOLDS_BODIES)
      next.what.z |= packed_in_28(span.exit_normal) << kExitNormal;
#endif
    }
    if (is_part) ++number;
    if (!has_more(ray)) {
      goes_on = found >= 0;
      // A part within the last body is the same box in another cell, or a crossing plate.
      bool is_within = run.has_body && continues(run.body, next) && next.lengths.y <= run.body.lengths.y;
      if (goes_on && !is_within) add_to_run(run, next, from_t, list, passed);
      goes_on = goes_on && run.clarity > kClosed;
      ray = cell;
      last_t = nearest;
      last = found;
      nearest = kNever;
      found = -1;
      number = 0;
    }
  }
}

// Set by `add_faces`, cleared by callers: true if a ray met a face that hides everything behind it.
bool met_closed_face;

// Finds the sides that a voxel's own shape hides wholly, a bit per direction. Returns false if it has none.
bool find_own_shape(int grid, ivec3 voxel, out uint hidden) {
  hidden = 0;
  uvec4 chunk;
  if (!find_chunk(shape_trees(grid).touched, voxel, chunk)) return false;
  uint index = index_in(voxel, 2);
  if (!has_child(chunk, index)) return false;
  uvec4 brick = Nodes(chunk.zw).at[child_of(chunk, index)];
  index = index_in(voxel, 1);
  if (!has_child(brick, index)) return false;
  uint child = child_of(brick, index);
  uvec4 word = uvec4(Words(brick.zw).at[child], 1, 0);
  index = index_in(voxel, 0);
  if (!has_child(word, index)) return false;
  uint words = bitCount(brick.x) + bitCount(brick.y);
  uint from = Numbers(address_after(brick.zw, 8 * words)).at[child];
  Numbers list = Numbers(address_after(record_of(chunk), 4 * from));
  uint first = list.at[child_of(word, index)];
  uint shape = list.at[first];
  if ((shape >> kShapePlace & 31) != 13) return false;  // of another voxel; the own one would be the first
  if ((shape & kShapeIsOpaque) != 0) hidden = shape_numbers(list.at[first + 1] + 1).y;
  return true;
}

// Returns true if a voxel hides the face of a neighbour of that type. `side`: the face, towards the voxel.
bool hides_face(GridTrees trees, int grid, ivec3 voxel, uint type, uint side) {
  uint hidden;
  if (kHasShapes && find_own_shape(grid, voxel, hidden)) return (hidden >> (side ^ 1) & 1) != 0;
  uvec4 chunk;
  bool is_known = find_chunk(trees.opaque, voxel, chunk);
  if (!is_known) is_known = find_chunk(trees.transparent, voxel, chunk);
  uint other = is_known ? type_in(record_of(chunk), voxel & 63) : 0;
  return other == type || (texture_entry(other) & kHidesFaces) != 0;
}

// Adds the faces of a cell that the ray meets: the outer side of the entry face and the inner side of the exit face.
// Matches `meet_cell` in scene/surfaces.h on the CPU. `cell`: the voxel, with its type, faces and flags; the walk has
// left it. `entry`: the position in the voxel where the ray enters. Returns false if a face ends the ray.
bool add_faces(Body cell, vec3 entry, float enter_t, float ray_t, float room, float from_t, inout BodyList list,
               inout vec3 passed) {
  int grid = placed_at(cell.voxel.w).ref_base.w;
  GridTrees trees = Grids(frame().grids).at[grid];
  bool is_open = true;
  for (int i = 0; i < 2 && is_open; ++i) {
    bool is_outer = i == 0;
    uint side = is_outer ? cell.what.y : cell.what.w & 7;
    float t = is_outer ? enter_t : walk_t;
    ivec3 front = cell.voxel.xyz;
    front[axis_of(side)] += int(sign_of(side));
    bool is_there = t <= room && !(is_outer && (cell.what.z & kStartsInside) != 0);
    if (is_there) is_there = !hides_face(trees, grid, front, cell.what.x, side);
    if (!is_there) continue;
    uvec4 what = TexturedFaces(frame().textured_faces).at[face_of_cell(cell.what.x, side)].what;
    uint alpha = what.z >> 12 & 3;
    uint texel = texel_at(what, entry + (t - enter_t) * ray_direction, what.z & 15);
    bool is_closed = alpha != kTranslucent && (alpha != kCutout || texel >> 24 >= kCutoutAlpha);
    bool is_seen = is_closed || (alpha == kTranslucent && is_outer && texel >> 24 > 0);
    is_closed = is_closed || (is_seen && texel >> 24 == 255);
    if (!is_seen) continue;
    Body face = cell;
    if (!is_outer) face.voxel.xyz = front;
    face.what.x |= kIsTextured | kIsFace;
    face.what.y = (is_outer ? side : side ^ 1) | side << 3;
    face.what.z = is_closed ? kIsClosed : 0;
    face.lengths = vec4(ray_t + t, ray_t + t, 0.0, uintBitsToFloat(texel));
    keep_body(list, face, from_t, passed);
    is_open = !is_closed;
  }
  met_closed_face = met_closed_face || !is_open;
  return is_open;
}

// Finds the bodies of an instance's voxels, of its field or of its shapes, along a ray whose walk has started.
// `voxels_a_t`: full-grid voxels per t.
void find_bodies_in(int i, bool is_of_field, bool is_of_shapes, GridRay ray, float voxels_a_t, float max_t,
                    float from_t, inout BodyList list, inout vec3 passed) {
  float room = max_t - ray.t;
  BodyRun run;
  run.clarity = 0.0;
  run.has_body = false;
  bool goes_on = true;
  // Cells of halved grids are glass of the mean colour.
  bool has_cells = kHasCells && placed_at(i).ref_view.w == 1.0;
  while (goes_on && run.clarity > kClosed && find_voxel(room)) {
    Body next;
    next.voxel = ivec4(walk_voxel, i);
    uint inside = walk_axis < 0 ? kStartsInside : 0;
    float enter_t = walk_t;
    GlassCell cell;
    bool is_mixed = false;
    int shift = 0;
    ShapeRay shapes;
    if (is_of_shapes) {
      shapes = shapes_found();
      next.what = uvec4(0, face_found(), 0, 8 * uint(i));
    } else if (is_of_field) {
      Numbers block;
      is_mixed = glass_block_found(block, next.what.x);
      next.what = uvec4(next.what.x, kNoNormal, inside | kBeginsInField | kEndsInField, 8 * uint(i));
      // A whole word is one body if it does not close along the diagonal; it then closes at the same cell as cell by
      // cell.
      float closing = -surface_of(next.what.x).log_clarity * voxels_a_t / length(ray_direction) * kDiagonal;
      if (is_mixed) {
        cell = glass_cell(block, walk_voxel);
      } else if (run.clarity - kClosed > 4.0 * closing) {
        shift = 2;
      }
    } else {
      next.what = uvec4(type_found(), face_found(), inside, 8 * uint(i));
    }
    vec3 entry = ray_origin + walk_t * ray_direction - vec3(walk_voxel - ray_base);
    goes_on = leave_block(shift, room);
    if (is_of_shapes) {
      add_shapes(shapes, next, min(walk_t, room), ray.t, voxels_a_t, from_t, run, list, passed);
      continue;
    }
    if (!is_of_field) next.what.w += uint(2 * walk_axis + (ray_forward[walk_axis] ? 0 : 1));
    uint how = has_cells && !is_of_field ? texture_entry(next.what.x) : 0;
    if ((how & kIsCellOfFaces) != 0) {
      if (!add_faces(next, entry, enter_t, ray.t, room, from_t, list, passed)) break;
      continue;
    }
    bool is_textured_glass = (how & kIsTexturedGlass) != 0;
#ifdef HAS_CLOUDS
    // A cloud has no surface to show a texture on.
    if (is_textured_glass) is_textured_glass = !(surface_of(next.what.x).scattering > 0.0);
#endif
    if (is_textured_glass) {
      float exit_t = min(walk_t, room);
      next.lengths = vec4(ray.t + enter_t, ray.t + exit_t, (exit_t - enter_t) * voxels_a_t, enter_t);
      if (run.has_body && continues(run.body, next)) {
        next.what.x = run.body.what.x;
        next.what.y = run.body.what.y;
        next.lengths.w = run.body.lengths.w;
      } else if (inside == 0) {
        uvec4 what = TexturedFaces(frame().textured_faces).at[face_of_cell(next.what.x, next.what.y)].what;
        next.what.x |= kIsTextured;
        next.lengths.w = uintBitsToFloat(texel_at(what, entry, what.z & 15));
      }
      add_to_run(run, next, from_t, list, passed);
      continue;
    }
    add_bodies(cell, is_mixed, next, enter_t, min(walk_t, room), ray.t, voxels_a_t, from_t, run, list, passed);
  }
  if (run.has_body) keep_body(list, run.body, from_t, passed);
}

// Finds all bodies of one instance along a ray.
void find_bodies(int i, GridTrees trees, GridRay ray, float voxels_a_t, float max_t, float from_t,
                 inout BodyList list, inout vec3 passed) {
  for (int content = 0; content < kGlassContents; ++content) {
    bool is_of_field = kHasFieldGlass && content == 1;
    bool is_of_shapes = is_shape_content(content);
    if (kHasShapes && !kHasFieldGlass && content == 1) continue;
    Tree tree = trees.transparent;
    if (is_of_field) tree = trees.glass;
    if (is_of_shapes) tree = shape_trees(placed_at(i).ref_base.w).glass;
    if (!start_walk(tree, ray.base, ray.origin, ray.direction, max_t - ray.t, -1)) continue;
    find_bodies_in(i, is_of_field, is_of_shapes, ray, voxels_a_t, max_t, from_t, list, passed);
  }
}

// Ends a body at the first face that hides everything behind it, if it reaches that far. `i`: the number of the next
// body in the list.
void end_at_face(BodyList list, uint i, inout Body body) {
  for (; i < list.count; ++i) {
    Body face = listed_body(list, i);
    if (face.lengths.x >= body.lengths.y) return;
    if (!is_face(face) || (face.what.z & kIsClosed) == 0) continue;
    body.lengths.z *= (face.lengths.x - body.lengths.x) / (body.lengths.y - body.lengths.x);
    body.lengths.y = face.lengths.x;
    return;
  }
}

// Gets the next body of a list, joined with the bodies that touch it. Returns false at the list's end.
bool next_body(BodyList list, inout uint i, out Body body) {
  if (i >= list.count) return false;
  body = listed_body(list, i++);
  while (i < list.count) {
    Body next = listed_body(list, i);
    if (!continues(body, next)) break;
    if (next.lengths.y > body.lengths.y) {
      body.lengths.y = next.lengths.y;
      end_as(body, next);
    }
    body.lengths.z += next.lengths.z;
    ++i;
  }
  if (kHasCells && !is_face(body)) end_at_face(list, i, body);
  return true;
}

// Returns the reflectance at a surface between media of two refractive indices, and the y of the reflected direction.
// `direction`, `normal`: in the world, unit.
vec2 mirror_at(vec3 direction, vec3 normal, float ior, float other_ior) {
  float along = dot(direction, normal);
  float cosine = min(abs(along), 1.0);
  float denser = max(ior, other_ior) / min(ior, other_ior);
  float up = direction.y - 2.0 * along * normal.y;
  if (!(denser > 1.0)) return vec2(0.0, up);
  float inside = sqrt(1.0 - (1.0 - cosine * cosine) / (denser * denser));
  float across = (cosine - denser * inside) / (cosine + denser * inside);
  float in_plane = (denser * cosine - inside) / (denser * cosine + inside);
  return vec2(0.5 * (across * across + in_plane * in_plane), up);
}
