#version 460
// Swaps red and blue in an image's words, for images with blue first.
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require

layout(local_size_x = 256) in;

layout(buffer_reference, std430, buffer_reference_align = 4) readonly buffer From {
  uint at[];
};
layout(buffer_reference, std430, buffer_reference_align = 4) writeonly buffer To {
  uint at[];
};
layout(push_constant) uniform Push {
  uvec2 from;
  uvec2 to;
  uint pixels;
  uint across;  // pixels in a row of workgroups
} push;

void main() {
  uint pixel = gl_GlobalInvocationID.y * push.across + gl_GlobalInvocationID.x;
  if (pixel >= push.pixels) return;
  uint word = From(push.from).at[pixel];
  To(push.to).at[pixel] = word & 0xFF00FF00u | word >> 16 & 0xFFu | (word & 0xFFu) << 16;
}
