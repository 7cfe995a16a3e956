#version 460
#define WITH_MATERIALS
#include "smooth_vertex.glsl"
