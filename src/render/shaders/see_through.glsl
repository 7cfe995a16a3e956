// The view through bodies of glass; matches render/light/glass_bodies.h on the CPU. The including file defines two
// functions: the view direction in the world, and the surface normal at `t` in the face of an instance's voxel. Both
// are unit vectors in the world.
vec3 seen_direction();
vec3 normal_met(int instance, uint face, float t);

// Returns the normal of a face in the world.
vec3 face_normal(Placed placed, uint face) {
  return sign_of(face) * placed.view_axes[axis_of(face)].xyz / placed.ref_inside.w;
}

// Returns the normal of a field's surface in the world; `in_grid` is unit.
vec3 field_normal(int instance, vec3 in_grid) {
  Placed placed = placed_at(instance);
  return turned(placed.view_axes, in_grid) / placed.ref_inside.w;
}
// Returns the normal of the surface where a ray enters or leaves a body; unit, in the world.
vec3 normal_of_side(Body body, bool is_entered) {
  int instance = is_entered ? body.voxel.w : int(body.what.w >> 3);
  if (kHasShapes && is_entered && (body.what.z & kBeginsInShape) != 0) {
    return field_normal(instance, side_normal(body.what.y));
  }
  if (kHasShapes && !is_entered && (body.what.z & kEndsInField) != 0) {
    return field_normal(instance, normal_from_28(body.what.z >> kExitNormal));
  }
  uint in_field = is_entered ? kBeginsInField : kEndsInField;
  if (kHasFieldGlass && (body.what.z & in_field) != 0) {
    return field_normal(instance, is_entered ? normal_of(body.what.y) : normal_from_28(body.what.z >> kExitNormal));
  }
  uint face = (is_entered ? body.what.y : body.what.w) & 7;
  return normal_met(instance, face, is_entered ? body.lengths.x : body.lengths.y);
}

// Adds a surface that reflects the sky. `normal`: unit, in the world; `tint`: of the reflection.
void meet_surface(vec3 normal, float before, float behind, vec3 tint, inout State state) {
  vec2 mirror = mirror_at(seen_direction(), normal, before, behind);
  state.colour.xyz += state.weight.xyz * tint * mirror.x * sky_colour(mirror.y);
  state.weight.xyz *= 1.0 - mirror.x;
}
// Handles the surfaces where a ray leaves a body for the next, or for air. A reflection at a body's end passes through
// the body again.
void meet_surfaces(Body from, bool has_from, Body to, bool has_to, inout State state) {
  bool touches = has_from && has_to && reaches(from, to.lengths.x);
  for (int side = 0; side < 2; ++side) {
    bool is_left = side == 0;
    bool is_met = is_left ? has_from : has_to && !touches && (to.what.z & kStartsInside) == 0;
    if (!is_met) continue;
    bool is_entered = !is_left || touches;
    vec3 normal = normal_of_side(is_entered ? to : from, is_entered);
    float behind = is_entered ? surface_of(type_of(to)).ior : 1.0;
    float before = 1.0;
    vec3 tint = vec3(1.0);
    if (is_left) {
      Surface surface = surface_of(type_of(from));
      before = surface.ior;
      tint = passed_by(surface, from.lengths.z, has_own_length(from));
    }
    meet_surface(normal, before, behind, tint, state);
  }
}

// Returns true if an opaque surface directly follows a body, without air. `opaque_t`: its distance; kInfinity without
// one.
bool lies_on_opaque(Body body, float opaque_t) {
  float voxel_size = placed_at(int(body.what.w >> 3)).ref_inside.w;
  return opaque_t <= body.lengths.y + frame().lift * voxel_size;
}

// A ray's way through the bodies of a list, nearest first.
struct Passage {
  BodyList list;
  uint next;
  Body met;       // the latest body or face
  bool has_met;
  Body body;      // the latest body
  bool has_body;
  bool is_left;     // the ray left it before the latest face
  bool is_entered;  // the first body was entered earlier
  bool is_last;     // all bodies fitted; otherwise stop before the last body, which may continue in the next round
};

Passage passage_through(BodyList list, bool is_entered) {
  Passage way;
  way.list = list;
  way.next = 0;
  way.has_body = way.has_met = way.is_left = false;
  way.is_entered = is_entered;
  way.is_last = list.dropped_t == kInfinity;
  return way;
}

// Continues into the next body, with the reflections of its surfaces. Returns false if there is no body left: the ray
// is then in air, unless an opaque surface at `opaque_t` follows directly. If not all bodies fit, state.weight.w is the
// distance to continue from.
bool enter_next(inout Passage way, float opaque_t, inout State state) {
  Body body;
  bool has_next = next_body(way.list, way.next, body);
  bool has_from = way.has_body && !way.is_left;
  bool is_at_face = has_next && is_face(body);
  bool is_met = has_next ? way.has_met || !way.is_entered
                         : way.is_last && has_from && !lies_on_opaque(way.body, opaque_t);
  if (is_at_face) {
    is_met = has_from && body.lengths.x > way.body.lengths.y;
    way.is_left = way.is_left || is_met;
  }
  if (has(kGlassSurfaces) && is_met) meet_surfaces(way.body, has_from, body, has_next && !is_at_face, state);
  if (!has_next) return false;
  if (!way.is_last && way.has_met && way.next == way.list.count) {
    state.weight.w = body.lengths.x;
    return false;
  }
  way.met = body;
  way.has_met = true;
  if (is_at_face) return true;
  way.body = body;
  way.has_body = true;
  way.is_left = false;
  return true;
}

// Passes through the latest body or face; returns the weight of its own light.
vec3 pass_body(Passage way, inout State state) {
  Body body = way.met;
  Surface surface = surface_of_body(body);
  // When values are shown, glass counts as opaque, except the body around the camera.
  if (has(kShowOcclusion) || has(kShowNormals)) {
    if ((body.what.z & kStartsInside) != 0) return vec3(0.0);
    vec3 weight = state.weight.xyz;
    state.weight.xyz = vec3(0.0);
    return weight;
  }
  if (is_face(body)) {
    vec3 of_face = state.weight.xyz * cover_of_face(body);
    state.weight.xyz *= passed_by_body(body);
    return of_face;
  }
  vec3 weight = state.weight.xyz * own_share(surface, body.lengths.z, has_own_length(body));
  state.weight.xyz *= passed_by(surface, body.lengths.z, has_own_length(body));
  return weight;
}
