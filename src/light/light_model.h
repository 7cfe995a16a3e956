#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include <glm/geometric.hpp>

#include <quoin/light/light_options.h>
#include <quoin/scene/level_of_detail.h>

namespace quoin {

// The constants of the reference model of light, which light/lighting.h describes.
constexpr double kRayLift = 0.01;  ///< voxels in front of the face, where secondary rays start
constexpr float kAmbient = 0.15F;
constexpr float kAmbientWithoutOcclusion = 0.10F;
constexpr float kLeastOfAll = 0.25F;  ///< remaining light at full occlusion if it darkens all light

/// Returns true if surfaces show propagated light, which needs light levels of voxels.
[[nodiscard]] inline bool is_propagated(const LightOptions& options) {
  return options.model == LightModel::Propagated && options.shading == Shading::Lit;
}

/// Returns true if the shading shows values instead of colours.
[[nodiscard]] inline bool shows_values(Shading shading) {
  return shading == Shading::Occlusion || shading == Shading::Normals;
}

/// The unit vector towards the sun.
[[nodiscard]] inline DVec3 to_sun(const LightOptions& options) {
  // Scaled first: the square of a very small or large number is 0 or infinite.
  const DVec3 size = glm::abs(options.sun);
  return glm::normalize(options.sun / std::max({size.x, size.y, size.z}));
}

/// Returns the exposure, limited to be finite: infinity times black would be NaN.
[[nodiscard]] inline float exposure_of(const LightOptions& options) {
  return static_cast<float>(std::min<double>(options.exposure, std::numeric_limits<float>::max()));
}

/// Returns the linear colour that represents a level of detail.
[[nodiscard]] inline Vec3 colour_of_detail(Detail detail, int halvings) {
  if (detail == Detail::Near) return {0.10F, 0.55F, 0.12F};
  if (detail == Detail::Far) return {0.08F, 0.20F, 0.75F};
  const float share = static_cast<float>(halvings - 1) / static_cast<float>(kMaxGridLevel - 1);
  return {0.85F, 0.70F - 0.50F * std::clamp(share, 0.0F, 1.0F), 0.03F};
}

}  // namespace quoin
