#version 460
// The light of what each pixel of a tile shows: light/lighting.h on the processor's side.
#include "data.glsl"
#include "walk.glsl"
#include "pairs.glsl"
#include "instances.glsl"
#include "glass.glsl"
#include "count.glsl"
#include "sky.glsl"
#include "srgb.glsl"
#include "lamps.glsl"

layout(constant_id = 0) const bool kHasGlass = true;

const uint kTurns = 1024;

// By face: its axis, and the axes of its edges.
const int kFaceU[6] = {1, 2, 2, 0, 0, 1};
const int kFaceV[6] = {2, 1, 0, 2, 1, 0};

int axis_of(uint face) {
  return int(face >> 1);
}
float sign_of(uint face) {
  return (face & 1) == 0 ? 1.0 : -1.0;
}

vec3 sky_colour(float up) {
  Frame f = frame();
  return sky_colour(Sky(f.sky_zenith.xyz, f.sky_horizon.xyz, f.sky_ground.xyz, f.ground_begins, f.ground_is_full), up);
}

float sky_up(vec2 point) {
  if (has(kPerspective)) return camera_ray(point).direction.y;
  vec3 d = frame().forward.xyz + picture_vector(point) * frame().sky_scale;
  return d.y / length(d);
}

vec3 occlusion_direction(uint face, int ray, uint hash) {
  Vectors directions = Vectors(frame().directions);
  if (has(kFixedDirections)) {
    vec3 fixed_one = directions.at[face * 9 + ray].xyz;
    float u = fixed_one[kFaceU[face]];
    float v = fixed_one[kFaceV[face]];
    fixed_one[kFaceU[face]] = push.turn.x * u - push.turn.y * v;
    fixed_one[kFaceV[face]] = push.turn.y * u + push.turn.x * v;
    return fixed_one;
  }
  vec2 ring = directions.at[ray].xy;
  vec2 turn = Vectors(frame().turns).at[hash % kTurns].xy;
  float shift = (float(hash / kTurns) + 0.5) * (float(kTurns) / 4294967296.0);
  float sine_squared = (float(ray) + shift) / float(frame().occlusion_count);
  float radius = sqrt(sine_squared);
  vec3 direction;
  direction[axis_of(face)] = sign_of(face) * sqrt(1.0 - sine_squared);
  direction[kFaceU[face]] = radius * (ring.x * turn.x - ring.y * turn.y);
  direction[kFaceV[face]] = radius * (ring.y * turn.x + ring.x * turn.y);
  return direction;
}

// Whether a ray in the space of grid `home`, which is asked first, meets an opaque voxel of any instance.
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
    Tree tree = Grids(frame().grids).at[placed.ref_base.w].opaque;
    if (start_walk(tree, ray.base, ray.origin, ray.direction, max_t, -1) && find_voxel(max_t)) return true;
    if (frame().placed_count == 1) return false;
  }
  return false;
}

// What of each channel of the sun's light passes what is transparent on the way.
vec3 sunlight_passed(uint slot, int home, Placed own, GridRay ray, float max_t) {
  ViewRay in_view = view_from_grid(own, ray);
  float length = own.ref_inside.w;
  BodyList list = BodyList(frame().sun_bodies, slot * kBodies, 0, kInfinity);
  vec3 passed = vec3(1.0);
  start_visit(in_view);
  for (int i = next_instance(max_t); i >= 0; i = next_instance(max_t)) {
    Placed placed = placed_at(i);
    Tree tree = Grids(frame().grids).at[placed.ref_base.w].transparent;
    GridRay in_grid = ray;
    if (i != home) in_grid = grid_from_view(placed, in_view);
    if (!start_walk(tree, in_grid.base, in_grid.origin, in_grid.direction, max_t, -1)) continue;
    find_bodies_in(i, in_grid, length * placed.ref_view.w / placed.ref_inside.w, max_t, 0.0, list, passed);
  }
  uint i = 0;
  Body body;
  while (next_body(list, i, body)) {
    passed *= passed_by(surface_of(body.what.x), body.lengths.z, body.what.z != 0);
  }
  return passed;
}

// 3 when both sides are occluders, else how many of the three are.
float vertex_occlusion(bool side_u, bool side_v, bool corner) {
  return side_u && side_v ? 3.0 : float(side_u) + float(side_v) + float(corner);
}

// The occlusion of the corners that a blocky mesh carries, counted around the face: light/corner_light.h.
vec4 corner_occlusion(Tree opaque, ivec3 voxel, uint face) {
  int u = kFaceU[face];
  int v = kFaceV[face];
  ivec3 front = voxel;
  front[axis_of(face)] += int(sign_of(face));
  uint occluders = 0;
  for (uint i = 0; i < 9; ++i) {
    ivec3 at = front;
    at[u] += int(i % 3) - 1;
    at[v] += int(i / 3) - 1;
    if (i != 4 && holds(opaque, at)) occluders |= 1u << i;
  }
  bool west = (occluders & 8) != 0;
  bool east = (occluders & 32) != 0;
  bool south = (occluders & 2) != 0;
  bool north = (occluders & 128) != 0;
  return vec4(vertex_occlusion(west, south, (occluders & 1) != 0), vertex_occlusion(east, south, (occluders & 4) != 0),
              vertex_occlusion(east, north, (occluders & 256) != 0),
              vertex_occlusion(west, north, (occluders & 64) != 0));
}

// Interpolated over the mesh's two triangles.
float occlusion_at(vec4 corners, uint face, vec3 inside) {
  float a = corners.x;
  float b = corners.y;
  float c = corners.z;
  float d = corners.w;
  float x = clamp(inside[kFaceU[face]], 0.0, 1.0);
  float y = clamp(inside[kFaceV[face]], 0.0, 1.0);
  if (!(a + c > b + d)) {
    if (x >= y) return a + x * (b - a) + y * (c - b);
    return a + y * (d - a) + x * (c - d);
  }
  if (x + y <= 1.0) return a + x * (b - a) + y * (d - a);
  return c + (1.0 - x) * (d - c) + (1.0 - y) * (b - c);
}

// What a face of an impostor says of itself.
float openness_of_far(Point point) {
  uint light = point.what.z >> 8;
  if (!has(kOcclusionVertex)) return float(light >> 8) / 9.0;
  vec4 corners = vec4(light & 3, light >> 2 & 3, light >> 4 & 3, light >> 6 & 3);
  return 1.0 - occlusion_at(corners, point.what.y, point.inside.xyz) / 3.0;
}

// Where a ray meets a face: put onto it, and a little inside its edges.
vec3 on_face(vec3 inside, uint face) {
  vec3 at = clamp(inside, vec3(1e-6), vec3(1.0 - 1e-6));
  at[axis_of(face)] = (face & 1) == 0 ? 1.0 : 0.0;
  return at;
}

uint rays_taken;

// Sunlight and openness of a surface point.
void trace_light(Point point, Placed placed, uint slot, out vec3 sunlight, out float openness) {
  uint face = point.what.y;
  int axis = axis_of(face);
  float cells = placed.ref_view.w;
  float cosine = face < 4 ? placed.diffuse[0][face] : placed.diffuse[1][face - 4];
  sunlight = vec3(cosine);
  openness = 0.0;
  ivec3 base = point.voxel.xyz & ~63;
  vec3 origin = vec3(point.voxel.xyz & 63) + point.inside.xyz;
  origin[axis] += frame().lift / cells * sign_of(face);
  int first = has(kLit) && has(kShadows) && cosine > 0.0 ? -1 : 0;
  bool is_far = (point.what.z & kIsFar) != 0;
  int count = has(kOcclusionRays) && !is_far ? frame().occlusion_count : 0;
  ivec2 pixel = push.corner + tile_pixel();
  uint hash = hash_of(uint(pixel.x), uint(pixel.y)) ^ push.seed;
  int open = 0;
  for (int i = first; i < count; ++i) {
    bool is_sun = i < 0;
    vec3 direction = placed.to_sun.xyz;
    if (!is_sun) direction = occlusion_direction(face, i, hash);
    GridRay ray = GridRay(base, origin, direction, 0.0);
    float max_t = (is_sun ? frame().shadow_distance : frame().occlusion_distance) / cells;
    bool blocked = is_blocked(point.voxel.w, placed, ray, max_t);
    ++rays_taken;
    if (!is_sun) {
      if (!blocked) ++open;
    } else if (blocked) {
      sunlight = vec3(0.0);
    } else if (kHasGlass) {
      sunlight *= sunlight_passed(slot, point.voxel.w, placed, ray, max_t);
    }
  }
  if (is_far) {
    openness = openness_of_far(point);
    return;
  }
  if (has(kOcclusionRays)) openness = float(open) / float(frame().occlusion_count);
  if (has(kOcclusionVertex)) {
    Tree opaque = Grids(frame().grids).at[placed.ref_base.w].opaque;
    openness = 1.0 - occlusion_at(corner_occlusion(opaque, point.voxel.xyz, face), face, point.inside.xyz) / 3.0;
  }
}

vec3 unlit_colour(Point point, uint slot, vec3 colour) {
  bool shows_values = has(kShowOcclusion) || has(kShowNormals);
  if (kind_of(point) != kSurface) return shows_values || kind_of(point) == kGlow ? vec3(0.0) : colour;
  if (has(kShowNormals)) {
    vec3 axis = placed_at(point.voxel.w).view_axes[axis_of(point.what.y)].xyz;
    return linear_from_srgb(0.5 + 0.5 * sign_of(point.what.y) * axis / length(axis));
  }
  if (!has(kShowOcclusion) && !has(kUnlitOcclusion)) return colour;
  vec3 sunlight;
  float openness = 1.0;
  if (has(kOcclusionRays) || has(kOcclusionVertex)) {
    trace_light(point, placed_at(point.voxel.w), slot, sunlight, openness);
  }
  if (has(kShowOcclusion)) return linear_from_srgb(vec3(openness));
  float least = frame().light.z;
  return colour * (least + (1.0 - least) * openness);
}

// What lamps add to a surface point.
vec3 trace_lamps(Point point, Placed placed, uint slot) {
  int level = placed.origin.w;
  uvec2 list = lamps_at(((point.voxel.xyz + placed.origin.xyz) << level) >> 4, point.voxel.w);
  uint face = point.what.y;
  int axis = axis_of(face);
  ivec3 base = point.voxel.xyz & ~63;
  vec3 origin = vec3(point.voxel.xyz & 63) + point.inside.xyz;
  origin[axis] += frame().lift / placed.ref_view.w * sign_of(face);
  float voxel_size = placed.ref_inside.w;
  vec3 normal = placed.view_axes[axis].xyz * (sign_of(face) / voxel_size);
  vec3 from = view_from_grid(placed, GridRay(base, origin, vec3(0.0), 0.0)).origin;
  vec3 sum = vec3(0.0);
  for (uint i = 0; i < list.y; ++i) {
    Lamp lamp = Lamps(frame().lamps).at[Numbers(frame().lamp_lists).at[list.x + i]];
    vec3 direction;
    float reach;
    vec3 light = lamp_light(lamp, lamp.position.xyz - from, normal, direction, reach);
    if (light == vec3(0.0)) continue;
    if (has(kShadows) && reach > 0.0) {
      GridRay ray = GridRay(base, origin, turned(placed.grid_axes, direction) * voxel_size, 0.0);
      float max_t = reach / voxel_size;
      ++rays_taken;
      if (is_blocked(point.voxel.w, placed, ray, max_t)) continue;
      if (kHasGlass) light *= sunlight_passed(slot, point.voxel.w, placed, ray, max_t);
    }
    sum += light;
  }
  return sum;
}

vec3 light_of(Point point, uint slot) {
  Surface surface = surface_of(point.what.x);
  if (has(kDetailColours)) {
    surface.colour = placed_at(point.voxel.w).detail_colour.xyz;
    surface.emitted = vec3(0.0);
  }
  if (!has(kLit)) return unlit_colour(point, slot, surface.colour);
  if (kind_of(point) == kUnlit) return surface.colour;
  vec3 colour = surface.emitted;
  if (kind_of(point) == kSurface) {
    vec3 sunlight;
    float openness;
    Placed placed = placed_at(point.voxel.w);
    trace_light(point, placed, slot, sunlight, openness);
    if (has(kLamps)) sunlight += trace_lamps(point, placed, slot);
    vec4 share = frame().light;
    vec3 light = share.x * openness + sunlight;
    if (!has(kOcclusionRays) && !has(kOcclusionVertex)) {
      light = share.y + sunlight;
    } else if (has(kAffectsAll)) {
      light = (share.x + sunlight) * (share.z + (1.0 - share.z) * openness);
    }
    colour += surface.colour * light;
  }
  return colour * frame().exposure;
}

Point point_of(Body body) {
  Point point;
  point.voxel = body.voxel;
  point.inside = vec4(exact_place(placed_at(body.voxel.w), exact_direction(), body.voxel.xyz, body.what.y), body.lengths.x);
  point.what = uvec4(body.what.xy, body.what.z != 0 ? kGlow : kSurface, 0);
  return point;
}

// Lights what this round has of a pixel, and returns whether that was all.
bool light_pixel(uint slot, inout State state) {
  vec2 at = picture_point();
  Point opaque = Points(frame().points).at[slot];
  uint bodies = kHasGlass ? uint(state.colour.w) - 1 : 0;
  BodyList list = BodyList(frame().bodies, slot * kBodies, bodies, kInfinity);
  bool is_last = !kHasGlass || state.weight.w == kInfinity;
  uint i = 0;
  Body body;
  bool is_first = true;
  bool is_done = false;
  while (!is_done) {
    Point point = opaque;
    vec3 weight = state.weight.xyz;
    if (kHasGlass && next_body(list, i, body)) {
      // What there was no room for may go on where the last ends: both are for the next round.
      if (!is_last && !is_first && i == list.count) {
        state.weight.w = body.lengths.x;
        break;
      }
      is_first = false;
      bool starts_inside = body.what.z != 0;
      // Where values are shown, glass is as good as stone, but for what one looks from.
      bool shows_values = has(kShowOcclusion) || has(kShowNormals);
      if (shows_values && starts_inside) continue;
      Surface surface = surface_of(body.what.x);
      point = point_of(body);
      weight *= shows_values ? 1.0 : own_share(surface, body.lengths.z, starts_inside);
      state.weight.xyz *= shows_values ? vec3(0.0) : passed_by(surface, body.lengths.z, starts_inside);
    } else {
      is_done = true;
      if (!is_last) break;
      if (point.voxel.w < 0) {
        state.colour.xyz += weight * sky_colour(sky_up(at));
        break;
      }
    }
    point.inside.xyz = on_face(point.inside.xyz, point.what.y);
    state.colour.xyz += weight * light_of(point, slot);
  }
  return is_last;
}

void main() {
  rays_taken = 0;
  if (is_in_tile()) {
    uint slot = slot_of_pixel();
    State state = States(frame().states).at[slot];
    if (push.round == 0 || state.colour.w > 0.0) {
      bool is_last = light_pixel(slot, state);
      if (is_last) {
        // The minimum is taken second: what is not a number becomes 0.
        vec3 sample_colour = min(max(vec3(0.0), state.colour.xyz), vec3(1.0));
        sample_colour = mix(sample_colour, vec3(0.0), isnan(state.colour.xyz));
        Sums sums = Sums(frame().sums);
        uint place = place_of_pixel();
        vec3 before = push.first != 0 ? vec3(0.0) : sums.at[place].xyz;
        sums.at[place] = vec4(before + sample_colour, 0.0);
      }
      state.colour.w = is_last ? 0.0 : 1.0;
      States(frame().states).at[slot] = state;
    }
  }
  add_counts(rays_taken, false, false);
}
