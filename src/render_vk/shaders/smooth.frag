#version 460
#include "mesh.glsl"

layout(location = 0) centroid in vec3 normal;
layout(location = 1) centroid in vec4 albedo;
layout(location = 2) centroid in vec3 emitted;
layout(location = 0) out vec4 pixel;

// The reference model of light without shadows, before exposure: light/lighting.h. `diffuse`: max(n.l, 0).
vec3 lit_colour(vec3 colour, float diffuse, float openness) {
  if (!has(kLit)) return colour;
  vec4 share = Frame(push.frame).light;
  float light = share.x * openness + diffuse;
  if (!has(kHasOcclusion)) {
    light = share.y + diffuse;
  } else if (has(kAffectsAll)) {
    light = (share.x + diffuse) * (share.z + (1.0 - share.z) * openness);
  }
  return colour * light + emitted;
}

void main() {
  vec4 surface = albedo;
  // Between opposite normals there may be none.
  float size = length(normal);
  vec3 n = size > 0.0 ? normal / size : vec3(0.0);
  vec3 colour;
  if (has(kShowOcclusion)) {
    colour = vec3(surface.w);
  } else if (has(kShowNormals)) {
    colour = 0.5 + 0.5 * n;
  } else {
    vec4 sun = Frame(push.frame).sun;
    colour = lit_colour(surface.xyz, max(dot(n, sun.xyz), 0.0), surface.w);
  }
  pixel = vec4(shown(colour), 1.0);
}
