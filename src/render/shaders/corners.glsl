// The corner occlusion of blocky meshes, found in a tree; matches render/light/corner_light.h on the CPU. The including
// file includes walk.glsl and lit.glsl before it.

// Returns 3 if both sides are occluders, otherwise the number of occluders among the three.
float vertex_occlusion(bool side_u, bool side_v, bool corner) {
  return side_u && side_v ? 3.0 : float(side_u) + float(side_v) + float(corner);
}

// Returns true if a voxel of a grid's opaque tree darkens corners.
bool is_occluder(Tree opaque, ivec3 voxel) {
  return holds(opaque, voxel) && (!has(kUnoccluding) || occludes(type_at(opaque, voxel)));
}

// Returns the corner occlusion that a blocky mesh stores, in order around the face.
vec4 corner_occlusion(Tree opaque, ivec3 voxel, uint face) {
  int u = kFaceU[face];
  int v = kFaceV[face];
  ivec3 front = voxel;
  front[axis_of(face)] += int(sign_of(face));
  uint occluders = 0;
  for (uint i = 0; i < 9; ++i) {
    ivec3 at = front;
    at[u] += int(i % 3) - 1;
    at[v] += int(i / 3) - 1;
    if (i != 4 && is_occluder(opaque, at)) occluders |= 1u << i;
  }
  bool west = (occluders & 8) != 0;
  bool east = (occluders & 32) != 0;
  bool south = (occluders & 2) != 0;
  bool north = (occluders & 128) != 0;
  return vec4(vertex_occlusion(west, south, (occluders & 1) != 0), vertex_occlusion(east, south, (occluders & 4) != 0),
              vertex_occlusion(east, north, (occluders & 256) != 0),
              vertex_occlusion(west, north, (occluders & 64) != 0));
}

// Interpolates occlusion over the mesh's two triangles.
float occlusion_at(vec4 corners, uint face, vec3 inside) {
  float a = corners.x;
  float b = corners.y;
  float c = corners.z;
  float d = corners.w;
  float x = clamp(inside[kFaceU[face]], 0.0, 1.0);
  float y = clamp(inside[kFaceV[face]], 0.0, 1.0);
  if (!(a + c > b + d)) {
    if (x >= y) return a + x * (b - a) + y * (c - b);
    return a + y * (d - a) + x * (c - d);
  }
  if (x + y <= 1.0) return a + x * (b - a) + y * (d - a);
  return c + (1.0 - x) * (d - c) + (1.0 - y) * (b - c);
}

// Moves a hit point onto its face, slightly inside the edges.
vec3 on_face(vec3 inside, uint face) {
  vec3 at = clamp(inside, vec3(1e-6), vec3(1.0 - 1e-6));
  at[axis_of(face)] = (face & 1) == 0 ? 1.0 : 0.0;
  return at;
}
