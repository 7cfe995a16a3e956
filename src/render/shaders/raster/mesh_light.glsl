// The light of a mesh fragment, by rays through the content placed in the image's frame. The including file defines
// `kTraces` (true if there are rays) and `kHasGlass` (true if there is glass), or PLAIN without rays.
#include "walk.glsl"
#include "instances.glsl"
#include "glass.glsl"
#include "direct_light.glsl"
#include "levels.glsl"

// Returns the light of the sun and of lamps, or all light with light levels. `voxel`: of an instance's tree, w: the
// instance, -1: it blocks no rays. `from`: the start of rays, as in a GridRay. `normal`: in the world, unit. `diffuse`:
// the sun's factor. `at`: the same position for light levels.
//
// One loop over all rays; direct_light.glsl gives the reason.
vec3 traced_light(ivec4 voxel, ivec3 base, vec3 from, vec3 normal, float diffuse, LevelPlace at) {
#ifdef PLAIN
  return sunlight_of(diffuse);
#else
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
#endif
}

// The point to be lit: the arguments of `traced_light`, its position in front of the surface, and its own colours.
struct LitPoint {
  ivec4 voxel;
  ivec3 base;
  vec3 from;
  vec3 normal;
  float diffuse;
  vec3 colour;
  vec3 emitted;
  float openness;
  LevelPlace at;
};

vec3 colour_of(LitPoint point) {
  vec3 sunlight = vec3(0.0);
  if (has(kLit)) sunlight = traced_light(point.voxel, point.base, point.from, point.normal, point.diffuse,
                                             point.at);
  return colour_in_light(point.colour, point.emitted, sunlight, point.openness);
}

// Returns the direction from the camera through the fragment's pixel; in the world, unit.
vec3 seen_direction() {
  Frame f = frame();
  vec3 direction = f.forward.xyz;
  if (has(kPerspective)) direction += f.corner.xyz + f.right.xyz * gl_FragCoord.x + f.down.xyz * gl_FragCoord.y;
  return direction / length(direction);
}
