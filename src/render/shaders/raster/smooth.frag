#version 460
// The colour of a point of a smooth mesh.
#include "mesh.glsl"
#include "smooth_colour.glsl"
