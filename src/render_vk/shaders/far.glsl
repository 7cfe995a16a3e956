// Impostors: the faces of far instances, as render/impostor/raster/raster.inl draws them on the processor's side.

// A face of a level: the voxel's face that it stands for, and which of 26 views saw it.
struct FarFace {
  vec4 centre;  // voxels from the content's centre; w: of a surfel, its slope along u
  uvec4 what;   // index among the impostor's faces, views, direction, of a surfel with kIsSurfel and half its
                // sides; its slope along v
};

// An instance in the picture. Vectors are in its grid, about the content's centre; rays depend on the pixel linearly,
// from the upper left corner of its area. x, y, z of each vector; what stands at w is told besides.
struct Far {
  vec4 point;  // of a pixel's ray, in the plane through the centre; w: the depth of that plane
  vec4 point_x;
  vec4 point_y;
  vec4 direction;  // w: how depth grows along it
  vec4 direction_x;
  vec4 direction_y;
  vec4 across;  // where points lie in the picture: ((across . q + across.w) / (ahead . q + ahead.w) + at.x, ...)
  vec4 down;
  vec4 ahead;
  vec4 at;
  vec4 size;    // xy: from a face's middle to its edges, at the level and of those that no view saw; zw: a bit further
  ivec4 area;   // pixels: left, top, right, bottom, the last two exclusive
  ivec4 origin; // of the tree's coordinates, in the grid; w: the instance
  uvec4 level;  // address of its faces, how many; bits of views that count, and above them of directions that do
  uvec4 unseen; // of those that no view saw: the same, all of them count
  uvec4 faces;  // address of what is the same at all levels; number of the first among those of the picture; how many
                // are of voxels
};

layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer FarFaces {
  FarFace at[];
};
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer Fars {
  Far at[];
};
// Which instances show in a tile: twice the instance, and one more for what no view saw; and the first workgroup.
layout(buffer_reference, std430, buffer_reference_align = 8) readonly buffer FarParts {
  uvec2 at[];
};
// Voxel, and type | corner occlusion << 16 | direction << 24 | open rays << 27. Of a surfel, which come last, three:
// then its offset and slopes, as floats, and its normal, packed; and its shift.
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer VoxelFaces {
  ivec4 at[];
};

const uint kIsSurfel = 8;
const uint kSurfelHalvesShift = 4;  // in whole 1/1,024, twelve bits each
const float kSurfelRoom = 0.05;  // as render/impostor/raster/faces.h has them
const float kSurfelLift = 0.5;

const uint kNoFace = 0xFFFFFFFFu;
