#version 460
// A vertex of a smooth mesh: seven words.
#include "mesh.glsl"

layout(location = 0) centroid out vec3 normal;  // in the grid
layout(location = 1) centroid out vec4 albedo;  // w: openness
layout(location = 2) centroid out vec3 emitted;
layout(location = 3) centroid out vec3 place;  // in voxels, from `base`
layout(location = 4) flat out ivec4 base;      // in the tree's coordinates; w: the type

invariant gl_Position;

void main() {
  Numbers words = Numbers(push.data);
  uint first = 7 * uint(gl_VertexIndex);
  place = vec3(uintBitsToFloat(words.at[first]), uintBitsToFloat(words.at[first + 1]),
               uintBitsToFloat(words.at[first + 2])) + mesh_frame().instances[push.instance].first_sample;
  precise vec3 point = place + push.offset;
  gl_Position = clip_from(push.clip, point);
  normal = unit_vector(words.at[first + 3]);
  albedo = vec4(unpackUnorm2x16(words.at[first + 4]), unpackUnorm2x16(words.at[first + 5]));
  uint type = words.at[first + 6];
  vec4 glow = Vectors(frame().surfaces).at[3 * min(type, frame().last_surface) + 1];
  emitted = min(glow.xyz, vec3(1e15));
  ivec4 home = mesh_frame().instances[push.instance].home;
  base = ivec4(home.xyz + ivec3(push.offset), int(type));
}
