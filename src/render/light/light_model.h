#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include <glm/geometric.hpp>

#include <quoin/core/vec.h>
#include <quoin/render/light_options.h>
#include <quoin/scene/environment.h>
#include <quoin/scene/level_of_detail.h>

namespace quoin {

// The constants of the reference model of light, which render/light/lighting.h describes.
constexpr double kRayLift = 0.01;  ///< voxels in front of the face, where secondary rays start
constexpr float kAmbient = 0.15F;
constexpr float kAmbientWithoutOcclusion = 0.10F;
constexpr float kLeastOfAll = 0.25F;  ///< remaining light at full occlusion if it darkens all light
/// Share of a field's occlusion rays that may be blocked without darkening, in the limit of an infinite reach.
constexpr double kFieldAllowance = 0.3;

/// Returns true if surfaces show propagated light, which needs light levels of voxels.
[[nodiscard]] inline bool is_propagated(const LightOptions& options) {
  return options.model == LightModel::Propagated && options.shading == Shading::Lit;
}

/// Returns the factor on the share of open occlusion rays at surfaces of fields; the product is limited to 1. The
/// factor is at least 1, and 1 up to a field_occlusion_reach of 1. Longer rays also meet the ground around open slopes.
/// With the factor they do not darken these slopes, and caves keep more contrast.
[[nodiscard]] inline float field_openness_factor(const LightOptions& options) {
  const double reach = std::max(options.field_occlusion_reach, 1.0);
  return static_cast<float>(1.0 / (1.0 - kFieldAllowance * (1.0 - 1.0 / reach)));
}

/// Returns true if the shading shows values instead of colours.
[[nodiscard]] inline bool shows_values(Shading shading) {
  return shading == Shading::Occlusion || shading == Shading::Normals;
}

/// Returns the exposure of surfaces, limited to be finite: infinity times black would be NaN.
[[nodiscard]] inline float exposure_of(const Environment& environment) {
  return static_cast<float>(std::min<double>(environment.exposure.value_or(1.0), std::numeric_limits<float>::max()));
}

/// Returns the linear colour that represents a level of detail.
[[nodiscard]] inline Vec3 colour_of_detail(Detail detail, int halvings) {
  if (detail == Detail::Near) return {0.10F, 0.55F, 0.12F};
  if (detail == Detail::Far) return {0.08F, 0.20F, 0.75F};
  const float share = static_cast<float>(halvings - 1) / static_cast<float>(kMaxGridLevel - 1);
  return {0.85F, 0.70F - 0.50F * std::clamp(share, 0.0F, 1.0F), 0.03F};
}

/// Sky colours in linear light. `kGroundBegins`, `kGroundIsFull`: the y of unit directions.
namespace sky {
constexpr Vec3 kZenith{0.145F, 0.335F, 0.700F};
constexpr Vec3 kHorizon{0.640F, 0.780F, 0.900F};
constexpr Vec3 kGround{0.400F, 0.410F, 0.430F};
constexpr float kGroundBegins = -0.02F;
constexpr float kGroundIsFull = -0.60F;
}  // namespace sky

/// The colours of a backdrop; by default a day's.
struct SkyColours {
  Vec3 zenith = sky::kZenith;
  Vec3 horizon = sky::kHorizon;
  Vec3 ground = sky::kGround;
};

/// Returns the backdrop in linear light: paler towards the horizon, with ground that fades in below it. An image's
/// exposure does not change it, so that a scene can be made brighter without overexposing the sky.
///
/// `up`: the y of a unit direction.
[[nodiscard]] inline Vec3 sky_colour(float up, const SkyColours& of = {}) {
  const float y = std::clamp(up, -1.0F, 1.0F);
  if (y >= 0.0F) {
    const float low = (1.0F - y) * (1.0F - y);
    return of.zenith + (of.horizon - of.zenith) * (low * (1.0F - 0.5F * y));
  }
  const float s = std::clamp((sky::kGroundBegins - y) / (sky::kGroundBegins - sky::kGroundIsFull), 0.0F, 1.0F);
  return of.horizon + (of.ground - of.horizon) * (s * s * (3.0F - 2.0F * s));
}

/// The light of sun and sky: the single model used by all renderers.
struct Daylight {
  SkyColours sky;               ///< before Sky::brightness
  Vec3 ambient{1.0F};           ///< times the ambient term
  Vec3 sun{1.0F};               ///< times the sun's light
  double sun_brightness = 1.0;  ///< as in the environment; 0 if the sun gives no light
};

/// Returns the colours of sun and sky. Always day for SkyModel::Fixed; all other models give the colours of Gradient.
///
/// Sun:     transmittance of the air by Rayleigh scattering. The length of the path is from F. Kasten, A. T. Young,
///          "Revised optical air mass tables and approximation formula" (1989). The sun fades out within two degrees.
/// Sky:     a monotone curve through a table of elevations. Above 30 degrees it has the day's colours; from 18 degrees
///          below the horizon downwards it is night, with a little light of its own.
[[nodiscard]] Daylight daylight_of(const Environment& environment);

}  // namespace quoin
