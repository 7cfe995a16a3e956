#version 460
#include "mesh.glsl"
#include "sky.glsl"

layout(location = 0) flat in vec4 zenith;
layout(location = 1) flat in vec4 horizon;
layout(location = 2) flat in vec4 ground;
layout(location = 0) out vec4 pixel;

void main() {
  vec3 across = push.clip[2].xyz + push.clip[0].xyz * gl_FragCoord.x + push.clip[1].xyz * gl_FragCoord.y;
  vec3 direction = push.clip[3].xyz + across * push.room;
  Sky sky = Sky(zenith.xyz, horizon.xyz, ground.xyz, zenith.w, ground.w);
  pixel = vec4(sky_colour(sky, direction.y / length(direction)), 1.0);
}
