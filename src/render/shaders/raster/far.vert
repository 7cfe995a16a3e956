#version 460
// A corner of an impostor's rectangle, lit as one voxel's face.
#define IS_IMPOSTOR
#include "quad.glsl"
#include "far.glsl"

layout(location = 5) out vec3 met;         // the ray's entry point, voxels from the content's centre
layout(location = 6) flat out uvec2 cell;  // with cells: the cell's number, and the rectangle's direction

// Returns the first corner of a face's triangles: render/light/corner_light.h.
uint first_corner(uint corners) {
  return (corners & 3) + (corners >> 4 & 3) > (corners >> 2 & 3) + (corners >> 6 & 3) ? 1 : 0;
}

void main() {
  uint index = uint(gl_VertexIndex);
  FarFaces faces = FarFaces(push.data);
  uvec4 which = faces.at[index >> 2].what;
  if (which.y == 0) {
    hide_corner();
    return;
  }
  // With cells, the fragment shader chooses the face.
  bool has_cells = (push.numbers >> 29 & 1) != 0;
  ivec4 voxel = VoxelFaces(push.far_faces).at[has_cells ? 0 : which.x];
  uint face = uint(voxel.w) >> 24 & 7;
  uint side = which.z;
  cell = which.xz;
  uint corners = uint(voxel.w) >> 16 & 0xFF;
  uint corner = ((index & 3) + first_corner(corners)) & 3;
  bool is_east = corner == 1 || corner == 2;
  bool is_north = corner >= 2;
  vec4 centre = faces.at[index >> 2].centre;
  vec2 reach = vec2(centre.w, uintBitsToFloat(which.w));
  precise vec3 point = push.offset + centre.xyz;
  point[kFaceU[side]] += is_east ? reach.x : -reach.x;
  point[kFaceV[side]] += is_north ? reach.y : -reach.y;
  Seen seen = Seen(push.clip, push.eye, push.room);
  vec3 widened;
  if (!put_corner(seen, side, point, is_east, is_north, widened)) {
    hide_corner();
    return;
  }
  met = point + widened - push.offset;
  // Uses the light of the whole voxel face, for rectangles of any size.
  int u = kFaceU[face];
  int v = kFaceV[face];
  vec3 low = vec3(0.0);
  if ((face & 1) == 0) low[axis_of(face)] = 1.0;
  vec3 high = low;
  high[u] = high[v] = 1.0;
  vec3 local = low;
  if (is_east) local[u] = 1.0;
  if (is_north) local[v] = 1.0;
  ivec4 home = mesh_frame().instances[push.instance].home;
  put_face(face, face, uint(voxel.w) & 0xFFFF, push.instance, local, low, high,
           voxel.xyz + home.xyz, openness_of(corners, corner));
}
