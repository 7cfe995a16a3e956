#version 460
#include "mesh.glsl"
#include "sky.glsl"

layout(location = 0) out vec4 pixel;

void main() {
  Frame f = Frame(push.frame);
  vec3 across = push.clip[2].xyz + push.clip[0].xyz * gl_FragCoord.x + push.clip[1].xyz * gl_FragCoord.y;
  vec3 direction = push.clip[3].xyz + across * push.room;
  vec4 zenith = f.sky_zenith;
  vec4 horizon = f.sky_horizon;
  vec4 ground = f.sky_ground;
  Sky sky = Sky(zenith.xyz, horizon.xyz, ground.xyz, f.ground_begins, f.ground_is_full);
  pixel = vec4(sky_colour(sky, direction.y / length(direction)), 1.0);
}
