#version 460
// The colour of a face of a blocky mesh.
#include "mesh.glsl"

layout(constant_id = 1) const bool kIsGlass = false;
layout(constant_id = 2) const bool kTraces = false;
layout(constant_id = 3) const bool kHasGlass = false;
layout(constant_id = 5) const uint kGlassStep = 0;  // draw mode, for the nearest glass
#include "face_colour.glsl"
#include "mesh_light.glsl"
#include "blocky_face.glsl"

layout(location = 0) out vec4 pixel;

// Returns the surface at the fragment, with its texture.
Surface surface_seen() {
  Surface surface = surface_of(uint(base.w));
  if (!kHasTextures) return surface;
  vec3 at = before_face(what.x, 0.0);
  vec3 behind = at;
  behind[axis_of(what.x)] -= 0.5 * sign_of(what.x);
  MeshFrame f = mesh_frame();
  vec4 axis = f.instances[what.y].axes[0];
  vec4 eye = f.instances[what.y].eye;
  ivec4 home = f.instances[what.y].home;
  vec3 away = at + vec3(base.xyz - home.xyz) - eye.xyz;
  float square_spacing = axis.w * axis.w * (eye.w != 0.0 ? dot(away, away) : 1.0);
  show_texture(uint(base.w), what.x, at - floor(behind), square_spacing, surface);
  return surface;
}

void main() {
  if (kGlassStep != 0 && is_beyond(what.x)) discard;
  vec4 seen = colour;
  if (kTraces || kHasTextures) seen = colour_of_face(what.x, surface_seen(), what.y, light_of(what.x), place.w);
  // Alpha between opaque corners can fall below 1: values beyond a triangle's edge are extrapolated.
  pixel = vec4(shown(seen.xyz), kIsGlass ? seen.w : 1.0);
}
