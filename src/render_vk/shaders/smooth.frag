#version 460
#include "mesh.glsl"

layout(constant_id = 2) const bool kTraces = false;
layout(constant_id = 3) const bool kHasGlass = false;
#include "lit.glsl"
#include "mesh_light.glsl"

layout(location = 0) centroid in vec3 normal;
layout(location = 1) centroid in vec4 albedo;
layout(location = 2) centroid in vec3 emitted;
layout(location = 3) centroid in vec3 place;
layout(location = 4) flat in ivec3 base;
layout(location = 0) out vec4 pixel;

// The surface lies up to most of a voxel below the corners of the voxels that it is of; what would be shadows of these
// on it begins past them. Voxels.
const float kLift = 1.0;

vec3 light_of(vec3 in_grid, vec3 n) {
  MeshFrame f = mesh_frame();
  vec4 sun = f.sun;
  ivec4 home = f.instances[push.instance].home;
  float diffuse = max(dot(n, sun.xyz), 0.0);
  vec3 from = place + kLift * in_grid;
  ivec4 voxel = ivec4(base + ivec3(floor(place - 0.5 * in_grid)), home.w);
  return traced_light(voxel, base & ~63, vec3(base & 63) + from, n, diffuse);
}

void main() {
  // Between opposite normals there may be none.
  float size = length(normal);
  vec3 in_grid = size > 0.0 ? normal / size : vec3(0.0);
  vec4 axes[3] = mesh_frame().instances[push.instance].axes;
  vec3 n = axes[0].xyz * in_grid.x + axes[1].xyz * in_grid.y + axes[2].xyz * in_grid.z;
  vec3 colour;
  if (has(kShowOcclusion)) {
    colour = vec3(albedo.w);
  } else if (has(kShowNormals)) {
    colour = 0.5 + 0.5 * n;
  } else {
    vec3 surface = albedo.xyz;
    vec3 glow = emitted;
    if (has(kDetailColours)) {
      ivec4 home = mesh_frame().instances[push.instance].home;
      if (home.w >= 0) surface = placed_at(home.w).detail_colour.xyz;
      glow = vec3(0.0);
    }
    colour = colour_in_light(surface, glow, light_of(in_grid, n), albedo.w);
  }
  pixel = vec4(shown(colour), 1.0);
}
