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

// Returns the texel at the fragment, without tint.
vec3 texel_seen() {
  vec3 at = before_face(what.x, 0.0);
  vec3 behind = at;
  behind[axis_of(what.x)] -= 0.5 * sign_of(what.x);
  vec3 away = at - viewer.xyz;
  float square_spacing = viewer.w * viewer.w * (viewer.w > 0.0 ? dot(away, away) : 1.0);
  return texel_of(texels, at - floor(behind), square_spacing);
}

void main() {
  if (kGlassStep != 0 && is_beyond(what.x)) discard;
  vec4 seen = colour;
  bool is_textured = kHasTextures && texels.w != 0;
  if (kTraces) {
    Surface surface = surface_of(uint(base.w));
    if (is_textured) {
      vec4 tint = TexturedFaces(frame().textured_faces).at[texels.w - 1].tint;
      set_texel(texel_seen(), tint, surface);
    }
    seen = colour_of_face(what.x, surface, what.y, light_of(what.x), place.w);
  } else if (is_textured) {
    seen.xyz *= texel_seen();
  }
  // Alpha between opaque corners can fall below 1: values beyond a triangle's edge are extrapolated.
  pixel = vec4(shown(seen.xyz), kIsGlass ? seen.w : 1.0);
}
