// The surfaces of types, and the reference lighting model; matches scene/surfaces.h and render/light/lighting.h on
// the CPU.

struct Surface {
  vec3 colour;
  float log_clarity;
  vec3 emitted;
  vec3 log_transmittance;
  float ior;
};

Surface surface_of(uint type) {
  uint i = 3 * min(type, frame().last_surface);
  Vectors surfaces = Vectors(frame().surfaces);
  vec4 colour = surfaces.at[i];
  vec4 emitted = surfaces.at[i + 1];
  return Surface(colour.xyz, colour.w, emitted.xyz, surfaces.at[i + 2].xyz, emitted.w);
}

// Returns the first fluid of the kind of a type; 0 for other types.
uint fluid_of(uint type) {
  float last = Vectors(frame().surfaces).at[3 * min(type, frame().last_surface) + 2].w;
  return last > 1.0 ? uint(last) - 1 : 0;
}

#include "textures.glsl"

// Shows the look of a cell of a halved grid, if its type has shapes. Returns true if it has.
bool show_mean_of_shapes(uint type, inout Surface surface) {
  vec4 mean = mean_of_shapes(type);
  if (mean.x < 0.0) return false;
  set_texel(mean.xyz, vec4(1.0, 1.0, 1.0, mean.w * emission_share_of_shapes(type)), surface);
  return true;
}

// Returns true if an opaque type darkens corners.
bool occludes(uint type) {
  return Vectors(frame().surfaces).at[3 * min(type, frame().last_surface) + 2].w == 0.0;
}

// Returns the surface of a field without materials.
Surface white_surface() {
  return Surface(vec3(1.0), 0.0, vec3(0.0), vec3(0.0), 1.0);
}

// Blends a share, 0 to 1, of another surface into `mixed`.
void mix_look(Surface look, float share, inout Surface mixed) {
  mixed.colour = mix(mixed.colour, look.colour, share);
  mixed.emitted = mix(mixed.emitted, look.emitted, share);
}

// Returns the transmittance of a body. Without `has_own_length` it counts as at least one voxel long.
vec3 passed_by(Surface surface, float voxels, bool has_own_length) {
  float length = max(voxels, has_own_length ? 0.0 : 1.0);
  return length > 0.0 ? exp(surface.log_transmittance * length) : vec3(1.0);
}
float own_share(Surface surface, float voxels, bool has_own_length) {
  float length = max(voxels, has_own_length ? 0.0 : 1.0);
  return length > 0.0 ? 1.0 - exp(surface.log_clarity * length) : 0.0;
}

// Returns the unblocked sunlight. `diffuse`: the point's share, times the sun's brightness.
vec3 sunlight_of(float diffuse) {
  vec4 colour = frame().sun;
  return diffuse * colour.xyz;
}

bool has_occlusion() {
  return has(kOcclusionRays) || has(kOcclusionVertex);
}

// Returns the share of light that occlusion leaves at a point. `openness`: 0 to 1.
float left_by_occlusion(float openness) {
  vec4 share = frame().light;
  return share.z + (1.0 - share.z) * openness;
}

// Returns the light of a point, before exposure. `sunlight`: the light of the sun and lamps; with light levels all
// light.
vec3 light_at(vec3 sunlight, float openness) {
  vec4 share = frame().light;
  vec4 ambient = frame().ambient;
  if (has(kPropagated)) return sunlight * (has_occlusion() ? left_by_occlusion(openness) : 1.0);
  if (!has_occlusion()) return share.y * ambient.xyz + sunlight;
  if (has(kAffectsAll)) return (share.x * ambient.xyz + sunlight) * left_by_occlusion(openness);
  return share.x * openness * ambient.xyz + sunlight;
}

// Returns the displayed colour of a surface when colours are shown instead of values.
vec3 colour_in_light(vec3 colour, vec3 emitted, vec3 sunlight, float openness) {
  if (has(kLit)) return (emitted + colour * light_at(sunlight, openness)) * frame().exposure;
  return has(kUnlitOcclusion) && has_occlusion() ? colour * left_by_occlusion(openness) : colour;
}
