#version 460
#include "mesh.glsl"

layout(location = 0) centroid in vec3 normal;
layout(location = 1) centroid in vec4 albedo;
layout(location = 2) centroid in vec3 emitted;
layout(location = 0) out vec4 pixel;

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
    colour = lit_colour(surface.xyz, emitted, max(dot(n, sun.xyz), 0.0), surface.w);
  }
  pixel = vec4(shown(colour), 1.0);
}
