#version 460
// A corner of a blocky mesh's quad: reads the eight bytes of mesh/quad.h and derives the rest.
#include "quad.glsl"

// true: quads of many chunks, in the order stored in memory; false: one chunk's quads.
layout(constant_id = 0) const bool kIsOrdered = false;

// Read once per corner, since reading them per fragment would take most of the time of an image.
layout(location = 5) flat out uvec4 texels;  // of the textured face; w: its number, from 1; 0: the face has no texture
layout(location = 6) flat out vec4 viewer;   // the camera, in voxels from `base`; w: the distance of samples, as in
                                             // MeshInstance, negative for an orthographic camera

void put_texture(uint face, uint type, uint instance) {
  texels = uvec4(0);
  viewer = vec4(0.0);
  if (!kHasTextures) return;
  uint number = textures_of(type);
  if (number == 0) return;
  uvec4 of_face = TexturedFaces(frame().textured_faces).at[6 * (number - 1) + face].what;
  texels = uvec4(of_face.xyz, 6 * (number - 1) + face + 1);
  vec4 axis = mesh_frame().instances[instance].axes[0];
  vec4 eye = mesh_frame().instances[instance].eye;
  ivec4 home = mesh_frame().instances[instance].home;
  viewer = vec4(eye.xyz - vec3(base.xyz - home.xyz), eye.w != 0.0 ? axis.w : -axis.w);
}

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
    texels = uvec4(0);
    viewer = vec4(0.0);
    return;
  }
  ivec4 home = mesh_frame().instances[placed].home;
  put_face(face, bits.y >> 10 & 0xFFFF, placed, local + widened, low, high, home.xyz + ivec3(offset),
           openness_of(bits.x >> 30 | (bits.y & 63) << 2, corner));
  put_texture(face, bits.y >> 10 & 0xFFFF, placed);
}
