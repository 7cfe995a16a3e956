// The colour of a point of a smooth mesh.
// With PLAIN defined, no rays light it: the shader is a fifth as large. Drivers process all of a shader for each
// pipeline, before they remove what its constants leave out.

layout(constant_id = 5) const uint kGlassStep = 0;  // draw mode, for the nearest glass
#ifdef PLAIN
const bool kTraces = false;
const bool kHasGlass = false;
#else
layout(constant_id = 2) const bool kTraces = false;
layout(constant_id = 3) const bool kHasGlass = false;
#endif
#include "lit.glsl"
#include "mesh_light.glsl"
#include "sky.glsl"
#include "smooth_point.glsl"
#include "field_textures.glsl"

layout(location = 5) flat in uvec3 materials;
layout(location = 6) centroid in vec4 weights;
layout(location = 7) flat in vec4 viewer;
layout(location = 8) flat in ivec4 origin;

layout(location = 0) out vec4 pixel;

// Shows the textures of a field's materials.
void show_materials(inout LitPoint point) {
  if (materials.z == 0 || has(kDetailColours)) return;
  float voxels = float(1 << origin.w);
  vec3 away = place - viewer.xyz;
  float square_spacing = viewer.w * viewer.w * (viewer.w > 0.0 ? dot(away, away) : 1.0);
  ivec3 voxel = base.xyz + ivec3(floor(place)) + origin.xyz;
  FieldPoint at = FieldPoint(voxel << origin.w, voxels * fract(place), own_normal_in_grid(),
                             square_spacing * voxels * voxels);
  point.colour = point.emitted = vec3(0.0);
  float total = weights.x + weights.y + weights.z + weights.w;
  for (int i = 0; i < 4; ++i) {
    if (!(weights[i] > 0.0)) continue;
    uint type = materials[i >> 1] >> 16 * (i & 1) & 0xFFFF;
    Surface surface = white_surface();
    if (type != 0) surface = surface_of(type);
    show_on_field(type, at, surface);
    point.colour += weights[i] / total * surface.colour;
    point.emitted += weights[i] / total * min(surface.emitted, vec3(1e15));
  }
}

// Treats the nearest glass as a body of one voxel in front of the opaque surface: returns its transmittance, or its
// added light.
vec4 seen_alone(vec3 colour) {
  Surface surface = surface_of(uint(base.w));
  vec2 mirror = vec2(0.0);
  if (has(kGlassSurfaces)) mirror = mirror_at(seen_direction(), own_normal(), 1.0, surface.ior);
  float left = 1.0 - mirror.x;
  if (kGlassStep == kGlassPassed) return vec4(left * passed_by(surface, 1.0, false), 1.0);
  vec3 added = left * own_share(surface, 1.0, false) * colour + mirror.x * sky_colour(mirror.y);
  return vec4(shown(added), 0.0);
}

void main() {
  vec3 colour = vec3(0.0);
  if (kGlassStep == 0 && has(kShowOcclusion)) {
    colour = vec3(albedo.w);
  } else if (kGlassStep == 0 && has(kShowNormals)) {
    colour = 0.5 + 0.5 * own_normal();
  } else if (kGlassStep == 0 || kGlassStep == kGlassAdded) {
    LitPoint point = own_point();
    if (kHasTextures && kGlassStep == 0) show_materials(point);
    colour = colour_of(point);
  }
  pixel = kGlassStep == 0 ? vec4(shown(colour), 1.0) : seen_alone(colour);
}
