#version 460
// The nearest opaque voxel of each pixel of a tile.
#include "data.glsl"
#include "walk.glsl"
#include "instances.glsl"
#include "count.glsl"


Point first_hit(vec2 at) {
  Point point;
  point.voxel = ivec4(0, 0, 0, -1);
  point.inside = vec4(0.0, 0.0, 0.0, kInfinity);
  point.what = uvec4(0);
  ViewRay ray = camera_ray(at);
  // Every instance has a start of its own; that of the nearest so far lies at this depth, and the hit `nearest` behind.
  // Differences of depths are exact.
  float scale = length_a_depth(at);
  float depth = 0.0;
  float nearest = kInfinity;
  start_visit(ray);
  for (int i = next_instance(kInfinity); i >= 0;
       i = next_instance((depth - frame().view_depth) * scale + nearest)) {
    Placed placed = placed_at(i);
    GridRay in_grid = camera_ray_in(placed, at);
    float limit = (depth - placed.start.w) * scale + nearest;
    float rounding = 1e-6 * max(abs(limit), nearest);
    Tree tree = Grids(frame().grids).at[placed.ref_base.w].opaque;
    float room = limit + rounding;
    if (!start_walk(tree, in_grid.base, in_grid.origin, in_grid.direction, room) || !find_voxel(room)) continue;
    // Of equally near ones the instance that comes first; equal but for the rounding of each grid's own space.
    bool is_equal = point.voxel.w >= 0 && abs(walk_t - limit) <= rounding;
    if (is_equal ? i > point.voxel.w : walk_t > limit) continue;
    depth = placed.start.w;
    nearest = walk_t;
    float t = in_grid.t + walk_t;
    bool is_inside = walk_axis < 0 && placed.start.w == 0.0;
    point.voxel = ivec4(walk_voxel, i);
    uint face = face_found();
    precise vec3 position = ray_origin + walk_t * ray_direction;
    point.inside = vec4(position - vec3(walk_voxel - ray_base), t);
    point.what = uvec4(type_found(), face, is_inside ? kUnlit : kSurface, floatBitsToUint(walk_t));
  }
  return point;
}

void main() {
  bool is_active = is_in_tile();
  bool is_hit = false;
  if (is_active) {
    Point point = first_hit(picture_point());
    is_hit = point.voxel.w >= 0;
    uint slot = slot_of_pixel();
    Points(frame().points).at[slot] = point;
    State state;
    state.weight = vec4(1.0, 1.0, 1.0, -kNever);
    state.colour = vec4(0.0, 0.0, 0.0, 1.0);
    States(frame().states).at[slot] = state;
    if (push.first != 0) Depths(frame().depths).at[slot] = point.inside.w;
  }
  add_counts(is_active ? 1 : 0, is_hit && push.first != 0, false);
}
