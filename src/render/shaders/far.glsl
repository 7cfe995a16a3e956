// Impostors: the rectangles of far instances; matches render/impostor/raster/raster_kernel.cpp on the CPU.

// A rectangle of a level.
struct FarFace {
  vec4 centre;  // voxels from the content's centre; w: half its side along u, or a surfel's slope along u
  uvec4 what;   // index of the face that lights it, or of its cell, 0 for fillers; direction (surfels: with kIsSurfel
                // and half its sides); half its side along v, or a surfel's slope along v
};

// The surface in a cube of 4^3 bits.
struct FarCell {
  vec4 corner;    // lowest corner, voxels from the content's centre
  uvec2 bits;     // bit x + 4 y + 16 z
  uint face[26];  // seen there by each view
};

struct FarLevel {
  uvec4 faces;  // address and number of its rectangles; bits of the visible sides
  uvec4 cells;  // address of its cells, 0 if rectangles are faces; as a float, the width of their bits in voxels
};

// An instance in the image. Vectors are in its grid, relative to the content's centre; rays depend linearly on the
// pixel, from the upper left corner of its area. Each vector is x, y, z; w holds the value named after it.
struct Far {
  vec4 point;  // of a pixel's ray, in the plane through the centre; w: the depth of that plane
  vec4 point_x;
  vec4 point_y;
  vec4 direction;  // w: the increase of depth along it
  vec4 direction_x;
  vec4 direction_y;
  vec4 across;  // image position of a point q: ((across . q + across.w) / (ahead . q + ahead.w) + at.x, ...)
  vec4 down;
  vec4 ahead;
  vec4 at;        // z: tolerance of rays beyond a rectangle's sides; w: share of pixels, of 2^24, that use the coarser
                  // level
  vec4 centre;    // of the content, in the tree's coordinates
  ivec4 area;     // pixels: left, top, right, bottom, the last two exclusive
  ivec4 origin;   // of the tree's coordinates, in the grid; w: the instance
  FarLevel level;
  FarLevel coarser;
  FarLevel unseen;  // faces not seen by any view, or cells of these and of the solid behind surfels
  uvec4 near;       // the views around the direction to the camera, one byte each; frequencies of the first two
  uvec4 faces;    // address of VoxelFaces; number of the first rectangle among all in the image; number of faces that
                  // are voxel faces
};

layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer FarFaces {
  FarFace at[];
};
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer FarCells {
  FarCell at[];
};
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer Fars {
  Far at[];
};
// The instances visible in a tile: ShaderFarPart.
layout(buffer_reference, std430, buffer_reference_align = 8) readonly buffer FarParts {
  uvec2 at[];
};
// Voxel, and type | corner occlusion << 16 | direction << 24 | open rays << 27. Surfels come last and take three
// elements. The second: their offset and slopes, as floats, and their packed normal. The third: their shift, as floats;
// for a piece of a shape also half its sides, in units of kPieceHalves, 16 bits each, and the shape's side, as in
// Point, plus 1.
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer VoxelFaces {
  ivec4 at[];
};

const uint kIsSurfel = 8;
const uint kSurfelHalvesShift = 4;  // in units of 1/1,024, twelve bits each
const uint kIsPiece = 1u << 28;     // a surfel that is a piece of a shape
const float kPieceHalves = 1.0 / 16384.0;
const float kSurfelRoom = 0.05;  // as in render/impostor/raster/impostor_faces.h

const uint kNoFace = 0xFFFFFFFFu;

// Returns the pattern number that selects one of two levels at a pixel: raster::Pattern.
int pattern_at(ivec2 pixel, uint sample_number) {
  return int((uint(pixel.x) * 12664745u + uint(pixel.y) * 9560333u + sample_number * 10368889u) & 0xFFFFFFu);
}

// Returns the view whose face lights a bit of a cell, chosen pseudo-randomly: index 0 to 2 in `near`.
uint chosen_view(uvec4 near, uint number) {
  uint at = mixed(number) >> 18;
  return at < near.y ? 0 : at < near.y + near.z ? 1 : 2;
}
uint view_of(uvec4 near, uint chosen) {
  return near.x >> 8 * chosen & 0xFF;
}

// Follows a ray, `point` + t * `direction` from the content's centre, through the bits of a cell. It enters the cell's
// box at `along` through a side across axis `side`. Returns the bit hit, and sets `along` to it; -1 if none.
int follow(FarCell cell, float bit_width, int side, vec3 point, vec3 direction, inout float along) {
  const float kPast = 1e-3;  // bits: beyond the entered side, despite rounding
  float scale = 1.0 / bit_width;
  precise vec3 from = (point - cell.corner.xyz) * scale;
  precise vec3 steps = direction * scale;
  precise vec3 entered = from + along * steps;
  entered[side] += steps[side] > 0.0 ? kPast : -kPast;
  ivec3 at = ivec3(clamp(entered, vec3(0.0), vec3(3.0)));
  for (int i = 0; i < 12; ++i) {
    int bit = at.x + 4 * at.y + 16 * at.z;
    if (((bit < 32 ? cell.bits.x : cell.bits.y) >> (bit & 31) & 1) != 0) return bit;
    int next = -1;
    float nearest = uintBitsToFloat(0x7F800000u);
    for (int axis = 0; axis < 3; ++axis) {
      if (steps[axis] == 0.0) continue;
      precise float until = (float(at[axis] + (steps[axis] > 0.0 ? 1 : 0)) - from[axis]) / steps[axis];
      if (until < nearest) {
        nearest = until;
        next = axis;
      }
    }
    if (next < 0) return -1;
    at[next] += steps[next] > 0.0 ? 1 : -1;
    if (at[next] < 0 || at[next] > 3) return -1;
    along = max(along, nearest);
  }
  return -1;
}
