// The inputs of mesh shaders. src/render/vulkan/raster/mesh_shader_data.h has the same layout for the CPU. Vectors are
// read as a whole: see docs/decisions/040.
#include "data.glsl"

// Draw modes: surfaces, triangle edges, one channel of transparent surfaces; or, for the nearest glass, its depth, its
// transmittance and its added light.
const uint kSurfaces = 0;
const uint kEdgesOver = 1;
const uint kEdgesOnly = 2;
const uint kGlass = 3;  // and the channel
const uint kDepth = 6;  // where surfaces are, before they are lit
const uint kGlassDepth = 7;
const uint kGlassPassed = 8;
const uint kGlassAdded = 9;

// An instance, relative to a point of its grid near the camera. A grid's axes have unit length in the world.
struct MeshInstance {
  vec4 clip[4];     // columns: clip space from there, in voxels
  vec4 axes[3];     // columns: the grid's axes in the world; w of the first: the distance of the image's samples, for
                    // textures: in voxels, with perspective at a distance of 1 voxel; 1e15: shows the means of faces
  vec4 eye;         // the camera, in voxels from there, and 1; orthographic: the direction towards it, and 0
  vec4 diffuse[2];  // the sun's light on its faces
  ivec4 home;       // that point in its tree's coordinates (an impostor's: the grid's origin); w: index of the
                    // frame's instance, -1 if none
  float room;          // margin of faces in voxels per clip w
  float first_sample;  // position of sample 0 of a smooth mesh in voxel 0: 0.5, the voxel's centre; 0 for fields
  vec2 far_steps;   // of an impostor: the width of the bits of its level's cells, and of the coarser level's
  uvec4 far_cells;  // addresses of both levels' cells
  uvec4 far_near;   // as in Far; of a field: the origin of its tree's coordinates in the grid, and its halvings
  vec4 far_centre;  // of the content, in the tree's coordinates
};

struct MeshDraw {
  uvec2 data;
  uint instance;
  uint pad;
  vec4 offset;
  uvec2 records;  // of the chunk's shapes, as in ShapeRecord
  uvec2 shapes;   // their faces
};

layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer MeshDraws {
  MeshDraw at[];
};
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer MeshFrame {
  uvec2 frame;  // of the image, shared with marched images
  uvec2 draws;
  uvec2 order;  // draw and quad indices of the transparent quads, in drawing order
  uvec2 pad;
  vec4 sun;  // direction to it in the world; its length is the brightness
  MeshInstance instances[];
};

// Data shared by many vertices are push constants instead of memory, up to the size that every Vulkan device supports.
layout(push_constant) uniform Push {
  vec4 clip[4];  // of the instance; the sky's: right, down, corner and forward, as in CameraRays
  vec4 eye;      // of the instance
  vec3 offset;   // of the chunk, from its instance's reference point, in voxels; an impostor's centre
  uint instance;
  uvec2 frame;
  uvec2 data;       // of the chunk: its quads, or the records of its shapes; or of the impostor's level
  uvec2 far_faces;  // of an impostor; or the faces of the chunk's shapes
  float room;       // of the instance; the sky's: converts the distance from the image's centre to the tangent of an
                    // angle
  uint numbers;     // bits 0-3: draw mode; from 4 on for a smooth mesh: its vertices if it has materials, else 0; for
                    // an impostor 4-27: share of pixels that use the coarser level, 28: 1 if this is that level, 29: 1
                    // if it has cells; for shapes and cutouts 30: 1 if their types are transparent, 31: 1 if only
                    // their faces that hide the background are drawn
} push;

MeshFrame mesh_frame() {
  return MeshFrame(push.frame);
}
Frame frame() {
  return Frame(mesh_frame().frame);
}
bool has(uint flag) {
  return (frame().flags & flag) != 0;
}
uint drawn() {
  return push.numbers & 15;
}

// The faces of a blocky mesh that a pipeline draws.
layout(constant_id = 20) const uint kPart = 0;
const uint kQuads = 0;
const uint kCutouts = 1;  // quads of transparent types with visible and invisible texels, from both sides
const uint kShapes = 2;
const uint kMixed = 3;  // quads and shapes in the order stored in memory

// Bits of the vertex output `what.x` above the direction.
const uint kIsShapeFace = 8;
const uint kFacesOutOfVoxel = 16;  // it lies on the side of its voxel that it faces
const uint kShapeVoxelShift = 8;

// Returns true if edges of triangles are drawn.
bool draws_edges() {
  return drawn() == kEdgesOver || drawn() == kEdgesOnly;
}

// Returns the unblocked sunlight on a face of an instance.
float diffuse_of(uint face, uint instance) {
  vec4 diffuse = mesh_frame().instances[instance].diffuse[face >> 2];
  return diffuse[face & 3];
}

// Returns true if an instance is a halved grid, or far away: its faces show the means of their textures.
bool shows_means(uint instance) {
  vec4 axis = mesh_frame().instances[instance].axes[0];
  return axis.w >= 1e15;
}

vec4 clip_from(vec4 clip[4], vec3 point) {
  return clip[0] * point.x + clip[1] * point.y + clip[2] * point.z + clip[3];
}

// Returns the displayed form of a colour, or of a value that is displayed directly.
vec3 shown(vec3 colour) {
  if (has(kShowOcclusion) || has(kShowNormals)) colour = linear_from_srgb(clamp(colour, 0.0, 1.0));
  if (drawn() == kEdgesOnly) return vec3(0.02);
  if (drawn() != kEdgesOver) return colour;
  // Edges contrast with dark and with bright surfaces.
  float luminance = dot(min(colour, vec3(1.0)), vec3(0.2126, 0.7152, 0.0722));
  return luminance > 0.03 ? vec3(0.002) : vec3(0.2);
}
