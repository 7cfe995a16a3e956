// What light reaches a fragment of a mesh, by rays through what the picture's frame places. Those that include this say
// whether there are any (`kTraces`), and whether there is glass (`kHasGlass`).
#include "walk.glsl"
#include "instances.glsl"
#include "glass.glsl"
#include "lamps.glsl"
#include "rays.glsl"

// The light of the sun and of lamps. `voxel`: of an instance's tree, w: which instance, -1: it is in nobody's way.
// `from`: where rays start, as in a GridRay; `normal`: in the world, unit; `diffuse`: of the sun.
vec3 traced_light(ivec4 voxel, ivec3 base, vec3 from, vec3 normal, float diffuse) {
  vec3 sunlight = sunlight_of(diffuse);
  if (!kTraces || voxel.w < 0) return sunlight;
  Placed placed = placed_at(voxel.w);
  GridRay ray = GridRay(base, from, placed.to_sun.xyz, 0.0);
  float max_t = frame().shadow_distance / placed.ref_view.w;
  if (has(kShadows) && diffuse > 0.0) {
    if (is_blocked(voxel.w, placed, ray, max_t)) {
      sunlight = vec3(0.0);
    } else if (kHasGlass) {
      sunlight *= sunlight_passed(0, voxel.w, placed, ray, max_t);
    }
  }
  if (has(kLamps)) sunlight += light_of_lamps(0, voxel, placed, ray, normal);
  return sunlight;
}
