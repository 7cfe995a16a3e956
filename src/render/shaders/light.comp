#version 460
// Lights the points that the pixels of a tile show; matches render/light/lighting.h on the CPU.
#include "compute.glsl"
#include "walk.glsl"
#include "instances.glsl"
#include "camera.glsl"

layout(constant_id = 0) const bool kHasGlass = true;
#define KEEPS_BODIES
#include "lit.glsl"
#include "glass.glsl"
#include "looks.glsl"
#include "sky.glsl"
#include "direct_light.glsl"
#include "field_textures.glsl"
#define SHOWS_FIELD_TEXTURES
FieldPoint blended_point;
#include "field_blend.glsl"
#include "corners.glsl"
#include "levels.glsl"
#include "see_through.glsl"

const uint kTurns = 1024;

float sky_up(vec2 point) {
  if (has(kPerspective)) return camera_ray(point).direction.y;
  vec3 d = frame().forward.xyz + image_vector(point) * frame().sky_scale;
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

// Returns the normal of a surface point, in its grid.
vec3 grid_normal(Point point) {
  if (is_of_shape(point)) return side_normal(point.what.y);
  return is_of_field(point) ? normal_of(point.what.y) : face_normal(point.what.y);
}
// Returns the face of a surface point, not of a field; of a shape, the direction nearest to its normal.
uint face_of(Point point) {
  return is_of_shape(point) ? side_direction(point.what.y) : point.what.y;
}
// Returns the openness stored in an impostor's face.
float openness_of_far(Point point) {
  uint light = point.what.z >> 8;
  if (!has(kOcclusionVertex) || is_of_field(point)) return float(light >> 8) / 9.0;
  vec4 corners = vec4(light & 3, light >> 2 & 3, light >> 4 & 3, light >> 6 & 3);
  return 1.0 - occlusion_at(corners, face_of(point), point.inside.xyz) / 3.0;
}

// Returns true if a surface point is not perpendicular to an axis of its grid.
bool is_inclined(Point point) {
  return is_of_field(point) || (is_of_shape(point) && is_tilted(point.what.y));
}

// Rotates `direction` as (0, 1, 0) is rotated to the unit vector `normal`: render/light/occlusion_directions.h.
vec3 turned_from_up(vec3 direction, vec3 normal) {
  if (normal.y < -1.0 + 1e-6) return vec3(-direction.xy, direction.z);
  vec3 axis = vec3(normal.z, 0.0, -normal.x);
  vec3 once = cross(axis, direction);
  return direction + once + cross(axis, once) / (1.0 + normal.y);
}

// Returns a ray that starts slightly in front of a surface point's face.
GridRay ray_from(Point point, Placed placed) {
  GridRay ray = GridRay(point.voxel.xyz & ~63, vec3(point.voxel.xyz & 63) + point.inside.xyz, vec3(0.0), 0.0);
  if (is_of_field(point) || is_of_shape(point)) {
    ray.origin += frame().lift / placed.ref_view.w * grid_normal(point);
    return ray;
  }
  ray.origin[axis_of(point.what.y)] += frame().lift / placed.ref_view.w * sign_of(point.what.y);
  return ray;
}

// The rays of a surface point, by number: -1 is the sun's ray, then the occlusion rays, then the lamps' rays.
struct LightRays {
  vec3 normal;  // in the grid
  uint face;    // for an inclined surface, directions are those for an upper face, rotated
  bool is_inclined;
  bool is_field;
  float cosine;  // of the sun
  int first;
  int open_count;
  uvec2 lamps;  // their first index in the lists, and the count
  vec3 in_view;
  vec3 normal_in_view;
  uint hash;  // of the pixel
};

bool traces_occlusion(Point point) {
  // A field has no faces with corners.
  return has(kOcclusionRays) || (is_of_field(point) && has(kOcclusionVertex));
}

LightRays rays_of(Point point, Placed placed, GridRay from) {
  const uint kUp = 2;
  LightRays rays;
  rays.is_field = is_of_field(point);
  rays.is_inclined = is_inclined(point);
  rays.face = rays.is_inclined ? kUp : face_of(point);
  rays.normal = grid_normal(point);
  rays.cosine = rays.face < 4 ? placed.diffuse[0][rays.face] : placed.diffuse[1][rays.face - 4];
  if (rays.is_inclined) rays.cosine = max(dot(rays.normal, placed.to_sun.xyz), 0.0) * placed.to_sun.w;
  bool is_far = (point.what.z & kIsFar) != 0;
  rays.open_count = traces_occlusion(point) && !is_far ? frame().occlusion_count : 0;
  rays.lamps = uvec2(0);
  if (has(kLit) && has(kLamps) && !has(kPropagated)) rays.lamps = lamps_around(point.voxel, placed);
  rays.first = has(kLit) && has(kShadows) && !has(kPropagated) && rays.cosine > 0.0 ? -1 : 0;
  rays.in_view = view_from_grid(placed, from).origin;
  rays.normal_in_view = turned(placed.view_axes, rays.normal) / placed.ref_inside.w;
  ivec2 pixel = push.corner + tile_pixel();
  rays.hash = hash_of(uint(pixel.x), uint(pixel.y)) ^ push.seed;
  return rays;
}

// Sets a ray to the direction of its number. `brought`: the light that a lamp adds if unblocked. Returns false if the
// ray is not needed.
bool aim(int number, LightRays rays, Placed placed, inout GridRay ray, out float max_t, out vec3 brought) {
  brought = vec3(0.0);
  float occlusion_distance = frame().occlusion_distance * (rays.is_field ? frame().light.w : 1.0);
  max_t = (number < 0 ? frame().shadow_distance : occlusion_distance) / placed.ref_view.w;
  if (number < 0) {
    ray.direction = placed.to_sun.xyz;
  } else if (number < rays.open_count) {
    ray.direction = occlusion_direction(rays.face, number, rays.hash);
    if (rays.is_inclined) ray.direction = turned_from_up(ray.direction, rays.normal);
  } else {
    uint lamp = rays.lamps.x + uint(number - rays.open_count);
    brought = light_of_lamp(lamp, rays.in_view, rays.normal_in_view, placed, ray, max_t);
    return brought != vec3(0.0) && has(kShadows) && max_t > 0.0;
  }
  return true;
}

// Returns the openness of a surface point with `open` unblocked occlusion rays.
float openness_of(Point point, Placed placed, int open) {
  if ((point.what.z & kIsFar) != 0) return openness_of_far(point);
  if (has(kOcclusionVertex) && !is_of_field(point)) {
    // Sides inside a voxel have no corners of voxels.
    if (is_of_shape(point) && (side_flags(point.what.y) & kSideIsOnVoxel) == 0) return 1.0;
    Tree opaque = opaque_tree(placed, 0);
    uint face = face_of(point);
    return 1.0 - occlusion_at(corner_occlusion(opaque, point.voxel.xyz, face), face, point.inside.xyz) / 3.0;
  }
  if (!traces_occlusion(point)) return 0.0;
  float share = float(open) / float(frame().occlusion_count);
  return is_of_field(point) ? min(share * frame().ambient.w, 1.0) : share;
}

LevelPlace level_place(Point point) {
  vec3 normal = grid_normal(point);
  if (is_of_shape(point)) {
    return place_on_shape(point.voxel.xyz, point.inside.xyz, normal, side_of_voxel(point.what.y));
  }
  return LevelPlace(point.voxel.xyz, point.inside.xyz, normal, is_of_field(point) ? -1 : int(point.what.y));
}

// Computes the light of the sun and lamps at a surface point, and its openness. One loop over all rays;
// direct_light.glsl gives the reason.
void trace_light(Point point, Placed placed, uint slot, out vec3 light, out float openness) {
  GridRay ray = ray_from(point, placed);
  LightRays rays = rays_of(point, placed, ray);
  vec3 sunlight = sunlight_of(rays.cosine);
  vec3 of_lamps = vec3(0.0);
  int open = 0;
  for (int i = rays.first; i < rays.open_count + int(rays.lamps.y); ++i) {
    float max_t;
    vec3 brought;
    if (!aim(i, rays, placed, ray, max_t, brought)) {
      of_lamps += brought;
      continue;
    }
    ++rays_taken;
    bool is_open = !is_blocked(point.voxel.w, placed, ray, max_t);
    bool is_of_occlusion = i >= 0 && i < rays.open_count;
    vec3 passed = vec3(is_open ? 1.0 : 0.0);
    bool needs_passed = kHasGlass && is_open && (kHasCells || !is_of_occlusion);
    if (needs_passed) passed = sunlight_passed(slot, point.voxel.w, placed, ray, max_t);
    if (is_of_occlusion) {
      if (is_open && !(kHasCells && met_closed_face)) ++open;
      continue;
    }
    if (i < 0) {
      sunlight *= passed;
    } else {
      of_lamps += brought * passed;
    }
  }
  light = has(kPropagated) ? light_by_levels(level_place(point), placed) : sunlight + of_lamps;
  openness = openness_of(point, placed, open);
}

// Returns a point of a field's surface, for the textures of its materials.
FieldPoint field_point(Point point, Placed placed) {
  float voxels = placed.ref_view.w;
  float spacing = frame().down.w;
  spacing *= has(kPerspective) ? point.inside.w / placed.ref_inside.w : 1.0 / placed.ref_inside.w;
  ivec3 voxel = (point.voxel.xyz + placed.origin.xyz) << placed.origin.w;
  return FieldPoint(voxel, point.inside.xyz * voxels, normal_of(point.what.y), spacing * spacing * voxels * voxels);
}

// Shows the texture of a voxel's face. Seen from inside, it lies around the ray's start. Glass around the ray's start
// shows no face.
void show_texture(Point point, Placed placed, inout Surface surface) {
  if (kind_of(point) == kGlow) return;
  uint face = point.what.y;
  vec3 inside = point.inside.xyz;
  float away = point.inside.w / placed.ref_inside.w;
  if (kind_of(point) == kUnlit) {
    vec3 start = start_from(exact_ray_in(placed, exact_direction()), placed, point.voxel.xyz).high;
    inside = on_face(start, face);
    away = length(inside - start);
  }
  float spacing = frame().down.w;
  spacing *= has(kPerspective) ? away : 1.0 / placed.ref_inside.w;
  // Cells of halved grids and impostors stand for many voxels.
  bool is_mean = (point.what.z & kIsFar) != 0 || placed.ref_view.w != 1.0;
  bool is_cell = kHasCells && (point.what.z & kIsCell) != 0;
  if (is_cell) {
    face = point.what.z >> 8 & 7;
  } else {
    turn_by_state(point.what.x, point.voxel.xyz, placed, face, inside);
  }
  show_texture(point.what.x, face, inside, is_mean ? kMeanOfFace : spacing * spacing, surface);
}

Surface surface_at(Point point, Placed placed) {
  bool is_bare = is_of_field(point) && point.what.x == 0;
  Surface surface = is_bare ? white_surface() : surface_of(point.what.x);
  if (has(kDetailColours)) {
    if (is_bare) return surface;
    surface.colour = placed.detail_colour.xyz;
    surface.emitted = vec3(0.0);
  } else if (is_of_field(point) && (point.what.z & kIsBlended) != 0) {
    bool is_far = (point.what.z & kIsFar) != 0;
    vec3 at = point.inside.xyz - (is_far ? kSurfelLift * normal_of(point.what.y) : vec3(0.0));
    vec3 cell = floor(at);
    if (kHasTextures) blended_point = field_point(point, placed);
    return blend_of_field(opaque_tree(placed, 1), point.voxel.xyz + ivec3(cell), at - cell, point.what.x);
  } else if (is_of_shape(point)) {
    float spacing = frame().down.w / placed.ref_inside.w;
    if (has(kPerspective)) spacing *= point.inside.w;
    bool is_mean = (point.what.z & kIsFar) != 0;
    show_side(point.what.y, point.inside.xyz, is_mean ? kMeanOfFace : spacing * spacing, surface);
  } else if (kHasShapes && !is_of_field(point) && placed.ref_view.w != 1.0 &&
             show_mean_of_shapes(point.what.x, surface)) {
    return surface;
  } else if (kHasTextures && !is_of_field(point)) {
    show_texture(point, placed, surface);
  }
  return surface;
}

vec3 light_of(Point point, uint slot) {
  Placed placed = placed_at(point.voxel.w);
  Surface surface = surface_at(point, placed);
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

// Returns the surface point where a body begins.
Point point_of(Body body) {
  Point point;
  point.voxel = body.voxel;
  bool is_of_field = kHasFieldGlass && (body.what.z & kBeginsInField) != 0;
  uint kind = (body.what.z & kStartsInside) != 0 ? kGlow : kSurface;
  point.what = uvec4(type_of(body), body.what.y, kind | (is_of_field ? kIsField : 0), 0);
  if (kHasShapes && (body.what.z & kBeginsInShape) != 0) {
    Placed placed = placed_at(body.voxel.w);
    float t = body.lengths.x - (placed.start.w - frame().view_depth) * length_a_depth(image_point());
    vec3 at = exact_place_on_shape(placed, exact_direction(), body.voxel.xyz, body.what.y, t);
    point.inside = vec4(at, body.lengths.x);
    point.what.z |= kIsShape;
    return point;
  }
  if (kHasCells && (body.what.x & kIsTextured) != 0) {
    point.what.y &= 7;
    point.what.z |= kIsCell | (is_face(body) ? body.what.y >> 3 : body.what.y) << 8;
  }
  ExactRay ray = exact_ray_in(placed_at(body.voxel.w), exact_direction());
  Pair start = start_from(ray, placed_at(body.voxel.w), body.voxel.xyz);
  Pair t = Pair(vec3(body.lengths.w), vec3(0.0));
  if (!is_of_field) t = distance_to_face(ray, start, point.what.y);
  point.inside = vec4(sum_of(start, product_of(t, ray.direction)).high, body.lengths.x);
  return point;
}

vec3 seen_direction() {
  return camera_ray(image_point()).direction;
}
vec3 normal_met(int instance, uint face, float t) {
  return face_normal(placed_at(instance), face);
}

// Returns true if too little light passes to be seen: kUnseen of cpu/cpu_renderer.cpp.
bool is_unseen(vec3 passed) {
  bool shows_values = has(kShowOcclusion) || has(kShowNormals);
  return !shows_values && max(max(passed.x, passed.y), passed.z) < 1.6e-5;
}

// Lights this round's points of a pixel; returns true if that completes it. One loop over all points;
// direct_light.glsl gives the reason.
bool light_pixel(uint slot, inout State state) {
  vec2 at = image_point();
  Point opaque = Points(frame().points).at[slot];
  float opaque_t = t_of(opaque, at);
  // The first of a later round was entered in the one before.
  BodyList list = BodyList(frame().bodies, slot * kBodies, kBodies, uint(state.colour.w) - 1, state.weight.w);
  Passage way = passage_through(list, push.round > 0);
  for (;;) {
    bool is_body = kHasGlass && enter_next(way, opaque_t, state);
    if (kHasGlass && !is_body && !way.is_last) return false;
    if (kHasGlass && is_unseen(state.weight.xyz) && !(is_body && is_face(way.met))) return true;
    Point point = opaque;
    vec3 weight = state.weight.xyz;
    if (is_body) {
      weight = pass_body(way, state);
      point = point_of(way.met);
    } else if (opaque.voxel.w < 0) {
      state.colour.xyz += weight * sky_colour(sky_up(at));
      return true;
    }
    if (!is_of_field(point) && !is_of_shape(point)) point.inside.xyz = on_face(point.inside.xyz, point.what.y);
    state.colour.xyz += weight * light_of(point, slot);
    if (!is_body) return true;
    if (is_face(way.met) && state.weight.xyz == vec3(0.0)) return true;  // it hides everything behind it
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
        // The minimum comes second, so that NaN becomes 0.
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
