#version 460
// What a face of a blocky mesh or of an impostor shows.
#include "mesh.glsl"

layout(constant_id = 1) const bool kIsGlass = false;
layout(constant_id = 2) const bool kTraces = false;
layout(constant_id = 3) const bool kHasGlass = false;
layout(constant_id = 6) const bool kSeesThrough = false;
#define HOLDS_BODIES
#include "face_colour.glsl"
#include "mesh_light.glsl"
#include "corners.glsl"
#include "sky.glsl"
#include "seen_glass.glsl"

layout(location = 0) centroid in vec4 place;
layout(location = 1) flat in ivec4 base;
layout(location = 2) flat in vec4 edges;
layout(location = 3) flat in uvec2 what;
layout(location = 4) centroid in vec4 colour;
layout(location = 0) out vec4 pixel;

// On the face, a little inside its edges, and from there a little before it: what is interpolated can lie beside both.
vec3 before_face(uint face, float lift) {
  const float kInside = 1e-4;
  vec3 at = place.xyz;
  at[kFaceU[face]] = clamp(at[kFaceU[face]], edges.x + kInside, edges.z - kInside);
  at[kFaceV[face]] = clamp(at[kFaceV[face]], edges.y + kInside, edges.w - kInside);
  at[axis_of(face)] = round(at[axis_of(face)]) + lift * sign_of(face);
  return at;
}

vec3 light_of(uint face) {
  MeshFrame f = mesh_frame();
  float diffuse = diffuse_of(face, what.y);
  ivec4 home = f.instances[what.y].home;
  if (home.w < 0) return sunlight_of(diffuse);
  vec3 from = before_face(face, frame().lift / placed_at(home.w).ref_view.w);
  vec3 behind = from;
  behind[axis_of(face)] -= 0.5 * sign_of(face);
  ivec4 voxel = ivec4(base.xyz + ivec3(floor(behind)), home.w);
  vec4 normal = sign_of(face) * f.instances[what.y].axes[axis_of(face)];
  return traced_light(voxel, base.xyz & ~63, vec3(base.xyz & 63) + from, normal.xyz, diffuse);
}

// Whether the fragment lies on what the face was widened by. There another face has one too, and of glass each place
// must be passed once.
bool is_beyond(uint face) {
  vec2 at = vec2(place[kFaceU[face]], place[kFaceV[face]]);
  return any(lessThan(at, edges.xy)) || any(greaterThanEqual(at, edges.zw));
}

vec3 normal_met(int instance, uint face, float t) {
  return face_normal(placed_at(instance), face);
}
vec3 light_of_body(Body body, uint slot) {
  Placed placed = placed_at(body.voxel.w);
  uint face = body.what.y;
  float diffuse = face < 4 ? placed.diffuse[0][face] : placed.diffuse[1][face - 4];
  return light_of_body(body, placed, face_normal(placed, face), diffuse);
}

// The body of the fragment begins in its face; those of other instances in which the ray starts began before.
void enter_first(inout BodyList list) {
  for (uint i = 0; i < list.count; ++i) {
    Body body = listed_body(list, i);
    if (body.what.z == 0 || body.voxel.w != seen_home) continue;
    body.what.y = what.x;
    body.what.z = 0;
    list_body(list, i, body);
  }
}

void main() {
  if (kSeesThrough) {
    const float kWithin = 1e-4;
    if (is_beyond(what.x)) discard;
    pixel = vec4(0.0);
    if (drawn() == kGlassDepth) return;
    pixel = seen_from(mesh_frame().instances[what.y].home.w, base.xyz, before_face(what.x, -kWithin));
    return;
  }
  vec4 seen = colour;
  if (kTraces) seen = colour_of_face(what.x, uint(base.w), what.y, light_of(what.x), place.w);
  // Between opaque corners is not always opaque: what is interpolated beyond a triangle's edge can be less.
  pixel = vec4(shown(seen.xyz), kIsGlass ? seen.w : 1.0);
}
