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
  if (!has(kOcclusionVertex) || is_of_field(point)) return float(light >> 8) / 9.0;
  vec4 corners = vec4(light & 3, light >> 2 & 3, light >> 4 & 3, light >> 6 & 3);
  return 1.0 - occlusion_at(corners, point.what.y, point.inside.xyz) / 3.0;
}

// Where a ray meets a face: put onto it, and a little inside its edges.
vec3 on_face(vec3 inside, uint face) {
  vec3 at = clamp(inside, vec3(1e-6), vec3(1.0 - 1e-6));
  at[axis_of(face)] = (face & 1) == 0 ? 1.0 : 0.0;
  return at;
}

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

// Sunlight and openness of a surface point.
void trace_light(Point point, Placed placed, uint slot, out vec3 sunlight, out float openness) {
  const uint kUp = 2;
  bool is_field = is_of_field(point);
  // Directions about a field's surface are those of an upper face, turned with it.
  uint face = is_field ? kUp : point.what.y;
  vec3 normal = grid_normal(point);
  float cells = placed.ref_view.w;
  float cosine = face < 4 ? placed.diffuse[0][face] : placed.diffuse[1][face - 4];
  if (is_field) cosine = max(dot(normal, placed.to_sun.xyz), 0.0) * placed.to_sun.w;
  sunlight = sunlight_of(cosine);
  openness = 0.0;
  GridRay ray = ray_from(point, placed);
  int first = has(kLit) && has(kShadows) && cosine > 0.0 ? -1 : 0;
  bool is_far = (point.what.z & kIsFar) != 0;
  // A field has no faces with corners.
  bool traces_occlusion = has(kOcclusionRays) || (is_field && has(kOcclusionVertex));
  int count = traces_occlusion && !is_far ? frame().occlusion_count : 0;
  ivec2 pixel = push.corner + tile_pixel();
  uint hash = hash_of(uint(pixel.x), uint(pixel.y)) ^ push.seed;
  int open = 0;
  for (int i = first; i < count; ++i) {
    bool is_sun = i < 0;
    ray.direction = is_sun ? placed.to_sun.xyz : occlusion_direction(face, i, hash);
    if (is_field && !is_sun) ray.direction = turned_from_up(ray.direction, normal);
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
  if (traces_occlusion) openness = float(open) / float(frame().occlusion_count);
  if (has(kOcclusionVertex) && !is_field) {
    Tree opaque = Grids(frame().grids).at[placed.ref_base.w].opaque;
    openness = 1.0 - occlusion_at(corner_occlusion(opaque, point.voxel.xyz, face), face, point.inside.xyz) / 3.0;
  }
}

vec3 unlit_colour(Point point, uint slot, vec3 colour) {
  bool shows_values = has(kShowOcclusion) || has(kShowNormals);
  if (kind_of(point) != kSurface) return shows_values || kind_of(point) == kGlow ? vec3(0.0) : colour;
  if (has(kShowNormals)) {
    Placed placed = placed_at(point.voxel.w);
    return linear_from_srgb(0.5 + 0.5 * turned(placed.view_axes, grid_normal(point)) / placed.ref_inside.w);
  }
  if (!has(kShowOcclusion) && !has(kUnlitOcclusion)) return colour;
  vec3 sunlight;
  float openness = 1.0;
  if (has(kOcclusionRays) || has(kOcclusionVertex)) {
    trace_light(point, placed_at(point.voxel.w), slot, sunlight, openness);
  }
  if (has(kShowOcclusion)) return linear_from_srgb(vec3(openness));
  return colour * left_by_occlusion(openness);
}

vec3 light_of(Point point, uint slot) {
  Surface surface = surface_of(point.what.x);
  if (has(kDetailColours)) {
    surface.colour = placed_at(point.voxel.w).detail_colour.xyz;
    surface.emitted = vec3(0.0);
  }
  // As in smooth meshes, a field without materials is white.
  if (is_of_field(point) && point.what.x == 0) {
    surface = Surface(vec3(1.0), surface.log_clarity, vec3(0.0), vec3(0.0), 1.0);
  }
  if (!has(kLit)) return unlit_colour(point, slot, surface.colour);
  if (kind_of(point) == kUnlit) return surface.colour;
  vec3 colour = surface.emitted;
  if (kind_of(point) == kSurface) {
    vec3 sunlight;
    float openness;
    Placed placed = placed_at(point.voxel.w);
    trace_light(point, placed, slot, sunlight, openness);
    if (has(kLamps)) {
      vec3 normal = turned(placed.view_axes, grid_normal(point)) / placed.ref_inside.w;
      sunlight += light_of_lamps(slot, point.voxel, placed, ray_from(point, placed), normal);
    }
    colour += surface.colour * light_at(sunlight, openness);
  }
  return colour * frame().exposure;
}

// Of a body of a field: where it begins, from its cell's lower corner.
vec3 place_in_field(Body body) {
  Placed placed = placed_at(body.voxel.w);
  ExactRay ray = exact_ray_in(placed, exact_direction());
  Pair way = product_of(Pair(vec3(body.lengths.w), vec3(0.0)), ray.direction);
  return sum_of(start_from(ray, placed, body.voxel.xyz), way).high;
}

Point point_of(Body body) {
  Point point;
  point.voxel = body.voxel;
  uint kind = (body.what.z & kStartsInside) != 0 ? kGlow : kSurface;
  if (kHasFieldGlass && (body.what.z & kBeginsInField) != 0) {
    point.inside = vec4(place_in_field(body), body.lengths.x);
    point.what = uvec4(body.what.xy, kIsField | kind, 0);
    return point;
  }
  vec3 place = exact_place(placed_at(body.voxel.w), exact_direction(), body.voxel.xyz, body.what.y);
  point.inside = vec4(place, body.lengths.x);
  point.what = uvec4(body.what.xy, kind, 0);
  return point;
}

// The normals of the surfaces through which a ray enters a body, and leaves it into air, in the grid.
vec3 normal_entered(Body body) {
  if (kHasFieldGlass && (body.what.z & kBeginsInField) != 0) return normal_of(body.what.y);
  return face_normal(body.what.y);
}
vec3 normal_left(Body body) {
  if (kHasFieldGlass && (body.what.z & kEndsInField) != 0) return normal_from_28(body.what.z >> kExitNormal);
  return face_normal(body.what.w & 7);
}

// A surface that mirrors the sky. `tint`: of what is mirrored.
void meet_surface(int instance, vec3 normal_in_grid, float before, float behind, vec3 tint, inout State state) {
  Placed placed = placed_at(instance);
  vec3 normal = turned(placed.view_axes, normal_in_grid) / placed.ref_inside.w;
  vec2 mirror = mirror_at(camera_ray(picture_point()).direction, normal, before, behind);
  state.colour.xyz += state.weight.xyz * tint * mirror.x * sky_colour(mirror.y);
  state.weight.xyz *= 1.0 - mirror.x;
}
// Where a ray leaves a body into air, or into another that touches it: what is mirrored passes it once more.
void leave_body(Body from, int instance, vec3 normal, float behind, inout State state) {
  Surface surface = surface_of(from.what.x);
  vec3 tint = passed_by(surface, from.lengths.z, has_own_length(from));
  meet_surface(instance, normal, surface.ior, behind, tint, state);
}
void leave_into_air(Body from, inout State state) {
  leave_body(from, int(from.what.w >> 3), normal_left(from), 1.0, state);
}
void enter_body(Body from, bool has_from, Body to, inout State state) {
  float ior = surface_of(to.what.x).ior;
  if (has_from && reaches(from, to.lengths.x)) {
    leave_body(from, to.voxel.w, normal_entered(to), ior, state);
    return;
  }
  if (has_from) leave_into_air(from, state);
  if ((to.what.z & kStartsInside) == 0) {
    meet_surface(to.voxel.w, normal_entered(to), 1.0, ior, vec3(1.0), state);
  }
}

// Whether something opaque leaves no air behind a body.
bool lies_on_opaque(Body body, Point opaque, vec2 at) {
  if (opaque.voxel.w < 0) return false;
  float voxel_size = placed_at(int(body.what.w >> 3)).ref_inside.w;
  return t_of(opaque, at) <= body.lengths.y + frame().lift * voxel_size;
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
  Body last;
  bool is_first = true;
  bool has_surfaces = kHasGlass && has(kGlassSurfaces);
  bool is_done = false;
  while (!is_done) {
    Point point = opaque;
    vec3 weight = state.weight.xyz;
    if (kHasGlass && next_body(list, i, body)) {
      // What there was no room for may go on where the last ends: both are for the next round.
      if (!is_last && !is_first && i == list.count) {
        if (has_surfaces) enter_body(last, true, body, state);
        state.weight.w = body.lengths.x;
        break;
      }
      // That of a later round was entered in the one before.
      if (has_surfaces && !(is_first && push.round > 0)) enter_body(last, !is_first, body, state);
      last = body;
      is_first = false;
      bool starts_inside = (body.what.z & kStartsInside) != 0;
      // Where values are shown, glass is as good as stone, but for what one looks from.
      bool shows_values = has(kShowOcclusion) || has(kShowNormals);
      if (shows_values && starts_inside) continue;
      Surface surface = surface_of(body.what.x);
      point = point_of(body);
      weight = state.weight.xyz * (shows_values ? 1.0 : own_share(surface, body.lengths.z, has_own_length(body)));
      state.weight.xyz *= shows_values ? vec3(0.0) : passed_by(surface, body.lengths.z, has_own_length(body));
    } else {
      is_done = true;
      if (!is_last) break;
      if (has_surfaces && !is_first && !lies_on_opaque(last, opaque, at)) leave_into_air(last, state);
      weight = state.weight.xyz;
      if (point.voxel.w < 0) {
        state.colour.xyz += weight * sky_colour(sky_up(at));
        break;
      }
    }
    if (!is_of_field(point)) point.inside.xyz = on_face(point.inside.xyz, point.what.y);
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
