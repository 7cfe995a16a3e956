#version 460
// The light of what each pixel of a tile shows: light/lighting.h on the processor's side.
#include "compute.glsl"
#include "walk.glsl"
#include "instances.glsl"
#include "pairs.glsl"
#include "camera.glsl"

layout(constant_id = 0) const bool kHasGlass = true;
#define KEEPS_BODIES
#include "lit.glsl"
#include "glass.glsl"
#include "count.glsl"
#include "sky.glsl"
#include "srgb.glsl"
#include "lamps.glsl"
#include "rays.glsl"
#include "faces.glsl"
#include "corners.glsl"
#include "see_through.glsl"

const uint kTurns = 1024;

float sky_up(vec2 point) {
  if (has(kPerspective)) return camera_ray(point).direction.y;
  vec3 d = frame().forward.xyz + picture_vector(point) * frame().sky_scale;
  return d.y / length(d);
}

vec3 occlusion_direction(uint face, int ray, uint hash) {
  Vectors directions = Vectors(frame().directions);
  if (has(kFixedDirections)) {
    vec3 fixed_one = directions.at[face * 9 + ray].xyz;
    if (ray == 0) {
      fixed_one[kFaceU[face]] = push.upright.x;
      fixed_one[kFaceV[face]] = push.upright.y;
      fixed_one[axis_of(face)] = sign_of(face) * push.upright.z;
      return fixed_one;
    }
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

// What a face of an impostor says of itself.
float openness_of_far(Point point) {
  uint light = point.what.z >> 8;
  if (!has(kOcclusionVertex) || is_of_field(point)) return float(light >> 8) / 9.0;
  vec4 corners = vec4(light & 3, light >> 2 & 3, light >> 4 & 3, light >> 6 & 3);
  return 1.0 - occlusion_at(corners, point.what.y, point.inside.xyz) / 3.0;
}

// Of a face, in the grid.
vec3 face_normal(uint face) {
  vec3 normal = vec3(0.0);
  normal[axis_of(face)] = sign_of(face);
  return normal;
}

// The upright of a surface point, in its grid.
vec3 grid_normal(Point point) {
  return is_of_field(point) ? normal_of(point.what.y) : face_normal(point.what.y);
}

// A direction that stands to (0, 1, 0) as the result stands to a unit `normal`: light/occlusion_directions.h.
vec3 turned_from_up(vec3 direction, vec3 normal) {
  if (normal.y < -1.0 + 1e-6) return vec3(-direction.xy, direction.z);
  vec3 axis = vec3(normal.z, 0.0, -normal.x);
  vec3 once = cross(axis, direction);
  return direction + once + cross(axis, once) / (1.0 + normal.y);
}

// Where rays start from a surface point: a little before its face.
GridRay ray_from(Point point, Placed placed) {
  GridRay ray = GridRay(point.voxel.xyz & ~63, vec3(point.voxel.xyz & 63) + point.inside.xyz, vec3(0.0), 0.0);
  if (is_of_field(point)) {
    ray.origin += frame().lift / placed.ref_view.w * normal_of(point.what.y);
    return ray;
  }
  ray.origin[axis_of(point.what.y)] += frame().lift / placed.ref_view.w * sign_of(point.what.y);
  return ray;
}

// What reaches a surface point: the sun's light and that of lamps, and its openness. One loop over all rays, for the
// reason that rays.glsl gives.
void trace_light(Point point, Placed placed, uint slot, out vec3 light, out float openness) {
  const uint kUp = 2;
  bool is_field = is_of_field(point);
  // Directions about a field's surface are those of an upper face, turned with it.
  uint face = is_field ? kUp : point.what.y;
  vec3 normal = grid_normal(point);
  float cells = placed.ref_view.w;
  float cosine = face < 4 ? placed.diffuse[0][face] : placed.diffuse[1][face - 4];
  if (is_field) cosine = max(dot(normal, placed.to_sun.xyz), 0.0) * placed.to_sun.w;
  vec3 sunlight = sunlight_of(cosine);
  GridRay ray = ray_from(point, placed);
  GridRay from = ray;
  bool is_far = (point.what.z & kIsFar) != 0;
  // A field has no faces with corners.
  bool traces_occlusion = has(kOcclusionRays) || (is_field && has(kOcclusionVertex));
  int open_count = traces_occlusion && !is_far ? frame().occlusion_count : 0;
  uvec2 lamps = uvec2(0);
  if (has(kLit) && has(kLamps)) lamps = lamps_around(point.voxel, placed);
  vec3 in_view = view_from_grid(placed, from).origin;
  vec3 normal_in_view = turned(placed.view_axes, normal) / placed.ref_inside.w;
  ivec2 pixel = push.corner + tile_pixel();
  uint hash = hash_of(uint(pixel.x), uint(pixel.y)) ^ push.seed;
  vec3 of_lamps = vec3(0.0);
  int open = 0;
  int first = has(kLit) && has(kShadows) && cosine > 0.0 ? -1 : 0;
  for (int i = first; i < open_count + int(lamps.y); ++i) {
    bool is_sun = i < 0;
    bool is_lamp = i >= open_count;
    vec3 brought = vec3(0.0);
    float max_t = (is_sun ? frame().shadow_distance : frame().occlusion_distance) / cells;
    if (is_sun) {
      ray.direction = placed.to_sun.xyz;
    } else if (!is_lamp) {
      ray.direction = occlusion_direction(face, i, hash);
      if (is_field) ray.direction = turned_from_up(ray.direction, normal);
    } else {
      brought = light_of_lamp(lamps.x + uint(i - open_count), in_view, normal_in_view, placed, ray, max_t);
      if (brought == vec3(0.0)) continue;
      if (!(has(kShadows) && max_t > 0.0)) {
        of_lamps += brought;
        continue;
      }
    }
    ++rays_taken;
    bool is_open = !is_blocked(point.voxel.w, placed, ray, max_t);
    if (is_sun || is_lamp) {
      vec3 passed = vec3(is_open ? 1.0 : 0.0);
      if (kHasGlass && is_open) passed = sunlight_passed(slot, point.voxel.w, placed, ray, max_t);
      if (is_sun) {
        sunlight *= passed;
      } else {
        of_lamps += brought * passed;
      }
    } else if (is_open) {
      ++open;
    }
  }
  light = sunlight + of_lamps;
  openness = 0.0;
  if (is_far) {
    openness = openness_of_far(point);
  } else if (has(kOcclusionVertex) && !is_field) {
    Tree opaque = Grids(frame().grids).at[placed.ref_base.w].opaque;
    openness = 1.0 - occlusion_at(corner_occlusion(opaque, point.voxel.xyz, face), face, point.inside.xyz) / 3.0;
  } else if (traces_occlusion) {
    openness = float(open) / float(frame().occlusion_count);
  }
}

vec3 light_of(Point point, uint slot) {
  Surface surface = surface_of(point.what.x);
  Placed placed = placed_at(point.voxel.w);
  if (has(kDetailColours)) {
    surface.colour = placed.detail_colour.xyz;
    surface.emitted = vec3(0.0);
  }
  // As in smooth meshes, a field without materials is white.
  if (is_of_field(point) && point.what.x == 0) {
    surface = Surface(vec3(1.0), surface.log_clarity, vec3(0.0), vec3(0.0), 1.0);
  }
  uint kind = kind_of(point);
  bool is_lit = has(kLit);
  if (!is_lit && kind != kSurface) {
    bool shows_values = has(kShowOcclusion) || has(kShowNormals);
    return shows_values || kind == kGlow ? vec3(0.0) : surface.colour;
  }
  if (kind == kUnlit) return surface.colour;
  if (!is_lit && has(kShowNormals)) {
    return linear_from_srgb(0.5 + 0.5 * turned(placed.view_axes, grid_normal(point)) / placed.ref_inside.w);
  }
  vec3 light = vec3(0.0);
  float openness = 1.0;
  bool shows_openness = (has(kShowOcclusion) || has(kUnlitOcclusion)) && has_occlusion();
  if (is_lit ? kind == kSurface : shows_openness) trace_light(point, placed, slot, light, openness);
  if (!is_lit && has(kShowOcclusion)) return linear_from_srgb(vec3(openness));
  return kind == kSurface ? colour_in_light(surface.colour, surface.emitted, light, openness)
                          : surface.emitted * frame().exposure;
}

// What a body shows where it begins.
Point point_of(Body body) {
  Point point;
  point.voxel = body.voxel;
  bool is_of_field = kHasFieldGlass && (body.what.z & kBeginsInField) != 0;
  uint kind = (body.what.z & kStartsInside) != 0 ? kGlow : kSurface;
  point.what = uvec4(body.what.xy, kind | (is_of_field ? kIsField : 0), 0);
  ExactRay ray = exact_ray_in(placed_at(body.voxel.w), exact_direction());
  Pair start = start_from(ray, placed_at(body.voxel.w), body.voxel.xyz);
  Pair t = Pair(vec3(body.lengths.w), vec3(0.0));
  if (!is_of_field) t = distance_to_face(ray, start, body.what.y);
  point.inside = vec4(sum_of(start, product_of(t, ray.direction)).high, body.lengths.x);
  return point;
}

vec3 seen_direction() {
  return camera_ray(picture_point()).direction;
}
vec3 normal_met(int instance, uint face, float t) {
  return face_normal(placed_at(instance), face);
}

// Lights what this round has of a pixel, and returns whether that was all. One loop over all that shows there, for the
// reason that rays.glsl gives.
bool light_pixel(uint slot, inout State state) {
  vec2 at = picture_point();
  Point opaque = Points(frame().points).at[slot];
  float opaque_t = t_of(opaque, at);
  // The first of a later round was entered in the one before.
  BodyList list = BodyList(frame().bodies, slot * kBodies, kBodies, uint(state.colour.w) - 1, state.weight.w);
  Passage way = passage_through(list, push.round > 0);
  for (;;) {
    bool is_body = kHasGlass && enter_next(way, opaque_t, state);
    if (kHasGlass && !is_body && !way.is_last) return false;
    Point point = opaque;
    vec3 weight = state.weight.xyz;
    if (is_body) {
      weight = pass_body(way, state);
      point = point_of(way.body);
    } else if (opaque.voxel.w < 0) {
      state.colour.xyz += weight * sky_colour(sky_up(at));
      return true;
    }
    if (!is_of_field(point)) point.inside.xyz = on_face(point.inside.xyz, point.what.y);
    state.colour.xyz += weight * light_of(point, slot);
    if (!is_body) return true;
  }
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
