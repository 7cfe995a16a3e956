// The shaders' inputs and outputs. src/render/vulkan/trees/shader_data.h has the same layout for the CPU.
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require

// True if any grid has a field; otherwise shaders are compiled without field code.
layout(constant_id = 4) const bool kHasFields = false;
// True if any field has a transparent part.
layout(constant_id = 6) const bool kHasFieldGlass = false;
// True if any grid has shapes (VoxelShapes).
layout(constant_id = 8) const bool kHasShapes = false;
// True if transparent types have textures: voxels of these are textured glass, or hollow cells of faces. Otherwise they
// are glass of their mean colour.
layout(constant_id = 9) const bool kHasCells = false;
// The trees of a grid: its voxels, then its field, then the voxels that shapes touch.
const int kContents = kHasShapes ? 3 : kHasFields ? 2 : 1;
const int kGlassContents = kHasShapes ? 3 : kHasFieldGlass ? 2 : 1;

const uint kPerspective = 1;
const uint kLit = 2;
const uint kShadows = 4;
const uint kOcclusionRays = 8;
const uint kOcclusionVertex = 16;
const uint kAffectsAll = 32;
const uint kFixedDirections = 64;
const uint kDetailColours = 128;
const uint kUnlitOcclusion = 256;
const uint kShowOcclusion = 512;
const uint kShowNormals = 1024;
const uint kLamps = 2048;
const uint kGlassSurfaces = 4096;
const uint kPropagated = 8192;
const uint kUnoccluding = 16384;  // some opaque types do not darken corners

#define kInfinity uintBitsToFloat(0x7F800000u)

// Unpacks a direction from a word: the octahedron's faces folded into a square.
// Source: Z. Cigolle et al., "A Survey of Efficient Representations for Independent Unit Vectors" (2014): octahedral.
vec3 unit_vector(uint word) {
  vec2 e = unpackSnorm2x16(word);
  vec3 v = vec3(e, 1.0 - abs(e.x) - abs(e.y));
  if (v.z < 0.0) v.xy = (1.0 - abs(v.yx)) * mix(vec2(-1.0), vec2(1.0), greaterThanEqual(v.xy, vec2(0.0)));
  return normalize(v);
}

const uint kBodies = 16;  // maximum number of glass bodies stored per pixel at a time

// A sparse tree whose nodes have 4^3 children each; a node of level l spans 4^(l + 1) voxels. Level 0 is a word of
// voxels, level 1 a brick of 16^3, level 2 a chunk.
struct Tree {
  uvec4 root;
  ivec4 low;   // tight bounds, from the tree's origin; w: the root's level, at least 2
  ivec4 high;  // w: unused
};
struct GridTrees {
  Tree opaque;
  Tree transparent;
  Tree field;  // cells that touch the field's opaque part
  Tree glass;  // cells that touch its transparent part
};

// An instance. View space has the world's axes and units; its origin is the camera, or a point before it where
// everything is far. `ref` is a point of the grid near there.
struct Placed {
  vec4 grid_axes[3];  // columns: grid from view
  vec4 view_axes[3];  // columns: view from grid
  ivec4 ref_base;     // in the tree's coordinates; w: the grid
  vec4 ref_inside;    // from there; w: world units per voxel
  vec4 ref_view;      // the same point in view; w: voxels of the full grid per voxel
  ivec4 start_base;   // of the image's rays, which start at start + x start_x + y start_y for pixel (x, y); w: the
                      // grid whose light levels it uses
  vec4 start;         // w: its distance along the rays, in lengths of their forward component
  vec4 start_x;
  vec4 start_y;
  vec4 to_sun;  // w: its brightness
  vec4 diffuse[2];  // by face
  vec4 detail_colour;
  // The rounding errors of the numbers above.
  vec4 grid_axes_low[3];
  vec4 start_low;
  vec4 start_x_low;
  vec4 start_y_low;
  ivec4 origin;  // of the tree's coordinates, in the grid; w: the level, its number of halvings
};

// The surface point that a pixel shows: a voxel, or a cell of a field.
struct Point {
  ivec4 voxel;  // w: the instance; -1: none
  vec4 inside;  // position in the voxel; w: t
  uvec4 what;   // type, face, kind; w: as a float, the distance from the start of the instance's ray
};
// For a field, the kind includes kIsField, and the face is a normal in the form of `packed_normal`. For an impostor,
// the kind is kSurface | kIsFar, with the corner occlusion and open rays of its face from bit 8 on. For a side of a
// shape, the kind includes kIsShape, the voxel is the one that has the shape, and the face is one of shapes.glsl.

// A run of transparent voxels, or of a field's transparent part, of one type. w of `voxel`: the instance. `lengths`:
// entry t and exit t, voxels, and entry t from the start of the instance's ray. `what`: type, face, flags of its ends,
// and the exit: 8 times the instance, plus the face. For a field the face is a normal, in the form of `packed_normal`.
// For a shape that the ray enters, the face is one of shapes.glsl, and the voxel is the one that has the shape. With
// kIsTextured in `what.x`, the last number of `lengths` has the bits of the texel where the ray enters. With kIsFace it
// is a visible texel of a cell of faces: the voxel and the face are those of the lit side, and 8 times the cell's own
// face is added.
struct Body {
  ivec4 voxel;
  vec4 lengths;
  uvec4 what;
};

// Flags of a body's ends; the bits from kExitNormal on hold the normal at its exit, see normal_from_28.
const uint kStartsInside = 1;
const uint kBeginsInField = 2;
const uint kEndsInField = 4;  // or in a shape: its normal is known
const uint kBeginsInShape = 8;
const uint kHowItBegins = 3;
const uint kBeginning = 11;   // all flags of its beginning
const uint kExitNormal = 4;  // bits
// Flags of its type, and the bits of the type.
const uint kIsTextured = 0x80000000u;
const uint kIsFace = 0x40000000u;
const uint kBodyType = 0xFFFF;
// In `what.z` of a face, as its only flag: it hides everything behind it.
const uint kIsClosed = 16;

// A pixel's state: the transmittance of the glass so far, the position to continue from, and the sample's colour so
// far.
struct State {
  vec4 weight;  // w: bodies from this t on are still to be lit
  vec4 colour;  // w: 0 when the sample is done, otherwise 1 plus the number of bodies to light in this round
};

// Height of light ray starts above a surfel, as in render/impostor/raster/impostor_faces.h.
const float kSurfelLift = 0.5;

const uint kSurface = 0;
const uint kUnlit = 1;
const uint kGlow = 2;
const uint kIsFar = 4;
const uint kIsField = 8;
const uint kIsBlended = 16;  // of a field: blended from the materials around, see blend_of_field
const uint kIsShape = 32;
const uint kIsCell = 64;  // of a transparent textured type; bits 8 to 10: the face whose texture it shows

uint kind_of(Point point) {
  return point.what.z & 3;
}
bool is_of_field(Point point) {
  return kHasFields && (point.what.z & kIsField) != 0;
}
bool is_of_shape(Point point) {
  return kHasShapes && (point.what.z & kIsShape) != 0;
}
// Return true for the content numbers of fields and shapes.
bool is_field_content(int content) {
  return kHasFields && content == 1;
}
bool is_shape_content(int content) {
  return kHasShapes && content == 2;
}

layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer Nodes {
  uvec4 at[];
};
layout(buffer_reference, std430, buffer_reference_align = 8) readonly buffer Words {
  uvec2 at[];
};
layout(buffer_reference, std430, buffer_reference_align = 4) readonly buffer Numbers {
  uint at[];
};
layout(buffer_reference, std430, buffer_reference_align = 4) readonly buffer Floats {
  float at[];
};
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer Vectors {
  vec4 at[];
};
// The entry of a type: the number of its six textured faces, from 1; 0: none.
const uint kTextureNumber = 0xFFFF;
const uint kTextureTurn = 16;  // bits: the turn of its voxels without data (pack_chunk)
const uint kTurnBits = 0x1FF;
const uint kIsTexturedGlass = 1u << 25;  // CellContent on the CPU, for transparent types with textures
const uint kIsCellOfFaces = 1u << 26;
const uint kHidesFaces = 1u << 30;  // of all opaque types: faces of neighbouring cells are not visible
const uint kIsTurnedByState = 0x80000000u;

// A face of a type: the address of its texels, of all mipmap levels, level 0 first. Then in bits 0-3 log2 of the texels
// per side; for the texture's rows (bits 4-6) and columns (8-10) the axis of the grid, plus 4 if they run against it;
// the use of alpha (12-13: opaque, cutout, translucent); and the face's turn (16-17) and mirror (18). Then the tint in
// sRGB. `tint`: in linear light; w: the face's emission. `on_fields`: field_textures.glsl.
struct TexturedFace {
  uvec4 what;
  vec4 tint;
  uint on_fields;
};
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer TexturedFaces {
  TexturedFace at[];
};
const uint kAlphaShift = 12;
// Returns the use of alpha from the third number of a textured face: 0 if all texels are opaque.
uint alpha_of(uint bits) {
  return bits >> kAlphaShift & 3;
}
// Values of a face's use of alpha; 0: opaque.
const uint kCutout = 1;
const uint kTranslucent = 2;
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer Grids {
  GridTrees at[];
};
// The shapes of a grid: all voxels that they touch, and those that shapes with glass touch.
struct ShapeTrees {
  Tree touched;
  Tree glass;
};
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer ShapeGrids {
  ShapeTrees at[];
};
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer PlacedGrids {
  Placed at[];
};
layout(buffer_reference, std430, buffer_reference_align = 16) buffer Points {
  Point at[];
};
layout(buffer_reference, std430, buffer_reference_align = 16) buffer Bodies {
  Body at[];
};
layout(buffer_reference, std430, buffer_reference_align = 16) buffer States {
  State at[];
};
layout(buffer_reference, std430, buffer_reference_align = 16) buffer Sums {
  vec4 at[];
};
layout(buffer_reference, std430, buffer_reference_align = 4) buffer Words32 {
  uint at[];
};
layout(buffer_reference, std430, buffer_reference_align = 4) buffer FarPixels {
  uint at[];
};
layout(buffer_reference, std430, buffer_reference_align = 4) buffer Depths {
  float at[];
};
// Rays in 64 bits, pixels that show a voxel, and pixels with bodies still to be lit.
layout(buffer_reference, std430, buffer_reference_align = 16) buffer Counters {
  uint rays_low;
  uint rays_high;
  uint hits;
  uint pending;
};

// The data of an image. Vectors are read as a whole: see docs/decisions/040.
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer Frame {
  vec4 right;  // per pixel to the right and down, and the image's upper left corner, at distance 1
  vec4 down;   // w: the distance of the image's samples, for textures
  vec4 corner;
  vec4 forward;
  vec4 start;  // ray of pixel (x, y): start + x start_x + y start_y
  vec4 start_x;
  vec4 start_y;
  vec4 right_low;
  vec4 down_low;
  vec4 corner_low;
  vec4 forward_low;
  vec4 sky_zenith;
  vec4 sky_horizon;
  vec4 sky_ground;
  vec4 light;  // ambient, ambient without occlusion, light left by full occlusion, reach of its rays at fields
  vec4 ambient;  // colours: of the ambient light (w: factor on the openness of fields), of the sun's
  vec4 sun;
  vec4 level_sky;  // light at level 15, from the sky and from lamps; and the minimum light
  vec4 level_lamps;
  vec4 level_least;
  uvec2 placed;
  uvec2 grids;
  uvec2 tree;    // nodes of the tree over the instances: low and high, w: first, count or -1 - axis
  uvec2 leaves;  // their boxes: low and high, w: the instance, and 1 if it is drawn from its impostor
  uvec2 surfaces;    // three vectors each: colour and log clarity, emitted and index of refraction, log transmittance
                     // and 1 for opaque types that do not darken corners
  uvec2 directions;  // of occlusion: nine per face; or the rings' angles
  uvec2 turns;
  uvec2 thresholds;  // the least light of each byte
  uvec2 points;
  uvec2 bodies;
  uvec2 sun_bodies;
  uvec2 states;
  uvec2 sums;
  uvec2 colours;
  uvec2 depths;
  uvec2 counters;
  uvec2 fars;         // impostors
  uvec2 far_parts;    // the impostors visible in each tile
  uvec2 far_depths;   // of the nearest impostor at each pixel of a tile, as bits, and its number
  uvec2 far_numbers;
  uvec2 lamps;
  uvec2 lamp_bricks;
  uvec2 lamp_lists;
  uvec2 light_bricks;  // levels around surfaces: levels.glsl
  uvec2 light_numbers;
  uvec2 light_pad;
  int width;
  int height;
  uint flags;
  uint placed_count;
  uint last_surface;
  int occlusion_count;
  float occlusion_distance;
  float shadow_distance;
  float exposure;
  float samples;
  float ground_begins;
  float ground_is_full;
  float view_depth;  // depth of view space's origin
  float sky_scale;   // converts the distance from an orthographic image's centre to the tangent of an angle
  float lift;
  uint far_count;  // 0: no impostors are drawn
  uint lamp_mask;  // for slots of bricks
  uint light_mask;  // for slots of light-level bricks
  uvec2 paths;  // for path tracing: paths/path_data.glsl
  uvec2 texture_numbers;  // per type: kTextureNumber and flags; the last: types out of range
  uvec2 textured_faces;
  uvec2 shape_grids;   // ShapeTrees of the first grids; the others have no shapes
  uvec2 shape_models;  // vectors: shapes.glsl
  uvec2 shape_means;   // two vectors per type: the mean colour of its shapes, for cells of halved grids; negative for a
                       // type without shapes; w: the emission, as a multiple of colours; then x: the cells' share of it
  uint shaped_grids;   // their number
};

// Returns the column or row of the nearest texel: grid/texture.h. `axis`: bits 4-6 or 8-10 of a textured face.
uint texel_number(vec3 inside, uint axis, uint size) {
  float along = inside[axis & 3];
  if ((axis & 4) != 0) along = 1.0 - along;
  return min(uint(max(0.0, along * float(size))), size - 1);
}
// Returns the nearest texel of a textured face, 8 bits each of red, green, blue, alpha. `inside`: the position in the
// voxel; `log_size`: of the mipmap level.
uint texel_at(uvec4 record, vec3 inside, uint log_size) {
  uint last = record.z & 15;
  uint column = texel_number(inside, record.z >> 4 & 7, 1u << log_size);
  uint row = texel_number(inside, record.z >> 8 & 7, 1u << log_size);
  // The levels before have size^2 * (1 + 1/4 + ...) texels.
  uint begin = ((4u << 2 * last) - (4u << 2 * log_size)) / 3;
  return Numbers(record.xy).at[begin + (row << log_size) + column];
}

#include "core.glsl"
