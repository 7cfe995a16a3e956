// What light reaches a fragment of a mesh, by rays through what the picture's frame places. Those that include this say
// whether there are any (`kTraces`), and whether there is glass (`kHasGlass`).
#include "walk.glsl"
#include "instances.glsl"
#include "glass.glsl"
#include "lamps.glsl"
#include "rays.glsl"
#include "levels.glsl"

// The light of the sun and of lamps, or all light by levels. `voxel`: of an instance's tree, w: which instance, -1: it
// is in nobody's way. `from`: where rays start, as in a GridRay; `normal`: in the world, unit; `diffuse`: of the sun;
// `at`: the same place for levels.
//
// One loop over them all, for the reason that rays.glsl gives.
vec3 traced_light(ivec4 voxel, ivec3 base, vec3 from, vec3 normal, float diffuse, LevelPlace at) {
  if (!kTraces || voxel.w < 0) return sunlight_of(diffuse);
  Placed placed = placed_at(voxel.w);
  if (has(kPropagated)) return light_by_levels(at, placed);
  GridRay ray = GridRay(base, from, vec3(0.0), 0.0);
  uvec2 lamps = uvec2(0);
  if (has(kLamps)) lamps = lamps_around(voxel, placed);
  vec3 in_view = view_from_grid(placed, ray).origin;
  vec3 sum = vec3(0.0);
  for (int i = -1; i < int(lamps.y); ++i) {
    vec3 light;
    float max_t;
    bool is_shadowed = has(kShadows);
    if (i < 0) {
      light = sunlight_of(diffuse);
      ray.direction = placed.to_sun.xyz;
      max_t = frame().shadow_distance / placed.ref_view.w;
    } else {
      light = light_of_lamp(lamps.x + uint(i), in_view, normal, placed, ray, max_t);
      is_shadowed = is_shadowed && max_t > 0.0;
    }
    if (light == vec3(0.0)) continue;
    if (is_shadowed) light *= passed_on_way(0, voxel.w, placed, ray, max_t);
    sum += light;
  }
  return sum;
}
