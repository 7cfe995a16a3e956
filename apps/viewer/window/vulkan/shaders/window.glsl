// What the shaders of a window read: window_pipelines.h says the same.
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require

layout(buffer_reference, std430, buffer_reference_align = 4) readonly buffer Words {
  uint at[];
};

layout(push_constant) uniform Push {
  uvec2 corners; // the overlay's
  uvec2 font;    // its opacity, four pixels a word
  ivec2 source;  // the size of the picture, or of the font's
  vec2 origin;   // of the picture in the window
  vec2 scale;    // pixels of the picture a pixel of the window
  vec2 window;   // its size
} push;

// Bytes as they are, red the lowest.
vec4 unpacked(uint word) {
  return unpackUnorm4x8(word);
}
