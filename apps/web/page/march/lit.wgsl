// Materials, the sky, and lamps: src/render/shaders/lit.glsl, sky.glsl, core.glsl and direct_light.glsl.

struct Surface {
  colour: vec3f,
  log_clarity: f32,
  emitted: vec3f,
  ior: f32,
  log_transmittance: vec3f,
}

fn surface_of(kind: u32) -> Surface {
  let at = (frame.surfaces.x >> 4u) + 3u * min(kind, frame.last_surface);
  let colour = bitcast<vec4f>(nodes[at]);
  let emitted = bitcast<vec4f>(nodes[at + 1u]);
  return Surface(colour.xyz, colour.w, emitted.xyz, emitted.w, bitcast<vec4f>(nodes[at + 2u]).xyz);
}

// The surface of a field without materials.
fn white_surface() -> Surface {
  return Surface(vec3f(1.0), 0.0, vec3f(), 1.0, vec3f());
}

// Blends a share, 0 to 1, of another surface into `mixed`.
fn mix_look(look: Surface, share: f32, mixed: ptr<function, Surface>) {
  (*mixed).colour = mix((*mixed).colour, look.colour, share);
  (*mixed).emitted = mix((*mixed).emitted, look.emitted, share);
}

// `has_own_length`: if false, it counts as at least one voxel long.
fn counted_length(voxels: f32, has_own_length: bool) -> f32 {
  return max(voxels, select(1.0, 0.0, has_own_length));
}
fn passed_by(surface: Surface, voxels: f32, has_own_length: bool) -> vec3f {
  let length = counted_length(voxels, has_own_length);
  return select(vec3f(1.0), exp(surface.log_transmittance * length), length > 0.0);
}
fn own_share(surface: Surface, voxels: f32, has_own_length: bool) -> f32 {
  let length = counted_length(voxels, has_own_length);
  return select(0.0, 1.0 - exp(surface.log_clarity * length), length > 0.0);
}

fn colour_in_light(surface: Surface, light: vec3f, openness: f32) -> vec3f {
  let all = frame.light.x * openness * frame.ambient.xyz + light;
  return (surface.emitted + surface.colour * all) * frame.exposure;
}

// `up`: the y of a unit direction.
fn sky_colour(up: f32) -> vec3f {
  let y = clamp(up, -1.0, 1.0);
  let zenith = frame.sky_zenith.xyz;
  let horizon = frame.sky_horizon.xyz;
  if (y >= 0.0) {
    let low = (1.0 - y) * (1.0 - y);
    return zenith + (horizon - zenith) * (low * (1.0 - 0.5 * y));
  }
  let s = clamp((frame.ground_begins - y) / (frame.ground_begins - frame.ground_is_full), 0.0, 1.0);
  return horizon + (frame.sky_ground.xyz - horizon) * (s * s * (3.0 - 2.0 * s));
}

// Hashes of one and of two numbers.
fn mixed(number: u32) -> u32 {
  var x = (number ^ (number >> 16u)) * 0x7FEB352Du;
  x = (x ^ (x >> 15u)) * 0x846CA68Bu;
  return x ^ (x >> 16u);
}
fn hash_of(a: u32, b: u32) -> u32 {
  return mixed(a * 0x9E3779B9u + b * 0x85EBCA6Bu + 0x27D4EB2Fu);
}

// The lamps that may reach a voxel of an instance's tree: the index of the first in the lists, and their number.
fn lamps_around(voxel: vec4i) -> vec2u {
  let origin = placed_whole(voxel.w, kOrigin);
  let brick = ((voxel.xyz + origin.xyz) << vec3u(u32(origin.w))) >> vec3u(4u);
  let at = bitcast<vec3u>(brick);
  var slot = hash_of(hash_of(at.x, at.y), hash_of(at.z, u32(voxel.w))) & frame.lamp_mask;
  loop {
    let place = (frame.lamp_bricks.x >> 4u) + 2u * slot;
    let list = nodes[place + 1u].xy;
    if (list.y == 0u) {
      break;
    }
    if (all(bitcast<vec4i>(nodes[place]) == vec4i(brick, voxel.w))) {
      return list;
    }
    slot = (slot + 1u) & frame.lamp_mask;
  }
  return vec2u();
}

// Evaluates a lamp, which has thirteen vectors: position (w: its reach), three axes (w: the addend to the squared
// distance, cosines of a spot's angles), six powers, low (w: 1 for a point, 2 for a spot), high and direction.
fn lamp_vector(lamp: u32, field: u32) -> vec4f {
  return vector_at(frame.lamps.x, 13u * lamp + field);
}

struct LampRay {
  light: vec3f,  // on a white surface, if unoccluded
  direction: vec3f,
  reach: f32,    // distance to the lamp's surface
}

fn lamp_ray(lamp: u32, in_view: vec3f, normal: vec3f) -> LampRay {
  let position = lamp_vector(lamp, 0u);
  let to_lamp = position.xyz - in_view;
  let squared = dot(to_lamp, to_lamp);
  let away = sqrt(squared);
  var ray = LampRay(vec3f(), vec3f(), 0.0);
  if (!(away < position.w) || !(away > 0.0)) {
    return ray;
  }
  ray.direction = to_lamp / away;
  let cosine = dot(normal, ray.direction);
  if (!(cosine > 0.0)) {
    return ray;
  }
  let share = away / position.w;
  let fading = 1.0 - share * share * share * share;
  let first_axis = lamp_vector(lamp, 1u);
  var factor = cosine * fading / (squared + first_axis.w);
  ray.reach = away;
  let low = lamp_vector(lamp, 10u);
  if (low.w > 0.0) {
    if (low.w > 1.0) {
      let towards = -dot(lamp_vector(lamp, 12u).xyz, ray.direction);
      let inner = lamp_vector(lamp, 2u).w;
      let outer = lamp_vector(lamp, 3u).w;
      let cone = clamp((towards - outer) / (inner - outer), 0.0, 1.0);
      factor *= cone * cone;
    }
    ray.light = lamp_vector(lamp, 4u).xyz * factor;
    return ray;
  }
  let high = lamp_vector(lamp, 11u);
  var inside = kInfinity;
  for (var axis = 0u; axis < 3u; axis++) {
    let along = -dot(lamp_vector(lamp, 1u + axis).xyz, ray.direction);
    let face = 2u * axis + select(0u, 1u, along < 0.0);
    ray.light += lamp_vector(lamp, 4u + face).xyz * (abs(along) * factor);
    if (along != 0.0) {
      inside = min(inside, select(low[axis], high[axis], along > 0.0) / along);
    }
  }
  ray.reach = away - inside * (1.0 + 1e-6) - 1e-3 * (high.x - low.x);
  return ray;
}
