#version 460
// The colour of a face of a blocky mesh.
#include "mesh.glsl"

layout(constant_id = 1) const bool kIsGlass = false;
layout(constant_id = 2) const bool kTraces = false;
layout(constant_id = 3) const bool kHasGlass = false;
layout(constant_id = 5) const uint kGlassStep = 0;  // what is drawn, if it is the nearest glass
#include "face_colour.glsl"
#include "mesh_light.glsl"
#include "blocky_face.glsl"
#include "blocky_light.glsl"

layout(location = 0) out vec4 pixel;

void main() {
  if (kGlassStep != 0 && is_beyond(what.x)) discard;
  vec4 seen = colour;
  if (kTraces) seen = colour_of_face(what.x, uint(base.w), what.y, light_of(what.x), place.w);
  // Between opaque corners is not always opaque: what is interpolated beyond a triangle's edge can be less.
  pixel = vec4(shown(seen.xyz), kIsGlass ? seen.w : 1.0);
}
