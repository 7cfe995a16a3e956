// The denoiser's surface data, and an image's layers; matches render/path/denoise.h on the CPU. Included by paths.comp
// after the declarations of paths and vertices.

bool wants_parts() {
  return path_frame().parts != uvec2(0);
}
uint part_place(uint slot) {
  return place_of_pixel() * kParts + slot;
}

void add_to_part(uint slot, vec3 light) {
  Parts parts = Parts(path_frame().parts);
  uint i = part_place(slot);
  for (int c = 0; c < 3; ++c) parts.at[i].light[c] += light[c];
  float bright = luminance(light);
  parts.at[i].square += bright * bright;
}

uint surface_id(ivec3 voxel, uint face, bool in_field, int placed, uint type) {
  uint plane = in_field ? 0 : uint(voxel[axis_of(face)]);
  uint id = mixed(plane ^ (in_field ? 6u : face) << 28);
  id = mixed(id ^ uint(placed));
  return mixed(id ^ type) | 1;
}

void note_part(vec3 colour, uint surface, bool is_curved, vec3 normal, vec3 in_view) {
  if (!wants_parts() || path.more.y != kNoPart || is(kIsCaught)) return;
  Parts parts = Parts(path_frame().parts);
  for (uint slot = 0; slot < kParts; ++slot) {
    uint i = part_place(slot);
    uint other = parts.at[i].surface;
    if (other != 0 && other != surface) continue;
    path.more.y = slot;
    parts.at[i].surface = surface;
    parts.at[i].samples += 1.0;
    for (int c = 0; c < 3; ++c) parts.at[i].albedo[c] += colour[c];
    for (int c = 0; c < 3 && is_curved; ++c) {
      parts.at[i].normal[c] += normal[c];
      parts.at[i].place[c] += in_view[c];
    }
    return;
  }
}

void note_layers(float t, uint type) {
  if (is(kIsNoted)) return;
  path.counts.w |= kIsNoted;
  if (!has_path(kPathLayers)) return;
  add_sum(kSumAlbedo, vec4(vertex.colour, 0.0));
  add_sum(kSumNormal, vec4(vertex.normal, 0.0));
  if (!is_first_sample()) return;
  set_sum(kSumLit, uintBitsToFloat(type));
  set_sum(kSumOpen, uintBitsToFloat(vertex.is_ground ? 0 : uint(vertex.voxel.w) + 1));
  if (is(kIsFirst)) set_sum(kSumCaught, t);
}

void note_depth(float t) {
  if (has_path(kPathLayers) && is_first_sample()) set_sum(kSumCaught, t);
}
