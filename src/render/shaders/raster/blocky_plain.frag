#version 460
// As blocky.frag, without rays.
#define PLAIN
#include "mesh.glsl"
#include "blocky_colour.glsl"
