#version 460
// What a face of a blocky mesh or of an impostor shows.
#include "mesh.glsl"

layout(constant_id = 1) const bool kIsGlass = false;
layout(constant_id = 2) const bool kTraces = false;
layout(constant_id = 3) const bool kHasGlass = false;
layout(constant_id = 5) const uint kGlassStep = 0;  // what is drawn, if it is the nearest glass
#include "face_colour.glsl"
#include "mesh_light.glsl"
#include "blocky_face.glsl"

layout(location = 0) out vec4 pixel;

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
  LevelPlace at = LevelPlace(voxel.xyz, before_face(face, 0.0) - floor(behind), face_normal(face), int(face));
  return traced_light(voxel, base.xyz & ~63, vec3(base.xyz & 63) + from, normal.xyz, diffuse, at);
}

void main() {
  if (kGlassStep != 0 && is_beyond(what.x)) discard;
  vec4 seen = colour;
  if (kTraces) seen = colour_of_face(what.x, uint(base.w), what.y, light_of(what.x), place.w);
  // Between opaque corners is not always opaque: what is interpolated beyond a triangle's edge can be less.
  pixel = vec4(shown(seen.xyz), kIsGlass ? seen.w : 1.0);
}
