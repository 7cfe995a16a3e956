// A fragment's point, lit by rays.

// The point to be lit: the arguments of `traced_light`, its position in front of the surface, and its own colours.
struct LitPoint {
  ivec4 voxel;
  ivec3 base;
  vec3 from;
  vec3 normal;
  float diffuse;
  vec3 colour;
  vec3 emitted;
  float openness;
  LevelPlace at;
};

vec3 colour_of(LitPoint point) {
  vec3 sunlight = vec3(0.0);
  if (has(kLit)) sunlight = traced_light(point.voxel, point.base, point.from, point.normal, point.diffuse,
                                             point.at);
  return colour_in_light(point.colour, point.emitted, sunlight, point.openness);
}

// Returns the direction from the camera through the fragment's pixel; in the world, unit.
vec3 seen_direction() {
  Frame f = frame();
  vec3 direction = f.forward.xyz;
  if (has(kPerspective)) direction += f.corner.xyz + f.right.xyz * gl_FragCoord.x + f.down.xyz * gl_FragCoord.y;
  return direction / length(direction);
}
