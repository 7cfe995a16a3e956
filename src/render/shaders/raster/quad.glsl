// Shared by blocky.vert and far.vert, which defines IS_IMPOSTOR: corners of faces, and their outputs for fragments.
// Without traced light the output is the colour, which is linear in the openness. Fragments with textures multiply it
// by their texels, because it is linear in the colour of the surface, too.
#include "mesh.glsl"

layout(constant_id = 1) const bool kIsGlass = false;
layout(constant_id = 2) const bool kTraces = false;
#include "face_colour.glsl"

layout(location = 0) centroid out vec4 place;  // in voxels, from `base`; w: openness
layout(location = 1) flat out ivec4 base;      // in the tree's coordinates; w: the type
layout(location = 2) flat out vec4 edges;      // of the face: begin and end along each of its edges
layout(location = 3) flat out uvec2 what;      // the face's direction, the instance
layout(location = 4) centroid out vec4 colour;

invariant gl_Position;

void hide_corner() {
  gl_Position = vec4(2.0, 2.0, 0.0, 1.0);
  place = vec4(0.0);
  base = ivec4(0);
  edges = vec4(0.0);
  what = uvec2(0);
  colour = vec4(0.0);
}

// The view of an instance.
struct Seen {
  vec4 clip[4];
  vec4 eye;
  float room;
};

// Projects a face's corner at `point`, and returns the margin that the face was widened by there. Returns false if the
// face is not visible.
bool put_corner(Seen seen, uint face, vec3 point, bool is_east, bool is_north, out vec3 widened) {
  widened = vec3(0.0);
  int axis = axis_of(face);
  int u = kFaceU[face];
  int v = kFaceV[face];
  vec3 to_eye = seen.eye.w != 0.0 ? seen.eye.xyz - point : seen.eye.xyz;
  if (sign_of(face) * to_eye[axis] <= 0.0 && drawn() != kEdgesOnly) return false;
  // Faces are widened in their planes, by less than the device's resolution. Otherwise rounding would leave gaps where
  // the edge of a face meets corners of other faces.
  vec4 at = clip_from(seen.clip, point);
  vec3 direction = to_eye / length(to_eye);
  float wide = seen.room * max(at.w, 0.0) / max(abs(direction[axis]), 0.0625);
  float wide_u = wide * sqrt(max(1.0 - direction[v] * direction[v], 0.0));
  float wide_v = wide * sqrt(max(1.0 - direction[u] * direction[u], 0.0));
  widened[u] = is_east ? wide_u : -wide_u;
  widened[v] = is_north ? wide_v : -wide_v;
  gl_Position = clip_from(seen.clip, point + widened);
  return true;
}

// Returns the openness of a corner. `corners`: occlusion of all four, two bits each.
float openness_of(uint corners, uint corner) {
  return 1.0 - float(corners >> 2 * corner & 3) / 3.0;
}

// Returns the surface of a face, in the colour that its fragments do not change. `face`: of the type.
Surface surface_at_corner(uint face, uint type, uint instance) {
  Surface surface = surface_of(type);
#ifndef IS_IMPOSTOR
  if (shows_means(instance) && show_mean_of_shapes(type, surface)) return surface;
#endif
  if (!kHasTextures) return surface;
#ifdef IS_IMPOSTOR
  show_texture(type, face, vec3(0.0), kMeanOfFace, surface);
#else
  uint number = textures_of(type);
  if (number == 0) return surface;
  vec4 tint = TexturedFaces(frame().textured_faces).at[6 * (number - 1) + face].tint;
  set_texel(vec3(1.0), tint, surface);
#endif
  return surface;
}

// Writes the outputs for fragments. `local`: the corner. `low` and `high`: of the whole face, relative to `from`.
// `shown`: the face of the type that has its texture.
void put_face(uint face, uint shown, uint type, uint instance, vec3 local, vec3 low, vec3 high, ivec3 from,
              float openness) {
  int u = kFaceU[face];
  int v = kFaceV[face];
  place = vec4(local, openness);
  base = ivec4(from, int(type));
  edges = vec4(low[u], low[v], high[u], high[v]);
  what = uvec2(face, instance);
  colour = vec4(0.0);
  if (kTraces) return;
  Surface surface = surface_at_corner(shown, type, instance);
  colour = colour_of_face(face, surface, instance, sunlight_of(diffuse_of(face, instance)), openness);
}
