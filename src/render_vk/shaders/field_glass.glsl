// What is transparent of a field along a ray: trace/density/density_glass.h on the processor's side. Its tree holds the
// cells with a transparent corner; a word of 4^3 cells is of one material throughout, or has the samples around it and
// what bodies these of its corners belong to.

const uint kOpaqueBody = 0xFFFF;  // no type's number
const int kBodiesEdge = 5;
const uint kBodiesBegin = 172;  // in a block, after its densities
const uint kIsUniform = 0x80000000u;

// A cell and its corners, by x + 2 y, of z and z + 1: densities, and 0 for air, kOpaqueBody, or a transparent type.
struct GlassCell {
  Numbers block;
  ivec3 first;  // its least corner in the block
  vec4 low;
  vec4 high;
  uvec4 body_low;
  uvec4 body_high;
};

// False where the word that was found is of one type.
bool glass_block_found(out Numbers block, out uint type) {
  uvec4 brick = walk_stack[1];
  uint child = child_of(brick, index_in(walk_voxel, 1));
  uint words = bitCount(brick.x) + bitCount(brick.y);
  uint from = Numbers(address_after(brick.zw, 8 * words)).at[child];
  block = Numbers(address_after(record_found(), 4 * from));
  type = from & 0xFFFF;
  return (from & kIsUniform) == 0;
}

uint body_of(Numbers block, ivec3 at) {
  uint i = uint((at.z * kBodiesEdge + at.y) * kBodiesEdge + at.x);
  return block.at[kBodiesBegin + (i >> 1)] >> (16 * (i & 1)) & 0xFFFF;
}
uvec4 bodies_of(Numbers block, ivec3 at) {
  return uvec4(body_of(block, at), body_of(block, at + ivec3(1, 0, 0)), body_of(block, at + ivec3(0, 1, 0)),
               body_of(block, at + ivec3(1, 1, 0)));
}

GlassCell glass_cell(Numbers block, ivec3 voxel) {
  GlassCell cell;
  cell.block = block;
  cell.first = (voxel & 3) + 1;
  corners_of(block, cell.first, cell.low, cell.high);
  cell.body_low = bodies_of(block, voxel & 3);
  cell.body_high = bodies_of(block, (voxel & 3) + ivec3(0, 0, 1));
  return cell;
}

uint body_at_corner(GlassCell cell, int i) {
  return i < 4 ? cell.body_low[i] : cell.body_high[i - 4];
}
bool is_transparent(uint body) {
  return body != 0 && body != kOpaqueBody;
}

// The field of one body: what is solid of others is as far out as it is in.
void corners_of_body(GlassCell cell, uint body, out vec4 low, out vec4 high) {
  low = mix(abs(cell.low), cell.low, equal(cell.body_low, uvec4(body)));
  high = mix(abs(cell.high), cell.high, equal(cell.body_high, uvec4(body)));
}

// A ray in a cell, and the cubics that say what it comes to.
struct RayInGlass {
  vec3 entry;
  vec3 way;
  vec4 solid;
  vec4 opaque;
  bool has_air;
  bool has_opaque;
  bool has_several;  // transparent types
  uint type;         // the first of these
};

vec4 cubic_of_body(GlassCell cell, RayInGlass ray, uint body) {
  vec4 low;
  vec4 high;
  corners_of_body(cell, body, low, high);
  return cubic_of(low, high, ray.entry, ray.way);
}

RayInGlass ray_in_glass(GlassCell cell, vec3 entry, vec3 way) {
  RayInGlass ray;
  ray.entry = entry;
  ray.way = way;
  ray.solid = cubic_of(cell.low, cell.high, entry, way);
  ray.has_air = ray.has_opaque = ray.has_several = false;
  ray.type = 0;
  for (int i = 0; i < 8; ++i) {
    uint body = body_at_corner(cell, i);
    ray.has_air = ray.has_air || body == 0;
    ray.has_opaque = ray.has_opaque || body == kOpaqueBody;
    if (!is_transparent(body)) continue;
    ray.has_several = ray.has_several || (ray.type != 0 && body != ray.type);
    ray.type = body;
  }
  ray.opaque = ray.has_opaque ? cubic_of_body(cell, ray, kOpaqueBody) : vec4(1.0, 0.0, 0.0, 0.0);
  return ray;
}

// The first place beyond `after` at which a cubic changes its sign; 1 where there is none before.
float change_after(vec4 f, float after) {
  float a = 3.0 * f.w;
  float b = 2.0 * f.z;
  float discriminant = b * b - 4.0 * a * f.y;
  vec2 extremes = vec2(-1.0);
  if (discriminant > 0.0) {
    float q = -0.5 * (b + (b < 0.0 ? -1.0 : 1.0) * sqrt(discriminant));
    float one = a != 0.0 ? q / a : -1.0;
    float other = q != 0.0 ? f.y / q : -1.0;
    extremes = vec2(min(one, other), max(one, other));
  }
  float low = 0.0;
  for (int i = 0; i < 3; ++i) {
    float high = i == 0 ? extremes.x : i == 1 ? extremes.y : 1.0;
    if (!(high > low && high <= 1.0)) continue;
    bool falls = value_at(f, high) < 0.0;
    if ((value_at(f, low) < 0.0) != falls) {
      float s = root_between(falls ? f : -f, low, high);
      if (s > after) return s;
    }
    low = high;
  }
  return 1.0;
}

float next_change(GlassCell cell, RayInGlass ray, float after) {
  float next = ray.has_air ? change_after(ray.solid, after) : 1.0;
  if (ray.has_opaque) next = min(next, change_after(ray.opaque, after));
  for (int i = 0; ray.has_several && i < 8; ++i) {
    uint one = body_at_corner(cell, i);
    for (int k = 0; is_transparent(one) && k < i; ++k) {
      uint other = body_at_corner(cell, k);
      if (!is_transparent(other) || other == one) continue;
      next = min(next, change_after(cubic_of_body(cell, ray, one) - cubic_of_body(cell, ray, other), after));
    }
  }
  return next;
}

// The transparent type there; 0 where there is none.
uint glass_at(GlassCell cell, RayInGlass ray, float s) {
  if (!(value_at(ray.solid, s) < 0.0) || value_at(ray.opaque, s) < 0.0) return 0;
  if (!ray.has_several) return ray.type;
  uint nearest = 0;
  float least = kNever;
  for (int i = 0; i < 8; ++i) {
    uint body = body_at_corner(cell, i);
    if (!is_transparent(body)) continue;
    float own = value_at(cubic_of_body(cell, ray, body), s);
    if (own > least || (own == least && body >= nearest)) continue;
    least = own;
    nearest = body;
  }
  return nearest;
}

// The normal of a body's surface in the cell, towards air (`other` is 0) or another transparent type.
vec3 glass_normal(GlassCell cell, vec3 inside, uint type, uint other) {
  if (other == 0) return normal_in(cell.block, cell.first, inside);
  vec4 low;
  vec4 high;
  vec4 other_low;
  vec4 other_high;
  corners_of_body(cell, type, low, high);
  corners_of_body(cell, other, other_low, other_high);
  vec3 gradient = gradient_of(low - other_low, high - other_high, inside);
  float size = length(gradient);
  return size > 0.0 ? gradient / size : vec3(0.0);
}

// A unit vector, or 0, in 28 bits: as unit_vector's word, but rougher.
const float kNormalSteps = 8191.0;
uint packed_in_28(vec3 n) {
  uint word = packed_normal(n);
  if (word == kNoNormal) return 0;
  uvec2 at = uvec2(round(unpackSnorm2x16(word) * kNormalSteps) + kNormalSteps) + 1;
  return at.x | at.y << 14;
}
vec3 normal_from_28(uint word) {
  if (word == 0) return vec3(0.0);
  vec2 at = vec2(uvec2(word & 0x3FFF, word >> 14) - 1) / kNormalSteps - 1.0;
  return unit_vector(packSnorm2x16(at));
}
