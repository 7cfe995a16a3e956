#version 460
// The bytes of an image, unchanged or stretched.
#include "window.glsl"

layout(binding = 0) uniform sampler2D image;
layout(location = 0) out vec4 colour;

vec3 pixel(ivec2 at) {
  ivec2 inside = clamp(at, ivec2(0), push.source - 1);
  return texelFetch(image, inside, 0).rgb;
}

void main() {
  vec2 at = (gl_FragCoord.xy - push.origin) * push.scale;
  if (push.scale == vec2(1.0)) {
    colour = vec4(pixel(ivec2(floor(at))), 1.0);
    return;
  }
  vec2 low = floor(at - 0.5);
  vec2 share = at - 0.5 - low;
  ivec2 corner = ivec2(low);
  vec3 above = mix(pixel(corner), pixel(corner + ivec2(1, 0)), share.x);
  vec3 below = mix(pixel(corner + ivec2(0, 1)), pixel(corner + ivec2(1, 1)), share.x);
  colour = vec4(mix(above, below, share.y), 1.0);
}
