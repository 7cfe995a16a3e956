// The voxel face of a fragment. Impostors choose it themselves: they define IS_IMPOSTOR.

#ifdef IS_IMPOSTOR
vec4 place;
ivec4 base;
vec4 edges;
uvec2 what;
vec4 colour;
#else
layout(location = 0) centroid in vec4 place;
layout(location = 1) flat in ivec4 base;
layout(location = 2) flat in vec4 edges;
layout(location = 3) flat in uvec2 what;
layout(location = 4) centroid in vec4 colour;
#endif

// Returns a point on the face, slightly inside its edges, lifted off it: interpolated positions can lie outside the
// edges or off the plane.
vec3 before_face(uint face, float lift) {
  const float kInside = 1e-4;
  vec3 at = place.xyz;
  at[kFaceU[face]] = clamp(at[kFaceU[face]], edges.x + kInside, edges.z - kInside);
  at[kFaceV[face]] = clamp(at[kFaceV[face]], edges.y + kInside, edges.w - kInside);
  at[axis_of(face)] = round(at[axis_of(face)]) + lift * sign_of(face);
  return at;
}

// Returns true if the fragment lies on the margin that the face was widened by. Another face covers the same point
// there, and glass must be counted once per point.
bool is_beyond(uint face) {
  vec2 at = vec2(place[kFaceU[face]], place[kFaceV[face]]);
  return any(lessThan(at, edges.xy)) || any(greaterThanEqual(at, edges.zw));
}
