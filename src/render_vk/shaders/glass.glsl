// Bodies of glass along a ray: light/glass.h on the processor's side. They are kept in a list, nearest first. With
// KEEPS_BODIES there is one of kBodies for each pixel of the tile; with HOLDS_BODIES the invocation has one.

// ln of the share of light below which a body counts as closed.
const float kClosed = -11.0;
// Lengths of t within which two bodies touch: the rounding of single precision.
const float kTouching = 4e-6;

bool reaches(Body body, float t) {
  return t <= body.lengths.y + kTouching * max(1.0, body.lengths.y);
}
bool continues(Body body, Body next) {
  return next.what.x == body.what.x && reaches(body, next.lengths.x);
}

struct BodyList {
  uvec2 address;
  uint first;
  uint room;  // 0: none is kept
  uint count;
  float dropped_t;  // where the first begins for which there was no room
};

#ifdef HOLDS_BODIES
const uint kHeldBodies = 8;
Body held_bodies[kHeldBodies];

Body listed_body(BodyList list, uint i) {
  return held_bodies[i];
}
void list_body(BodyList list, uint i, Body body) {
  held_bodies[i] = body;
}
#else
Body listed_body(BodyList list, uint i) {
  return Bodies(list.address).at[list.first + i];
}
void list_body(BodyList list, uint i, Body body) {
  Bodies(list.address).at[list.first + i] = body;
}
#endif

// Puts a body in its place; when the list is full the furthest gives way, and is returned.
bool insert_body(inout BodyList list, Body body, out Body dropped) {
  dropped = body;
  if (list.room == 0) return true;
  bool is_full = list.count == list.room;
  if (is_full) {
    Body last = listed_body(list, list.room - 1);
    if (body.lengths.x >= last.lengths.x) return true;
    dropped = last;
  } else {
    ++list.count;
  }
  uint i = list.count - 1;
  for (; i > 0; --i) {
    Body before = listed_body(list, i - 1);
    bool stays = before.lengths.x < body.lengths.x ||
                 (before.lengths.x == body.lengths.x && before.voxel.w <= body.voxel.w);
    if (stays) break;
    list_body(list, i, before);
  }
  list_body(list, i, body);
  return is_full;
}

// What one more body does to the light of those that found no room.
void keep_body(inout BodyList list, Body body, float from_t, inout vec3 passed) {
  if (body.lengths.x < from_t) return;
  Body dropped;
  if (!insert_body(list, body, dropped)) return;
  list.dropped_t = min(list.dropped_t, dropped.lengths.x);
  passed *= passed_by(surface_of(dropped.what.x), dropped.lengths.z, dropped.what.z != 0);
}

// The bodies of one instance, along a ray whose walk has been started. `voxels_a_t`: of the full grid.
void find_bodies_in(int i, GridRay ray, float voxels_a_t, float max_t, float from_t, inout BodyList list,
                    inout vec3 passed) {
  float room = max_t - ray.t;
  float clarity = 0.0;
  bool has_body = false;
  Body body;
  while (clarity > kClosed && find_voxel(room)) {
    Body next;
    next.voxel = ivec4(walk_voxel, i);
    next.what = uvec4(type_found(), face_found(), walk_axis < 0 ? 1 : 0, 0);
    float enter_t = walk_t;
    bool goes_on = leave_block(0, room);
    float exit_t = min(walk_t, room);
    next.what.w = 8 * uint(i) + uint(2 * walk_axis + (ray_forward[walk_axis] ? 0 : 1));
    next.lengths = vec4(ray.t + enter_t, ray.t + exit_t, (exit_t - enter_t) * voxels_a_t, enter_t);
    if (next.lengths.z > 0.0) {
      clarity += surface_of(next.what.x).log_clarity * next.lengths.z;
      if (has_body && continues(body, next)) {
        body.lengths.y = next.lengths.y;
        body.lengths.z += next.lengths.z;
        body.what.w = next.what.w;
      } else {
        if (has_body) keep_body(list, body, from_t, passed);
        body = next;
        has_body = true;
      }
    }
    if (!goes_on) break;
  }
  if (has_body) keep_body(list, body, from_t, passed);
}

// The next body of a list, as one with those that it touches; false at the list's end.
bool next_body(BodyList list, inout uint i, out Body body) {
  if (i >= list.count) return false;
  body = listed_body(list, i++);
  while (i < list.count) {
    Body next = listed_body(list, i);
    if (!continues(body, next)) break;
    if (next.lengths.y > body.lengths.y) {
      body.lengths.y = next.lengths.y;
      body.what.w = next.what.w;
    }
    body.lengths.z += next.lengths.z;
    ++i;
  }
  return true;
}

// What a surface between media of two indices of refraction mirrors of a ray, and the y of the mirrored direction.
// `direction`, `normal`: in the world, unit.
vec2 mirror_at(vec3 direction, vec3 normal, float ior, float other_ior) {
  float along = dot(direction, normal);
  float cosine = min(abs(along), 1.0);
  float denser = max(ior, other_ior) / min(ior, other_ior);
  float up = direction.y - 2.0 * along * normal.y;
  if (!(denser > 1.0)) return vec2(0.0, up);
  float inside = sqrt(1.0 - (1.0 - cosine * cosine) / (denser * denser));
  float across = (cosine - denser * inside) / (cosine + denser * inside);
  float in_plane = (denser * cosine - inside) / (denser * cosine + inside);
  return vec2(0.5 * (across * across + in_plane * in_plane), up);
}
