#version 460
// What a point of a smooth mesh shows.
#include "mesh.glsl"

layout(constant_id = 2) const bool kTraces = false;
layout(constant_id = 3) const bool kHasGlass = false;
layout(constant_id = 5) const bool kIsNearestGlass = false;
layout(constant_id = 6) const bool kSeesThrough = false;
#define HOLDS_BODIES
#include "faces.glsl"
#include "lit.glsl"
#include "mesh_light.glsl"
#include "corners.glsl"
#include "sky.glsl"
#include "seen_glass.glsl"

layout(location = 0) centroid in vec3 normal;
layout(location = 1) centroid in vec4 albedo;
layout(location = 2) centroid in vec3 emitted;
layout(location = 3) centroid in vec3 place;
layout(location = 4) flat in ivec4 base;
layout(location = 0) out vec4 pixel;

// The surface lies up to most of a voxel below the corners of the voxels that it is of; what would be shadows of these
// on it begins past them. Voxels.
const float kLift = 1.0;

// Of the fragment; in its grid, and in the world.
vec3 own_normal_in_grid() {
  // Between opposite normals there may be none.
  float size = length(normal);
  return size > 0.0 ? normal / size : vec3(0.0);
}
vec3 own_normal() {
  vec4 axes[3] = mesh_frame().instances[push.instance].axes;
  vec3 in_grid = own_normal_in_grid();
  return axes[0].xyz * in_grid.x + axes[1].xyz * in_grid.y + axes[2].xyz * in_grid.z;
}

vec3 own_light() {
  MeshFrame f = mesh_frame();
  vec4 sun = f.sun;
  ivec4 home = f.instances[push.instance].home;
  vec3 in_grid = own_normal_in_grid();
  vec3 n = own_normal();
  float diffuse = max(dot(n, sun.xyz), 0.0);
  vec3 from = place + kLift * in_grid;
  ivec4 voxel = ivec4(base.xyz + ivec3(floor(place - 0.5 * in_grid)), home.w);
  return traced_light(voxel, base.xyz & ~63, vec3(base.xyz & 63) + from, n, diffuse);
}

vec3 own_colour() {
  vec3 surface = albedo.xyz;
  vec3 glow = emitted;
  if (has(kDetailColours)) {
    ivec4 home = mesh_frame().instances[push.instance].home;
    if (home.w >= 0) surface = placed_at(home.w).detail_colour.xyz;
    glow = vec3(0.0);
  }
  return colour_in_light(surface, glow, own_light(), albedo.w);
}

// Outwards at a point of a grid's surface, in its tree's coordinates from `base`: of all voxels, blurred by quadratic
// splines; unit, or 0 where nothing is on one side rather than on the other.
vec3 blurred_normal(GridTrees trees, ivec3 base, vec3 point) {
  vec3 whole = floor(point);
  vec3 off = point - whole - 0.5;
  vec3 weights[3] = {0.5 * (0.5 - off) * (0.5 - off), 0.75 - off * off, 0.5 * (0.5 + off) * (0.5 + off)};
  vec3 slopes[3] = {off - 0.5, -2.0 * off, off + 0.5};
  vec3 inwards = vec3(0.0);
  for (int i = 0; i < 27; ++i) {
    ivec3 at = ivec3(i % 3, i / 3 % 3, i / 9);
    ivec3 voxel = base + ivec3(whole) + at - 1;
    if (!holds(trees.transparent, voxel) && !holds(trees.opaque, voxel)) continue;
    vec3 w = vec3(weights[at.x].x, weights[at.y].y, weights[at.z].z);
    inwards += vec3(slopes[at.x].x * w.y * w.z, w.x * slopes[at.y].y * w.z, w.x * w.y * slopes[at.z].z);
  }
  float size = length(inwards);
  return size > 0.05 ? inwards / -size : vec3(0.0);
}

// The first surface is the fragment's; others are of voxels, between bodies that touch each other their faces.
vec3 normal_met(int instance, uint face, float t) {
  if (t <= 0.0) return own_normal();
  Placed placed = placed_at(instance);
  GridRay ray = seen_ray_in(instance, placed);
  vec3 in_grid = blurred_normal(Grids(frame().grids).at[placed.ref_base.w], ray.base, ray.origin + t * ray.direction);
  if (!(sign_of(face) * in_grid[axis_of(face)] > 0.0)) return face_normal(placed, face);
  return normalize(turned(placed.view_axes, in_grid));
}

vec3 light_of_body(Body body, uint slot) {
  if (body.lengths.x <= 0.0) return own_colour();
  vec4 sun = mesh_frame().sun;
  vec3 met = normal_met(body.voxel.w, body.what.y, body.lengths.x);
  return light_of_body(body, placed_at(body.voxel.w), met, max(dot(met, sun.xyz), 0.0));
}

// The surface lies up to about a voxel before the voxels of its body, or within them. Where there are none, there is no
// more than what counts as one voxel.
void enter_first(inout BodyList list) {
  const float kNear = 2.0;
  float voxel_size = placed_at(seen_home).ref_inside.w;
  if (list.count > 0) {
    Body first = listed_body(list, 0);
    if (first.voxel.w == seen_home && first.lengths.x < kNear * voxel_size) {
      first.what.z = 0;
      first.lengths.x = 0.0;
      list_body(list, 0, first);
      return;
    }
  }
  vec3 in_grid = own_normal_in_grid();
  vec3 size = abs(in_grid);
  int axis = size.y > size.x ? 1 : 0;
  if (size.z > size[axis]) axis = 2;
  uint face = uint(2 * axis) + (in_grid[axis] < 0.0 ? 1 : 0);
  Body thin;
  thin.voxel = ivec4(base.xyz + ivec3(floor(place)), seen_home);
  thin.lengths = vec4(0.0);
  thin.what = uvec4(uint(base.w), face, 0, 8 * uint(seen_home) + face);
  Body dropped;
  if (insert_body(list, thin, dropped)) list.dropped_t = min(list.dropped_t, dropped.lengths.x);
}

// Without rays: as a body of one voxel, before what is opaque.
vec4 seen_alone() {
  Surface surface = surface_of(uint(base.w));
  vec2 mirror = vec2(0.0);
  if (has(kGlassSurfaces)) mirror = mirror_at(seen_direction(), own_normal(), 1.0, surface.ior);
  float left = 1.0 - mirror.x;
  if (drawn() == kGlassPassed) return vec4(left * passed_by(surface, 1.0, false), 1.0);
  vec3 added = left * own_share(surface, 1.0, false) * own_colour() + mirror.x * sky_colour(mirror.y);
  return vec4(shown(added), 0.0);
}

vec4 shown_glass() {
  if (drawn() == kGlassDepth) return vec4(0.0);
  if (!kSeesThrough) return seen_alone();
  return seen_from(mesh_frame().instances[push.instance].home.w, base.xyz, place);
}

vec4 shown_surface() {
  vec3 colour;
  if (has(kShowOcclusion)) {
    colour = vec3(albedo.w);
  } else if (has(kShowNormals)) {
    colour = 0.5 + 0.5 * own_normal();
  } else {
    colour = own_colour();
  }
  return vec4(shown(colour), 1.0);
}

void main() {
  pixel = kIsNearestGlass ? shown_glass() : shown_surface();
}
