// The backdrop; matches render/light/light_model.h on the CPU.

struct Sky {
  vec3 zenith;
  vec3 horizon;
  vec3 ground;
  float ground_begins;
  float ground_is_full;
};

// Returns the sky's colour. `up`: the y of a unit direction.
vec3 sky_colour(Sky sky, float up) {
  float y = clamp(up, -1.0, 1.0);
  if (y >= 0.0) {
    float low = (1.0 - y) * (1.0 - y);
    return sky.zenith + (sky.horizon - sky.zenith) * (low * (1.0 - 0.5 * y));
  }
  float s = clamp((sky.ground_begins - y) / (sky.ground_begins - sky.ground_is_full), 0.0, 1.0);
  return sky.horizon + (sky.ground - sky.horizon) * (s * s * (3.0 - 2.0 * s));
}
// Returns the sky's image colour at a height.
vec3 sky_colour(float up) {
  Frame f = frame();
  return sky_colour(Sky(f.sky_zenith.xyz, f.sky_horizon.xyz, f.sky_ground.xyz, f.ground_begins, f.ground_is_full), up);
}
