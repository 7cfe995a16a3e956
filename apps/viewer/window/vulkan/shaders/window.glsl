// Data read by the window's shaders; window_pipelines.h mirrors it.
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require

layout(buffer_reference, std430, buffer_reference_align = 4) readonly buffer Words {
  uint at[];
};

layout(push_constant) uniform Push {
  uvec2 corners; // the overlay's
  uvec2 font;    // its opacity, four pixels per word
  ivec2 source;  // the size of the image, or of the font image
  vec2 origin;   // of the image in the window
  vec2 scale;    // image pixels per window pixel
  vec2 window;   // its size
} push;

// Unpacks unchanged bytes, red the lowest.
vec4 unpacked(uint word) {
  return unpackUnorm4x8(word);
}
