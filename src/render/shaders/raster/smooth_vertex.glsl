// A vertex of a smooth mesh: seven words; and three of its materials, after all vertices.
#include "mesh.glsl"

layout(constant_id = 7) const bool kHasTextures = false;

layout(location = 0) centroid out vec3 normal;  // in the grid
layout(location = 1) centroid out vec4 albedo;  // w: openness
layout(location = 2) centroid out vec3 emitted;
layout(location = 3) centroid out vec3 place;  // in voxels, from `base`
layout(location = 4) flat out ivec4 base;      // in the tree's coordinates; w: the type
#ifdef WITH_MATERIALS
// The materials of a field's triangle, for textures.
layout(location = 5) flat out uvec3 materials;  // their types, two per word; the last: 0 if the mesh has none
layout(location = 6) centroid out vec4 weights;
layout(location = 7) flat out vec4 viewer;  // the camera, in voxels from `base`; w: the distance of samples, as in
                                            // MeshInstance, negative for an orthographic camera
layout(location = 8) flat out ivec4 origin;  // of the tree's coordinates in the grid; w: the number of halvings
#endif

invariant gl_Position;

#ifdef WITH_MATERIALS
void put_materials() {
  materials = uvec3(0);
  weights = viewer = vec4(0.0);
  origin = ivec4(0);
  uint vertices = push.numbers >> 4;
  if (!kHasTextures || vertices == 0) return;
  Numbers words = Numbers(push.data);
  uint first = 7 * vertices + 3 * uint(gl_VertexIndex);
  materials = uvec3(words.at[first], words.at[first + 1], 1);
  weights = unpackUnorm4x8(words.at[first + 2]);
  vec4 axis = mesh_frame().instances[push.instance].axes[0];
  uvec4 field = mesh_frame().instances[push.instance].far_near;
  ivec4 home = mesh_frame().instances[push.instance].home;
  viewer = vec4(push.eye.xyz - vec3(base.xyz - home.xyz), push.eye.w != 0.0 ? axis.w : -axis.w);
  origin = ivec4(field);
}
#endif

void main() {
  Numbers words = Numbers(push.data);
  uint first = 7 * uint(gl_VertexIndex);
  place = vec3(uintBitsToFloat(words.at[first]), uintBitsToFloat(words.at[first + 1]),
               uintBitsToFloat(words.at[first + 2])) + mesh_frame().instances[push.instance].first_sample;
  precise vec3 point = place + push.offset;
  gl_Position = clip_from(push.clip, point);
  normal = unit_vector(words.at[first + 3]);
  albedo = vec4(unpackUnorm2x16(words.at[first + 4]), unpackUnorm2x16(words.at[first + 5]));
  uint type = words.at[first + 6];
  vec4 glow = Vectors(frame().surfaces).at[3 * min(type, frame().last_surface) + 1];
  emitted = min(glow.xyz, vec3(1e15));
  ivec4 home = mesh_frame().instances[push.instance].home;
  base = ivec4(home.xyz + ivec3(push.offset), int(type));
#ifdef WITH_MATERIALS
  put_materials();
#endif
}
