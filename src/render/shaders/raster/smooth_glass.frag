#version 460
// The colour of the nearest point of a smooth glass body, including everything visible through it.
#include "mesh.glsl"

layout(constant_id = 5) const uint kGlassStep = 0;
const bool kTraces = true;
const bool kHasGlass = true;
#define HOLDS_BODIES
#include "lit.glsl"
#include "mesh_light.glsl"
#include "corners.glsl"
#include "sky.glsl"
#include "seen_glass.glsl"
#include "smooth_point.glsl"

layout(location = 0) out vec4 pixel;

// Returns the outward normal at a point of a grid's surface, in its tree's coordinates from `base`: from all voxels,
// blurred by quadratic splines. Unit, or 0 if both sides are equal.
vec3 blurred_normal(GridTrees trees, ivec3 base, vec3 point) {
  vec3 whole = floor(point);
  vec3 off = point - whole - 0.5;
  vec3 weights[3] = {0.5 * (0.5 - off) * (0.5 - off), 0.75 - off * off, 0.5 * (0.5 + off) * (0.5 + off)};
  vec3 slopes[3] = {off - 0.5, -2.0 * off, off + 0.5};
  vec3 inwards = vec3(0.0);
  for (int i = 0; i < 27; ++i) {
    ivec3 at = ivec3(i % 3, i / 3 % 3, i / 9);
    ivec3 voxel = base + ivec3(whole) + at - 1;
    bool is_held = false;
    for (int k = 0; k < 2 && !is_held; ++k) {
      Tree tree = trees.transparent;
      if (k == 1) tree = trees.opaque;
      is_held = holds(tree, voxel);
    }
    if (!is_held) continue;
    vec3 w = vec3(weights[at.x].x, weights[at.y].y, weights[at.z].z);
    inwards += vec3(slopes[at.x].x * w.y * w.z, w.x * slopes[at.y].y * w.z, w.x * w.y * slopes[at.z].z);
  }
  float size = length(inwards);
  return size > 0.05 ? inwards / -size : vec3(0.0);
}

// Returns the normal of a surface on the ray. The first surface is the fragment's; later ones are of voxels, or their
// faces between bodies that touch.
vec3 normal_met(int instance, uint face, float t) {
  if (t <= 0.0) return own_normal();
  Placed placed = placed_at(instance);
  GridRay ray = seen_ray_in(instance, placed);
  vec3 in_grid = blurred_normal(Grids(frame().grids).at[placed.ref_base.w], ray.base, ray.origin + t * ray.direction);
  if (!(sign_of(face) * in_grid[axis_of(face)] > 0.0)) return face_normal(placed, face);
  return normalize(turned(placed.view_axes, in_grid));
}

LitPoint point_of_body(Body body) {
  if (body.lengths.x <= 0.0) return own_point();
  vec4 sun = mesh_frame().sun;
  vec3 met = normal_of_side(body, true);
  return point_of_body(body, placed_at(body.voxel.w), met, max(dot(met, sun.xyz), 0.0));
}

// The mesh surface lies up to about one voxel in front of its body's voxels, or within them. For a field with less
// detail it lies up to a few samples in front. If the ray finds no body there, the glass counts as one voxel, and for a
// field only as a surface.
void enter_first(inout BodyList list) {
  bool is_of_field = kHasFieldGlass && mesh_frame().instances[push.instance].first_sample == 0.0;
  float near = (is_of_field ? 8.0 : 2.0) * placed_at(seen_home).ref_inside.w;
  vec3 in_grid = own_normal_in_grid();
  if (list.count > 0) {
    Body first = listed_body(list, 0);
    bool is_of_kind = ((first.what.z & kBeginsInField) != 0) == is_of_field;
    bool is_of_type = !is_of_field || type_of(first) == uint(base.w);
    if (is_of_kind && is_of_type && first.voxel.w == seen_home && first.lengths.x < near) {
      first.what.z &= ~kStartsInside;
      if (is_of_field) first.what.y = packed_normal(in_grid);
      first.lengths.x = 0.0;
      list_body(list, 0, first);
      return;
    }
  }
  vec3 size = abs(in_grid);
  int axis = size.y > size.x ? 1 : 0;
  if (size.z > size[axis]) axis = 2;
  uint face = uint(2 * axis) + (in_grid[axis] < 0.0 ? 1 : 0);
  Body thin;
  thin.voxel = ivec4(base.xyz + ivec3(floor(place)), seen_home);
  thin.lengths = vec4(0.0);
  thin.what = uvec4(uint(base.w), face, 0, 8 * uint(seen_home) + face);
  if (is_of_field) {
    thin.what.y = packed_normal(in_grid);
    thin.what.z = kBeginsInField;
  }
  Body dropped;
  if (insert_body(list, thin, dropped)) list.dropped_t = min(list.dropped_t, dropped.lengths.x);
}

void main() {
  pixel = seen_from(mesh_frame().instances[push.instance].home.w, base.xyz, place);
}
