// Lamps in path tracing; matches render/path/path_lamps.h and light_tree.h on the CPU.

struct LampSample {
  vec3 direction;
  float distance;
  vec3 radiance;  // divided by the density; 0: none
  float density;
};

const float kSmallLamp = 0.01;
const float kOnlySampled = -3.0;  // above PathLamp::normal.w of lamps that paths do not find by scattering

// A rectangle as seen from a point in front of it.
struct SphericalRectangle {
  vec2 low;   // along the lamp's u and v
  vec2 high;
  float z;
  float b0;
  float b1;
  float turn;
  float solid_angle;
};

SphericalRectangle rectangle_of(PathLamp lamp, vec3 to_corner) {
  SphericalRectangle seen;
  seen.low = vec2(dot(to_corner, lamp.u.xyz), dot(to_corner, lamp.v.xyz));
  seen.high = seen.low + vec2(lamp.u.w, lamp.v.w);
  seen.z = dot(to_corner, lamp.normal.xyz);
  float zz = seen.z * seen.z;
  seen.b0 = -seen.low.y / sqrt(zz + seen.low.y * seen.low.y);
  seen.b1 = seen.high.y / sqrt(zz + seen.high.y * seen.high.y);
  float right = seen.high.x / sqrt(zz + seen.high.x * seen.high.x);
  float left = -seen.low.x / sqrt(zz + seen.low.x * seen.low.x);
  vec4 cosines = vec4(-seen.b0 * right, -right * seen.b1, -seen.b1 * left, -left * seen.b0);
  vec4 g;
  for (int i = 0; i < 4; ++i) g[i] = arc_cosine(cosines[i]);
  seen.turn = 2.0 * kPi - g.z - g.w;
  seen.solid_angle = max(g.x + g.y - seen.turn, 0.0);
  return seen;
}

// Returns a sampled direction from the point, along the lamp's u, v and normal.
vec3 sample_rectangle(SphericalRectangle seen, vec2 u) {
  float turns = (u.x * seen.solid_angle + seen.turn) / (2.0 * kPi);
  turns -= floor(turns);
  SineCosine angle = of_turns(turns);
  float f = (angle.cosine * seen.b0 - seen.b1) / (angle.sine != 0.0 ? angle.sine : 1e-12);
  float c = clamp((f > 0.0 ? 1.0 : -1.0) / sqrt(f * f + seen.b0 * seen.b0), -1.0 + 1e-7, 1.0 - 1e-7);
  float x = clamp(c * abs(seen.z) / sqrt(1.0 - c * c), seen.low.x, seen.high.x);
  float d = sqrt(x * x + seen.z * seen.z);
  float h0 = seen.low.y / sqrt(d * d + seen.low.y * seen.low.y);
  float h1 = seen.high.y / sqrt(d * d + seen.high.y * seen.high.y);
  float h = h0 + u.y * (h1 - h0);
  float y = h > 0.0 ? seen.high.y : seen.low.y;
  if (h * h < 1.0 - 1e-6) y = clamp(h * d / sqrt(1.0 - h * h), seen.low.y, seen.high.y);
  return vec3(x, y, seen.z);
}

struct LampSeen {
  vec3 to_corner;
  bool is_before;
  bool is_small;
};

LampSeen lamp_from(PathLamp lamp, vec3 point) {
  LampSeen seen;
  seen.to_corner = lamp.corner.xyz - point;
  seen.is_before = dot(seen.to_corner, lamp.normal.xyz) < 0.0;
  vec3 to_middle = seen.to_corner + lamp.u.xyz * (0.5 * lamp.u.w) + lamp.v.xyz * (0.5 * lamp.v.w);
  float longest = max(lamp.u.w, lamp.v.w);
  seen.is_small = longest * longest < kSmallLamp * dot(to_middle, to_middle);
  return seen;
}

float lamp_density(PathLamp lamp, LampSeen seen, vec3 direction, float distance) {
  if (!seen.is_before) return 0.0;
  if (!seen.is_small) {
    float angle = rectangle_of(lamp, seen.to_corner).solid_angle;
    return angle > 0.0 ? 1.0 / angle : 0.0;
  }
  float cosine = -dot(direction, lamp.normal.xyz);
  return cosine > 0.0 ? distance * distance / (cosine * lamp.u.w * lamp.v.w) : 0.0;
}

// Returns the radiance at a point of a lamp with a texture. `from_corner`: in view.
vec3 radiance_at(PathLamp lamp, vec3 from_corner) {
  uint face = lamp.texels.w >> 16;
  vec2 at = vec2(dot(from_corner, lamp.u.xyz), dot(from_corner, lamp.v.xyz));
  at = fract(clamp(at, vec2(0.0), vec2(lamp.u.w, lamp.v.w)) / lamp.light_of_texel.w);
  vec3 inside = vec3(0.0);
  inside[kFaceU[face]] = at.x;
  inside[kFaceV[face]] = at.y;
  uint texel = texel_at(lamp.texels, turned_cube(inside, lamp.texels.w), lamp.texels.z & 15);
  return linear_from_srgb(unpackUnorm4x8(texel).xyz) * lamp.light_of_texel.xyz;
}

// Returns the light of a side of a shape at a distance, as a multiple of its radiance.
float far_light(PathLamp lamp, float distance) {
  float square = distance * distance;
  float size = lamp.light_of_texel.w;
  return 1.0 + lamp.light_of_texel.x * square / (square + 0.25 * size * size);
}

LampSample sample_of_lamp(PathLamp lamp, vec3 point, vec2 u) {
  LampSample found = LampSample(vec3(0.0), 0.0, vec3(0.0), 0.0);
  float reach = lamp.corner.w;
  vec3 way;
  LampSeen seen;
  if (reach > 0.0) {
    way = lamp.corner.xyz - point;
  } else {
    seen = lamp_from(lamp, point);
    if (!seen.is_before) return found;
    if (seen.is_small) {
      way = seen.to_corner + lamp.u.xyz * (u.x * lamp.u.w) + lamp.v.xyz * (u.y * lamp.v.w);
    } else {
      vec3 local = sample_rectangle(rectangle_of(lamp, seen.to_corner), u);
      way = lamp.u.xyz * local.x + lamp.v.xyz * local.y + lamp.normal.xyz * local.z;
    }
  }
  found.distance = length(way);
  if (!(found.distance > 0.0)) return found;
  found.direction = way / found.distance;
  if (reach <= 0.0) {
    found.density = lamp_density(lamp, seen, found.direction, found.distance);
    vec3 radiance = lamp.radiance.xyz;
    if (kHasTextures && lamp.texels.z != 0) radiance = radiance_at(lamp, way - seen.to_corner);
    if (found.density > 0.0) found.radiance = radiance / found.density;
    if (lamp.normal.w < kOnlySampled) {
      found.radiance *= far_light(lamp, found.distance);
      found.density = kInfinity;
    }
    return found;
  }
  if (found.distance >= reach) return found;
  found.density = kInfinity;
  float share = found.distance / reach;
  float factor = (1.0 - share * share * share * share) / (found.distance * found.distance);
  if (lamp.normal.w > -2.0) {
    float along = -dot(lamp.normal.xyz, found.direction);
    float cone = clamp((along - lamp.radiance.w) / (lamp.normal.w - lamp.radiance.w), 0.0, 1.0);
    factor *= cone * cone;
  }
  found.radiance = lamp.radiance.xyz * factor;
  return found;
}

float importance_of(LampNode node, vec3 point, vec3 normal) {
  vec3 half_size = (node.high.xyz - node.low.xyz) * 0.5;
  vec3 way = node.low.xyz + half_size - point;
  float radius2 = dot(half_size, half_size);
  float distance2 = max(dot(way, way), max(radius2, 1e-12));
  float far = sqrt(distance2);
  float before = is_black(abs(normal)) ? far : dot(way, normal) + dot(half_size, abs(normal));
  if (!(before > 0.0)) return 0.0;
  float shone = far;
  if (node.axis.w > -1.0 && node.high.w > 0.9999) {
    shone = dot(half_size, abs(node.axis.xyz)) - dot(way, node.axis.xyz);
    if (!(shone > 0.0)) return 0.0;
    shone = min(shone, far);
  }
  return node.low.w * min(before, far) * shone / (distance2 * distance2);
}

// Descends the tree to a random lamp, or to `lamp` if it is >= 0. Returns the probability of the random choice; 0: no
// lamp.
float go_down(inout int lamp, vec3 point, vec3 normal, float u) {
  LampNodes nodes = LampNodes(path_frame().lamp_nodes);
  uvec2 way = uvec2(0);
  bool is_known = lamp >= 0;
  if (is_known) way = Words(path_frame().lamp_ways).at[lamp];
  uint at = 0;
  float probability = 1.0;
  LampNode node = nodes.at[0];
  if (node.next.y >= 0 && !(importance_of(node, point, normal) > 0.0)) return 0.0;
  while (node.next.y < 0) {
    uint second = uint(node.next.x);
    float of_first = importance_of(nodes.at[at + 1], point, normal);
    float of_second = importance_of(nodes.at[second], point, normal);
    float all = of_first + of_second;
    if (!(all > 0.0)) return 0.0;
    float share = of_first / all;
    bool is_second = is_known ? (way.x & 1) != 0 : u >= share;
    if (is_known) {
      way = uvec2(way.x >> 1 | way.y << 31, way.y >> 1);
    } else {
      u = min(is_second ? (u - share) / (1.0 - share) : u / share, kAlmostOne);
    }
    probability *= is_second ? 1.0 - share : share;
    at = is_second ? second : at + 1;
    node = nodes.at[at];
  }
  lamp = node.next.y;
  return probability;
}

// Samples a point on a lamp. `point`: in view; `normal`: 0 for a point in air.
LampSample sample_lamp(vec3 point, vec3 normal, float choice, vec2 u) {
  int lamp = -1;
  float probability = go_down(lamp, point, normal, choice);
  if (!(probability > 0.0)) return LampSample(vec3(0.0), 0.0, vec3(0.0), 0.0);
  LampSample found = sample_of_lamp(PathLampTable(path_frame().lamps).at[lamp], point, u);
  found.radiance /= probability;
  found.density *= probability;
  return found;
}

// Returns the probability density, in `sample_lamp`, of the point of a lamp in `direction` at `distance`.
float density_of_lamp(int lamp, vec3 point, vec3 normal, vec3 direction, float distance) {
  PathLamp of = PathLampTable(path_frame().lamps).at[lamp];
  float here = lamp_density(of, lamp_from(of, point), direction, distance);
  if (!(here > 0.0)) return 0.0;
  return here * go_down(lamp, point, normal, 0.0);
}

// Returns the index of the lamp that contains a voxel's face; -1 if none does.
int lamp_of_face(int placed, ivec3 voxel, uint face) {
  if (path_frame().lamp_count == 0) return -1;
  Keys keys = Keys(path_frame().face_keys);
  Numbers lamps = Numbers(path_frame().face_lamps);
  int last = placed * 8 + int(face);
  uint hash = uint(last);
  for (int axis = 0; axis < 3; ++axis) hash = mixed(hash ^ uint(voxel[axis]));
  uint mask = path_frame().face_mask;
  for (uint slot = hash & mask;; slot = (slot + 1) & mask) {
    int lamp = int(lamps.at[slot]);
    if (lamp < 0 || keys.at[slot] == ivec4(voxel, last)) return lamp;
  }
}
