#version 460
// One triangle over the whole image, behind everything.
#include "mesh.glsl"

layout(location = 0) flat out vec4 zenith;  // w: height where the ground begins
layout(location = 1) flat out vec4 horizon;
layout(location = 2) flat out vec4 ground;  // w: height where it is fully visible

void main() {
  Frame f = frame();
  gl_Position = vec4(gl_VertexIndex == 1 ? 3.0 : -1.0, gl_VertexIndex == 2 ? 3.0 : -1.0, 0.0, 1.0);
  zenith = f.sky_zenith;
  horizon = f.sky_horizon;
  ground = f.sky_ground;
  zenith.w = f.ground_begins;
  ground.w = f.ground_is_full;
}
