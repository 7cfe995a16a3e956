// The textures of materials on fields; matches TriplanarRule and triplanar_colour (scene/surfaces.h) on the CPU.
//
// `on_fields` of a type's six textured faces: `steep_y`, `flat_y`, the textures per voxel, then the fraction of this
// number in units of 2^-32 and 2^-64; the last is not used.

// A point of a field's surface, in voxels of the full grid.
struct FieldPoint {
  ivec3 voxel;
  vec3 inside;  // from there
  vec3 normal;  // unit
  float square_spacing;  // of the image's samples
};

// Returns the fraction of the product of a whole number and a number whose fraction is `scale`. Exact, so that textures
// keep their position far from the origin.
float fraction_of(int number, uvec2 scale) {
  uint high, low;
  umulExtended(uint(number), scale.y, high, low);
  if (number < 0) high -= scale.y;
  return float((uint(number) * scale.x + high) >> 8) * (1.0 / 16777216.0);
}

// Returns the weights of the textures along x, y and z.
vec3 triplanar_weights(vec3 normal, float steep_y, float flat_y) {
  float rise = clamp((abs(normal.y) - steep_y) / (flat_y - steep_y), 0.0, 1.0);
  float upper = rise * rise * (3.0 - 2.0 * rise);
  vec3 square = normal * normal;
  float x = square.x * square.x;
  float z = square.z * square.z;
  float share_of_x = x + z > 0.0 ? x / (x + z) : 0.5;
  return vec3((1.0 - upper) * share_of_x, upper, (1.0 - upper) * (1.0 - share_of_x));
}

// Shows the textures of a material at a point; does nothing if it has none.
void show_on_field(uint type, FieldPoint point, inout Surface surface) {
  uint number = textures_of(type);
  if (number == 0) return;
  TexturedFaces faces = TexturedFaces(frame().textured_faces);
  uint first = 6 * (number - 1);
  uint rule[5];
  for (int i = 0; i < 5; ++i) rule[i] = faces.at[first + i].on_fields;
  float scale = uintBitsToFloat(rule[2]);
  vec3 inside = point.inside * scale;
  for (int axis = 0; axis < 3; ++axis) inside[axis] += fraction_of(point.voxel[axis], uvec2(rule[3], rule[4]));
  inside = fract(inside);
  vec3 weights = triplanar_weights(point.normal, uintBitsToFloat(rule[0]), uintBitsToFloat(rule[1]));
  float square_spacing = point.square_spacing * scale * scale;
  surface.colour = surface.emitted = vec3(0.0);
  for (int axis = 0; axis < 3; ++axis) {
    if (!(weights[axis] > 0.0)) continue;
    uint side = first + 2 * axis + (point.normal[axis] < 0.0 ? 1 : 0);
    uvec4 what = faces.at[side].what;
    vec4 tint = faces.at[side].tint;
    vec3 colour = weights[axis] * tint.xyz * texel_of(what, inside, square_spacing);
    surface.colour += colour;
    surface.emitted += colour * tint.w;
  }
}
