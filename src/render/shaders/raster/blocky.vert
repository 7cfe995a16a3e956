#version 460
// A corner of a blocky mesh's quad: reads the eight bytes of mesh/quad.h and derives the rest.
#include "quad.glsl"

// true: quads of many chunks, in the order stored in memory; false: one chunk's quads.
layout(constant_id = 0) const bool kIsOrdered = false;

void main() {
  uint index = uint(gl_VertexIndex);
  uint number = index >> 2;
  uvec2 data = push.data;
  uint placed = push.instance;
  vec3 offset = push.offset;
  Seen seen = Seen(push.clip, push.eye, push.room);
  if (kIsOrdered) {
    uvec2 next = Words(mesh_frame().order).at[number];
    MeshDraw of = MeshDraws(mesh_frame().draws).at[next.x];
    data = of.data;
    placed = of.instance;
    vec4 of_offset = of.offset;
    offset = of_offset.xyz;
    number = next.y;
    seen.clip = mesh_frame().instances[placed].clip;
    seen.eye = mesh_frame().instances[placed].eye;
    seen.room = mesh_frame().instances[placed].room;
  }
  uvec2 bits = Words(data).at[number];

  uint face = bits.y >> 7 & 7;
  // The corners of a flipped quad are numbered from the next corner, which flips the diagonal.
  uint corner = ((index & 3) + (bits.y >> 6 & 1)) & 3;
  bool is_east = corner == 1 || corner == 2;
  bool is_north = corner >= 2;
  int u = kFaceU[face];
  int v = kFaceV[face];
  vec3 low = vec3(bits.x & 63, bits.x >> 6 & 63, bits.x >> 12 & 63);
  if ((face & 1) == 0) low[axis_of(face)] += 1.0;
  vec3 high = low;
  high[u] += float((bits.x >> 18 & 63) + 1);
  high[v] += float((bits.x >> 24 & 63) + 1);
  vec3 local = low;
  if (is_east) local[u] = high[u];
  if (is_north) local[v] = high[v];
  // Integers: the corners of neighbouring chunks are bit-identical.
  precise vec3 point = local + offset;
  vec3 widened;
  if (!put_corner(seen, face, point, is_east, is_north, widened)) {
    hide_corner();
    return;
  }
  ivec4 home = mesh_frame().instances[placed].home;
  put_face(face, bits.y >> 10 & 0xFFFF, placed, local + widened, low, high, home.xyz + ivec3(offset),
           openness_of(bits.x >> 30 | (bits.y & 63) << 2, corner));
}
