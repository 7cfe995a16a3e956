#pragma once

#include <quoin/core/vec.h>
#include <quoin/scene/environment.h>

namespace quoin {

// Conversion of propagated light levels to colours. Images, shaders and mesh files all use these functions.

/// Mean of the light levels of several voxels: 0 to 15, fractional.
struct MeanLevels {
  float sky = 0.0F;
  float red = 0.0F;
  float green = 0.0F;
  float blue = 0.0F;

  bool operator==(const MeanLevels&) const = default;
};

/// Colours that light levels convert to, linear.
struct LightLook {
  Vec3 sky{1.0F};
  Vec3 lamps{1.0F};  ///< light of level 15 from lamps; multiplied with the lamps' own colours
  Vec3 least{0.0F};  ///< minimum light, added everywhere, also at level 0
};

/// Returns the colours of propagated light. The sky's colour combines sky and sun: 0.3 of the ambient light's colour,
/// scaled by the sky's brightness, plus 0.7 of the sun's colour, scaled by the sun's brightness. By day, with both
/// brightnesses 1, it is white. `least_light`: LightOptions::least_light.
[[nodiscard]] LightLook light_look(const Environment& environment, double least_light = 0.0);

/// Returns the linear brightness of a light level: f / (4 - 3 f) with f = level / 15. It is 1 at level 15 and 0 at
/// level 0. It stays within 0.04 of 0.8^(15 - level), the curve of older games, but reaches 0.
/// Source: the curve of Minecraft's light table, applied to linear light.
[[nodiscard]] constexpr float light_of_level(float level) {
  const float f = level * (1.0F / 15.0F);
  return f / (4.0F - 3.0F * f);
}

/// Returns the brightness of a surface by its orientation: 1 upwards, 0.5 downwards, 0.8 along z, 0.6 along x, and
/// between these weighted by the squares of the normal. It keeps edges visible in evenly lit rooms.
/// Source: Minecraft's block shading, extended to any normal as in Forge.
[[nodiscard]] constexpr float light_of_facing(Vec3 normal) {
  const float up = normal.y < 0.0F ? 0.5F : 1.0F;
  return 0.6F * normal.x * normal.x + up * normal.y * normal.y + 0.8F * normal.z * normal.z;
}

/// Returns the linear, unclamped factor for a surface's colour. Sky light and lamp light add up.
/// Requires: `normal` has unit length, in grid coordinates (y is up).
[[nodiscard]] inline Vec3 light_colour(const MeanLevels& levels, Vec3 normal, const LightLook& look) {
  const Vec3 of_lamps{light_of_level(levels.red), light_of_level(levels.green), light_of_level(levels.blue)};
  return light_of_facing(normal) * (look.least + light_of_level(levels.sky) * look.sky + of_lamps * look.lamps);
}

}  // namespace quoin
