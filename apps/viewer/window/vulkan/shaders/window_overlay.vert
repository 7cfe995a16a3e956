#version 460
// The vertices of an overlay, five words each.
#include "window.glsl"

layout(location = 0) out vec2 place;
layout(location = 1) out vec4 tint;

void main() {
  Words corners = Words(push.corners);
  uint first = uint(gl_VertexIndex) * 5;
  vec2 at = vec2(uintBitsToFloat(corners.at[first]), uintBitsToFloat(corners.at[first + 1]));
  place = vec2(uintBitsToFloat(corners.at[first + 2]), uintBitsToFloat(corners.at[first + 3]));
  tint = unpacked(corners.at[first + 4]);
  gl_Position = vec4(2.0 * at / push.window - 1.0, 0.0, 1.0);
}
