#version 460
// The colour of the nearest glass face, including everything visible through it.
#include "mesh.glsl"

layout(constant_id = 5) const uint kGlassStep = 0;
const bool kTraces = true;
const bool kHasGlass = true;
#define HOLDS_BODIES
#include "lit.glsl"
#include "mesh_light.glsl"
#include "corners.glsl"
#include "sky.glsl"
#include "seen_glass.glsl"
#include "blocky_face.glsl"

layout(location = 0) out vec4 pixel;

// Lengths of the ray, in voxels, between its start and the fragment: behind the face of a cube; before that of a shape,
// whose box the ray then enters, and before that of a cube with a texture.
const float kWithin = 1e-4;
const bool kStartsBefore = kPart == kShapes || kHasCells;

vec3 normal_met(int instance, uint face, float t) {
  return face_normal(placed_at(instance), face);
}
LitPoint point_of_body(Body body) {
  Placed placed = placed_at(body.voxel.w);
  bool is_of_shape = kHasShapes && (body.what.z & kBeginsInShape) != 0;
  if (is_of_shape || (kHasFieldGlass && (body.what.z & kBeginsInField) != 0)) {
    vec3 normal = normal_of_side(body, true);
    return point_of_body(body, placed, normal, max(dot(normal, mesh_frame().sun.xyz), 0.0));
  }
  uint face = body.what.y & 7;
  float diffuse = face < 4 ? placed.diffuse[0][face] : placed.diffuse[1][face - 4];
  return point_of_body(body, placed, face_normal(placed, face), diffuse);
}

// Adds the fragment's body, which begins in its face; bodies of other instances around the ray's start began earlier.
void enter_first(inout BodyList list) {
  if (kStartsBefore) return;
  for (uint i = 0; i < list.count; ++i) {
    Body body = listed_body(list, i);
    if ((body.what.z & kHowItBegins) != kStartsInside || body.voxel.w != seen_home) continue;
    body.what.y = what.x;
    body.what.z &= ~kHowItBegins;
    list_body(list, i, body);
  }
}

void main() {
  if (kPart != kShapes && is_beyond(what.x)) discard;
  // Read so that no output of the vertex shader is unused.
  vec4 nothing = min(abs(colour + viewer + vec4(texels)), vec4(0.0));
  vec3 from = place.xyz + kWithin * edges.xyz;
  if (kPart != kShapes) from = before_face(what.x, kStartsBefore ? kWithin : -kWithin);
  pixel = nothing + seen_from(mesh_frame().instances[what.y].home.w, base.xyz, from);
}
