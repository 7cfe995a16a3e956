// The light that reaches a point: lamps, and rays among all instances. The including file defines `kHasGlass`: true if
// there is glass.
//
// Compilers inline a function at each call, and a walk is long. Each function is therefore called at one place in a
// shader, in a loop over all its uses. See docs/decisions/archive/088.

// ---- lamps; match render/light/lamp_table.h on the CPU ----

struct Lamp {
  vec4 position;  // in view; w: its reach
  vec4 axes[3];   // its own in view, unit; w: the term added to the squared distance, cosines of a spot's angles
  vec4 power[6];
  vec4 low;       // of its box, from its position along its axes; w: 1 for a point lamp, 2 for a spot
  vec4 high;
  vec4 direction;
};

struct LampBrick {
  ivec4 key;  // the brick; w: the instance
  uvec4 list;  // first, count: 0 if the slot is free
};

layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer Lamps {
  Lamp at[];
};
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer LampBricks {
  LampBrick at[];
};

// Returns the lamps of a 16^3 brick of an instance's full grid: the first index in the lists, and the count.
uvec2 lamps_at(ivec3 brick, int placed) {
  LampBricks bricks = LampBricks(frame().lamp_bricks);
  uint mask = frame().lamp_mask;
  uint slot = hash_of(hash_of(uint(brick.x), uint(brick.y)), hash_of(uint(brick.z), uint(placed))) & mask;
  for (;;) {
    LampBrick found = bricks.at[slot];
    if (found.list.y == 0) return uvec2(0);
    if (found.key == ivec4(brick, placed)) return found.list.xy;
    slot = (slot + 1) & mask;
  }
}

// Returns the light on a white surface if unblocked. If it is not 0, also sets the direction towards the lamp and the
// distance of its surface.
vec3 lamp_light(Lamp lamp, vec3 to_lamp, vec3 normal, out vec3 direction, out float reach) {
  float squared = dot(to_lamp, to_lamp);
  float far = sqrt(squared);
  if (!(far < lamp.position.w) || !(far > 0.0)) return vec3(0.0);
  direction = to_lamp / far;
  float cosine = dot(normal, direction);
  if (!(cosine > 0.0)) return vec3(0.0);
  float share = far / lamp.position.w;
  float fading = 1.0 - share * share * share * share;
  float factor = cosine * fading / (squared + lamp.axes[0].w);
  reach = far;
  if (lamp.low.w > 0.0) {
    if (lamp.low.w > 1.0) {
      float towards = -dot(lamp.direction.xyz, direction);
      float cone = clamp((towards - lamp.axes[2].w) / (lamp.axes[1].w - lamp.axes[2].w), 0.0, 1.0);
      factor *= cone * cone;
    }
    return lamp.power[0].xyz * factor;
  }
  vec3 light = vec3(0.0);
  float inside = kInfinity;
  for (int axis = 0; axis < 3; ++axis) {
    float along = -dot(lamp.axes[axis].xyz, direction);
    light += lamp.power[2 * axis + (along < 0.0 ? 1 : 0)].xyz * (abs(along) * factor);
    if (along != 0.0) inside = min(inside, (along > 0.0 ? lamp.high[axis] : lamp.low[axis]) / along);
  }
  reach = far - inside * (1.0 + 1e-6) - 1e-3 * (lamp.high.x - lamp.low.x);
  return light;
}

// ---- rays ----

uint rays_taken;

// Returns true if a ray in the space of grid `home` meets an opaque voxel or an opaque part of a field in any instance.
// Tests `home` first.
bool is_blocked(int home, Placed own, GridRay ray, float max_t) {
  ViewRay in_view = view_from_grid(own, ray);
  start_visit(in_view);
  Placed placed = own;
  bool is_first = true;
  for (int i = home; i >= 0; i = next_instance(max_t)) {
    if (i == home && !is_first) continue;
    if (!is_first) {
      placed = placed_at(i);
      ray = grid_from_view(placed, in_view);
    }
    is_first = false;
    for (int content = 0; content < kContents; ++content) {
      float t;
      if (find_opaque(placed, content, ray, max_t, t)) return true;
    }
    if (frame().placed_count == 1) return false;
  }
  return false;
}

// Finds the bodies of all instances along a ray, given in the space of grid `home` and in view. `length`: of the ray's
// direction in the world.
void find_bodies(int home, GridRay ray, ViewRay in_view, float length, float max_t, float from_t, inout BodyList list,
                 inout vec3 passed) {
  start_visit(in_view);
  for (;;) {
    int i = next_instance(max_t);
    if (i < 0) break;
    Placed placed = placed_at(i);
    GridRay in_grid = ray;
    if (i != home) in_grid = grid_from_view(placed, in_view);
    find_bodies(i, Grids(frame().grids).at[placed.ref_base.w], in_grid,
                length * placed.ref_view.w / placed.ref_inside.w, max_t, from_t, list, passed);
  }
}

// Returns the transmittance of each channel for sunlight along the ray.
vec3 sunlight_passed(uint slot, int home, Placed own, GridRay ray, float max_t) {
#ifdef KEEPS_BODIES
  BodyList list = BodyList(frame().sun_bodies, slot * kBodies, kBodies, 0, kInfinity);
#else
  BodyList list = BodyList(uvec2(0), 0, 0, 0, kInfinity);
#endif
  vec3 passed = vec3(1.0);
  met_closed_face = false;
  find_bodies(home, ray, view_from_grid(own, ray), own.ref_inside.w, max_t, 0.0, list, passed);
  uint i = 0;
  Body body;
  while (next_body(list, i, body)) {
    passed *= passed_by_body(body);
  }
  return passed;
}

// Returns the lamps that may reach a voxel of an instance's tree: the first index in the lists, and the count.
uvec2 lamps_around(ivec4 voxel, Placed placed) {
  return lamps_at(((voxel.xyz + placed.origin.xyz) << placed.origin.w) >> 4, voxel.w);
}

// Returns the light that a listed lamp adds at a point in view if unblocked; sets the ray towards it, up to `max_t`.
vec3 light_of_lamp(uint number, vec3 in_view, vec3 normal, Placed placed, inout GridRay ray, out float max_t) {
  Lamp lamp = Lamps(frame().lamps).at[Numbers(frame().lamp_lists).at[number]];
  vec3 direction = vec3(0.0);
  float reach = 0.0;
  vec3 light = lamp_light(lamp, lamp.position.xyz - in_view, normal, direction, reach);
  float voxel_size = placed.ref_inside.w;
  ray.direction = turned(placed.grid_axes, direction) * voxel_size;
  max_t = reach / voxel_size;
  return light;
}

// Returns the transmittance of each channel along a ray. `slot`: selects the lists of bodies to use.
vec3 passed_on_way(uint slot, int home, Placed own, GridRay ray, float max_t) {
  ++rays_taken;
  if (is_blocked(home, own, ray, max_t)) return vec3(0.0);
  return kHasGlass ? sunlight_passed(slot, home, own, ray, max_t) : vec3(1.0);
}
