#version 460
#include "mesh.glsl"
#include "sky.glsl"

layout(location = 0) out vec4 pixel;

void main() {
  Frame f = Frame(push.frame);
  vec4 right = f.right;
  vec4 down = f.down;
  vec4 corner = f.corner;
  vec4 forward = f.forward;
  vec3 across = corner.xyz + right.xyz * gl_FragCoord.x + down.xyz * gl_FragCoord.y;
  vec3 direction = forward.xyz + across * f.sky_scale;
  vec4 zenith = f.sky_zenith;
  vec4 horizon = f.sky_horizon;
  vec4 ground = f.sky_ground;
  Sky sky = Sky(zenith.xyz, horizon.xyz, ground.xyz, f.ground_begins, f.ground_is_full);
  pixel = vec4(sky_colour(sky, direction.y / length(direction)), 1.0);
}
