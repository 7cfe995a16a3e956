// What the shaders of meshes read; src/render_vk/raster/mesh_shader_data.h says the same to the compiler of the processor's
// side. Vectors are read as a whole: see docs/decisions/040.
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require
#include "srgb.glsl"

const uint kLit = 1;
const uint kHasOcclusion = 2;
const uint kAffectsAll = 4;
const uint kShowOcclusion = 8;
const uint kShowNormals = 16;

// What is drawn: surfaces, the edges of their triangles, or one channel of what is transparent.
const uint kSurfaces = 0;
const uint kEdgesOver = 1;
const uint kEdgesOnly = 2;
const uint kGlass = 3;  // and the channel

// An instance, from a point of its grid that is not far from the camera. A grid's axes are unit in the world.
struct Instance {
  vec4 clip[4];   // columns: clip space from there, in voxels
  vec4 axes[3];   // columns: the grid's axes in the world
  vec4 eye;       // the camera, in voxels from there, and 1; orthographic: the direction towards it, and 0
  vec2 light[6];  // of a face that is not open at all, and what openness adds
  float room;     // voxels per clip w by which faces are widened
  float pad[3];
};

struct Draw {
  uvec2 data;
  uint instance;
  uint pad;
  vec4 offset;
};

layout(buffer_reference, std430, buffer_reference_align = 4) readonly buffer Words {
  uint at[];
};
layout(buffer_reference, std430, buffer_reference_align = 8) readonly buffer Pairs {
  uvec2 at[];
};
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer Vectors {
  vec4 at[];
};
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer Draws {
  Draw at[];
};
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer Frame {
  vec4 sky_zenith;
  vec4 sky_horizon;
  vec4 sky_ground;
  vec4 sun;
  vec4 light;  // ambient, ambient without occlusion, what occlusion leaves of all
  uvec2 draws;
  uvec2 order;  // which quad of which draw is next, of what is transparent
  float exposure;
  float ground_begins;
  float ground_is_full;
  float pad;
  Instance instances[];
};

// What is the same for many vertices is here rather than in memory, all that Vulkan has room for everywhere.
layout(push_constant) uniform Push {
  vec4 clip[4];  // of the instance; the sky's: right, down, corner and forward, as CameraRays has them
  vec4 eye;      // of the instance
  vec3 offset;   // of the chunk, from where its instance is counted, in voxels
  uint instance;
  uvec2 frame;
  uvec2 data;      // of the chunk
  uvec2 surfaces;  // three vectors each: colour and own share as glass, emitted, what passes
  float room;      // of the instance; the sky's: turns the way from the picture's middle into the tangent of an angle
  uint numbers;    // bits 0-3 what is drawn, 4-11 flags, from 12 the last surface
} push;

uint drawn() {
  return push.numbers & 15;
}
bool has(uint flag) {
  return (push.numbers >> 4 & flag) != 0;
}
uint surface_at(uint type) {
  return 3 * min(type, push.numbers >> 12);
}

// What a fragment is to show of a colour, or of a value that is to be seen as it is.
vec3 shown(vec3 colour) {
  if (has(kShowOcclusion) || has(kShowNormals)) {
    colour = linear_from_srgb(clamp(colour, 0.0, 1.0));
  } else {
    colour *= Frame(push.frame).exposure;
  }
  if (drawn() == kEdgesOnly) return vec3(0.02);
  if (drawn() != kEdgesOver) return colour;
  // Edges stand out from dark and from bright surfaces.
  float luminance = dot(min(colour, vec3(1.0)), vec3(0.2126, 0.7152, 0.0722));
  return luminance > 0.03 ? vec3(0.002) : vec3(0.2);
}
