// Faces of voxels, as core/direction.h numbers them.

// The axes of a face's edges.
const int kFaceU[6] = {1, 2, 2, 0, 0, 1};
const int kFaceV[6] = {2, 1, 0, 2, 1, 0};

int axis_of(uint face) {
  return int(face >> 1);
}
float sign_of(uint face) {
  return (face & 1) == 0 ? 1.0 : -1.0;
}
// Returns a face's normal in the grid.
vec3 face_normal(uint face) {
  vec3 normal = vec3(0.0);
  normal[axis_of(face)] = sign_of(face);
  return normal;
}
