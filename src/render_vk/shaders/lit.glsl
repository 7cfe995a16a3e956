// The reference model of light: light/lighting.h on the processor's side.

bool has_occlusion() {
  return has(kOcclusionRays) || has(kOcclusionVertex);
}

// What occlusion leaves of all light of a point, 0 to 1 open.
float left_by_occlusion(float openness) {
  vec4 share = frame().light;
  return share.z + (1.0 - share.z) * openness;
}

// The light of a point, before exposure. `sunlight`: what the sun and lamps add.
vec3 light_at(vec3 sunlight, float openness) {
  vec4 share = frame().light;
  if (!has_occlusion()) return share.y + sunlight;
  if (has(kAffectsAll)) return (share.x + sunlight) * left_by_occlusion(openness);
  return share.x * openness + sunlight;
}

// What a surface shows where colours are seen, rather than values.
vec3 colour_in_light(vec3 colour, vec3 emitted, vec3 sunlight, float openness) {
  if (has(kLit)) return (emitted + colour * light_at(sunlight, openness)) * frame().exposure;
  return has(kUnlitOcclusion) && has_occlusion() ? colour * left_by_occlusion(openness) : colour;
}
