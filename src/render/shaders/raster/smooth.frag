#version 460
// The colour of a point of a smooth mesh.
#include "mesh.glsl"

layout(constant_id = 2) const bool kTraces = false;
layout(constant_id = 3) const bool kHasGlass = false;
layout(constant_id = 5) const uint kGlassStep = 0;  // draw mode, for the nearest glass
#include "lit.glsl"
#include "mesh_light.glsl"
#include "sky.glsl"
#include "smooth_point.glsl"

layout(location = 0) out vec4 pixel;

// Treats the nearest glass as a body of one voxel in front of the opaque surface: returns its transmittance, or its
// added light.
vec4 seen_alone(vec3 colour) {
  Surface surface = surface_of(uint(base.w));
  vec2 mirror = vec2(0.0);
  if (has(kGlassSurfaces)) mirror = mirror_at(seen_direction(), own_normal(), 1.0, surface.ior);
  float left = 1.0 - mirror.x;
  if (kGlassStep == kGlassPassed) return vec4(left * passed_by(surface, 1.0, false), 1.0);
  vec3 added = left * own_share(surface, 1.0, false) * colour + mirror.x * sky_colour(mirror.y);
  return vec4(shown(added), 0.0);
}

void main() {
  vec3 colour = vec3(0.0);
  if (kGlassStep == 0 && has(kShowOcclusion)) {
    colour = vec3(albedo.w);
  } else if (kGlassStep == 0 && has(kShowNormals)) {
    colour = 0.5 + 0.5 * own_normal();
  } else if (kGlassStep == 0 || kGlassStep == kGlassAdded) {
    colour = colour_of(own_point());
  }
  pixel = kGlassStep == 0 ? vec4(shown(colour), 1.0) : seen_alone(colour);
}
