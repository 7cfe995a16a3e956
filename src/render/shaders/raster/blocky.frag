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

void main() {
  if (kGlassStep != 0 && is_beyond(what.x)) discard;
  vec4 seen = colour;
  if (kTraces) seen = colour_of_face(what.x, uint(base.w), what.y, light_of(what.x), place.w);
  // Alpha between opaque corners can fall below 1: values beyond a triangle's edge are extrapolated.
  pixel = vec4(shown(seen.xyz), kIsGlass ? seen.w : 1.0);
}
