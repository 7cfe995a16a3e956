#version 460
// What a face of a blocky mesh or of an impostor shows.
#include "mesh.glsl"
#include "faces.glsl"

layout(constant_id = 1) const bool kIsGlass = false;
layout(constant_id = 2) const bool kTraces = false;
layout(constant_id = 3) const bool kHasGlass = false;
#include "mesh_light.glsl"

layout(location = 0) centroid in vec4 place;
layout(location = 1) flat in ivec4 base;
layout(location = 2) flat in vec4 edges;
layout(location = 3) flat in uvec2 what;
layout(location = 0) out vec4 pixel;

// On the face, a little inside its edges, and from there a little before it: what is interpolated can lie beside both.
vec3 before_face(uint face, float lift) {
  const float kInside = 1e-4;
  vec3 at = place.xyz;
  at[kFaceU[face]] = clamp(at[kFaceU[face]], edges.x + kInside, edges.z - kInside);
  at[kFaceV[face]] = clamp(at[kFaceV[face]], edges.y + kInside, edges.w - kInside);
  at[axis_of(face)] = round(at[axis_of(face)]) + lift * sign_of(face);
  return at;
}

vec3 light_of(uint face) {
  MeshFrame f = mesh_frame();
  vec4 diffuse = f.instances[what.y].diffuse[face >> 2];
  if (!kTraces) return vec3(diffuse[face & 3]);
  ivec4 home = f.instances[what.y].home;
  float cells = home.w < 0 ? 1.0 : placed_at(home.w).ref_view.w;
  vec3 from = before_face(face, frame().lift / cells);
  vec3 behind = from;
  behind[axis_of(face)] -= 0.5 * sign_of(face);
  ivec4 voxel = ivec4(base.xyz + ivec3(floor(behind)), home.w);
  vec4 normal = sign_of(face) * f.instances[what.y].axes[axis_of(face)];
  return traced_light(voxel, base.xyz & ~63, vec3(base.xyz & 63) + from, normal.xyz, diffuse[face & 3]);
}

vec3 colour_of(uint face, Surface surface) {
  if (has(kShowOcclusion)) return vec3(place.w);
  if (has(kShowNormals)) {
    vec4 axis = mesh_frame().instances[what.y].axes[axis_of(face)];
    return 0.5 + 0.5 * sign_of(face) * axis.xyz;
  }
  if (has(kDetailColours)) {
    ivec4 home = mesh_frame().instances[what.y].home;
    if (home.w >= 0) surface.colour = placed_at(home.w).detail_colour.xyz;
    surface.emitted = vec3(0.0);
  }
  // Brighter than anything, but its products with what is blended stay numbers.
  return colour_in_light(surface.colour, min(surface.emitted, vec3(1e15)), light_of(face), place.w);
}

void main() {
  uint face = what.x;
  Surface surface = surface_of(uint(base.w));
  vec3 colour = colour_of(face, surface);
  float hidden = 1.0;
  if (kIsGlass) {
    // Of one voxel.
    colour *= own_share(surface, 1.0, false);
    hidden = 1.0 - passed_by(surface, 1.0, false)[drawn() - kGlass];
  }
  pixel = vec4(shown(colour), hidden);
}
