#version 460
// The colour of a face of a blocky mesh: of a quad, or of a shape.
#include "mesh.glsl"
#include "blocky_colour.glsl"
