// What one sees through bodies of glass, as light/glass.h says on the processor's side. Those that include this define
// these: the light of the face through which a body is entered, which way one looks, in the world, and the upright of
// the surface that is met at `t`, in the face of an instance's voxel; unit, in the world.
vec3 light_of_body(Body body, uint slot);
vec3 seen_direction();
vec3 normal_met(int instance, uint face, float t);

// Of a face.
vec3 face_normal(Placed placed, uint face) {
  return sign_of(face) * placed.view_axes[axis_of(face)].xyz / placed.ref_inside.w;
}

// Of a field's surface; `in_grid` is unit.
vec3 field_normal(int instance, vec3 in_grid) {
  Placed placed = placed_at(instance);
  return turned(placed.view_axes, in_grid) / placed.ref_inside.w;
}
// The uprights of the surfaces through which a ray enters a body, and leaves it; unit, in the world.
vec3 normal_entered(Body body) {
  bool is_of_field = kHasFieldGlass && (body.what.z & kBeginsInField) != 0;
  if (is_of_field) return field_normal(body.voxel.w, normal_of(body.what.y));
  return normal_met(body.voxel.w, body.what.y, body.lengths.x);
}
vec3 normal_left(Body body) {
  int instance = int(body.what.w >> 3);
  bool is_of_field = kHasFieldGlass && (body.what.z & kEndsInField) != 0;
  if (is_of_field) return field_normal(instance, normal_from_28(body.what.z >> kExitNormal));
  return normal_met(instance, body.what.w & 7, body.lengths.y);
}

// A surface that mirrors the sky. `normal`: unit, in the world; `tint`: of what is mirrored.
void meet_surface(vec3 normal, float before, float behind, vec3 tint, inout State state) {
  vec2 mirror = mirror_at(seen_direction(), normal, before, behind);
  state.colour.xyz += state.weight.xyz * tint * mirror.x * sky_colour(mirror.y);
  state.weight.xyz *= 1.0 - mirror.x;
}
// Where a ray leaves a body into air, or into another that touches it: what is mirrored passes it once more.
void leave_body(Body from, vec3 normal, float behind, inout State state) {
  Surface surface = surface_of(from.what.x);
  vec3 tint = passed_by(surface, from.lengths.z, has_own_length(from));
  meet_surface(normal, surface.ior, behind, tint, state);
}
void leave_into_air(Body from, inout State state) {
  leave_body(from, normal_left(from), 1.0, state);
}
void enter_body(Body from, bool has_from, Body to, inout State state) {
  float ior = surface_of(to.what.x).ior;
  if (has_from && reaches(from, to.lengths.x)) {
    leave_body(from, normal_entered(to), ior, state);
    return;
  }
  if (has_from) leave_into_air(from, state);
  if ((to.what.z & kStartsInside) == 0) meet_surface(normal_entered(to), 1.0, ior, vec3(1.0), state);
}

// Whether something opaque leaves no air behind a body. `opaque_t`: how far that is; kInfinity where there is nothing.
bool lies_on_opaque(Body body, float opaque_t) {
  float voxel_size = placed_at(int(body.what.w >> 3)).ref_inside.w;
  return opaque_t <= body.lengths.y + frame().lift * voxel_size;
}

// Lets a ray through the bodies of a list, nearest first, with what they show. Where there was no room for all
// (`is_last` is false) it stops before the last one, which may go on among the others: state.weight.w says from where.
// `is_entered`: the first was entered before. Returns whether there was any; `last` is the last that was passed.
bool pass_bodies(BodyList list, bool is_last, bool is_entered, uint slot, inout State state, out Body last) {
  bool has_surfaces = has(kGlassSurfaces);
  bool is_first = true;
  uint i = 0;
  Body body;
  while (next_body(list, i, body)) {
    if (!is_last && !is_first && i == list.count) {
      if (has_surfaces) enter_body(last, true, body, state);
      state.weight.w = body.lengths.x;
      break;
    }
    if (has_surfaces && !(is_first && is_entered)) enter_body(last, !is_first, body, state);
    last = body;
    is_first = false;
    bool starts_inside = (body.what.z & kStartsInside) != 0;
    // Where values are shown, glass is as good as stone, but for what one looks from.
    bool shows_values = has(kShowOcclusion) || has(kShowNormals);
    if (shows_values && starts_inside) continue;
    Surface surface = surface_of(body.what.x);
    vec3 weight = state.weight.xyz * (shows_values ? 1.0 : own_share(surface, body.lengths.z, has_own_length(body)));
    state.weight.xyz *= shows_values ? vec3(0.0) : passed_by(surface, body.lengths.z, has_own_length(body));
    state.colour.xyz += weight * light_of_body(body, slot);
  }
  return !is_first;
}
