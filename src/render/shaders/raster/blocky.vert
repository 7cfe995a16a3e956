#version 460
// A corner of a blocky mesh's quad: reads the eight bytes of mesh/quad.h and derives the rest. Or a corner of a shape's
// face: shape.glsl.
#include "quad.glsl"

// true: quads of many chunks, in the order stored in memory; false: one chunk's quads.
layout(constant_id = 0) const bool kIsOrdered = false;
layout(constant_id = 5) const uint kGlassStep = 0;  // draw mode, for the nearest glass

// Read once per corner, since reading them per fragment would take most of the time of an image.
layout(location = 5) flat out uvec4 texels;  // of the textured face; w: its number, from 1; 0: the face has no texture
layout(location = 6) flat out vec4 viewer;   // the camera, in voxels from `base`; w: the distance of samples, as in
                                             // MeshInstance, negative for an orthographic camera

// True if quads of transparent types need their textures: some are cutouts, which count as solid.
bool has_textured_cells() {
  return kHasTextures && (kPart == kCutouts || kIsGlass || kGlassStep != 0);
}

void hide() {
  hide_corner();
  texels = uvec4(0);
  viewer = vec4(0.0);
}

void put_viewer(uint instance) {
  vec4 axis = mesh_frame().instances[instance].axes[0];
  vec4 eye = mesh_frame().instances[instance].eye;
  ivec4 home = mesh_frame().instances[instance].home;
  viewer = vec4(eye.xyz - vec3(base.xyz - home.xyz), eye.w != 0.0 ? axis.w : -axis.w);
}

// An orientation, by its index in core/axis_orientation.h: for each axis of the grid the axis of the type (bits 0-1,
// 2-3, 4-5), and whether it is negated (bits 6-8).
uint orientation_of(uint index) {
  const uint kOrders[6] = {36, 9, 18, 33, 24, 6};
  return kOrders[index >> 3] | (index & 7) << 6;
}
// Returns the face of a type that its orientation turns to `face`.
uint unturned_face(uint face, uint orientation) {
  uint axis = face >> 1;
  return 2 * (orientation >> 2 * axis & 3) + ((face & 1) ^ (orientation >> (6 + axis) & 1));
}
// Turns an axis of a texture: bits 0-1 the axis, bit 2 set if it runs against it.
uint turned_axis(uint axis, uint orientation) {
  uint to = 0;
  while ((orientation >> 2 * to & 3) != (axis & 3)) ++to;
  return to | ((axis >> 2 & 1) ^ (orientation >> (6 + to) & 1)) << 2;
}

// Finds the texture of a type's face, in the form of `texels`. `shown`: the face without its turn; `orientation`: the
// index.
uvec4 texels_of(uint type, uint shown, uint orientation) {
  uint number = textures_of(type);
  if (number == 0) return uvec4(0);
  uint i = 6 * (number - 1) + shown;
  uvec4 found = TexturedFaces(frame().textured_faces).at[i].what;
  if (orientation != 0) {
    uint turn = orientation_of(orientation);
    found.z = (found.z & ~0x770u) | turned_axis(found.z >> 4 & 7, turn) << 4 | turned_axis(found.z >> 8 & 7, turn) << 8;
  }
  return uvec4(found.xyz, i + 1);
}

#include "shape.glsl"

void main() {
  uint index = uint(gl_VertexIndex);
  uint number = index >> 2;
  uvec2 data = push.data;
  uvec2 shapes = push.far_faces;
  uint placed = push.instance;
  vec3 offset = push.offset;
  Seen seen = Seen(push.clip, push.eye, push.room);
  bool is_shape = kPart == kShapes;
  if (kIsOrdered) {
    uvec2 next = Words(mesh_frame().order).at[number];
    MeshDraw of = MeshDraws(mesh_frame().draws).at[next.x];
    is_shape = kPart == kMixed && (next.y >> 31) != 0;
    data = is_shape ? of.records : of.data;
    shapes = of.shapes;
    placed = of.instance;
    vec4 of_offset = of.offset;
    offset = of_offset.xyz;
    number = next.y & 0x7FFFFFFFu;
    seen.clip = mesh_frame().instances[placed].clip;
    seen.eye = mesh_frame().instances[placed].eye;
    seen.room = mesh_frame().instances[placed].room;
  }
  if (is_shape) {
    put_shape(seen, data, shapes, number, index, placed, offset);
    return;
  }
  uvec2 bits = Words(data).at[number];

  uint face = bits.y >> 7 & 7;
  uint type = bits.y >> 10 & 0xFFFF;
  // The corners of a flipped quad are numbered from the next corner, which flips the diagonal.
  uint corner = ((index & 3) + (bits.y >> 6 & 1)) & 3;
  bool is_east = corner == 1 || corner == 2;
  bool is_north = corner >= 2;
  int u = kFaceU[face];
  int v = kFaceV[face];
  vec3 low = vec3(bits.x & 63, bits.x >> 6 & 63, bits.x >> 12 & 63);
  if ((face & 1) == 0) low[axis_of(face)] += 1.0;
  vec3 high = low;
  high[u] += float((bits.x >> 18 & 63) + 1);
  high[v] += float((bits.x >> 24 & 63) + 1);
  vec3 local = low;
  if (is_east) local[u] = high[u];
  if (is_north) local[v] = high[v];
  // Integers: the corners of neighbouring chunks are bit-identical.
  precise vec3 point = local + offset;
  // The lit side, which the camera sees.
  uint side = face;
  uint orientation = bits.y >> 26;
  uint shown = orientation == 0 ? face : unturned_face(face, orientation_of(orientation));
  uvec4 texture_shown = uvec4(0);
  bool is_hidden = false;
  if (has_textured_cells()) {
    texture_shown = texels_of(type, shown, orientation);
    bool is_solid = texture_shown.w != 0 && alpha_of(texture_shown.z) != kTranslucent;
    // Glass is drawn later, and solid faces were drawn before.
    is_hidden = kPart == kCutouts ? (push.numbers >> 31) != 0 && !is_solid : is_solid;
    int axis = axis_of(face);
    float to_eye = sign_of(face) * (seen.eye.w != 0.0 ? seen.eye[axis] - point[axis] : seen.eye[axis]);
    if (kPart == kCutouts && is_solid && to_eye < 0.0) side = face ^ 1;
  }
  vec3 widened;
  if (is_hidden || !put_corner(seen, side, point, side == face ? is_east : is_north,
                               side == face ? is_north : is_east, widened)) {
    hide();
    return;
  }
  ivec4 home = mesh_frame().instances[placed].home;
  put_face(side, shown, type, placed, local + widened, low, high, home.xyz + ivec3(offset),
           openness_of(bits.x >> 30 | (bits.y & 63) << 2, corner));
  texels = texture_shown;
  if (kHasTextures && !has_textured_cells()) texels = texels_of(type, shown, orientation);
  // Cells of types with shapes have the mean colour of their sides.
  if (kHasTextures && texels.w != 0 && shows_means(placed) && mean_of_shapes(type).x >= 0.0) texels = uvec4(0);
  viewer = vec4(0.0);
  if (kHasTextures && texels.w != 0) put_viewer(placed);
}
