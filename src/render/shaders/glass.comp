#version 460
// Finds the glass bodies in front of each pixel's hit.
#include "compute.glsl"
#include "walk.glsl"
#include "instances.glsl"
#include "camera.glsl"
#define KEEPS_BODIES
#include "lit.glsl"
#include "glass.glsl"

// Distances are measured from the origin of view space, except `first_t`.
void find_glass(uint slot, inout State state, out float first_t, out bool has_hit) {
  vec2 point = image_point();
  ViewRay ray = camera_ray(point);
  Pair direction = exact_direction();
  Point hit = Points(frame().points).at[slot];
  has_hit = hit.voxel.w >= 0;
  float scale = length_a_depth(point);
  float depth = frame().view_depth;
  float max_t = t_of(hit, point);
  BodyList list = BodyList(frame().bodies, slot * kBodies, kBodies, 0, kInfinity);
  vec3 unused = vec3(1.0);
  start_visit(ray);
  for (;;) {
    int i = next_instance(max_t);
    if (i < 0) break;
    Placed placed = placed_at(i);
    GridRay in_grid = rounded(placed, exact_ray_in(placed, direction), (placed.start.w - depth) * scale);
    find_bodies(i, Grids(frame().grids).at[placed.ref_base.w], in_grid, placed.ref_view.w / placed.ref_inside.w, max_t,
                state.weight.w, list, unused);
  }
  first_t = list.count > 0 ? depth * scale + Bodies(list.address).at[list.first].lengths.x : kInfinity;
  state.weight.w = list.dropped_t;
  state.colour.w = float(list.count + 1);
}

void main() {
  bool is_new_hit = false;
  bool is_pending = false;
  if (is_in_tile()) {
    uint slot = slot_of_pixel();
    State state = States(frame().states).at[slot];
    // Later rounds only handle pixels with remaining bodies.
    if (push.round == 0 || state.colour.w > 0.0) {
      float first_t;
      bool has_hit;
      find_glass(slot, state, first_t, has_hit);
      is_pending = state.weight.w < kInfinity;
      if (push.first != 0 && push.round == 0 && state.colour.w > 1.0) {
        is_new_hit = !has_hit;
        Depths(frame().depths).at[slot] = first_t;
      }
      States(frame().states).at[slot] = state;
    }
  }
  add_counts(0, is_new_hit, is_pending);
}
