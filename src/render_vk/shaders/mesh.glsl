// What the shaders of meshes read; src/render_vk/mesh_shader_data.h says the same to the compiler of the processor's
// side. Vectors are read as a whole: see docs/decisions/040.
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require

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
  vec4 clip[4];     // columns: clip space from there, in voxels
  vec4 axes[3];     // columns: the grid's axes in the world
  vec4 diffuse[2];  // by face
  vec4 eye;         // the camera, in voxels from there; orthographic: the direction towards it
  vec4 room;        // voxels per clip w by which faces are widened
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
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer Instances {
  Instance at[];
};
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer Draws {
  Draw at[];
};
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer Frame {
  vec4 right;  // a pixel to the right and down, and the picture's upper left corner, at a distance of 1
  vec4 down;
  vec4 corner;
  vec4 forward;
  vec4 sky_zenith;
  vec4 sky_horizon;
  vec4 sky_ground;
  vec4 sun;
  vec4 light;  // ambient, ambient without occlusion, what occlusion leaves of all
  uvec2 surfaces;   // three vectors each: colour and own share as glass, emitted, what passes
  uvec2 instances;
  uvec2 draws;
  uvec2 pad;
  uint last_surface;
  uint flags;
  float exposure;
  float ground_begins;
  float ground_is_full;
  float sky_scale;
};

layout(push_constant) uniform Push {
  uvec2 frame;
  uvec2 data;   // of the chunk
  vec3 offset;  // of the chunk, from where its instance is counted, in voxels
  uint instance;
  uvec2 order;  // not 0: which quad of which draw is next
  uint what;
  uint pad;
} push;

bool has(uint flag) {
  return (Frame(push.frame).flags & flag) != 0;
}

struct Surface {
  vec3 colour;
  float own;
  vec3 emitted;
  vec3 passed;
};

Surface surface_of(uint type) {
  Frame f = Frame(push.frame);
  uint at = 3 * min(type, f.last_surface);
  vec4 colour = Vectors(f.surfaces).at[at];
  vec4 emitted = Vectors(f.surfaces).at[at + 1];
  vec4 passed = Vectors(f.surfaces).at[at + 2];
  return Surface(colour.xyz, colour.w, emitted.xyz, passed.xyz);
}

// The reference model of light without shadows, before exposure: light/lighting.h. `diffuse`: max(n.l, 0).
vec3 lit_colour(vec3 colour, vec3 emitted, float diffuse, float openness) {
  if (!has(kLit)) return colour;
  vec4 share = Frame(push.frame).light;
  float light = share.x * openness + diffuse;
  if (!has(kHasOcclusion)) {
    light = share.y + diffuse;
  } else if (has(kAffectsAll)) {
    light = (share.x + diffuse) * (share.z + (1.0 - share.z) * openness);
  }
  return colour * light + emitted;
}

// What a fragment is to show of a colour, or of a value that is to be seen as it is.
vec3 shown(vec3 colour) {
  if (has(kShowOcclusion) || has(kShowNormals)) {
    vec3 value = clamp(colour, 0.0, 1.0);
    colour = mix(pow((value + 0.055) / 1.055, vec3(2.4)), value / 12.92, lessThanEqual(value, vec3(0.04045)));
  } else {
    colour *= Frame(push.frame).exposure;
  }
  if (push.what == kEdgesOnly) return vec3(0.02);
  if (push.what != kEdgesOver) return colour;
  // Edges stand out from dark and from bright surfaces.
  float luminance = dot(min(colour, vec3(1.0)), vec3(0.2126, 0.7152, 0.0722));
  return luminance > 0.12 ? vec3(0.004) : vec3(0.5);
}
