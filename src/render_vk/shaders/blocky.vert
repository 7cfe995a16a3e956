#version 460
// A corner of a quad of a blocky mesh: eight bytes of mesh/quad.h are read, the rest is made here.
#include "mesh.glsl"

const int kFaceU[6] = {1, 2, 2, 0, 0, 1};
const int kFaceV[6] = {2, 1, 0, 2, 1, 0};

layout(location = 0) centroid out vec4 colour;  // w: what is hidden of what lies behind, of the channel that is drawn

// The quads are those of many chunks, in the order that memory says, rather than one chunk's.
layout(constant_id = 0) const bool kIsOrdered = false;
layout(constant_id = 1) const bool kIsGlass = false;

invariant gl_Position;

vec4 clip_from(vec4 clip[4], vec3 point) {
  return clip[0] * point.x + clip[1] * point.y + clip[2] * point.z + clip[3];
}

// The colour or value of a corner.
vec4 colour_of(uint type, uint face, float openness, uint placed) {
  Frame f = Frame(push.frame);
  if (has(kShowOcclusion)) return vec4(vec3(openness), 1.0);
  if (has(kShowNormals)) {
    vec4 axis = f.instances[placed].axes[face >> 1];
    return vec4(0.5 + ((face & 1) == 0 ? 0.5 : -0.5) * axis.xyz, 1.0);
  }
  uint at = surface_at(type);
  vec4 surface = Vectors(push.surfaces).at[at];
  vec4 emitted = Vectors(push.surfaces).at[at + 1];
  vec2 light = f.instances[placed].light[face];
  vec3 lit = surface.xyz * (light.x + light.y * openness);
  if (has(kLit)) lit += emitted.xyz;
  if (!kIsGlass) return vec4(lit, 1.0);
  vec4 passed = Vectors(push.surfaces).at[at + 2];
  return vec4(surface.w * lit, 1.0 - passed[drawn() - kGlass]);
}

void main() {
  uint index = uint(gl_VertexIndex);
  uint number = index >> 2;
  uvec2 data = push.data;
  uint placed = push.instance;
  vec3 offset = push.offset;
  vec4 clip[4] = push.clip;
  vec4 eye = push.eye;
  float room = push.room;
  if (kIsOrdered) {
    Frame f = Frame(push.frame);
    uvec2 next = Pairs(f.order).at[number];
    Draw of = Draws(f.draws).at[next.x];
    data = of.data;
    placed = of.instance;
    offset = of.offset.xyz;
    number = next.y;
    clip = f.instances[placed].clip;
    eye = f.instances[placed].eye;
    room = f.instances[placed].room;
  }
  uvec2 bits = Pairs(data).at[number];

  uint corners = bits.x >> 30 | (bits.y & 63) << 2;
  uint face = bits.y >> 7 & 7;
  // The corners of a flipped quad are counted from the next one, which turns the diagonal.
  uint corner = ((index & 3) + (bits.y >> 6 & 1)) & 3;
  bool is_east = corner == 1 || corner == 2;
  bool is_north = corner >= 2;
  int axis = int(face >> 1);
  int u = kFaceU[face];
  int v = kFaceV[face];
  vec3 local = vec3(bits.x & 63, bits.x >> 6 & 63, bits.x >> 12 & 63);
  if ((face & 1) == 0) local[axis] += 1.0;
  if (is_east) local[u] += float((bits.x >> 18 & 63) + 1);
  if (is_north) local[v] += float((bits.x >> 24 & 63) + 1);
  // Whole numbers: neighbouring chunks have the same corners to the bit.
  precise vec3 point = local + offset;

  vec3 to_eye = eye.w != 0.0 ? eye.xyz - point : eye.xyz;
  float facing = (face & 1) == 0 ? to_eye[axis] : -to_eye[axis];
  if (facing <= 0.0 && drawn() != kEdgesOnly) {
    gl_Position = vec4(2.0, 2.0, 0.0, 1.0);
    colour = vec4(0.0);
    return;
  }
  // Quads are widened, in their planes, by less than a device can tell places apart: where the edge of one meets the
  // corners of others, rounding would leave gaps.
  vec4 at = clip_from(clip, point);
  vec3 direction = to_eye / length(to_eye);
  float wide = room * max(at.w, 0.0) / max(abs(direction[axis]), 0.0625);
  float wide_u = wide * sqrt(max(1.0 - direction[v] * direction[v], 0.0));
  float wide_v = wide * sqrt(max(1.0 - direction[u] * direction[u], 0.0));
  point[u] += is_east ? wide_u : -wide_u;
  point[v] += is_north ? wide_v : -wide_v;
  gl_Position = clip_from(clip, point);
  colour = colour_of(bits.y >> 10 & 0xFFFF, face, 1.0 - float(corners >> 2 * corner & 3) / 3.0, placed);
}
