// Propagated light at surfaces; matches quoin/render/propagated_light.h and render/light/voxel_light.h on the CPU.

struct LightBrick {
  ivec4 key;   // voxel coordinates / 8; w: the grid
  uvec4 what;  // 0 if the slot is free; the start of its numbers, or kIsUniform | light
};
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer LightBrickTable {
  LightBrick at[];
};

const uint kLightIsUniform = 0x80000000u;
const uint kAllOpaque = 0xFFFFFFFFu;

// Returns the start of a brick's numbers, kLightIsUniform | light if it is uniform, or kAllOpaque. Returns only after
// the loop: on some drivers, diverging lanes that returned from within it got wrong values.
uint find_light_brick(ivec3 brick, int grid) {
  LightBrickTable bricks = LightBrickTable(frame().light_bricks);
  uint mask = frame().light_mask;
  uint slot = hash_of(hash_of(uint(brick.x), uint(brick.y)), hash_of(uint(brick.z), uint(grid))) & mask;
  uint what = kAllOpaque;
  bool goes_on = true;
  while (goes_on) {
    LightBrick found = bricks.at[slot];
    bool is_it = found.key == ivec4(brick, grid);
    if (found.what.x != 0 && is_it) what = found.what.y;
    goes_on = found.what.x != 0 && !is_it;
    slot = (slot + 1) & mask;
  }
  return what;
}

// Gets the levels of a voxel: sky, red, green, blue. Returns false if light cannot reach it.
bool levels_of_voxel(ivec3 voxel, int grid, out vec4 levels) {
  uint what = find_light_brick(voxel >> 3, grid);
  bool passes = what != kAllOpaque;
  uint word = what & 0xFFFFu;
  if ((what & kLightIsUniform) == 0) {
    Numbers numbers = Numbers(frame().light_numbers);
    uvec3 at = uvec3(voxel & 7);
    uint i = at.x + 8 * at.y + 64 * at.z;
    passes = (numbers.at[what + 256 + i / 32] >> (i & 31) & 1) != 0;
    word = numbers.at[what + i / 2] >> (16 * (i & 1)) & 0xFFFFu;
  }
  levels = passes ? vec4(word & 15, word >> 4 & 15, word >> 8 & 15, word >> 12) : vec4(0.0);
  return passes;
}

// Returns the mean over the four voxels at a corner in front of a face: the face's own, its two neighbours and the
// diagonal.
vec4 corner_levels(vec4 levels[9], uint passing, int u, int v) {
  if ((passing & 16) == 0) return vec4(0.0);
  int side = 3 + u;
  int other = 3 * v + 1;
  int across = 3 * v + u;
  bool has_side = (passing >> side & 1) != 0;
  bool has_other = (passing >> other & 1) != 0;
  vec4 sum = levels[4];
  float count = 1.0;
  if (has_side) sum += levels[side], count += 1.0;
  if (has_other) sum += levels[other], count += 1.0;
  if ((has_side || has_other) && (passing >> across & 1) != 0) sum += levels[across], count += 1.0;
  return sum / count;
}

// Returns the levels on a face of a cell of (2^level)^3 voxels. `inside`: position in the cell, 0 to 1.
vec4 levels_on_face(ivec3 cell, uint face, vec3 inside, int level, int grid) {
  int axis = axis_of(face);
  int edge = 1 << level;
  ivec3 front = cell << level;
  front[axis] += sign_of(face) > 0.0 ? edge : -1;
  vec3 along = clamp(inside, vec3(0.0), vec3(1.0)) * float(edge);
  ivec3 whole = min(ivec3(along), ivec3(edge - 1));
  along -= vec3(whole);
  int u = kFaceU[face];
  int v = kFaceV[face];
  front[u] += whole[u];
  front[v] += whole[v];
  vec4 levels[9];
  for (int step = 1; step < edge && !levels_of_voxel(front, grid, levels[4]); ++step) front[axis] += int(sign_of(face));
  uint passing = 0;
  for (int i = 0; i < 9; ++i) {
    ivec3 at = front;
    at[u] += i % 3 - 1;
    at[v] += i / 3 - 1;
    if (levels_of_voxel(at, grid, levels[i])) passing |= 1u << i;
  }
  vec4 low = mix(corner_levels(levels, passing, 0, 0), corner_levels(levels, passing, 2, 0), along[u]);
  vec4 high = mix(corner_levels(levels, passing, 0, 2), corner_levels(levels, passing, 2, 2), along[u]);
  return mix(low, high, along[v]);
}

// Averages the eight voxels around a point (integer coordinates at voxel centres, relative to `base`), restricted to
// voxels reachable from the nearest one that passes light. If that has no share, all shares are equal.
bool levels_around(ivec3 base, vec3 point, int grid, out vec4 mean) {
  mean = vec4(0.0);
  vec3 low = floor(point);
  vec3 off = point - low;
  vec4 levels[8];
  float nearness[8];
  uint passing = 0;
  int nearest = -1;
  for (int i = 0; i < 8; ++i) {
    bvec3 up = bvec3((i & 1) != 0, (i & 2) != 0, (i & 4) != 0);
    vec3 share = mix(1.0 - off, off, up);
    nearness[i] = share.x * share.y * share.z;
    if (!levels_of_voxel(base + ivec3(low) + ivec3(up), grid, levels[i])) continue;
    passing |= 1u << i;
    if (nearest < 0 || nearness[i] > nearness[nearest]) nearest = i;
  }
  if (nearest < 0) return false;
  if (nearness[nearest] == 0.0) {
    for (int i = 0; i < 8; ++i) nearness[i] = 1.0;
  }
  uint counted = 1u << nearest;
  for (int i = 0; i < 7; ++i) {
    uint moved = (counted & 0x55) << 1 | (counted & 0xAA) >> 1 | (counted & 0x33) << 2 | (counted & 0xCC) >> 2 |
                 (counted & 0x0F) << 4 | (counted & 0xF0) >> 4;
    counted = (counted | moved) & passing;
  }
  float all = 0.0;
  for (int i = 0; i < 8; ++i) {
    if ((counted >> i & 1) == 0) continue;
    mean += nearness[i] * levels[i];
    all += nearness[i];
  }
  mean /= all;
  return true;
}

// Returns the light levels in front of a field's surface with samples 2^level apart.
vec4 levels_before(ivec3 cell, vec3 inside, vec3 normal, int level, int grid) {
  float edge = float(1 << level);
  vec4 mean;
  if (!levels_around(cell << level, (inside + 0.5 * normal) * edge, grid, mean)) {
    levels_around(cell << level, inside * edge, grid, mean);
  }
  return mean;
}

vec4 light_of_levels(vec4 levels) {
  vec4 f = levels / 15.0;
  return f / (4.0 - 3.0 * f);
}
float light_of_facing(vec3 normal) {
  vec3 square = normal * normal;
  return 0.6 * square.x + (normal.y < 0.0 ? 0.5 : 1.0) * square.y + 0.8 * square.z;
}
vec3 light_colour(vec4 levels, vec3 normal) {
  vec4 light = light_of_levels(levels);
  return light_of_facing(normal) *
         (frame().level_least.xyz + light.x * frame().level_sky.xyz + light.yzw * frame().level_lamps.xyz);
}

// A lookup position for light levels.
struct LevelPlace {
  ivec3 voxel;  // in an instance's tree; or the surface sample that is the origin of `inside`
  vec3 inside;
  vec3 normal;  // in the grid
  int face;     // of the voxel; -1: on a surface
};

// Returns the position of a shape's point. `inside`: from the lower corner of `voxel`. `face`: if the point lies on a
// side of the voxel and faces outwards, that side, which is lit as a cube's; else -1.
LevelPlace place_on_shape(ivec3 voxel, vec3 inside, vec3 normal, int face) {
  if (face < 0) inside -= 0.5;  // a voxel's light is that of its centre
  return LevelPlace(voxel, inside, normal, face);
}

// Returns all light at a surface point.
vec3 light_by_levels(LevelPlace at, Placed placed) {
  ivec3 cell = at.voxel + placed.origin.xyz;
  vec4 levels;
  if (at.face < 0) {
    levels = levels_before(cell, at.inside, at.normal, placed.origin.w, placed.start_base.w);
  } else {
    levels = levels_on_face(cell, uint(at.face), at.inside, placed.origin.w, placed.start_base.w);
  }
  return light_colour(levels, at.normal);
}
