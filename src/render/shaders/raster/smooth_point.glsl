// The inputs of smooth mesh fragments, and their lighting.

layout(location = 0) centroid in vec3 normal;
layout(location = 1) centroid in vec4 albedo;
layout(location = 2) centroid in vec3 emitted;
layout(location = 3) centroid in vec3 place;
layout(location = 4) flat in ivec4 base;

// Voxels. The surface lies up to almost one voxel below the corners of its voxels; rays start above them, so that these
// voxels cast no shadow on it.
const float kLift = 1.0;

// Return the fragment's normal, in its grid and in the world.
vec3 own_normal_in_grid() {
  // Interpolation between opposite normals may give 0.
  float size = length(normal);
  return size > 0.0 ? normal / size : vec3(0.0);
}
vec3 own_normal() {
  vec4 axes[3] = mesh_frame().instances[push.instance].axes;
  vec3 in_grid = own_normal_in_grid();
  return axes[0].xyz * in_grid.x + axes[1].xyz * in_grid.y + axes[2].xyz * in_grid.z;
}

LitPoint own_point() {
  MeshFrame f = mesh_frame();
  vec4 sun = f.sun;
  ivec4 home = f.instances[push.instance].home;
  vec3 in_grid = own_normal_in_grid();
  vec3 n = own_normal();
  vec3 surface = albedo.xyz;
  vec3 glow = emitted;
  if (has(kDetailColours)) {
    if (home.w >= 0) surface = placed_at(home.w).detail_colour.xyz;
    glow = vec3(0.0);
  }
  vec3 from = vec3(base.xyz & 63) + place + kLift * in_grid;
  ivec4 voxel = ivec4(base.xyz + ivec3(floor(place - 0.5 * in_grid)), home.w);
  vec3 in_samples = place - f.instances[push.instance].first_sample;
  LevelPlace at = LevelPlace(base.xyz + ivec3(floor(in_samples)), fract(in_samples), in_grid, -1);
  return LitPoint(voxel, base.xyz & ~63, from, n, max(dot(n, sun.xyz), 0.0), surface, glow, albedo.w, at);
}
