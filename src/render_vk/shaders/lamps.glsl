// Lamps; matches light/lamp_table.h on the CPU.
#include "hash.glsl"

struct Lamp {
  vec4 position;  // in view; w: its reach
  vec4 axes[3];   // its own in view, unit; w: the term added to the squared distance, cosines of a spot's angles
  vec4 power[6];
  vec4 low;       // of its box, from its position along its axes; w: 1 for a point lamp, 2 for a spot
  vec4 high;
  vec4 direction;
};

struct LampBrick {
  ivec4 key;  // the brick; w: the instance
  uvec4 list;  // first, count: 0 if the slot is free
};

layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer Lamps {
  Lamp at[];
};
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer LampBricks {
  LampBrick at[];
};

// Returns the lamps of a 16^3 brick of an instance's full grid: the first index in the lists, and the count.
uvec2 lamps_at(ivec3 brick, int placed) {
  LampBricks bricks = LampBricks(frame().lamp_bricks);
  uint mask = frame().lamp_mask;
  uint slot = hash_of(hash_of(uint(brick.x), uint(brick.y)), hash_of(uint(brick.z), uint(placed))) & mask;
  for (;;) {
    LampBrick found = bricks.at[slot];
    if (found.list.y == 0) return uvec2(0);
    if (found.key == ivec4(brick, placed)) return found.list.xy;
    slot = (slot + 1) & mask;
  }
}

// Returns the light on a white surface if unblocked. If it is not 0, also sets the direction towards the lamp and the
// distance of its surface.
vec3 lamp_light(Lamp lamp, vec3 to_lamp, vec3 normal, out vec3 direction, out float reach) {
  float squared = dot(to_lamp, to_lamp);
  float far = sqrt(squared);
  if (!(far < lamp.position.w) || !(far > 0.0)) return vec3(0.0);
  direction = to_lamp / far;
  float cosine = dot(normal, direction);
  if (!(cosine > 0.0)) return vec3(0.0);
  float share = far / lamp.position.w;
  float fading = 1.0 - share * share * share * share;
  float factor = cosine * fading / (squared + lamp.axes[0].w);
  reach = far;
  if (lamp.low.w > 0.0) {
    if (lamp.low.w > 1.0) {
      float towards = -dot(lamp.direction.xyz, direction);
      float cone = clamp((towards - lamp.axes[2].w) / (lamp.axes[1].w - lamp.axes[2].w), 0.0, 1.0);
      factor *= cone * cone;
    }
    return lamp.power[0].xyz * factor;
  }
  vec3 light = vec3(0.0);
  float inside = kInfinity;
  for (int axis = 0; axis < 3; ++axis) {
    float along = -dot(lamp.axes[axis].xyz, direction);
    light += lamp.power[2 * axis + (along < 0.0 ? 1 : 0)].xyz * (abs(along) * factor);
    if (along != 0.0) inside = min(inside, (along > 0.0 ? lamp.high[axis] : lamp.low[axis]) / along);
  }
  reach = far - inside * (1.0 + 1e-6) - 1e-3 * (lamp.high.x - lamp.low.x);
  return light;
}
