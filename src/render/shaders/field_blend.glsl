// The surface of a field; matches Surfaces::blend_of_field on the CPU. The including file defines `Surface`,
// `surface_of`, `white_surface` and `mix_look`. With SHOWS_FIELD_TEXTURES it also includes field_textures.glsl and sets
// `blended_point`, where materials show their textures.

// Gets the samples around a cell's word. Returns false if the word has none because all samples are solid.
bool samples_around(Tree field, ivec3 cell, out Numbers block) {
  if (any(lessThan(cell, field.low.xyz)) || any(greaterThanEqual(cell, field.high.xyz))) return false;
  uvec4 node = field.root;
  uvec2 record = uvec2(0);
  for (int level = field.low.w; level > 1; --level) {
    uint index = index_in(cell, level);
    if ((node.z & 1) != 0 || !has_child(node, index)) return false;
    if (level == 2) record = record_of(node);
    node = Nodes(node.zw).at[child_of(node, index)];
  }
  if ((node.z & 1) != 0 || !has_child(node, index_in(cell, 1))) return false;
  return block_in(node, record, cell, block);
}

// Returns the surface of a material; fields without materials are white, as in smooth meshes.
Surface surface_of_material(uint type) {
  if (type == 0) return white_surface();
  return surface_of(type);
}

// Returns the surface of a material at the point that is blended.
Surface surface_of_share(uint type) {
  Surface surface = surface_of_material(type);
#ifdef SHOWS_FIELD_TEXTURES
  if (kHasTextures) show_on_field(type, blended_point, surface);
#endif
  return surface;
}

// Returns the look at a point `inside` a cell, blended from the solid samples of the 27 around. `nearest`: the nearest
// sample's material.
Surface blend_of_field(Tree field, ivec3 cell, vec3 inside, uint nearest) {
  Surface blend = surface_of_share(nearest);
  Numbers block;
  if (!samples_around(field, cell, block)) return blend;
  ivec3 nearer = ivec3(greaterThanEqual(inside, vec3(0.5)));
  vec3 off = inside - vec3(nearer);
  vec3 shares[3] = vec3[3](0.25 - 0.5 * off, vec3(0.5), 0.25 + 0.5 * off);
  uint known = nearest;
  Surface look = blend;
  float total = 0.0;
  for (int i = 0; i < 27; ++i) {
    ivec3 step = ivec3(i % 3, i / 3 % 3, i / 9);
    ivec3 corner = nearer + step - 1;
    float share = shares[step.x].x * shares[step.y].y * shares[step.z].z;
    bool is_solid = floatBitsToInt(sample_of(block, (cell & 3) + 1 + corner)) < 0;
    if (!is_solid || !(share > 0.0)) continue;
    uint type = type_at(field, cell + corner);
    if (type != known) look = surface_of_share(type);
    known = type;
    total += share;
    mix_look(look, share / total, blend);
  }
  return blend;
}
