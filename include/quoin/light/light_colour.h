#pragma once

#include <quoin/core/vec.h>
#include <quoin/light/light_options.h>

namespace quoin {

// How levels of propagated light become colours: pictures, shaders and files of meshes all do it by this.

/// Levels that are means of those of voxels: 0 to 15, not whole.
struct MeanLevels {
  float sky = 0.0F;
  float red = 0.0F;
  float green = 0.0F;
  float blue = 0.0F;

  bool operator==(const MeanLevels&) const = default;
};

/// What light of level 15 is like, linear.
struct LightLook {
  Vec3 sky{1.0F};
  Vec3 lamps{1.0F};  ///< times their own colours
  Vec3 least{0.0F};  ///< shines everywhere, at level 0 too
};

/// The sky's is what comes from the sky and the sun together: 0.3 of the ambient light's colour, with the sky's
/// brightness, and 0.7 of the sun's, with its own. By day, both 1, it is white.
[[nodiscard]] LightLook light_look(const LightOptions& options);

/// What arrives of a light, linear: f / (4 - 3 f) with f = level / 15. 1 at level 15, 0 at 0; within 0.04 of 0.8 to the
/// power of 15 - level, which older games have, but that this one comes to nothing.
/// Source: the curve of the light table of Minecraft, of linear light here.
[[nodiscard]] constexpr float light_of_level(float level) {
  const float f = level * (1.0F / 15.0F);
  return f / (4.0F - 3.0F * f);
}

/// How bright a surface is by the way it faces: 1 above, 0.5 below, 0.8 along z, 0.6 along x, and between them by the
/// squares of the normal. Without it corners of rooms cannot be seen where light is even.
/// Source: as Minecraft shades blocks, and as Forge continues that to any normal.
[[nodiscard]] constexpr float light_of_facing(Vec3 normal) {
  const float up = normal.y < 0.0F ? 0.5F : 1.0F;
  return 0.6F * normal.x * normal.x + up * normal.y * normal.y + 0.8F * normal.z * normal.z;
}

/// Linear, not clamped: what a surface's colour is multiplied with. Sky and lamps add up, as light does.
/// `normal`: unit, in the grid, whose y is up.
[[nodiscard]] inline Vec3 light_colour(const MeanLevels& levels, Vec3 normal, const LightLook& look) {
  const Vec3 of_lamps{light_of_level(levels.red), light_of_level(levels.green), light_of_level(levels.blue)};
  return light_of_facing(normal) * (look.least + light_of_level(levels.sky) * look.sky + of_lamps * look.lamps);
}

}  // namespace quoin
