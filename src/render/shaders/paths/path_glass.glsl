// Glass and clouds along a path; matches render/path/path_tile_media.cpp on the CPU. Included by paths.comp after the
// declarations of paths, vertices and rays.

// Returns the reflectance of a surface between two media, and the cosine of the transmitted direction.
vec2 refraction(float cosine, float eta) {
  float sine2 = eta * eta * max(0.0, 1.0 - cosine * cosine);
  if (sine2 >= 1.0) return vec2(1.0, 0.0);
  float inner = sqrt(1.0 - sine2);
  float across = (eta * cosine - inner) / (eta * cosine + inner);
  float in_plane = (cosine - eta * inner) / (cosine + eta * inner);
  return vec2(0.5 * (across * across + in_plane * in_plane), inner);
}

bool is_begun(Body body) {
  return (body.what.z & kStartsInside) != 0;
}
float length_of(Surface surface, Body body) {
  return max(body.lengths.z, has_own_length(body) ? 0.0 : 1.0);
}

// Computes a ray's position in an instance at `t`: the voxel, and the position in it.
void place_along(int instance, ViewRay ray, float t, out ivec4 voxel, out vec3 inside) {
  GridRay in_grid = ray_in(instance, path.voxel, path.inside.xyz, ray);
  vec3 at = in_grid.origin + t * in_grid.direction;
  vec3 whole = floor(at);
  voxel = ivec4(in_grid.base + ivec3(whole), instance);
  inside = at - whole;
}

// Returns the face of a voxel body, or the lit side of a face of a cell.
uint face_entered(Body body) {
  return body.what.y & 7;
}
bool begins_in_shape(Body body) {
  return kHasShapes && (body.what.z & kBeginsInShape) != 0;
}
vec3 normal_entered(Body body) {
  if (begins_in_shape(body)) return side_normal(body.what.y);
  bool in_field = kHasFieldGlass && (body.what.z & kBeginsInField) != 0;
  return in_field ? normal_of(body.what.y) : face_normal(face_entered(body));
}

// A path's next event in glass or air. Each outcome is handled in one place, since compilers inline functions.
struct Glass {
  uint outcome;
  Body body;
  // kTurnsAtGlass: the position, and the side of the surface where the path continues.
  int instance;
  float t;
  vec3 direction;
  vec3 normal;  // in the instance's grid
  uint within;
  // kInAir, with t.
  vec3 colour;
  float anisotropy;
};

// Continues a path from a glass surface.
uint turn_at(Glass glass, ViewRay ray) {
  ivec4 voxel;
  vec3 inside;
  place_along(glass.instance, ray, glass.t, voxel, inside);
  path.voxel = voxel;
  path.inside = vec4(inside + glass.normal * frame().lift, kInfinity);
  path.direction = vec4(normalize(glass.direction), -1.0);
  path.throughput.w = -kNever;
  path.more.x = glass.within;
  path.counts.y += kDimensions;
  path.counts.w &= ~kIsFirst;
  if (path.counts.y > kDimensions * (kMostGlass + 2 * bounces() + 2 * scatterings())) path.throughput.xyz = vec3(0.0);
  return kTurns;
}

uint hit_glass(Body body, ViewRay ray) {
  Surface surface = surface_of_body(body);
  bool in_field = kHasFieldGlass && (body.what.z & kBeginsInField) != 0;
  ivec4 voxel;
  vec3 inside;
  place_along(body.voxel.w, ray, body.lengths.x, voxel, inside);
  inside += vec3(voxel.xyz - body.voxel.xyz);
  if (!in_field && !begins_in_shape(body)) inside = put_on_face(inside, face_entered(body));
  vertex.is_ground = vertex.is_medium = false;
  put_on_surface(body.voxel, inside, normal_entered(body));
  vertex.colour = surface.colour;
  vertex.roughness = is_face(body) ? surface.roughness : 1.0;
  vertex.metalness = is_face(body) ? surface.metalness : 0.0;
  count_scene();
  if (is_face(body) && !is(kIsNoted)) {
    uint id = surface_id(voxel_of_grid(body.voxel), face_entered(body), false, body.voxel.w, type_of(body));
    note_part(vertex.colour, id, false, vertex.normal, vertex.in_view);
  }
  note_layers(body.lengths.x + behind, type_of(body));
  add_emitted(surface.emitted, -1, vec3(0.0), 0.0);
  return kScatters;
}

// Scatters the path in a cloud if `u` is below the share of paths that scatter there.
void scatter_in(Body body, float u, inout Glass glass) {
  Surface surface = surface_of(type_of(body));
  float share = free_way(u, surface.scattering) / max(body.lengths.z, 1e-12);
  glass.t = body.lengths.x + (body.lengths.y - body.lengths.x) * clamp(share, 0.0, 1.0);
  glass.colour = surface.colour;
  glass.anisotropy = surface.anisotropy;
  glass.outcome = kInAir;
}

bool scatters(Body body) {
  return surface_of(type_of(body)).scattering > 0.0;
}

// Meets a visible texel of a cell: its cover stops the path at random.
void pass_face(Body face, inout float u, inout Glass glass) {
  float cover = cover_of_face(face);
  if (u < cover) {
    glass.body = face;
    glass.outcome = kOnGlass;
    return;
  }
  u = min((u - cover) / (1.0 - cover), kAlmostOne);
  path.throughput.xyz *= passed_by_body(face) / (1.0 - cover);
}

// Passes straight through a body: light between surfaces, and all paths in clouds. The glass's opaque share stops the
// path at random.
void pass_through(Body body, inout float u, inout Glass glass) {
  Surface surface = surface_of_body(body);
  bool is_cloud = surface.scattering > 0.0;
  float voxels = length_of(surface, body);
  float cover = cover_of(surface, voxels);
  if (u >= cover) {
    u = min((u - cover) / (1.0 - cover), kAlmostOne);
    if (!is(kIsSeen)) path.throughput.xyz *= tint_of(surface, voxels);
    return;
  }
  glass.body = body;
  if (is_cloud || is_begun(body)) add_emitted(surface.emitted, -1, vec3(0.0), 0.0);
  if (is_cloud) {
    scatter_in(body, u, glass);
  } else {
    glass.outcome = is_begun(body) ? kEnds : kOnGlass;  // from inside, only its emission counts
  }
}

// `u`: a random number between 0 and 1.
void enter_glass(Body body, float u, inout Glass glass) {
  Surface surface = surface_of_body(body);
  vec3 in_grid = normal_entered(body);
  vec3 normal = turned(placed_at(body.voxel.w).view_axes, in_grid) / placed_at(body.voxel.w).ref_inside.w;
  vec3 direction = path.direction.xyz;
  float cosine = clamp(-dot(normal, direction), 1e-4, 1.0);
  if (is(kIsFirst)) {
    bool in_field = kHasFieldGlass && (body.what.z & kBeginsInField) != 0;
    uint face = in_field ? 0 : begins_in_shape(body) ? side_direction(body.what.y) : body.what.y;
    uint id = surface_id(voxel_of_grid(body.voxel), face, in_field, body.voxel.w, type_of(body));
    note_part(vec3(1.0), id, false, vec3(0.0), vec3(0.0));
  }
  float eta = 1.0 / surface.ior;
  vec2 through = refraction(cosine, eta);
  float cover = cover_of(surface, length_of(surface, body));
  bool is_mirrored = u < through.x;
  glass.outcome = kTurnsAtGlass;
  glass.body = body;
  glass.instance = body.voxel.w;
  glass.t = body.lengths.x;
  if (is_mirrored) {
    glass.direction = direction + normal * (2.0 * cosine);
    glass.normal = in_grid;
    glass.within = 0;
  } else if (u < through.x + (1.0 - through.x) * cover) {
    glass.outcome = kOnGlass;
  } else {
    glass.direction = direction * eta + normal * (eta * cosine - through.y);
    glass.normal = -in_grid;
    glass.within = type_of(body);
  }
}

// Returns true if the path, or the camera, is in the first glass body on its ray.
bool is_within(Body body) {
  return is_begun(body) && (path.more.x == 0 || joins(type_of(body), path.more.x));
}
// Returns the distance where the path leaves the first body; -1 if it is not within that. Before, it meets faces of
// cells: those of other grids, and those at the end of the glass.
float end_within(Body body, Body face) {
  if (!is_within(body)) return -1.0;
  bool is_closed = (face.what.z & kIsClosed) != 0;
  return body.lengths.y + (is_closed ? frame().lift * placed_at(int(body.what.w >> 3)).ref_inside.w : 0.0);
}

// Follows a path within glass to the end of the body, or to an object inside it, at `opaque_t`. The tint of the glass
// is already part of the throughput.
void leave_glass(Body body, bool has_next, Body next, float opaque_t, float u, inout Glass glass) {
  Surface surface = surface_of(type_of(body));
  int instance = int(body.what.w >> 3);
  Placed placed = placed_at(instance);
  bool touches = has_next && reaches(body, next.lengths.x);
  // The glass lies on an opaque surface.
  if (!touches && opaque_t <= body.lengths.y + frame().lift * placed.ref_inside.w) return;
  float other = touches ? surface_of(type_of(next)).ior : 1.0;
  bool in_field = (kHasFieldGlass || kHasShapes) && (body.what.z & kEndsInField) != 0;
  vec3 in_grid = in_field ? normal_from_28(body.what.z >> kExitNormal) : face_normal(body.what.w & 7);
  vec3 normal = turned(placed.view_axes, in_grid) / placed.ref_inside.w;
  vec3 direction = path.direction.xyz;
  if (dot(normal, direction) < 0.0) {
    normal = -normal;
    in_grid = -in_grid;
  }
  float cosine = clamp(dot(normal, direction), 1e-4, 1.0);
  float eta = surface.ior / other;
  vec2 through = refraction(cosine, eta);
  bool is_mirrored = u < through.x;
  glass.outcome = kTurnsAtGlass;
  glass.instance = instance;
  glass.t = body.lengths.y;
  glass.direction =
      is_mirrored ? direction - normal * (2.0 * cosine) : direction * eta + normal * (through.y - eta * cosine);
  glass.normal = is_mirrored ? -in_grid : in_grid;
  glass.within = is_mirrored ? type_of(body) : touches ? type_of(next) : 0;
}

// Handles the first glass body on a ray (clouds are skipped), and the body after it. `u`: a random number between 0 and
// 1, not used by clouds.
void look_into(bool has_body, Body body, bool has_next, Body next, float opaque_t, float u, inout Glass glass) {
  if (has_body && is_within(body)) {
    path.more.x = type_of(body);
    leave_glass(body, has_next, next, opaque_t, u, glass);
    return;
  }
  // A path that was in glass left through a corner, or by rounding.
  path.more.x = 0;
  if (has_body && !is_begun(body)) enter_glass(body, u, glass);
}
