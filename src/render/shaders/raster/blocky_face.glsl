// The voxel face of a fragment, and its light. Impostors choose it themselves: they define IS_IMPOSTOR.

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
layout(location = 5) flat in uvec4 texels;
layout(location = 6) flat in vec4 viewer;
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

// Returns the light at the fragment.
vec3 light_of(uint face) {
  MeshFrame f = mesh_frame();
  float diffuse = diffuse_of(face, what.y);
  ivec4 home = f.instances[what.y].home;
  if (home.w < 0) return sunlight_of(diffuse);
  vec3 from = before_face(face, frame().lift / placed_at(home.w).ref_view.w);
  vec3 behind = from;
  behind[axis_of(face)] -= 0.5 * sign_of(face);
  ivec4 voxel = ivec4(base.xyz + ivec3(floor(behind)), home.w);
  vec4 normal = sign_of(face) * f.instances[what.y].axes[axis_of(face)];
  LevelPlace at = LevelPlace(voxel.xyz, before_face(face, 0.0) - floor(behind), face_normal(face), int(face));
  return traced_light(voxel, base.xyz & ~63, vec3(base.xyz & 63) + from, normal.xyz, diffuse, at);
}

#ifndef IS_IMPOSTOR
// Returns the square of the distance of samples at a point, in voxels from `base`.
float square_spacing_at(vec3 at) {
  vec3 away = at - viewer.xyz;
  return viewer.w * viewer.w * (viewer.w > 0.0 ? dot(away, away) : 1.0);
}

// Shapes. The vertex shader's outputs (shape.glsl) are the normal of the side that is seen in `edges`, the direction
// nearest to it and the voxel in `what.x`, the texture's coordinates and the emission in `colour`, and the texture in
// `texels`: z is 0 if the face has the colour of its type, w the tint in sRGB. The emission is then a share of the
// type's.

vec3 shape_tint() {
  return linear_from_srgb(unpackUnorm4x8(texels.w).xyz);
}
void show_texture_of_shape(inout Surface surface) {
  vec3 texel = texel_of(texels, vec3(colour.xy, 0.0), square_spacing_at(place.xyz) * edges.w);
  set_texel(texel, vec4(shape_tint(), colour.z), surface);
}

// Returns the normal of the fragment's shape, in the world.
vec3 shape_normal() {
  vec4 axes[3] = mesh_frame().instances[what.y].axes;
  return axes[0].xyz * edges.x + axes[1].xyz * edges.y + axes[2].xyz * edges.z;
}

LitPoint point_of_shape(Surface surface) {
  MeshFrame f = mesh_frame();
  vec3 normal = shape_normal();
  vec4 sun = f.sun;
  ivec4 home = f.instances[what.y].home;
  uint bits = what.x >> kShapeVoxelShift;
  ivec3 local = ivec3(bits & 63, bits >> 6 & 63, bits >> 12 & 63);
  ivec4 voxel = ivec4(base.xyz + local, home.w);
  vec3 from = place.xyz;
  if (home.w >= 0) from += frame().lift / placed_at(home.w).ref_view.w * edges.xyz;
  int face = (what.x & kFacesOutOfVoxel) != 0 ? int(what.x & 7) : -1;
  LevelPlace at = place_on_shape(voxel.xyz, place.xyz - vec3(local), edges.xyz, face);
  return LitPoint(voxel, base.xyz & ~63, vec3(base.xyz & 63) + from, normal, max(dot(normal, sun.xyz), 0.0),
                  surface.colour, surface.emitted, place.w, at);
}
#endif
