#version 460
// Colour times the font's opacity, interpolated between font pixels.
#include "window.glsl"

layout(location = 0) in vec2 place;
layout(location = 1) in vec4 tint;
layout(location = 0) out vec4 colour;

float opacity(ivec2 at) {
  ivec2 inside = clamp(at, ivec2(0), push.source - 1);
  uint index = uint(inside.y * push.source.x + inside.x);
  return unpacked(Words(push.font).at[index >> 2])[index & 3];
}

void main() {
  vec2 at = place * vec2(push.source) - 0.5;
  vec2 low = floor(at);
  vec2 share = at - low;
  ivec2 corner = ivec2(low);
  float above = mix(opacity(corner), opacity(corner + ivec2(1, 0)), share.x);
  float below = mix(opacity(corner + ivec2(0, 1)), opacity(corner + ivec2(1, 1)), share.x);
  colour = vec4(tint.rgb, tint.a * mix(above, below, share.y));
}
