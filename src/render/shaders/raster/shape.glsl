// The corners of shapes' faces. render/vulkan/raster/mesh_shader_data.h has the same layout for the CPU.

// A face of a shape's model, in voxels from its voxel. The corners are counter-clockwise; a triangle has its last one
// twice.
struct ShapeRecord {
  vec4 corners[4];  // w: the texture's coordinate to the right
  vec4 down;        // the texture's other coordinate
  vec4 normal;      // w: the square of the texture's sides per voxel
  uvec4 what;       // of a face with a look of its own, as in TexturedFace, with axes x and y; and the bits below. The
                    // tint's alpha is the face's share of the type's emission
};

// Bits of the third number in `what`.
const uint kOwnLook = 1u << 14;  // it has a texture of its own; else that of its type's face, bits 19-21
const uint kTypeLookShift = 19;
const uint kNoLook = 7;  // instead of a type's face: the colour of the type
const uint kNormalShift = 22;  // the direction nearest to the normal
const uint kIsOpen = 1u << 25;  // the box lacks sides, so that the inner sides of others can be seen
const uint kIsPlate = 1u << 26;  // another face is its other side
const uint kIsOnVoxel = 1u << 27;  // it lies on a side of its voxel

layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer ShapeRecords {
  ShapeRecord at[];
};

// Turns and mirrors the coordinates of a type's face, as `texture_uv` in grid/voxel_shape.h.
vec2 turned_uv(vec2 uv, uint bits) {
  uint turn = bits >> 16 & 3;
  if ((turn & 2) != 0) uv = 1.0 - uv;
  if ((turn & 1) != 0) uv = vec2(uv.y, 1.0 - uv.x);
  if ((bits >> 18 & 1) != 0) uv.x = 1.0 - uv.x;
  return uv;
}

// Returns the way from one corner to another, of length 1, or 0 if they are the same.
vec3 way_to(vec3 to, vec3 from) {
  float size = length(to - from);
  return size > 0.0 ? (to - from) / size : vec3(0.0);
}

// Writes a corner of a face, or hides it. `shapes`: the faces, two words each. The first one has the voxel and the
// occlusion of the corners as in ShapeFace, bit 26 set if the diagonal is flipped, and the higher bits of the record's
// number from bit 27 on; the second one the type, and the lower bits of that number from bit 16 on.
void put_shape(Seen seen, uvec2 records, uvec2 shapes, uint number, uint index, uint placed, vec3 offset) {
  uvec2 words = Words(shapes).at[number];
  uint type = words.y & 0xFFFF;
  uint i = words.y >> 16 | words.x >> 27 << 16;
  uint corner = ((index & 3) + (words.x >> 26 & 1)) & 3;
  ShapeRecords all = ShapeRecords(records);
  uvec4 found = all.at[i].what;
  vec4 normal = all.at[i].normal;
  vec4 first = all.at[i].corners[0];
  vec4 own = all.at[i].corners[corner];
  vec4 down = all.at[i].down;
  vec2 uv = vec2(own.w, down[corner]);
  bool has_look = (found.z & kOwnLook) != 0;
  float emission = 1.0;  // without a texture: as a share of the type's
  uint type_look = found.z >> kTypeLookShift & 7;
  if (kHasTextures && !has_look && type_look != kNoLook) {
    uint of_type = textures_of(type);
    has_look = of_type != 0;
    if (has_look) {
      TexturedFaces faces = TexturedFaces(frame().textured_faces);
      uint face = 6 * (of_type - 1) + type_look;
      uvec4 of_face = faces.at[face].what;
      found.xyw = of_face.xyw;
      emission = faces.at[face].tint.w;
      found.z |= of_face.z & (15u | 3u << kAlphaShift | 7u << 16);
      uv = turned_uv(uv, of_face.z);
    }
  }
  bool is_glass = kIsGlass || kGlassStep != 0;
  bool is_transparent = is_glass || (push.numbers >> 30 & 1) != 0;
  bool is_solid = !is_transparent || (has_look && alpha_of(found.z) != kTranslucent);
  bool is_hidden = is_glass ? is_solid : (push.numbers >> 31) != 0 && !is_solid;

  vec3 voxel = vec3(words.x & 63, words.x >> 6 & 63, words.x >> 12 & 63);
  vec3 local = voxel + own.xyz;
  precise vec3 point = local + offset;
  vec3 to_eye = seen.eye.w != 0.0 ? seen.eye.xyz - (voxel + offset + first.xyz) : seen.eye.xyz;
  bool is_behind = dot(normal.xyz, to_eye) <= 0.0;
  bool is_hollow = is_transparent && is_solid;
  bool has_two_sides = is_solid && (found.z & kIsPlate) == 0 && (is_hollow || (found.z & kIsOpen) != 0);
  if (is_hidden || (is_behind && !has_two_sides && drawn() != kEdgesOnly)) {
    hide();
    return;
  }
  // As for quads; but glass is counted once per point.
  vec3 widened = vec3(0.0);
  if (!is_glass) {
    vec4 at = clip_from(seen.clip, point);
    vec3 direction = seen.eye.w != 0.0 ? normalize(seen.eye.xyz - point) : seen.eye.xyz;
    float wide = seen.room * max(at.w, 0.0) / max(abs(dot(direction, normal.xyz)), 0.0625);
    vec4 before = all.at[i].corners[(corner + 3) & 3];
    vec4 after = all.at[i].corners[(corner + 1) & 3];
    widened = wide * (way_to(own.xyz, before.xyz) + way_to(own.xyz, after.xyz));
  }
  gl_Position = clip_from(seen.clip, point + widened);

  bool is_own = (found.z & kOwnLook) != 0;
  if (is_own || type_look == kNoLook) emission = unpackUnorm4x8(found.w).w;
  if (is_own) emission *= mean_of_shapes(type).w;
  uint direction = found.z >> kNormalShift & 7;
  ivec4 home = mesh_frame().instances[placed].home;
  place = vec4(local + widened, openness_of(words.x >> 18 & 0xFF, corner));
  base = ivec4(home.xyz + ivec3(offset), int(type));
  edges = vec4(is_behind ? -normal.xyz : normal.xyz, normal.w);
  if (is_behind) direction ^= 1;
  bool faces_out = !is_behind && (found.z & kIsOnVoxel) != 0;
  what = uvec2(direction | kIsShapeFace | (faces_out ? kFacesOutOfVoxel : 0) | (words.x & 0x3FFFF) << kShapeVoxelShift,
               placed);
  colour = vec4(uv, emission, 0.0);
  // Rows along x and columns along y of the coordinates.
  texels = has_look ? uvec4(found.xy, (found.z & (15u | 3u << kAlphaShift)) | 1u << 8 | kOwnLook, found.w) : uvec4(0);
  put_viewer(placed);
}
