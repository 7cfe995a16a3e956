#version 460
#include "mesh.glsl"

layout(constant_id = 1) const bool kIsGlass = false;

layout(location = 0) centroid in vec4 colour;
layout(location = 0) out vec4 pixel;

void main() {
  // Between opaque corners is not always opaque: what is interpolated beyond a triangle's edge can be less.
  pixel = vec4(shown(colour.xyz), kIsGlass ? colour.w : 1.0);
}
