#version 460
#include "mesh.glsl"

layout(location = 0) centroid in vec4 colour;
layout(location = 0) out vec4 pixel;

void main() {
  pixel = vec4(shown(colour.xyz), colour.w);
}
