// Glass bodies along a ray: src/render/shaders/glass.glsl and see_through.glsl. An invocation has two lists, nearest
// first: the visible bodies, and the bodies on a light ray.

// ln of the transmittance below which a body counts as opaque.
const kClosed = -11.0;
const kDiagonal = 1.7320508;  // of a cube of 1
// Two bodies within this distance of t touch: the rounding of single precision.
const kTouching = 4e-6;

const kHeldBodies = 8u;
const kSeen = 0u;         // the start of a list
const kOnWay = 8u;
var<private> held_bodies: array<Body, 16>;

struct BodyList {
  first: u32,
  count: u32,
  dropped_t: f32,  // start of the first body that did not fit
}

fn reaches(body: Body, t: f32) -> bool {
  return t <= body.lengths.y + kTouching * max(1.0, body.lengths.y);
}
// Bodies of fields, and bodies that contain the ray's start, count only with their actual length.
fn has_own_length(body: Body) -> bool {
  return (body.what.z & kHowItBegins) != 0u;
}
fn continues(body: Body, next: Body) -> bool {
  return next.what.x == body.what.x && reaches(body, next.lengths.x);
}

// Inserts a body in order. If the list is full, drops the furthest and records its transmittance in `passed`.
fn keep_body(list: ptr<function, BodyList>, body: Body, from_t: f32, passed: ptr<function, vec3f>) {
  if (body.lengths.x < from_t) {
    return;
  }
  let begin = (*list).first;
  let is_full = (*list).count == kHeldBodies;
  var dropped = body;
  var is_kept = true;
  if (is_full) {
    let last = held_bodies[begin + kHeldBodies - 1u];
    is_kept = body.lengths.x < last.lengths.x;
    if (is_kept) {
      dropped = last;
    }
  } else {
    (*list).count += 1u;
  }
  if (is_kept) {
    var i = (*list).count - 1u;
    for (; i > 0u; i--) {
      let before = held_bodies[begin + i - 1u];
      if (before.lengths.x < body.lengths.x ||
          (before.lengths.x == body.lengths.x && before.voxel.w <= body.voxel.w)) {
        break;
      }
      held_bodies[begin + i] = before;
    }
    held_bodies[begin + i] = body;
  }
  if (is_full) {
    (*list).dropped_t = min((*list).dropped_t, dropped.lengths.x);
    *passed *= passed_by(surface_of(dropped.what.x), dropped.lengths.z, has_own_length(dropped));
  }
}

// The bodies of one instance found along a ray, in order.
struct BodyRun {
  body: Body,  // the last one
  has_body: bool,
  clarity: f32,
}

fn end_as(body: ptr<function, Body>, next: Body) {
  (*body).what.w = next.what.w;
  if (kHasFieldGlass) {
    (*body).what.z = ((*body).what.z & kHowItBegins) | (next.what.z & ~kHowItBegins);
  }
}

fn add_to_run(run: ptr<function, BodyRun>, next: Body, from_t: f32, list: ptr<function, BodyList>,
              passed: ptr<function, vec3f>) {
  if (!(next.lengths.z > 0.0)) {
    return;
  }
  (*run).clarity += surface_of(next.what.x).log_clarity * next.lengths.z;
  if ((*run).has_body && continues((*run).body, next)) {
    var body = (*run).body;
    body.lengths.y = next.lengths.y;
    body.lengths.z += next.lengths.z;
    end_as(&body, next);
    (*run).body = body;
    return;
  }
  if ((*run).has_body) {
    keep_body(list, (*run).body, from_t, passed);
  }
  (*run).body = next;
  (*run).has_body = true;
}

// The bodies of an instance's voxels or field along a ray whose walk has started. `voxels_a_t`: voxels of the full grid
// per t.
fn find_bodies_in(i: i32, is_of_field: bool, ray: GridRay, voxels_a_t: f32, max_t: f32, from_t: f32,
                  list: ptr<function, BodyList>, passed: ptr<function, vec3f>) {
  let room = max_t - ray.t;
  var run: BodyRun;
  run.clarity = 0.0;
  run.has_body = false;
  var goes_on = true;
  while (goes_on && run.clarity > kClosed && find_voxel(room)) {
    var next: Body;
    next.voxel = vec4i(walk_voxel, i);
    let inside = select(0u, kStartsInside, walk_axis < 0);
    let enter_t = walk_t;
    var cell: GlassCell;
    var is_mixed = false;
    var shift = 0u;
    if (is_of_field) {
      let number = number_found();
      is_mixed = (number & kIsUniform) == 0u;
      let kind = number & 0xFFFFu;
      next.what = vec4u(kind, kNoNormal, inside | kBeginsInField | kEndsInField, 8u * u32(i));
      // A whole word whose diagonal does not make the body opaque: single cells would make it opaque at the same cell.
      let closing = -surface_of(kind).log_clarity * voxels_a_t / length(ray_direction) * kDiagonal;
      if (is_mixed) {
        cell = glass_cell((record_found() >> 2u) + number, walk_voxel);
      } else if (run.clarity - kClosed > 4.0 * closing) {
        shift = 2u;
      }
    } else {
      next.what = vec4u(type_found(), face_found(), inside, 8u * u32(i));
    }
    goes_on = leave_block(shift, room);
    if (!is_of_field) {
      next.what.w += u32(2 * walk_axis) + select(1u, 0u, ray_forward[walk_axis]);
    }
    let exit_t = min(walk_t, room);
    if (is_mixed) {
      add_bodies_of_cell(cell, next, enter_t, exit_t, ray.t, voxels_a_t, from_t, &run, list, passed);
    } else if (next.what.x != 0u) {
      next.lengths = vec4f(ray.t + enter_t, ray.t + exit_t, (exit_t - enter_t) * voxels_a_t, enter_t);
      add_to_run(&run, next, from_t, list, passed);
    }
  }
  if (run.has_body) {
    keep_body(list, run.body, from_t, passed);
  }
}

// Finds all bodies of one instance along a ray.
fn find_bodies(i: i32, ray: GridRay, voxels_a_t: f32, max_t: f32, from_t: f32, list: ptr<function, BodyList>,
               passed: ptr<function, vec3f>) {
  for (var content = 0; content < select(1, 2, kHasFieldGlass); content++) {
    let is_of_field = kHasFieldGlass && content == 1;
    let tree = tree_of(i, select(kTransparent, kGlass, is_of_field));
    if (start_walk(tree, ray.base, ray.origin, ray.direction, max_t - ray.t, -1)) {
      find_bodies_in(i, is_of_field, ray, voxels_a_t, max_t, from_t, list, passed);
    }
  }
}

// Takes the next body of a list, merged with those it touches; false at the list's end.
fn next_body(list: BodyList, i: ptr<function, u32>, out: ptr<function, Body>) -> bool {
  if (*i >= list.count) {
    return false;
  }
  var body = held_bodies[list.first + *i];
  *i += 1u;
  while (*i < list.count) {
    let next = held_bodies[list.first + *i];
    if (!continues(body, next)) {
      break;
    }
    if (next.lengths.y > body.lengths.y) {
      body.lengths.y = next.lengths.y;
      end_as(&body, next);
    }
    body.lengths.z += next.lengths.z;
    *i += 1u;
  }
  *out = body;
  return true;
}

// The reflectance of a surface between media with two indices of refraction, and the y of the mirrored direction.
fn mirror_at(direction: vec3f, normal: vec3f, ior: f32, other_ior: f32) -> vec2f {
  let along = dot(direction, normal);
  let cosine = min(abs(along), 1.0);
  let denser = max(ior, other_ior) / min(ior, other_ior);
  let up = direction.y - 2.0 * along * normal.y;
  if (!(denser > 1.0)) {
    return vec2f(0.0, up);
  }
  let inside = sqrt(1.0 - (1.0 - cosine * cosine) / (denser * denser));
  let s = (cosine - denser * inside) / (cosine + denser * inside);
  let p = (denser * cosine - inside) / (denser * cosine + inside);
  return vec2f(0.5 * (s * s + p * p), up);
}

// The normal of the surface where a ray enters or leaves a body; unit, in world space.
fn normal_of_side(body: Body, is_entered: bool) -> vec3f {
  let instance = select(i32(body.what.w >> 3u), body.voxel.w, is_entered);
  let size = voxel_size(instance);
  if (kHasFieldGlass && (body.what.z & select(kEndsInField, kBeginsInField, is_entered)) != 0u) {
    var in_grid = normal_from_28(body.what.z >> kExitNormal);
    if (is_entered) {
      in_grid = normal_of(body.what.y);
    }
    return turned(instance, kViewAxes, in_grid) / size;
  }
  let face = select(body.what.w & 7u, body.what.y, is_entered);
  return sign_of(face) * placed_vector(instance, kViewAxes + (face >> 1u)).xyz / size;
}

// The sky's reflection where a ray leaves a body and enters the next or air. Light mirrored at a body's end passes
// through the body again.
fn meet_surfaces(one: Body, has_one: bool, other: Body, has_other: bool, state: ptr<function, State>) {
  let direction = camera_ray().direction;
  let touches = has_one && has_other && reaches(one, other.lengths.x);
  for (var side = 0; side < 2; side++) {
    let is_left = side == 0;
    if (!select(has_other && !touches && (other.what.z & kStartsInside) == 0u, has_one, is_left)) {
      continue;
    }
    let is_entered = !is_left || touches;
    var body = one;
    var behind = 1.0;
    if (is_entered) {
      body = other;
      behind = surface_of(other.what.x).ior;
    }
    var before = 1.0;
    var tint = vec3f(1.0);
    if (is_left) {
      let surface = surface_of(one.what.x);
      before = surface.ior;
      tint = passed_by(surface, one.lengths.z, has_own_length(one));
    }
    let mirror = mirror_at(direction, normal_of_side(body, is_entered), before, behind);
    let weight = (*state).weight;
    (*state).colour += vec4f(weight.xyz * tint * mirror.x * sky_colour(mirror.y), 0.0);
    (*state).weight = vec4f(weight.xyz * (1.0 - mirror.x), weight.w);
  }
}

// Returns true if an opaque surface follows a body without air between.
fn lies_on_opaque(body: Body, opaque_t: f32) -> bool {
  return opaque_t <= body.lengths.y + frame.lift * voxel_size(i32(body.what.w >> 3u));
}

// A ray's progress through the bodies of a list, nearest first.
struct Passage {
  list: BodyList,
  next: u32,
  body: Body,  // the last one reached
  has_body: bool,
  is_entered: bool,  // the first was entered before
  is_last: bool,     // all bodies fitted; else it stops before the last one, which may continue between others
}

// Continues into the next body and adds its surfaces' reflections; false if there is none left. The ray has then left
// the glass, unless an opaque surface at `opaque_t` follows at once. If not all bodies fitted, state.weight.w is the
// position to continue from.
fn enter_next(way: ptr<function, Passage>, opaque_t: f32, state: ptr<function, State>) -> bool {
  var body: Body;
  var next = (*way).next;
  let has_next = next_body((*way).list, &next, &body);
  (*way).next = next;
  let is_met = select((*way).is_last && (*way).has_body && !lies_on_opaque((*way).body, opaque_t),
                      (*way).has_body || !(*way).is_entered, has_next);
  if (has(kGlassSurfaces) && is_met) {
    meet_surfaces((*way).body, (*way).has_body, body, has_next, state);
  }
  if (!has_next) {
    return false;
  }
  if (!(*way).is_last && (*way).has_body && (*way).next == (*way).list.count) {
    (*state).weight.w = body.lengths.x;
    return false;
  }
  (*way).body = body;
  (*way).has_body = true;
  return true;
}

// Passes through the body and returns the weight of its own light.
fn pass_body(body: Body, state: ptr<function, State>) -> vec3f {
  let surface = surface_of(body.what.x);
  let weight = (*state).weight;
  let is_own = has_own_length(body);
  (*state).weight = vec4f(weight.xyz * passed_by(surface, body.lengths.z, is_own), weight.w);
  return weight.xyz * own_share(surface, body.lengths.z, is_own);
}
