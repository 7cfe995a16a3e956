// Functions of src/core: the numbers of faces (core/direction.h), hashes (core/hash.h) and sRGB.

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

// Mixes the bits of a number.
uint mixed(uint x) {
  x = (x ^ (x >> 16)) * 0x7FEB352Du;
  x = (x ^ (x >> 15)) * 0x846CA68Bu;
  return x ^ (x >> 16);
}
uint hash_of(uint a, uint b) {
  return mixed(a * 0x9E3779B9u + b * 0x85EBCA6Bu + 0x27D4EB2Fu);
}

// Returns the linear light of a displayed value, 0 to 1.
vec3 linear_from_srgb(vec3 value) {
  return mix(pow((value + 0.055) / 1.055, vec3(2.4)), value / 12.92, lessThanEqual(value, vec3(0.04045)));
}
