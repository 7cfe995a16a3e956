#version 460
// A corner of a face of an impostor, which stands for a face of one voxel.
#include "quad.glsl"
#include "far.glsl"

// Which corner the triangles of such a face begin with: light/corner_light.h.
uint first_corner(uint corners) {
  return (corners & 3) + (corners >> 4 & 3) > (corners >> 2 & 3) + (corners >> 6 & 3) ? 1 : 0;
}

void main() {
  uint index = uint(gl_VertexIndex);
  FarFaces faces = FarFaces(push.data);
  uvec4 which = faces.at[index >> 2].what;
  if ((which.y & push.numbers >> 4 & 0x3FFFFFF) == 0) {
    hide_corner();
    return;
  }
  uint face = which.z;
  ivec4 voxel = VoxelFaces(push.far_faces).at[which.x];
  uint corners = uint(voxel.w) >> 16 & 0xFF;
  uint corner = ((index & 3) + first_corner(corners)) & 3;
  bool is_east = corner == 1 || corner == 2;
  bool is_north = corner >= 2;
  bool is_unseen = (push.numbers >> 30 & 1) != 0;
  MeshFrame f = mesh_frame();
  float half_size = is_unseen ? f.instances[push.instance].unseen_half : f.instances[push.instance].far_half;
  int u = kFaceU[face];
  int v = kFaceV[face];
  vec4 centre = faces.at[index >> 2].centre;
  precise vec3 point = push.offset + centre.xyz;
  point[u] += is_east ? half_size : -half_size;
  point[v] += is_north ? half_size : -half_size;
  Seen seen = Seen(push.clip, push.eye, push.room);
  vec3 widened;
  if (!put_corner(seen, face, point, is_east, is_north, widened)) {
    hide_corner();
    return;
  }
  // Of the voxel that is stood for, whatever the size of what is drawn.
  vec3 low = vec3(0.0);
  if ((face & 1) == 0) low[axis_of(face)] = 1.0;
  vec3 high = low;
  high[u] = high[v] = 1.0;
  vec3 local = low;
  if (is_east) local[u] = 1.0;
  if (is_north) local[v] = 1.0;
  ivec4 home = f.instances[push.instance].home;
  put_face(face, uint(voxel.w) & 0xFFFF, push.instance, local, low, high, voxel.xyz + home.xyz,
           openness_of(corners, corner));
}
