// Transparent parts of fields: src/render/shaders/glass.glsl. The tree contains the cells with a transparent corner.
// A word of 4^3 cells either has one material throughout, or has the samples around it and the bodies of its corners.

const kOpaqueBody = 0xFFFFu;  // not the number of any type
const kBodiesEdge = 5;
const kBodiesBegin = 172u;  // in a block, after its densities
const kIsUniform = 0x80000000u;

// A cell and its corners, by x + 2 y, of z and z + 1: densities, and 0 for air, kOpaqueBody, or a transparent type.
struct GlassCell {
  block: u32,
  first: vec3i,  // its minimum corner in the block
  corners: Corners,
  bodies: array<u32, 8>,
}

fn glass_cell(block: u32, voxel: vec3i) -> GlassCell {
  var cell: GlassCell;
  cell.block = block;
  let at = voxel & vec3i(3);
  cell.first = at + 1;
  cell.corners = corners_of(block, at + 1);
  for (var k = 0; k < 8; k++) {
    let corner = at + vec3i(k & 1, (k >> 1u) & 1, k >> 2u);
    let i = u32((corner.z * kBodiesEdge + corner.y) * kBodiesEdge + corner.x);
    cell.bodies[k] = (words[block + kBodiesBegin + (i >> 1u)] >> (16u * (i & 1u))) & 0xFFFFu;
  }
  return cell;
}
fn is_transparent(body: u32) -> bool {
  return body != 0u && body != kOpaqueBody;
}

// The field of one body: densities of other solid bodies are negated, so that they are outside.
fn corners_of_body(cell: GlassCell, body: u32) -> Corners {
  let b = cell.bodies;
  let own_low = vec4u(b[0], b[1], b[2], b[3]) == vec4u(body);
  let own_high = vec4u(b[4], b[5], b[6], b[7]) == vec4u(body);
  return Corners(select(abs(cell.corners.low), cell.corners.low, own_low),
                 select(abs(cell.corners.high), cell.corners.high, own_high));
}

// A ray in a cell, and the cubics that determine its next body.
struct RayInGlass {
  entry: vec3f,
  way: vec3f,
  solid: vec4f,
  opaque: vec4f,
  has_air: bool,
  has_opaque: bool,
  has_several: bool,  // transparent types
  kind: u32,          // the first of these
}

fn ray_in_glass(cell: GlassCell, entry: vec3f, way: vec3f) -> RayInGlass {
  var ray = RayInGlass(entry, way, cubic_of(cell.corners, entry, way), vec4f(1.0, 0.0, 0.0, 0.0), false, false, false,
                       0u);
  var bodies = cell.bodies;
  for (var i = 0; i < 8; i++) {
    let body = bodies[i];
    ray.has_air = ray.has_air || body == 0u;
    ray.has_opaque = ray.has_opaque || body == kOpaqueBody;
    if (!is_transparent(body)) {
      continue;
    }
    ray.has_several = ray.has_several || (ray.kind != 0u && body != ray.kind);
    ray.kind = body;
  }
  if (ray.has_opaque) {
    ray.opaque = cubic_of(corners_of_body(cell, kOpaqueBody), entry, way);
  }
  return ray;
}

// The first position after `after` where a cubic changes its sign; 1 if there is none before.
fn change_after(f: vec4f, after: f32) -> f32 {
  let extremes = extremes_of(f);
  var low = 0.0;
  for (var i = 0; i < 3; i++) {
    var high = 1.0;
    if (i < 2) {
      high = extremes[i];
    }
    if (!(high > low && high <= 1.0)) {
      continue;
    }
    let falls = value_at(f, high) < 0.0;
    if ((value_at(f, low) < 0.0) != falls) {
      let s = root_between(select(-f, f, falls), low, high);
      if (s > after) {
        return s;
      }
    }
    low = high;
  }
  return 1.0;
}

// The next position where a ray passes from one body, or air, into another. One loop over the cubics: solid, opaque,
// and the nearer of two transparent types.
fn next_change(cell: GlassCell, ray: RayInGlass, after: f32) -> f32 {
  var bodies = cell.bodies;
  var next = 1.0;
  for (var i = -2; i < select(0, 8, ray.has_several); i++) {
    for (var k = 0; k < max(i, 1); k++) {
      var f = ray.solid;
      if (i < 0) {
        if (!select(ray.has_opaque, ray.has_air, i == -2)) {
          break;
        }
        if (i != -2) {
          f = ray.opaque;
        }
      } else {
        let one = bodies[i];
        let other = bodies[k];
        if (!is_transparent(one)) {
          break;
        }
        if (!is_transparent(other) || other == one) {
          continue;
        }
        f = cubic_of(corners_of_body(cell, one), ray.entry, ray.way) -
            cubic_of(corners_of_body(cell, other), ray.entry, ray.way);
      }
      next = min(next, change_after(f, after));
    }
  }
  return next;
}

// The transparent type at a position; 0: none.
fn glass_at(cell: GlassCell, ray: RayInGlass, s: f32) -> u32 {
  if (!(value_at(ray.solid, s) < 0.0) || value_at(ray.opaque, s) < 0.0) {
    return 0u;
  }
  if (!ray.has_several) {
    return ray.kind;
  }
  var bodies = cell.bodies;
  var nearest = 0u;
  var least = kNever;
  for (var i = 0; i < 8; i++) {
    let body = bodies[i];
    if (!is_transparent(body)) {
      continue;
    }
    let own = value_at(cubic_of(corners_of_body(cell, body), ray.entry, ray.way), s);
    if (own > least || (own == least && body >= nearest)) {
      continue;
    }
    least = own;
    nearest = body;
  }
  return nearest;
}

// The normal of a body's surface in the cell, towards air (`other` is 0) or another transparent type.
fn glass_normal(cell: GlassCell, inside: vec3f, kind: u32, other: u32) -> vec3f {
  if (other == 0u) {
    return normal_in(cell.block, cell.first, inside);
  }
  let one = corners_of_body(cell, kind);
  let two = corners_of_body(cell, other);
  let gradient = gradient_of(Corners(one.low - two.low, one.high - two.high), inside);
  let size = length(gradient);
  if (size > 0.0) {
    return gradient / size;
  }
  return vec3f();
}

// A unit vector, or 0, in 28 bits: like unit_vector's word, but less precise.
const kNormalSteps = 8191.0;
fn packed_in_28(n: vec3f) -> u32 {
  let word = packed_normal(n);
  if (word == kNoNormal) {
    return 0u;
  }
  let at = vec2u(round(unpack2x16snorm(word) * kNormalSteps) + kNormalSteps) + 1u;
  return at.x | (at.y << 14u);
}
fn normal_from_28(word: u32) -> vec3f {
  if (word == 0u) {
    return vec3f();
  }
  let at = vec2f(vec2u(word & 0x3FFFu, word >> 14u) - 1u) / kNormalSteps - 1.0;
  return unit_vector(pack2x16snorm(at));
}

// The normals at the start and end of a body in a cell, at `begin` and `end` of the ray's path in it.
fn put_normals(cell: GlassCell, ray: RayInGlass, begin: f32, end: f32, run: BodyRun, body: ptr<function, Body>) {
  let touches = run.has_body && reaches(run.body, (*body).lengths.x);
  let is_entered = !touches || run.body.what.x != (*body).what.x;
  for (var side = 0; side < 2; side++) {
    let is_begin = side == 0;
    if (!select(ray.has_air, is_entered, is_begin)) {
      continue;
    }
    let at = ray.entry + select(end, begin, is_begin) * ray.way;
    let normal = glass_normal(cell, at, (*body).what.x, select(0u, run.body.what.x, is_begin && touches));
    if (is_begin) {
      (*body).what.y = packed_normal(normal);
    } else {
      (*body).what.z |= packed_in_28(normal) << kExitNormal;
    }
  }
}

// The bodies of a cell with several types, from `enter_t` to `exit_t`. `whole_body`: the values shared by all of them.
fn add_bodies_of_cell(cell: GlassCell, whole_body: Body, enter_t: f32, exit_t: f32, ray_t: f32, voxels_a_t: f32,
                      from_t: f32, run: ptr<function, BodyRun>, list: ptr<function, BodyList>,
                      passed: ptr<function, vec3f>) {
  let size = exit_t - enter_t;
  let entry = clamp(ray_origin + enter_t * ray_direction - vec3f(whole_body.voxel.xyz - ray_base), vec3f(), vec3f(1.0));
  let ray = ray_in_glass(cell, entry, ray_direction * size);
  var begin = 0.0;
  while (begin < 1.0) {
    let end = next_change(cell, ray, begin);
    var next = whole_body;
    next.what.x = glass_at(cell, ray, 0.5 * (begin + end));
    if (begin > 0.0) {
      next.what.z &= ~kStartsInside;
    }
    if (next.what.x != 0u) {
      let begin_t = select(enter_t + begin * size, enter_t, begin <= 0.0);
      let end_t = select(enter_t + end * size, exit_t, end >= 1.0);
      next.lengths = vec4f(ray_t + begin_t, ray_t + end_t, (end_t - begin_t) * voxels_a_t, begin_t);
      put_normals(cell, ray, begin, end, *run, &next);
      add_to_run(run, next, from_t, list, passed);
    }
    begin = end;
  }
}
