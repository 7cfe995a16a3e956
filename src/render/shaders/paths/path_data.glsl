// The inputs and outputs of path tracing. src/render/vulkan/paths/path_data.h has the same layout for the CPU.

// The data of a path-traced image: PathOptions and tables. Addresses of absent tables are 0.
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer PathFrame {
  vec4 to_sun;    // w: 1 minus the cosine of half its disc's angle; 0: no disc
  vec4 sunlight;  // irradiance of a surface that faces it; w: 1 if the camera sees its disc
  vec4 sky;       // of SkyModel::Uniform; w: factor for the light of other skies
  vec4 background;    // w: 1 if there is one
  vec4 ground;        // its colour; w: its height in view
  vec4 fog;           // its colour; w: its top in view
  vec4 lens_right;    // of the camera; w: the lens's radius
  vec4 lens_up;       // w: the distance in focus
  vec4 environment;   // sine and cosine of its rotation; z: the ground's fade
  vec4 air;           // fog: density, anisotropy; lamps' brightness
  uvec2 sky_pixels;   // of the octahedron, or of the environment: 3 floats each
  uvec2 sky_rows;     // sums
  uvec2 sky_columns;
  uvec2 gloss;        // pairs
  uvec2 lamps;        // PathLamp
  uvec2 lamp_nodes;   // LampNode
  uvec2 lamp_ways;
  uvec2 face_keys;    // ivec4
  uvec2 face_lamps;   // int
  uvec2 states;       // PathState, of a tile
  uvec2 sums;         // of the image: kSums or kSumsWithLayers vectors per pixel
  uvec2 parts;        // kParts per pixel; 0: not requested
  int sky_model;
  int sky_width;
  int sky_height;
  uint face_mask;
  uint lamp_count;
  int max_bounces;
  int max_scatterings;
  uint seed;
  int lens_blades;
  float lens_turn;    // in turns, 0 to 1
  uint flags;
  uint sum_pitch;     // vectors per pixel
};

const uint kPathGround = 1;
const uint kPathOnlyShadows = 2;
const uint kPathFog = 4;
const uint kPathLayers = 8;
const uint kPathMedia = 16;
const uint kPathUneven = 32;  // the sky is sampled by itself
const uint kPathSun = 64;

const int kSkyPhysical = 2;
const int kSkyGradient = 1;
const int kSkyUniform = 3;
const int kSkyImage = 4;

struct PathLamp {
  vec4 corner;  // in view; w: the reach of a lamp without a body, else 0
  vec4 u;       // unit; w: size
  vec4 v;
  vec4 normal;    // w: cosine of a spot's inner angle; below kOnlySampled: a side of a shape
  vec4 radiance;  // w: cosine of its outer angle; of a face with a texture: the mean
  uvec4 texels;   // of a face with a texture, as in TexturedFace; w: how to turn its voxels back (turned_cube), and
                  // from bit 16 on the face in the grid. z is 0 without a texture
  vec4 light_of_texel;  // radiance as a multiple of the texel's colour; w: world units per voxel. Of a side of a shape,
                        // x: PathLamp::far_boost
};
struct LampNode {
  vec4 low;   // in view; w: power
  vec4 high;  // w: cosine of the spread
  vec4 axis;  // w: cosine of the edge
  ivec4 next;  // the second child, or -1; the lamp, or -1
};
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer PathLampTable {
  PathLamp at[];
};
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer LampNodes {
  LampNode at[];
};
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer Keys {
  ivec4 at[];
};

// A path between two steps.
struct PathState {
  ivec4 voxel;      // start of its next ray, in an instance's tree; w: the instance, -1: `inside` is in view
  vec4 inside;      // from the voxel's lower corner; w: density of the sampled direction
  vec4 direction;   // in the world, unit; w: random number for glass ahead on this ray; -1: a new one
  vec4 throughput;  // w: glass bodies from this t on are still to be found
  vec4 radiance;
  vec4 normal;      // in the world, at the last scattering
  uvec4 counts;     // sample, dimension, bounces | scatterings << 16, flags
  uvec4 more;       // the glass type around the path, the part of the pixel's surfaces; zw: unused
};
layout(buffer_reference, std430, buffer_reference_align = 16) buffer PathStates {
  PathState at[];
};

const uint kIsSeen = 1;    // by the camera, directly or through glass and mirrors
const uint kIsFirst = 2;   // no surface has been hit yet
const uint kIsCaught = 4;  // it passed shadow-catching ground
const uint kIsNoted = 8;   // recorded in the layers
const uint kIsAlive = 16;

// The sums over a pixel's samples.
const uint kSumBackground = 0;  // w: share of the scene
const uint kSumScene = 1;       // w: share of shadow-catching ground
const uint kSumCaught = 2;      // w: depth
const uint kSumLit = 3;         // w: type
const uint kSumOpen = 4;        // w: instance
const uint kSumAlbedo = 5;
const uint kSumNormal = 6;

const uint kNoPart = 255;
const uint kParts = 3;
const uint kSkySurface = 4;
const uint kGroundSurface = 2;

// SurfacePart of render/path/denoise.h.
struct Part {
  uint surface;
  float samples;
  float square;
  float light[3];
  float albedo[3];
  float normal[3];
  float place[3];
};
layout(buffer_reference, std430, buffer_reference_align = 4) buffer Parts {
  Part at[];
};

layout(push_constant) uniform Push {
  uvec2 frame_address;
  ivec2 corner;  // of the tile, in pixels
  ivec2 size;    // of the tile
  uint first;    // sample
  uint count;    // of samples
  uint begins;   // 1: new paths begin; 0: paths continue
  uint width;    // of the image
} push;

#include "tile.glsl"

PathFrame path_frame() {
  return PathFrame(frame().paths);
}
bool has_path(uint flag) {
  return (path_frame().flags & flag) != 0;
}
uint place_of_pixel() {
  ivec2 pixel = push.corner + tile_pixel();
  return uint(pixel.y) * push.width + uint(pixel.x);
}
