#version 460
// A corner of a quad of a blocky mesh: eight bytes of mesh/quad.h are read, the rest is made here.
#include "mesh.glsl"

const int kFaceU[6] = {1, 2, 2, 0, 0, 1};
const int kFaceV[6] = {2, 1, 0, 2, 1, 0};

layout(location = 0) centroid out vec4 colour;  // w: what is hidden of what lies behind, of the channel that is drawn

invariant gl_Position;

vec4 clip_from(Instance instance, vec3 point) {
  return instance.clip[0] * point.x + instance.clip[1] * point.y + instance.clip[2] * point.z + instance.clip[3];
}

void main() {
  Frame f = Frame(push.frame);
  uint index = uint(gl_VertexIndex);
  uint number = index >> 2;
  uvec2 data = push.data;
  uint placed = push.instance;
  vec3 offset = push.offset;
  if (push.order != uvec2(0)) {
    uvec2 next = Pairs(push.order).at[number];
    Draw of = Draws(f.draws).at[next.x];
    data = of.data;
    placed = of.instance;
    offset = of.offset.xyz;
    number = next.y;
  }
  uvec2 bits = Pairs(data).at[number];
  Instance instance = Instances(f.instances).at[placed];

  uint levels = bits.x >> 30 | (bits.y & 63) << 2;
  uint face = bits.y >> 7 & 7;
  // The corners of a flipped quad are counted from the next one, which turns the diagonal.
  uint corner = ((index & 3) + (bits.y >> 6 & 1)) & 3;
  bool is_east = corner == 1 || corner == 2;
  bool is_north = corner >= 2;
  int axis = int(face >> 1);
  int u = kFaceU[face];
  int v = kFaceV[face];
  float side = (face & 1) == 0 ? 1.0 : -1.0;
  vec3 local = vec3(bits.x & 63, bits.x >> 6 & 63, bits.x >> 12 & 63);
  if ((face & 1) == 0) local[axis] += 1.0;
  if (is_east) local[u] += float((bits.x >> 18 & 63) + 1);
  if (is_north) local[v] += float((bits.x >> 24 & 63) + 1);
  // Whole numbers: neighbouring chunks have the same corners to the bit.
  precise vec3 point = local + offset;

  vec4 eye = instance.eye;
  vec3 to_eye = eye.w != 0.0 ? eye.xyz - point : eye.xyz;
  float facing = side * to_eye[axis];
  if (facing <= 0.0 && push.what != kEdgesOnly) {
    gl_Position = vec4(2.0, 2.0, 0.0, 1.0);
    colour = vec4(0.0);
    return;
  }
  // Quads are widened, in their planes, by less than a device can tell places apart: where the edge of one meets the
  // corners of others, rounding would leave gaps.
  vec4 at = clip_from(instance, point);
  vec3 direction = to_eye / length(to_eye);
  float room = instance.room.x * max(at.w, 0.0) / max(abs(direction[axis]), 0.0625);
  float room_u = room * sqrt(max(1.0 - direction[v] * direction[v], 0.0));
  float room_v = room * sqrt(max(1.0 - direction[u] * direction[u], 0.0));
  point[u] += is_east ? room_u : -room_u;
  point[v] += is_north ? room_v : -room_v;
  gl_Position = clip_from(instance, point);

  float openness = 1.0 - float(levels >> 2 * corner & 3) / 3.0;
  Surface surface = surface_of(bits.y >> 10 & 0xFFFF);
  if (has(kShowOcclusion)) {
    colour = vec4(vec3(openness), 1.0);
  } else if (has(kShowNormals)) {
    colour = vec4(0.5 + 0.5 * side * instance.axes[axis].xyz, 1.0);
  } else {
    float diffuse = face < 4 ? instance.diffuse[0][face] : instance.diffuse[1][face - 4];
    vec3 lit = lit_colour(surface.colour, surface.emitted, diffuse, openness);
    bool is_glass = push.what >= kGlass;
    colour = is_glass ? vec4(surface.own * lit, 1.0 - surface.passed[push.what - kGlass]) : vec4(lit, 1.0);
  }
}
