// The textures of types; matches scene/surfaces.h on the CPU. The including file defines `Surface` before.

// True if any type has textures; otherwise shaders are compiled without them.
layout(constant_id = 7) const bool kHasTextures = false;

const float kMeanOfFace = 1e30;

// Returns a type's entry in the table of texture numbers.
uint texture_entry(uint type) {
  return Numbers(frame().texture_numbers).at[min(type, frame().last_surface)];
}

// Returns the mean colour of a type's shapes, which cells of halved grids show; negative if it has none. w: the
// emission of the type.
vec4 mean_of_shapes(uint type) {
  return Vectors(frame().shape_means).at[2 * min(type, frame().last_surface)];
}
// Returns the share of the type's emission that these cells have.
float emission_share_of_shapes(uint type) {
  return Vectors(frame().shape_means).at[2 * min(type, frame().last_surface) + 1].x;
}

// Returns the number of a type's textured faces, from 1; 0 if it has none.
uint textures_of(uint type) {
  return texture_entry(type) & kTextureNumber;
}

// Returns the mipmap level of a texture of 2^last texels per side: log2 of the texels between samples, rounded. That is
// half the exponent of twice their square, plus the texture's own size. `square_spacing`: the square of the samples'
// distance, in sides of the texture.
int mipmap_level(float square_spacing, int last) {
  int exponent = int(floatBitsToUint(2.0 * square_spacing) >> 23) - 127;
  return clamp((exponent >> 1) + last, 0, last);
}

// Returns the colour of the nearest texel, without tint, in the mipmap level that fits the distance of samples; matches
// render/light/lighting.h on the CPU. `record`: of a textured face. `inside`: the position in the voxel.
// `square_spacing`: the square of the distance of samples there, in voxels; kMeanOfFace: the mean of the texture.
vec3 texel_of(uvec4 record, vec3 inside, float square_spacing) {
  int last = int(record.z & 15);
  uint log_size = uint(last - mipmap_level(square_spacing, last));
  uint texel = texel_at(record, inside, log_size);
  return linear_from_srgb(unpackUnorm4x8(texel).xyz);
}

// Sets the colours of a surface with a texture. `tint`: of the textured face.
void set_texel(vec3 texel, vec4 tint, inout Surface surface) {
  surface.colour = texel * tint.xyz;
  surface.emitted = surface.colour * tint.w;
}

// Shows the texture of a type's face, as `texel_of`; does nothing if it has none. Without kHasCells, cutout and
// translucent faces keep the mean colour of their type: their texels may have colours that cannot be seen.
void show_texture(uint type, uint face, vec3 inside, float square_spacing, inout Surface surface) {
  uint number = textures_of(type);
  if (number == 0) return;
  TexturedFaces faces = TexturedFaces(frame().textured_faces);
  uvec4 what = faces.at[6 * (number - 1) + face].what;
  if (!kHasCells && alpha_of(what.z) != 0) return;
  vec4 tint = faces.at[6 * (number - 1) + face].tint;
  set_texel(texel_of(what, inside, square_spacing), tint, surface);
}
