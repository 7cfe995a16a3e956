#version 460
// The nearest opaque voxel of each pixel of a tile.
#include "data.glsl"
#include "walk.glsl"
#include "pairs.glsl"
#include "instances.glsl"
#include "count.glsl"


Point first_hit(vec2 at) {
  Point point;
  point.voxel = ivec4(0, 0, 0, -1);
  point.inside = vec4(0.0, 0.0, 0.0, kInfinity);
  point.what = uvec4(0);
  ViewRay ray = camera_ray(at);
  Pair direction = exact_direction();
  // Every instance has a start of its own; that of the nearest so far lies at this depth, and the hit `nearest` behind.
  // Differences of depths are exact.
  float scale = length_a_depth(at);
  float depth = 0.0;
  float nearest = kInfinity;
  start_visit(ray);
  for (int i = next_instance(kInfinity); i >= 0;
       i = next_instance((depth - frame().view_depth) * scale + nearest)) {
    Placed placed = placed_at(i);
    Tree tree = Grids(frame().grids).at[placed.ref_base.w].opaque;
    ExactRay exact = exact_ray_in(placed, direction);
    float moved_t;
    int moved;
    if (!move_to_bounds(tree, placed, exact, moved_t, moved)) continue;
    GridRay in_grid = rounded(placed, exact, placed.start.w * scale);
    float limit = (depth - placed.start.w) * scale + nearest;
    float rounding = 1e-6 * max(abs(limit), nearest);
    float room = limit + rounding - moved_t;
    if (!start_walk(tree, in_grid.base, in_grid.origin, in_grid.direction, room, moved) || !find_voxel(room)) continue;
    float found_t = moved_t + walk_t;
    // Of equally near ones the instance that comes first; equal but for the rounding of each grid's own space.
    bool is_equal = point.voxel.w >= 0 && abs(found_t - limit) <= rounding;
    if (is_equal ? i > point.voxel.w : found_t > limit) continue;
    depth = placed.start.w;
    nearest = found_t;
    float t = in_grid.t + found_t;
    bool is_inside = walk_axis < 0;
    point.voxel = ivec4(walk_voxel, i);
    uint face = face_found();
    point.inside.w = t;
    point.what = uvec4(type_found(), face, is_inside ? kUnlit : kSurface, floatBitsToUint(found_t));
  }
  // Inside a voxel the place does not count.
  if (point.voxel.w >= 0 && point.what.z == kSurface) {
    point.inside.xyz = exact_place(placed_at(point.voxel.w), direction, point.voxel.xyz, point.what.y);
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
