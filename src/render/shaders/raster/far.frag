#version 460
// The colour of a rectangle of an impostor, or of the bit that the ray meets behind it.
#include "mesh.glsl"

layout(constant_id = 1) const bool kIsGlass = false;
layout(constant_id = 2) const bool kTraces = false;
layout(constant_id = 3) const bool kHasGlass = false;
#define IS_IMPOSTOR
#include "face_colour.glsl"
#include "mesh_light.glsl"
#include "corners.glsl"
#include "blocky_face.glsl"
#include "far.glsl"

layout(location = 0) centroid in vec4 in_place;
layout(location = 1) flat in ivec4 in_base;
layout(location = 2) flat in vec4 in_edges;
layout(location = 3) flat in uvec2 in_what;
layout(location = 4) centroid in vec4 in_colour;
layout(location = 5) in vec3 met;
layout(location = 6) flat in uvec2 cell;

layout(location = 0) out vec4 pixel;

// Returns the surface of a type's face, which shows the mean of its texture.
Surface surface_of_face(uint type, uint face) {
  Surface surface = surface_of(type);
  if (kHasTextures) show_texture(type, face, vec3(0.0), kMeanOfFace, surface);
  return surface;
}

// Returns true if the impostor's other level is drawn at this pixel.
bool is_of_other_level() {
  bool is_coarser = (push.numbers >> 28 & 1) != 0;
  int coarser = int(push.numbers >> 4 & 0xFFFFFF);
  return (pattern_at(ivec2(gl_FragCoord.xy), 0) < coarser) != is_coarser;
}

// Follows the ray through the cell; replaces the corner's face by the face that lights the first bit hit.
bool find_face() {
  MeshFrame f = mesh_frame();
  bool is_coarser = (push.numbers >> 28 & 1) != 0;
  uvec4 addresses = f.instances[push.instance].far_cells;
  FarCell from = FarCells(is_coarser ? addresses.zw : addresses.xy).at[cell.x];
  vec2 steps = f.instances[push.instance].far_steps;
  // Parametrised to be 0 at the camera and 1 at the entry to the cell's box, so that lengths are of that order.
  precise vec3 eye = push.eye.xyz - push.offset;
  precise vec3 direction = push.eye.w != 0.0 ? met - eye : -push.eye.xyz;
  precise vec3 start = met - direction;
  float along = 1.0;
  int bit = follow(from, is_coarser ? steps.y : steps.x, int(cell.y >> 1), start, direction, along);
  if (bit < 0) return false;
  uvec4 near = f.instances[push.instance].far_near;
  uint view = view_of(near, chosen_view(near, 64 * cell.x + uint(bit)));
  ivec4 voxel = VoxelFaces(push.far_faces).at[from.face[view]];
  uint face = uint(voxel.w) >> 24 & 7;
  precise vec3 point = start + along * direction;
  vec4 at = clip_from(push.clip, point + push.offset);
  gl_FragDepth = at.z / at.w;
  ivec4 home = f.instances[push.instance].home;
  base = ivec4(voxel.xyz + home.xyz, voxel.w & 0xFFFF);
  edges = vec4(0.0, 0.0, 1.0, 1.0);
  what = uvec2(face, push.instance);
  // Uses the light of the hit face, which may lie elsewhere in the cell.
  vec4 centre = f.instances[push.instance].far_centre;
  vec3 on = on_face(point + centre.xyz - vec3(base.xyz), face);
  uint corners = uint(voxel.w) >> 16 & 0xFF;
  vec4 levels = vec4(corners & 3, corners >> 2 & 3, corners >> 4 & 3, corners >> 6 & 3);
  place = vec4(on, 1.0 - occlusion_at(levels, face, on) / 3.0);
  colour = vec4(0.0);
  if (!kTraces) {
    vec3 sunlight = sunlight_of(diffuse_of(face, push.instance));
    colour = colour_of_face(face, surface_of_face(uint(base.w), face), push.instance, sunlight, place.w);
  }
  return true;
}

void main() {
  if (is_of_other_level()) discard;
  place = in_place;
  base = in_base;
  edges = in_edges;
  what = in_what;
  colour = in_colour;
  gl_FragDepth = gl_FragCoord.z;
  if ((push.numbers >> 29 & 1) != 0 && !find_face()) discard;
  vec4 seen = colour;
  if (kTraces) {
    Surface surface = surface_of_face(uint(base.w), what.x);
    seen = colour_of_face(what.x, surface, what.y, light_of(what.x), place.w);
  }
  pixel = vec4(shown(seen.xyz), 1.0);
}
