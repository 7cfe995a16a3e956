// Shared by the shaders that compute a tile of an image with one invocation per pixel.
#include "data.glsl"

layout(push_constant) uniform Push {
  uvec2 frame_address;
  ivec2 corner;     // of the tile, in pixels
  ivec2 size;       // of the tile
  vec2 point;       // of the sample, within pixels
  vec2 point_low;   // its rounding error
  vec2 turn;        // of the sample: cosine and sine of the rotation of nine fixed occlusion directions
  vec3 upright;     // the first of these directions, along u, v and the normal
  uint seed;        // of the sample
  uint first;       // 1: of the pixel's samples
  uint round;       // of the sample
  uint base;        // of the tile's first pixel in sums and colours, and the distance of two rows there
  uint pitch;
  uint far_first;   // the tile's part of the impostor list, and the number of workgroups that draw it
  uint far_count;
  uint far_groups;
  uint sample_number;
  uint pad;
} push;

#include "tile.glsl"

// Returns the pixel's index in the assembled image.
uint place_of_pixel() {
  return push.base + gl_GlobalInvocationID.y * push.pitch + gl_GlobalInvocationID.x;
}
