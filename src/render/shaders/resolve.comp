#version 460
// Converts the samples' mean to sRGB bytes, rounded exactly: the byte is the number of thresholds that the light
// reaches.
#include "compute.glsl"

uint encoded(float light) {
  Floats thresholds = Floats(frame().thresholds);
  uint byte = 0;
  for (uint step = 128; step > 0; step >>= 1) {
    if (light >= thresholds.at[byte + step]) byte += step;
  }
  return byte;
}

void main() {
  if (!is_in_tile()) return;
  uint place = place_of_pixel();
  vec3 mean = Sums(frame().sums).at[place].xyz / frame().samples;
  uint rgb = encoded(mean.x) | encoded(mean.y) << 8 | encoded(mean.z) << 16;
  Words32(frame().colours).at[place] = rgb | 0xFF000000u;
}
