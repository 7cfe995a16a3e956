#version 460
// Path tracing; matches render/path/path_tile.h on the CPU. One invocation per pixel: it takes some steps of its path,
// each to the path's next hit. When a path ends, the next sample's path begins.
#include "data.glsl"
#include "paths/path_data.glsl"
#include "walk.glsl"
#include "instances.glsl"
#include "paths/path_math.glsl"
#include "paths/path_surface.glsl"
#include "looks.glsl"
#define KEEPS_BODIES
layout(constant_id = 0) const bool kHasGlass = true;
#include "glass.glsl"
#include "sky.glsl"
#include "paths/path_sky.glsl"
#include "paths/path_lamps.glsl"
#include "field_textures.glsl"
#define SHOWS_FIELD_TEXTURES
FieldPoint blended_point;
#include "field_blend.glsl"

// Steps per dispatch: one with glass, where paths with several steps would diverge (docs/decisions/archive/105).
const uint kSteps = kHasGlass ? 1 : 4;
const uint kSureBounces = 3;
const float kMostLikely = 0.95;
const uint kMostGlass = 64;

// Dimensions of a vertex, and additional numbers: render/path/path_tile.h.
const uint kDimensions = 8;
const uint kOfSun = 0;
const uint kOfLampChoice = 1;
const uint kOfLampPoint = 2;
const uint kOfSky = 3;
const uint kOfDirection = 4;
const uint kOfLobe = 5;
const uint kOfRoulette = 6;
const uint kOfGlass = 7;
const uint kOfFog = 0x40000000u;
const uint kOfFade = 0x50000000u;

// The outcome of a step.
const uint kGoesOn = 0;  // no surface has been hit yet
const uint kTurns = 1;   // the path has a next ray
const uint kScatters = 2;
const uint kEnds = 3;
// The outcomes at glass.
const uint kTurnsAtGlass = 4;
const uint kOnGlass = 5;
const uint kInAir = 6;

// A point where a path scatters.
struct Vertex {
  ivec4 voxel;  // as in PathState::voxel
  vec3 inside;
  vec3 in_view;
  vec3 normal;  // in the world
  vec3 colour;
  float roughness;
  float metalness;
  float anisotropy;
  bool is_ground;
  bool is_medium;
};

struct Request {
  vec3 direction;
  float max_t;
  vec3 light;
};

// A ray's hit on an opaque surface.
struct Hit {
  ivec4 voxel;  // w: the instance; -1: none
  vec3 inside;
  float t;
  vec3 normal;  // in the grid
  uint type;
  uint face;
  bool in_field;
  bool in_shape;  // met `side`, of shapes.glsl
  bool starts_inside;
  uint side;
};

PathState path;
Random random;
Vertex vertex;
Request requests[3];
int request_count;
uint rays_taken;
float behind;  // distance of the camera behind the start of the path's first ray

// ---- accessors of a path's state ----

uint dimension() {
  return path.counts.y;
}
uint bounces() {
  return path.counts.z & 0xFFFF;
}
uint scatterings() {
  return path.counts.z >> 16;
}
bool is(uint flag) {
  return (path.counts.w & flag) != 0;
}
float number(uint which) {
  return random_one(random, path.counts.y + which);
}
vec2 numbers(uint which) {
  return random_pair(random, path.counts.y + which);
}

void add_sum(uint which, vec4 value) {
  Sums sums = Sums(path_frame().sums);
  uint i = place_of_pixel() * path_frame().sum_pitch + which;
  sums.at[i] += value;
}
void set_sum(uint which, float w) {
  Sums sums = Sums(path_frame().sums);
  sums.at[place_of_pixel() * path_frame().sum_pitch + which].w = w;
}
bool is_first_sample() {
  return path.counts.x == 0;
}

// ---- notes ----

// The denoiser's surface data, and an image's layers; matches render/path/denoise.h on the CPU.

bool wants_parts() {
  return path_frame().parts != uvec2(0);
}
uint part_place(uint slot) {
  return place_of_pixel() * kParts + slot;
}

void add_to_part(uint slot, vec3 light) {
  Parts parts = Parts(path_frame().parts);
  uint i = part_place(slot);
  for (int c = 0; c < 3; ++c) parts.at[i].light[c] += light[c];
  float bright = luminance(light);
  parts.at[i].square += bright * bright;
}

uint surface_id(ivec3 voxel, uint face, bool in_field, int placed, uint type) {
  uint plane = in_field ? 0 : uint(voxel[axis_of(face)]);
  uint id = mixed(plane ^ (in_field ? 6u : face) << 28);
  id = mixed(id ^ uint(placed));
  return mixed(id ^ type) | 1;
}

void note_part(vec3 colour, uint surface, bool is_curved, vec3 normal, vec3 in_view) {
  if (!wants_parts() || path.more.y != kNoPart || is(kIsCaught)) return;
  Parts parts = Parts(path_frame().parts);
  for (uint slot = 0; slot < kParts; ++slot) {
    uint i = part_place(slot);
    uint other = parts.at[i].surface;
    if (other != 0 && other != surface) continue;
    path.more.y = slot;
    parts.at[i].surface = surface;
    parts.at[i].samples += 1.0;
    for (int c = 0; c < 3; ++c) parts.at[i].albedo[c] += colour[c];
    for (int c = 0; c < 3 && is_curved; ++c) {
      parts.at[i].normal[c] += normal[c];
      parts.at[i].place[c] += in_view[c];
    }
    return;
  }
}

void note_layers(float t, uint type) {
  if (is(kIsNoted)) return;
  path.counts.w |= kIsNoted;
  if (!has_path(kPathLayers)) return;
  add_sum(kSumAlbedo, vec4(vertex.colour, 0.0));
  add_sum(kSumNormal, vec4(vertex.normal, 0.0));
  if (!is_first_sample()) return;
  set_sum(kSumLit, uintBitsToFloat(type));
  set_sum(kSumOpen, uintBitsToFloat(vertex.is_ground ? 0 : uint(vertex.voxel.w) + 1));
  if (is(kIsFirst)) set_sum(kSumCaught, t);
}

void note_depth(float t) {
  if (has_path(kPathLayers) && is_first_sample()) set_sum(kSumCaught, t);
}

// ---- rays ----

// Returns a ray in the space of its start's own grid.
GridRay ray_at(ivec4 voxel, vec3 inside, vec3 direction) {
  return GridRay(voxel.xyz & ~63, vec3(voxel.xyz & 63) + inside, turned(placed_at(voxel.w).grid_axes, direction), 0.0);
}
ViewRay view_ray_at(ivec4 voxel, vec3 inside, vec3 direction) {
  if (voxel.w < 0) return ViewRay(inside, direction);
  return ViewRay(view_from_grid(placed_at(voxel.w), ray_at(voxel, inside, direction)).origin, direction);
}
// Returns the ray in the space of an instance.
GridRay ray_in(int instance, ivec4 voxel, vec3 inside, ViewRay in_view) {
  if (instance == voxel.w) return ray_at(voxel, inside, in_view.direction);
  return grid_from_view(placed_at(instance), in_view);
}

// Replaces the hit by a ray's hit on a grid's content if that is nearer.
bool meet_content(int content, int i, Placed placed, GridRay ray, float max_t, inout Hit hit) {
  float limit = min(hit.t, max_t);
  float t;
  FieldHit in_cell;
  Tree tree = opaque_tree(placed, content);
  bool is_field = is_field_content(content);
  if (!start_walk(tree, ray.base, ray.origin, ray.direction, limit, -1)) return false;
  if (!find_content(content, limit, t, in_cell)) return false;
  if (hit.voxel.w >= 0 && (t > hit.t || (t == hit.t && i > hit.voxel.w))) return false;
  hit.voxel = ivec4(walk_voxel, i);
  hit.t = t;
  hit.in_field = is_field;
  hit.in_shape = is_shape_content(content) && !shape_met.starts_inside;
  hit.starts_inside = walk_axis < 0;
  hit.face = face_found();
  if (is_field) {
    hit.starts_inside = in_cell.starts_inside;
    hit.inside = in_cell.inside;
    hit.normal = normal_found(in_cell.inside);
    hit.type = material_found(tree, in_cell.inside);
  } else if (is_shape_content(content)) {
    hit.starts_inside = shape_met.starts_inside;
    hit.voxel.xyz = shape_met.voxel;
    hit.inside = ray_origin + t * ray_direction - vec3(shape_met.voxel - ray_base);
    hit.type = shape_met.type;
    hit.normal = face_normal(hit.face);
    if (!hit.starts_inside) {
      hit.side = shape_met.side;
      hit.face = side_direction(hit.side);
      hit.normal = side_normal(hit.side);
    }
  } else {
    hit.inside = ray_origin + t * ray_direction - vec3(walk_voxel - ray_base);
    hit.type = type_found();
    hit.normal = face_normal(hit.face);
  }
  return true;
}

// Returns the nearest opaque hit up to `max_t`; with `is_any`, any opaque hit.
Hit trace(ivec4 voxel, vec3 inside, ViewRay in_view, float max_t, bool is_any) {
  Hit hit;
  hit.voxel = ivec4(0, 0, 0, -1);
  hit.t = kInfinity;
  ++rays_taken;
  start_visit(in_view);
  int home = voxel.w;
  bool is_first = home >= 0;
  for (;;) {
    int i = is_first ? home : next_instance(min(hit.t, max_t));
    if (i < 0) break;
    if (i == home && !is_first) continue;
    is_first = false;
    Placed placed = placed_at(i);
    GridRay ray = ray_in(i, voxel, inside, in_view);
    for (int content = 0; content < kContents; ++content) {
      if (meet_content(content, i, placed, ray, max_t, hit) && is_any) return hit;
    }
    if (home >= 0 && frame().placed_count == 1) break;
  }
  return hit;
}

// Finds the bodies of all instances along a ray, from `from_t` to `max_t`.
void find_bodies(ivec4 voxel, vec3 inside, ViewRay in_view, float max_t, float from_t, inout BodyList list,
                 inout vec3 dropped) {
  start_visit(in_view);
  for (;;) {
    int i = next_instance(max_t);
    if (i < 0) return;
    Placed placed = placed_at(i);
    find_bodies(i, Grids(frame().grids).at[placed.ref_base.w], ray_in(i, voxel, inside, in_view),
                placed.ref_view.w / placed.ref_inside.w, max_t, from_t, list, dropped);
  }
}

float ground_at(vec3 origin, vec3 direction, float from) {
  if (!has_path(kPathGround) || !(direction.y < 0.0)) return kInfinity;
  float t = (path_frame().ground.w - origin.y) / direction.y;
  return t > from ? t : kInfinity;
}

// Returns the part of a ray that lies in fog, from `from` to `max_t`.
vec2 in_fog(vec3 origin, vec3 direction, float from, float max_t) {
  float above = origin.y - path_frame().fog.w;
  float up = direction.y;
  if (up == 0.0) return above >= 0.0 ? vec2(0.0) : vec2(from, max_t);
  float crossed = -above / up;
  vec2 way = up > 0.0 ? vec2(from, min(crossed, max_t)) : vec2(max(crossed, from), max_t);
  return way.x < way.y ? way : vec2(0.0);
}

float free_way(float u, float density) {
  return -log_of_two(1.0 - u) * 0.69314718 / density;
}

// ---- paths begin and end ----

vec2 on_lens(vec2 u) {
  int blades = path_frame().lens_blades;
  if (blades < 3) return on_disc(u);
  float place = u.x * float(blades);
  float first = min(floor(place), float(blades - 1));
  vec2 corner[2];
  for (int i = 0; i < 2; ++i) {
    float turns = (first + float(i)) / float(blades) + path_frame().lens_turn;
    SineCosine turn = of_turns(turns - floor(turns));
    corner[i] = vec2(turn.cosine, turn.sine);
  }
  float outward = sqrt(place - first);
  return outward * (corner[0] + (corner[1] - corner[0]) * u.y);
}

void set_random() {
  ivec2 pixel = push.corner + tile_pixel();
  uint place = hash_of(uint(pixel.x), uint(pixel.y));
  random = Random(mixed(place ^ path_frame().seed * 0x9E3779B9u), path.counts.x);
}

// Returns the image position of a path's first camera ray, which begins at the origin of view space.
vec2 point_of_path() {
  return vec2(push.corner + tile_pixel()) + random_pair(random, 0);
}

void begin_path(uint sample_number) {
  path.counts = uvec4(sample_number, 2, 0, kIsSeen | kIsFirst | kIsAlive);
  path.more = uvec4(0, kNoPart, 0, 0);
  set_random();
  vec2 point = point_of_path();
  ViewRay ray = camera_ray(point);
  vec4 right = path_frame().lens_right;
  vec4 up = path_frame().lens_up;
  if (has(kPerspective) && right.w > 0.0) {
    vec2 lens = on_lens(random_pair(random, 1));
    vec3 from = (right.xyz * lens.x + up.xyz * lens.y) * right.w;
    float t = up.w / dot(ray.direction, frame().forward.xyz);
    ray.origin += from * (1.0 - frame().view_depth / up.w);
    ray.direction = normalize(ray.direction * t - from);
  }
  path.voxel = ivec4(0, 0, 0, -1);
  path.inside = vec4(ray.origin, kInfinity);
  path.direction = vec4(ray.direction, -1.0);
  path.throughput = vec4(1.0, 1.0, 1.0, -kNever);
  path.radiance = vec4(0.0);
  path.normal = vec4(0.0);
}

void end_path() {
  add_sum(is(kIsCaught) ? kSumLit : kSumScene, vec4(path.radiance.xyz, 0.0));
  if (path.more.y != kNoPart) add_to_part(path.more.y, path.radiance.xyz);
  uint next = path.counts.x + 1;
  if (next < push.first + push.count) {
    begin_path(next);
  } else {
    path.counts.w &= ~kIsAlive;
  }
}

// Adds the sky's light to a path that leaves the scene.
void leave(vec3 origin, vec3 direction) {
  if (is(kIsFirst) && !has(kPerspective)) {
    direction = normalize(frame().forward.xyz + origin * frame().sky_scale);
  }
  float found = path.inside.w;
  vec3 light = sky_radiance(direction);
  if (found < kInfinity && has_path(kPathUneven)) light *= balance(found, sky_density(direction));
  float density = path_frame().sunlight.w > 0.0 || !is(kIsSeen) ? sun_density(direction) : 0.0;
  if (density > 0.0) {
    light += path_frame().sunlight.xyz * density * (found < kInfinity ? balance(found, density) : 1.0);
  }
  if (!is(kIsFirst)) {
    path.radiance.xyz += path.throughput.xyz * light;
    return;
  }
  if (path_frame().background.w > 0.0) light = path_frame().background.xyz;
  add_sum(kSumBackground, vec4(light, 0.0));
  if (path.more.y != kNoPart) add_to_part(path.more.y, light);
  note_depth(kInfinity);
}

// ---- hits of paths ----

void add_emitted(vec3 emitted, int lamp, vec3 origin, float distance) {
  if (is_black(emitted)) return;
  float share = is(kIsSeen) ? 1.0 : path_frame().air.z;
  if (lamp >= 0 && path.inside.w < kInfinity) {
    share *= balance(path.inside.w, density_of_lamp(lamp, origin, path.normal.xyz, path.direction.xyz, distance));
  }
  path.radiance.xyz += path.throughput.xyz * emitted * share;
}

void count_scene() {
  if (is(kIsFirst)) add_sum(kSumBackground, vec4(0.0, 0.0, 0.0, 1.0));
}

Surface surface_met(Hit hit) {
  if (!hit.in_field) {
    Surface surface = surface_of(hit.type);
    if (kHasShapes && hit.in_shape) show_side(hit.side, hit.inside, 0.0, surface);
    return surface;
  }
  if (hit.starts_inside) return surface_of_material(hit.type);
  Placed placed = placed_at(hit.voxel.w);
  if (kHasTextures) {
    ivec3 voxel = (hit.voxel.xyz + placed.origin.xyz) << placed.origin.w;
    blended_point = FieldPoint(voxel, hit.inside * placed.ref_view.w, hit.normal, 0.0);
  }
  Tree field = opaque_tree(placed, 1);
  return blend_of_field(field, hit.voxel.xyz, hit.inside, hit.type);
}

// Shows the texel of a cube's face. `inside`: the position in the voxel, on the face.
void show_texel(Hit hit, vec3 inside, inout Surface surface) {
  Placed placed = placed_at(hit.voxel.w);
  uint face = hit.face;
  if (placed.ref_view.w == 1.0) turn_by_state(hit.type, hit.voxel.xyz, placed, face, inside);
  show_texture(hit.type, face, inside, 0.0, surface);
}

// Places the vertex slightly in front of an instance's surface.
void put_on_surface(ivec4 voxel, vec3 inside, vec3 normal_in_grid) {
  Placed placed = placed_at(voxel.w);
  vertex.voxel = voxel;
  vertex.inside = inside + normal_in_grid * frame().lift;
  vertex.normal = normalize(turned(placed.view_axes, normal_in_grid));
  vertex.in_view = view_ray_at(voxel, vertex.inside, vec3(0.0)).origin;
}

vec3 put_on_face(vec3 inside, uint face) {
  vec3 at = clamp(inside, vec3(1e-6), vec3(1.0 - 1e-6));
  at[axis_of(face)] = (face & 1) == 0 ? 1.0 : 0.0;
  return at;
}

ivec3 voxel_of_grid(ivec4 voxel) {
  return voxel.xyz + placed_at(voxel.w).origin.xyz;
}

uint hit_matter(Hit hit, vec3 origin) {
  Surface surface = surface_met(hit);
  count_scene();
  if (hit.starts_inside) {  // from inside: its own colour, unlit
    path.radiance.xyz += path.throughput.xyz * (is(kIsSeen) ? surface.colour : surface.emitted);
    if (is(kIsFirst)) note_depth(0.0);
    return kEnds;
  }
  vertex.is_ground = vertex.is_medium = false;
  bool is_on_face = !hit.in_field && !(kHasShapes && hit.in_shape);
  vec3 inside = is_on_face ? put_on_face(hit.inside, hit.face) : hit.inside;
  put_on_surface(hit.voxel, inside, hit.normal);
  if (kHasTextures && is_on_face) show_texel(hit, inside, surface);
  vertex.colour = surface.colour;
  vertex.roughness = surface.roughness;
  vertex.metalness = surface.metalness;
  ivec3 voxel = voxel_of_grid(hit.voxel);
  if (!is(kIsNoted)) {
    bool is_matte = surface.roughness >= 1.0 && surface.metalness <= 0.0 && is_black(surface.emitted);
    note_part(vertex.colour, surface_id(voxel, hit.face, hit.in_field, hit.voxel.w, is_matte ? 0 : hit.type),
              hit.in_field, vertex.normal, vertex.in_view);
  }
  note_layers(hit.t + behind, hit.type);
  // Light from lamps of shapes is only sampled.
  bool is_sampled = kHasShapes && hit.in_shape && (hit.side & kFromBehind) == 0 &&
                    (side_flags(hit.side) & kSideIsLamp) != 0;
  if (!is_black(surface.emitted) && (is(kIsSeen) || !is_sampled)) {
    int lamp = is_on_face ? lamp_of_face(hit.voxel.w, voxel, hit.face) : -1;
    add_emitted(surface.emitted, lamp, origin, hit.t);
  }
  return kScatters;
}

uint hit_ground(vec3 origin, float t) {
  vec3 direction = path.direction.xyz;
  float fade = path_frame().environment.z;
  if (is(kIsFirst) && fade > 0.0) {
    float near = clamp(-direction.y / fade, 0.0, 1.0);
    if (number(kOfFade) >= near * near * (3.0 - 2.0 * near)) {
      leave(origin, normalize(vec3(direction.x, -direction.y, direction.z)));
      return kEnds;
    }
  }
  vertex.is_ground = true;
  vertex.is_medium = false;
  vertex.in_view = origin + direction * t;
  vertex.in_view.y = path_frame().ground.w + frame().lift;
  vertex.voxel = ivec4(0, 0, 0, -1);
  vertex.inside = vertex.in_view;
  vertex.normal = vec3(0.0, 1.0, 0.0);
  vertex.colour = path_frame().ground.xyz;
  vertex.roughness = 1.0;
  vertex.metalness = 0.0;
  if (is(kIsFirst) && has_path(kPathOnlyShadows)) {
    path.counts.w |= kIsCaught;
    add_sum(kSumScene, vec4(0.0, 0.0, 0.0, 1.0));
    add_sum(kSumCaught, vec4(sky_radiance(direction), 0.0));
    note_depth(kInfinity);
    return kScatters;
  }
  count_scene();
  if (!is(kIsNoted)) note_part(vertex.colour, kGroundSurface, false, vertex.normal, vertex.in_view);
  note_layers(t + behind, 0);
  return kScatters;
}

uint hit_air(vec3 origin, float t, vec3 colour, float anisotropy) {
  vertex.is_ground = false;
  vertex.is_medium = true;
  vertex.anisotropy = anisotropy;
  vertex.in_view = origin + path.direction.xyz * t;
  vertex.voxel = ivec4(0, 0, 0, -1);
  vertex.inside = vertex.in_view;
  vertex.colour = colour;
  vertex.normal = vec3(0.0);
  vertex.roughness = 1.0;
  vertex.metalness = 0.0;
  count_scene();
  if (is(kIsFirst)) note_depth(t + behind);
  if (!is(kIsNoted) && has_path(kPathLayers)) add_sum(kSumAlbedo, vec4(colour, 0.0));
  path.counts.w |= kIsNoted;
  return kScatters;
}

// Records the surface that a path would meet without fog and clouds.
void note_behind(Hit hit, float until) {
  if (!is(kIsFirst)) return;
  if (hit.voxel.w >= 0 && hit.t <= until) {
    uint id = surface_id(voxel_of_grid(hit.voxel), hit.face, hit.in_field, hit.voxel.w, hit.type);
    note_part(vec3(1.0), id, false, vec3(0.0), vec3(0.0));
  } else {
    note_part(vec3(1.0), until < kInfinity ? kGroundSurface : kSkySurface, false, vec3(0.0), vec3(0.0));
  }
}

#include "paths/path_glass.glsl"

// ---- light ----

// Requests a shadow ray for light that reaches the vertex if unblocked.
void ask(vec3 direction, float max_t, vec3 light) {
  if (is_black(light)) return;
  if (ground_at(vertex.in_view, direction, 0.0) < max_t) return;
  if (has_path(kPathFog)) {
    vec2 way = in_fog(vertex.in_view, direction, 0.0, max_t);
    if (way.y > way.x) light *= exponential(-path_frame().air.x * (way.y - way.x));
    if (is_black(light)) return;
  }
  requests[request_count++] = Request(direction, max_t, light);
}

bool goes_on(bool in_medium) {
  if (in_medium) path.counts.z += 1 << 16;
  bool is_sure = in_medium ? scatterings() <= kSureBounces : bounces() < kSureBounces;
  if (!is_sure) {
    float likely = min(largest(path.throughput.xyz), in_medium ? 1.0 : kMostLikely);
    if (!(number(kOfRoulette) < likely)) return false;
    path.throughput.xyz /= likely;
  }
  if (!in_medium) ++path.counts.z;
  return true;
}

// Lights the vertex, and scatters the path. Returns true if it continues.
bool shade() {
  bool in_medium = vertex.is_medium;
  int left = in_medium ? path_frame().max_scatterings - int(scatterings()) : path_frame().max_bounces - int(bounces());
  if (left <= 0 || is_black(path.throughput.xyz)) return false;
  vec3 direction = path.direction.xyz;
  vec3 normal = vertex.normal;
  if (!in_medium) {
    float facing = -dot(normal, direction);
    // A smooth normal may point away from the viewer.
    if (facing < 1e-3) normal = normalize(normal - direction * (1e-3 - facing));
  }
  Axes axes = axes_about(in_medium ? direction : normal);
  Scatter scatter;
  if (in_medium) {
    scatter = scatter_in_medium(vertex.colour, vertex.anisotropy);
  } else {
    vec3 outward = to_local(axes, -direction);
    outward.z = max(outward.z, 1e-4);
    scatter = scatter_of(vertex.colour, vertex.roughness, vertex.metalness, normalize(outward));
  }
  Scattered next = sample_scatter(scatter, numbers(kOfDirection), number(kOfLobe));
  bool is_caught = is(kIsCaught) && bounces() == 0;
  for (int i = 0; i < 3; ++i) {
    vec3 towards;
    vec3 radiance;
    float density;
    float max_t = kInfinity;
    if (i == 0) {
      if (!has_path(kPathSun)) continue;
      SkySample sun = sample_sun(numbers(kOfSun));
      towards = sun.direction;
      density = sun.density;
      radiance = density < kInfinity ? sun.radiance / density : sun.radiance;
    } else if (i == 1) {
      if (!has_path(kPathUneven)) continue;
      SkySample sky = sample_sky(numbers(kOfSky));
      if (!(sky.density > 0.0)) continue;
      towards = sky.direction;
      density = sky.density;
      radiance = sky.radiance / density;
    } else {
      if (path_frame().lamp_count == 0) continue;
      LampSample lamp = sample_lamp(vertex.in_view, in_medium ? vec3(0.0) : normal, number(kOfLampChoice),
                                    numbers(kOfLampPoint));
      if (is_black(lamp.radiance)) continue;
      towards = lamp.direction;
      density = lamp.density;
      radiance = lamp.radiance;
      max_t = lamp.distance * (1.0 - 1e-4);  // slightly in front of the lamp, because of rounding
    }
    vec3 inward = to_local(axes, towards);
    if (!(inward.z > 0.0) && !in_medium) continue;
    vec4 both = evaluate(scatter, inward);
    float share = density < kInfinity ? balance(density, both.w) : 1.0;
    ask(towards, max_t, path.throughput.xyz * both.xyz * radiance * share);
  }
  if (is_caught) {
    SkySample sun = sample_sun(numbers(kOfSun));
    vec3 open = sky_radiance(to_world(axes, next.direction)) * next.weight;
    if (has_path(kPathSun)) {
      open += path_frame().sunlight.xyz * vertex.colour * (max(sun.direction.y, 0.0) / kPi);
    }
    add_sum(kSumOpen, vec4(open, 0.0));
  }
  if (is_black(next.weight)) return false;
  path.throughput.xyz *= next.weight;
  if (!goes_on(in_medium)) return false;
  path.counts.y += kDimensions;
  path.voxel = vertex.voxel;
  path.inside = vec4(vertex.inside, next.density);
  path.direction = vec4(normalize(to_world(axes, next.direction)), -1.0);
  path.throughput.w = -kNever;
  path.normal = vec4(normal, 0.0);
  if (next.density < kInfinity) path.counts.w &= ~kIsSeen;
  path.counts.w &= ~kIsFirst;
  path.more.x = 0;
  return true;
}

// Returns the outcome of the path's own ray, after the outcome of its glass.
uint meet(Hit hit, Glass glass, ViewRay ray, float until) {
  if (kHasGlass && glass.outcome == kTurnsAtGlass) return turn_at(glass, ray);
  if (kHasGlass && glass.outcome == kOnGlass) return hit_glass(glass.body, ray);
  if (glass.outcome == kInAir) return hit_air(ray.origin, glass.t, glass.colour, glass.anisotropy);
  if (glass.outcome != kGoesOn) return glass.outcome;
  if (hit.voxel.w >= 0 && hit.t <= until) return hit_matter(hit, ray.origin);
  if (until < kInfinity) return hit_ground(ray.origin, until);
  leave(ray.origin, path.direction.xyz);
  return kEnds;
}

// Takes one step: traces the path's own ray, then its shadow rays. One loop over all of them; direct_light.glsl gives
// the reason.
void step_path() {
  request_count = 0;
  bool goes_on_after = false;
  behind = 0.0;
  if (is(kIsFirst)) behind = frame().view_depth / dot(path.direction.xyz, frame().forward.xyz);
  for (int i = 0; i <= request_count; ++i) {
    bool is_own = i == 0;
    ivec4 voxel = is_own ? path.voxel : vertex.voxel;
    vec3 inside = is_own ? path.inside.xyz : vertex.inside;
    vec3 direction = is_own ? path.direction.xyz : requests[i - 1].direction;
    float max_t = is_own ? kInfinity : requests[i - 1].max_t;
    ViewRay ray = view_ray_at(voxel, inside, direction);
    Hit hit = trace(voxel, inside, ray, max_t, !is_own);
    if (!is_own && hit.voxel.w >= 0) continue;
    Glass glass;
    glass.outcome = kGoesOn;
    float opaque_t = max_t;
    float until = max_t;
    if (is_own) {
      opaque_t = until = min(hit.t, ground_at(ray.origin, direction, -behind));
      if (has_path(kPathMedia)) note_behind(hit, until);
      if (has_path(kPathFog) && path_frame().air.x > 0.0 && path.more.x == 0) {
        vec2 way = in_fog(ray.origin, direction, -behind, until);
        float met = way.x + free_way(number(kOfFog), path_frame().air.x);
        if (met < way.y) until = met;
      }
    }
    if (kHasGlass) {
      BodyList list = BodyList(frame().bodies, slot_of_pixel() * kBodies, kBodies, 0, kInfinity);
      vec3 passed = vec3(1.0);
      find_bodies(voxel, inside, ray, until, is_own ? path.throughput.w : -kNever, list, passed);
      float u = path.direction.w >= 0.0 ? path.direction.w : number(kOfGlass);
      uint k = 0;
      Body body;
      Body first;
      bool has_first = false;
      bool has_next = false;
      while (glass.outcome == kGoesOn && !has_next && next_body(list, k, body)) {
        if (!is_own) {
          passed *= passed_by_body(body);
        } else if (is_face(body)) {
          if (!has_first || body.lengths.x <= end_within(first, body)) pass_face(body, u, glass);
        } else if (!is(kIsSeen) || (path.more.x == 0 && !has_first && scatters(body))) {
          pass_through(body, u, glass);
        } else if (!has_first) {
          first = body;
          has_first = true;
          if (is_within(first)) path.throughput.xyz *= tint_of(surface_of(type_of(first)), first.lengths.z);
        } else {
          has_next = true;
        }
      }
      if (!is_own) {
        requests[i - 1].light *= passed;
      } else if (glass.outcome == kGoesOn) {
        if (is(kIsSeen) && (has_first || path.more.x != 0)) {
          look_into(has_first, first, has_next, body, opaque_t, u, glass);
        } else if (list.dropped_t < kInfinity) {
          // Bodies that did not fit are searched for in a separate step.
          path.throughput.w = list.dropped_t;
          path.direction.w = u;
          glass.outcome = kTurns;
        }
      }
    }
    if (!is_own) {
      path.radiance.xyz += requests[i - 1].light;
      continue;
    }
    if (glass.outcome == kGoesOn && until < opaque_t) {
      glass.outcome = kInAir;
      glass.t = until;
      glass.colour = path_frame().fog.xyz;
      glass.anisotropy = path_frame().air.y;
    }
    uint met = meet(hit, glass, ray, until);
    goes_on_after = met == kTurns && !is_black(path.throughput.xyz);
    // The loop's remaining requests belong to the vertex.
    if (met == kScatters) goes_on_after = shade();
  }
  if (!goes_on_after) end_path();
}

void main() {
  rays_taken = 0;
  bool is_alive = false;
  if (is_in_tile()) {
    uint slot = slot_of_pixel();
    PathStates states = PathStates(path_frame().states);
    if (push.begins != 0) {
      begin_path(push.first);
    } else {
      path = states.at[slot];
      set_random();
    }
    for (uint i = 0; i < kSteps && is(kIsAlive); ++i) step_path();
    states.at[slot] = path;
    is_alive = is(kIsAlive);
  }
  add_counts(rays_taken, false, is_alive);
}
