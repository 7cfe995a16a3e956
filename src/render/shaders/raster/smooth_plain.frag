#version 460
// As smooth.frag, without rays.
#define PLAIN
#include "mesh.glsl"
#include "smooth_colour.glsl"
