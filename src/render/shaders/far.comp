#version 460
// Draws the impostors of a tile, some rectangles per invocation: first the nearest depth at each pixel, then that
// rectangle's number. At equal depth the lower number wins. Numbers order by instance, then by part (level, coarser
// level, unseen faces), then by rectangle.
#include "compute.glsl"
#include "far.glsl"

layout(constant_id = 0) const bool kFindsFaces = false;

const uint kFacesAGroup = 512;
const float kMargin = 0.01;  // pixels: for rounding

// A pixel rectangle, from the area's corner, inclusive.
struct Rectangle {
  vec2 low;
  vec2 high;
  bool is_shown;
};

// Returns a conservative bound of the pixels that a box around `q` covers.
Rectangle rectangle_of(Far far, vec3 q, vec3 half_size) {
  vec2 at = far.at.xy - push.point;
  float ahead = dot(far.ahead.xyz, q) + far.ahead.w;
  vec2 middle = vec2(dot(far.across.xyz, q) + far.across.w, dot(far.down.xyz, q) + far.down.w) / ahead;
  float deep = dot(half_size, abs(far.ahead.xyz));
  vec2 wide = vec2(dot(half_size, abs(far.across.xyz - middle.x * far.ahead.xyz)),
                   dot(half_size, abs(far.down.xyz - middle.y * far.ahead.xyz)));
  // The part of the area in the tile.
  vec2 least = vec2(max(push.corner - far.area.xy, ivec2(0)));
  vec2 most = vec2(min(push.corner + push.size, far.area.zw) - far.area.xy - 1);
  float nearest = ahead - deep;
  Rectangle found = Rectangle(least, most, true);
  // Boxes that reach the camera's plane may be visible anywhere.
  if (0.01 * ahead < nearest) {
    vec2 size = wide / nearest;
    found.low = max(ceil(middle - size + (at - kMargin)), least);
    found.high = min(floor(middle + size + (at + kMargin)), most);
  }
  found.is_shown = all(lessThanEqual(found.low, found.high)) && 0.0 < ahead + deep;
  return found;
}

void put(ivec2 pixel, float depth, uint number) {
  uint slot = uint(pixel.y) * uint(push.size.x) + uint(pixel.x);
  uint bits = floatBitsToUint(depth);
  if (!kFindsFaces) {
    atomicMin(FarPixels(frame().far_depths).at[slot], bits);
  } else if (FarPixels(frame().far_depths).at[slot] == bits) {
    atomicMin(FarPixels(frame().far_numbers).at[slot], number);
  }
}

// The pixels that show the part: pattern numbers from x up to, but not including, y.
ivec2 share;

bool is_shared(Far far, vec2 pixel) {
  int pattern = pattern_at(far.area.xy + ivec2(pixel), push.sample_number);
  return pattern >= share.x && pattern < share.y;
}

void draw(Far far, FarLevel level, vec3 q, uint side, vec2 reach, uint face, uint number) {
  int axis = int(side >> 1);
  int u = kFaceU[side];
  int v = kFaceV[side];
  float sign = (side & 1) == 0 ? 1.0 : -1.0;
  vec3 half_box = vec3(0.0);
  half_box[u] = reach.x;
  half_box[v] = reach.y;
  Rectangle rectangle = rectangle_of(far, q, half_box);
  if (!rectangle.is_shown) return;
  ivec2 to_tile = far.area.xy - push.corner;
  for (float y = rectangle.low.y; y <= rectangle.high.y; y += 1.0) {
    for (float x = rectangle.low.x; x <= rectangle.high.x; x += 1.0) {
      vec2 at = vec2(x, y) + push.point;
      precise vec3 point = far.point.xyz + far.point_x.xyz * at.x + far.point_y.xyz * at.y;
      precise vec3 direction = far.direction.xyz + far.direction_x.xyz * at.x + far.direction_y.xyz * at.y;
      float towards = direction[axis];
      precise float along = (q[axis] - point[axis]) / towards;
      precise float depth = far.point.w + along * far.direction.w;
      vec3 off = abs(point + along * direction - q);
      bool is_met = off[u] <= reach.x + far.at.z && off[v] <= reach.y + far.at.z && towards * sign < 0.0 && 0.0 < depth;
      if (!is_met || !is_shared(far, vec2(x, y))) continue;
      uint chosen = 0;
      if ((level.cells.x | level.cells.y) != 0) {
        FarCell cell = FarCells(level.cells.xy).at[face];
        int bit = follow(cell, uintBitsToFloat(level.cells.z), axis, point, direction, along);
        if (bit < 0) continue;
        depth = max(depth, far.point.w + along * far.direction.w);
        chosen = chosen_view(far.near, 64 * face + uint(bit));
      }
      put(ivec2(x, y) + to_tile, depth, number | chosen);
    }
  }
}

// Draws a surfel: a plane with a slope along each side.
void draw_surfel(Far far, vec3 q, vec2 slope, vec2 reach, uint side, uint number) {
  int axis = int(side >> 1);
  int u = kFaceU[side];
  int v = kFaceV[side];
  float sign = (side & 1) == 0 ? 1.0 : -1.0;
  vec3 half_box;
  half_box[u] = reach.x;
  half_box[v] = reach.y;
  half_box[axis] = dot(reach, abs(slope));
  Rectangle rectangle = rectangle_of(far, q, half_box);
  if (!rectangle.is_shown) return;
  ivec2 to_tile = far.area.xy - push.corner;
  for (float y = rectangle.low.y; y <= rectangle.high.y; y += 1.0) {
    for (float x = rectangle.low.x; x <= rectangle.high.x; x += 1.0) {
      vec2 at = vec2(x, y) + push.point;
      precise vec3 from = far.point.xyz + far.point_x.xyz * at.x + far.point_y.xyz * at.y - q;
      precise vec3 direction = far.direction.xyz + far.direction_x.xyz * at.x + far.direction_y.xyz * at.y;
      precise float rise = slope.x * from[u] + slope.y * from[v] - from[axis];
      precise float towards = direction[axis] - slope.x * direction[u] - slope.y * direction[v];
      precise float along = rise / towards;
      precise float depth = far.point.w + along * far.direction.w;
      vec3 off = abs(from + along * direction);
      bool is_met = off[u] <= reach.x + far.at.z && off[v] <= reach.y + far.at.z && towards * sign < 0.0 && 0.0 < depth;
      if (is_met && is_shared(far, vec2(x, y))) put(ivec2(x, y) + to_tile, depth, number);
    }
  }
}

// Returns the part of the tile's list that the workgroup belongs to: the last part that begins at or before it.
uvec2 part_of(uint group) {
  FarParts parts = FarParts(frame().far_parts);
  uint low = push.far_first;
  uint high = low + push.far_count;
  while (high - low > 1) {
    uint middle = (low + high) / 2;
    if (parts.at[middle].y <= group) {
      low = middle;
    } else {
      high = middle;
    }
  }
  return parts.at[low];
}

void main() {
  uint group = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
  if (group >= push.far_groups) return;
  uvec2 part = part_of(group);
  Far far = Fars(frame().fars).at[part.x >> 2];
  uint which = part.x & 3;
  FarLevel level = far.level;
  uint before = 0;
  if (which == 1) {
    before = level.faces.z;
    level = far.coarser;
  } else if (which == 2) {
    before = level.faces.z + far.coarser.faces.z;
    level = far.unseen;
  }
  int coarser = int(far.at.w);
  share = which == 1 ? ivec2(0, coarser) : ivec2(coarser, 1 << 24);
  uint first = (group - part.y) * kFacesAGroup;
  uint end = min(first + kFacesAGroup, level.faces.z);
  for (uint i = first + gl_LocalInvocationIndex; i < end; i += 64) {
    uvec4 what = FarFaces(level.faces.xy).at[i].what;
    if (what.y == 0) continue;
    uint number = (far.faces.z + before + i) << 2;
    if ((what.z & kIsSurfel) != 0) {
      vec4 centre = FarFaces(level.faces.xy).at[i].centre;
      vec2 halves = vec2(what.z >> kSurfelHalvesShift & 0xFFF, what.z >> (kSurfelHalvesShift + 12) & 0xFFF) / 1024.0;
      if ((what.z & kIsPiece) == 0) halves += kSurfelRoom;
      draw_surfel(far, centre.xyz, vec2(centre.w, uintBitsToFloat(what.w)), halves, what.z & 7, number);
      continue;
    }
    if ((level.faces.w >> what.z & 1) == 0) continue;
    vec4 centre = FarFaces(level.faces.xy).at[i].centre;
    draw(far, level, centre.xyz, what.z, vec2(centre.w, uintBitsToFloat(what.w)), what.x, number);
  }
}
