#version 460
// A vertex of a smooth mesh: seven words.
#include "mesh.glsl"

layout(location = 0) centroid out vec3 normal;  // in the world
layout(location = 1) centroid out vec4 albedo;  // w: openness
layout(location = 2) centroid out vec3 emitted;

invariant gl_Position;

// Source: Z. Cigolle et al., "A Survey of Efficient Representations for Independent Unit Vectors" (2014): octahedral.
vec3 unit_vector(uint word) {
  vec2 e = unpackSnorm2x16(word);
  vec3 v = vec3(e, 1.0 - abs(e.x) - abs(e.y));
  if (v.z < 0.0) v.xy = (1.0 - abs(v.yx)) * mix(vec2(-1.0), vec2(1.0), greaterThanEqual(v.xy, vec2(0.0)));
  return normalize(v);
}

void main() {
  Words words = Words(push.data);
  uint first = 7 * uint(gl_VertexIndex);
  vec3 local = vec3(uintBitsToFloat(words.at[first]), uintBitsToFloat(words.at[first + 1]),
                    uintBitsToFloat(words.at[first + 2]));
  precise vec3 point = (local + 0.5) + push.offset;
  gl_Position = push.clip[0] * point.x + push.clip[1] * point.y + push.clip[2] * point.z + push.clip[3];
  vec3 n = unit_vector(words.at[first + 3]);
  vec4 axes[3] = Frame(push.frame).instances[push.instance].axes;
  normal = axes[0].xyz * n.x + axes[1].xyz * n.y + axes[2].xyz * n.z;
  albedo = vec4(unpackUnorm2x16(words.at[first + 4]), unpackUnorm2x16(words.at[first + 5]));
  vec4 glow = Vectors(push.surfaces).at[surface_at(words.at[first + 6]) + 1];
  emitted = glow.xyz;
}
