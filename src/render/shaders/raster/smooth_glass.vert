#version 460
// For smooth_glass.frag, which reads no materials.
#include "smooth_vertex.glsl"
