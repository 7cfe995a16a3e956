// Path tracing materials and their scattering; matches scene/surfaces.h and render/path/scatter.h on the CPU.
#define HAS_CLOUDS

struct Surface {
  vec3 colour;
  float log_clarity;
  vec3 emitted;
  vec3 log_transmittance;
  float ior;
  float roughness;
  float metalness;
  float scattering;
  float anisotropy;
};

Surface surface_of(uint type) {
  uint i = 4 * min(type, frame().last_surface);
  Vectors surfaces = Vectors(frame().surfaces);
  vec4 colour = surfaces.at[i];
  vec4 emitted = surfaces.at[i + 1];
  vec4 passed = surfaces.at[i + 2];
  vec4 rest = surfaces.at[i + 3];
  return Surface(colour.xyz, colour.w, emitted.xyz, passed.xyz, emitted.w, passed.w, rest.x, rest.y, rest.z);
}

// As in lit.glsl.
uint fluid_of(uint type) {
  return uint(Vectors(frame().surfaces).at[4 * min(type, frame().last_surface) + 3].w);
}

#include "textures.glsl"

// As in lit.glsl.
Surface white_surface() {
  return Surface(vec3(1.0), 0.0, vec3(0.0), vec3(0.0), 1.0, 1.0, 0.0, 0.0, 0.0);
}
void mix_look(Surface look, float share, inout Surface mixed) {
  mixed.colour = mix(mixed.colour, look.colour, share);
  mixed.emitted = mix(mixed.emitted, look.emitted, share);
  mixed.roughness = mix(mixed.roughness, look.roughness, share);
  mixed.metalness = mix(mixed.metalness, look.metalness, share);
}
vec3 passed_by(Surface surface, float voxels, bool has_own_length) {
  float length = max(voxels, has_own_length ? 0.0 : 1.0);
  return length > 0.0 ? exponential(surface.log_transmittance * length) : vec3(1.0);
}

vec3 tint_of(Surface surface, float voxels) {
  if (!(voxels > 0.0)) return vec3(1.0);
  // Glass with full coverage transmits no light: the difference of infinities would be NaN.
  bool has_clarity = surface.log_clarity > -kNever;
  return has_clarity ? exponential((surface.log_transmittance - surface.log_clarity) * voxels) : vec3(1.0);
}
float cover_of(Surface surface, float voxels) {
  return voxels > 0.0 ? 1.0 - exponential(surface.log_clarity * voxels) : 0.0;
}

const float kDielectric = 0.04;
const float kMirrorAlpha = 1e-4;
const int kGlossEdge = 32;

struct Scatter {
  vec3 outward;  // in the frame of the normal
  vec3 colour;
  vec3 matte;
  vec3 metal_gain;
  vec3 dielectric_gain;
  float alpha;
  float gloss_share;
  bool is_mirror;
  bool is_medium;
  float anisotropy;
};

float schlick(float cosine) {
  float x = clamp(1.0 - cosine, 0.0, 1.0);
  return x * x * (x * x) * x;
}
vec3 fresnel(vec3 at_normal, float cosine) {
  return at_normal + (1.0 - at_normal) * schlick(cosine);
}

float lambda_term(vec3 v, float alpha2) {
  return sqrt(alpha2 + (1.0 - alpha2) * v.z * v.z);
}
float ggx_of(vec3 halfway, float alpha2) {
  float d = 1.0 + (alpha2 - 1.0) * halfway.z * halfway.z;
  return alpha2 / (kPi * d * d);
}
float microfacets(vec3 outward, vec3 inward, vec3 halfway, float alpha) {
  float alpha2 = alpha * alpha;
  float shadowing =
      2.0 * inward.z * outward.z / (inward.z * lambda_term(outward, alpha2) + outward.z * lambda_term(inward, alpha2));
  return ggx_of(halfway, alpha2) * shadowing / (4.0 * outward.z);
}
float microfacet_density(vec3 outward, vec3 halfway, float alpha) {
  float alpha2 = alpha * alpha;
  return ggx_of(halfway, alpha2) / (2.0 * (outward.z + lambda_term(outward, alpha2)));
}
vec3 visible_normal(vec3 outward, float alpha, vec2 u) {
  vec3 stretched = normalize(vec3(alpha * outward.xy, outward.z));
  float z = (1.0 - u.y) * (1.0 + stretched.z) - stretched.z;
  float radius = sqrt(clamp(1.0 - z * z, 0.0, 1.0));
  SineCosine turn = of_turns(u.x);
  vec3 halfway = vec3(radius * turn.cosine, radius * turn.sine, z) + stretched;
  return normalize(vec3(alpha * halfway.xy, max(halfway.z, 1e-9)));
}

// Returns the total gloss reflectance: the factor of F0, and the constant term.
vec2 gloss_table(float cosine, float roughness) {
  float x = clamp(cosine, 0.0, 1.0) * float(kGlossEdge - 1);
  float y = clamp(roughness, 0.0, 1.0) * float(kGlossEdge - 1);
  int i = min(int(x), kGlossEdge - 2);
  int j = min(int(y), kGlossEdge - 2);
  float fx = x - float(i);
  float fy = y - float(j);
  Floats table = Floats(path_frame().gloss);
  uint at = uint(2 * (j * kGlossEdge + i));
  uint above = at + uint(2 * kGlossEdge);
  vec2 low = vec2(table.at[at], table.at[at + 1]) * (1.0 - fx) + vec2(table.at[at + 2], table.at[at + 3]) * fx;
  vec2 high =
      vec2(table.at[above], table.at[above + 1]) * (1.0 - fx) + vec2(table.at[above + 2], table.at[above + 3]) * fx;
  return low * (1.0 - fy) + high * fy;
}

Scatter scatter_in_medium(vec3 colour, float anisotropy) {
  return Scatter(vec3(0.0), colour, vec3(0.0), vec3(0.0), vec3(0.0), 1.0, 0.0, false, true, anisotropy);
}

Scatter scatter_of(vec3 colour, float roughness, float metalness, vec3 outward) {
  Scatter scatter = scatter_in_medium(colour, 0.0);
  scatter.is_medium = false;
  scatter.outward = outward;
  float metal = clamp(metalness, 0.0, 1.0);
  float rough = clamp(roughness, 0.0, 1.0);
  scatter.matte = colour * (1.0 - metal);
  if (metal <= 0.0 && rough >= 1.0) return scatter;
  scatter.alpha = rough * rough;
  bool is_mirror = scatter.alpha < kMirrorAlpha;
  scatter.is_mirror = is_mirror;
  vec2 gloss = gloss_table(outward.z, rough);
  float whole = max(gloss.x + gloss.y, 1e-3);
  vec3 of_dielectric = vec3(kDielectric);
  vec3 metal_gain = is_mirror ? vec3(1.0) : 1.0 + colour * (1.0 / whole - 1.0);
  vec3 dielectric_gain = is_mirror ? vec3(1.0) : 1.0 + of_dielectric * (1.0 / whole - 1.0);
  vec3 by_metal = is_mirror ? fresnel(colour, outward.z) : (colour * gloss.x + gloss.y) * metal_gain;
  vec3 by_dielectric =
      is_mirror ? fresnel(of_dielectric, outward.z) : (of_dielectric * gloss.x + gloss.y) * dielectric_gain;
  if (rough >= 1.0) {
    dielectric_gain = vec3(0.0);
    by_dielectric = vec3(0.0);
  }
  scatter.metal_gain = metal_gain * metal;
  scatter.dielectric_gain = dielectric_gain * (1.0 - metal);
  scatter.matte *= 1.0 - min(by_dielectric.x, 1.0);
  float shine = largest(by_metal * metal + by_dielectric * (1.0 - metal));
  float below = largest(scatter.matte);
  scatter.gloss_share = shine > 0.0 ? clamp(shine / (shine + below), below > 0.0 ? 0.1 : 1.0, 1.0) : 0.0;
  return scatter;
}

float phase(float g, float cosine) {
  float under = max(1.0 + g * g - 2.0 * g * cosine, 1e-6);
  return (1.0 - g * g) / (4.0 * kPi * under * sqrt(under));
}

vec3 gloss_at(Scatter scatter, float cosine) {
  return fresnel(scatter.colour, cosine) * scatter.metal_gain +
         fresnel(vec3(kDielectric), cosine) * scatter.dielectric_gain;
}

// Returns the scattering function times the cosine of `inward`; w: its density in `sample_scatter`.
vec4 evaluate(Scatter scatter, vec3 inward) {
  if (scatter.is_medium) {
    float share = phase(scatter.anisotropy, inward.z);
    return vec4(scatter.colour * share, share);
  }
  if (!(inward.z > 0.0)) return vec4(0.0);
  vec4 both = vec4(scatter.matte * (inward.z / kPi), (1.0 - scatter.gloss_share) * inward.z / kPi);
  if (scatter.gloss_share <= 0.0 || scatter.is_mirror) return both;
  vec3 halfway = normalize(scatter.outward + inward);
  both.xyz += gloss_at(scatter, dot(scatter.outward, halfway)) *
              microfacets(scatter.outward, inward, halfway, scatter.alpha);
  both.w += scatter.gloss_share * microfacet_density(scatter.outward, halfway, scatter.alpha);
  return both;
}

// A scattered direction. `weight` is 0 if no light arrives from there.
struct Scattered {
  vec3 direction;
  vec3 weight;
  float density;
};

Scattered sample_scatter(Scatter scatter, vec2 u, float choice) {
  const Scattered none = Scattered(vec3(0.0), vec3(0.0), 0.0);
  if (scatter.is_medium) {
    float g = scatter.anisotropy;
    float cosine = 1.0 - 2.0 * u.x;
    if (abs(g) > 1e-3) {
      float part = (1.0 - g * g) / (1.0 + g - 2.0 * g * u.x);
      cosine = clamp((1.0 + g * g - part * part) / (2.0 * g), -1.0, 1.0);
    }
    float sine = sqrt(1.0 - cosine * cosine);
    SineCosine turn = of_turns(u.y);
    return Scattered(vec3(sine * turn.cosine, sine * turn.sine, cosine), scatter.colour, phase(g, cosine));
  }
  if (choice < scatter.gloss_share && scatter.is_mirror) {
    return Scattered(vec3(-scatter.outward.xy, scatter.outward.z),
                     gloss_at(scatter, scatter.outward.z) / scatter.gloss_share, kInfinity);
  }
  vec3 inward;
  bool is_matte = choice >= scatter.gloss_share;
  if (is_matte) {
    inward = cosine_weighted(u);
  } else {
    vec3 halfway = visible_normal(scatter.outward, scatter.alpha, u);
    inward = halfway * (2.0 * dot(scatter.outward, halfway)) - scatter.outward;
  }
  if (!(inward.z > 0.0)) return none;
  if (is_matte && scatter.gloss_share <= 0.0) return Scattered(inward, scatter.matte, inward.z / kPi);
  vec4 both = evaluate(scatter, inward);
  if (!(both.w > 0.0)) return none;
  return Scattered(normalize(inward), both.xyz / both.w, both.w);
}
