// The looks of sides of shapes, and of cubes that their state turns. Include it after walk.glsl, instances.glsl and
// textures.glsl.

// Shows the look of a shape's side: its texture, or its tint. `inside`: the position in the shape's voxel.
// `square_spacing`: as in `texel_of`.
void show_side(uint side, vec3 inside, float square_spacing, inout Surface surface) {
  uvec4 what = shape_numbers(side_index(side) + 3);
  if ((what.z & kSideHasLook) == 0) return;
  vec3 texel = vec3(1.0);
  if ((what.z & kSideHasTexels) != 0) {
    int last = int(what.z & 15);
    int log_size = last - mipmap_level(square_spacing * uintBitsToFloat(what.w), last);
    texel = linear_from_srgb(unpackUnorm4x8(side_texel(side, inside, log_size)).xyz);
  }
  set_texel(texel, shape_vector(side_index(side) + 4), surface);
}

// Turns a position in a voxel. `turn`: nine bits (turn_bits on the CPU).
vec3 turned_cube(vec3 inside, uint turn) {
  vec3 off = inside - 0.5;
  for (int i = 0; i < 3; ++i) {
    uint from = turn >> (3 * i) & 7;
    int axis = int(from & 3);
    inside[i] = ((from & 4) != 0 ? -off[axis] : off[axis]) + 0.5;
  }
  return inside;
}

// Returns the turn of a voxel by its state, as nine bits (pack_chunk). `turn`: of its type's voxels without data.
uint turn_by_data(Tree opaque, ivec3 voxel, uint turn) {
  uvec4 chunk;
  if (!find_chunk(opaque, voxel, chunk)) return turn;
  uvec2 types = Nodes(record_of(chunk)).at[0].xy;
  uint count = Numbers(address_before(types, 4)).at[0];
  Numbers list = Numbers(address_before(types, 4 + 4 * count));
  ivec3 at = voxel & 63;
  uint number = uint(at.x + 64 * (at.y + 64 * at.z));
  uint low = 0;
  for (uint high = count; low < high;) {
    uint middle = (low + high) / 2;
    if ((list.at[middle] & 0x3FFFF) < number) {
      low = middle + 1;
    } else {
      high = middle;
    }
  }
  return low < count && (list.at[low] & 0x3FFFF) == number ? list.at[low] >> 18 : turn;
}

// Turns a face of a voxel, and a position in it, to the unturned cube, if the voxel's state turns its type.
void turn_by_state(uint type, ivec3 voxel, Placed placed, inout uint face, inout vec3 inside) {
  uint how = texture_entry(type);
  if ((how & kIsTurnedByState) == 0) return;
  uint turn = turn_by_data(opaque_tree(placed, 0), voxel, how >> kTextureTurn & kTurnBits);
  uint shown = face;
  for (int i = 0; i < 3; ++i) {
    uint from = turn >> (3 * i) & 7;
    if (int(from & 3) == axis_of(face)) shown = uint(2 * i) + ((face & 1) ^ (from >> 2));
  }
  inside = turned_cube(inside, turn);
  face = shown;
}
