// The colour of a point on a face of a blocky mesh or an impostor. The including file defines `kIsGlass`: true for
// glass.
#include "lit.glsl"

// Returns a colour, or a value that is displayed directly; w: opacity, of the channel drawn.
vec4 colour_of_face(uint face, Surface surface, uint instance, vec3 sunlight, float openness) {
  if (has(kShowOcclusion)) return vec4(vec3(openness), 1.0);
  if (has(kShowNormals)) {
    vec4 axis = mesh_frame().instances[instance].axes[axis_of(face)];
    return vec4(0.5 + 0.5 * sign_of(face) * axis.xyz, 1.0);
  }
  if (has(kDetailColours)) {
    ivec4 home = mesh_frame().instances[instance].home;
    if (home.w >= 0) {
      vec4 colour = PlacedGrids(frame().placed).at[home.w].detail_colour;
      surface.colour = colour.xyz;
    }
    surface.emitted = vec3(0.0);
  }
  // Brighter than any display value, but products with interpolated values stay finite.
  vec3 lit = colour_in_light(surface.colour, min(surface.emitted, vec3(1e15)), sunlight, openness);
  lit = min(lit, vec3(1e15));
  if (!kIsGlass) return vec4(lit, 1.0);
  // The glass counts as one voxel.
  return vec4(own_share(surface, 1.0, false) * lit, 1.0 - passed_by(surface, 1.0, false)[drawn() - kGlass]);
}
