// The colour of a face of a blocky mesh: of a quad, or of a shape.
// With PLAIN defined, no rays light it: the shader is a fifth as large. Drivers process all of a shader for each
// pipeline, before they remove what its constants leave out.

layout(constant_id = 1) const bool kIsGlass = false;
layout(constant_id = 5) const uint kGlassStep = 0;  // draw mode, for the nearest glass
#ifdef PLAIN
const bool kTraces = false;
const bool kHasGlass = false;
#else
layout(constant_id = 2) const bool kTraces = false;
layout(constant_id = 3) const bool kHasGlass = false;
#endif
#include "face_colour.glsl"
#include "mesh_light.glsl"
#include "blocky_face.glsl"

layout(location = 0) out vec4 pixel;

// Returns the finest texel of a textured face, with its alpha.
vec4 finest_texel(vec3 inside) {
  uint last = texels.z & 15;
  uint column = texel_number(inside, texels.z >> 4 & 7, 1u << last);
  uint row = texel_number(inside, texels.z >> 8 & 7, 1u << last);
  return unpackUnorm4x8(Numbers(texels.xy).at[(row << last) + column]);
}

// Discards the fragment if its texel is invisible; all rays agree about the finest texels. Gives glass the colour and
// alpha of the texel.
void show_alpha(vec3 inside, vec3 tint, inout Surface surface) {
  uint alpha = alpha_of(texels.z);
  if (alpha == 0 || draws_edges()) return;
  vec4 texel = finest_texel(inside);
  if (texel.w == 0.0 || (alpha == kCutout && texel.w < 128.0 / 255.0)) discard;
  if (!kIsGlass) return;
  float passed = 1.0 - texel.w;
  surface.log_clarity = passed > 0.0 ? log(passed) : -1e4;
  vec3 left = passed * (1.0 - texel.w * (1.0 - linear_from_srgb(texel.xyz) * tint));
  surface.log_transmittance = mix(vec3(-1e4), log(max(left, vec3(1e-30))), greaterThan(left, vec3(0.0)));
}

vec4 colour_of_shape() {
  Surface surface = surface_of(uint(base.w));
  if (texels.z != 0) {
    show_alpha(vec3(colour.xy, 0.0), shape_tint(), surface);
    show_texture_of_shape(surface);
  } else {
    surface.emitted *= colour.z;
  }
  if (drawn() == kDepth) return vec4(0.0);
  if (has(kShowNormals)) return vec4(0.5 + 0.5 * shape_normal(), 1.0);
  LitPoint point = point_of_shape(surface);
  vec3 light = traced_light(point.voxel, point.base, point.from, point.normal, point.diffuse, point.at);
  return colour_of_face(what.x & 7, surface, what.y, light, place.w);
}

vec4 colour_of_quad() {
  bool is_textured = kHasTextures && texels.w != 0;
  if (!is_textured && !kTraces) return colour;
  if (!is_textured) {
    Surface surface = surface_of(uint(base.w));
    if (shows_means(what.y)) show_mean_of_shapes(uint(base.w), surface);
    return colour_of_face(what.x, surface, what.y, light_of(what.x), place.w);
  }
  vec3 at = before_face(what.x, 0.0);
  vec3 behind = at;
  behind[axis_of(what.x)] -= 0.5 * sign_of(what.x);
  vec3 inside = at - floor(behind);
  if (!kTraces && !kIsGlass && kPart != kCutouts) {
    return vec4(colour.xyz * texel_of(texels, inside, square_spacing_at(at)), colour.w);
  }
  Surface surface = surface_of(uint(base.w));
  vec4 tint = TexturedFaces(frame().textured_faces).at[texels.w - 1].tint;
  if (kPart == kCutouts || kIsGlass) show_alpha(inside, tint.xyz, surface);
  if (drawn() == kDepth) return vec4(0.0);
  set_texel(texel_of(texels, inside, square_spacing_at(at)), tint, surface);
  vec3 sunlight = kTraces ? light_of(what.x) : sunlight_of(diffuse_of(what.x, what.y));
  return colour_of_face(what.x, surface, what.y, sunlight, place.w);
}

void main() {
  bool is_shape = kPart == kShapes || (kPart == kMixed && (what.x & kIsShapeFace) != 0);
  if (kGlassStep != 0 && !is_shape && is_beyond(what.x)) discard;
  vec4 seen;
  if (is_shape) {
    seen = colour_of_shape();
  } else {
    seen = colour_of_quad();
  }
  // Alpha between opaque corners can fall below 1: values beyond a triangle's edge are extrapolated.
  pixel = vec4(shown(seen.xyz), kIsGlass ? seen.w : 1.0);
}
