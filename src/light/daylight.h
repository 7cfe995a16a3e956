#pragma once

#include <algorithm>

#include <quoin/core/vec.h>
#include <quoin/light/light_options.h>

namespace quoin {

/// In linear light. `kGroundBegins`, `kGroundIsFull`: the y of unit directions.
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

/// The backdrop in linear light: paler towards the horizon, with ground that fades in below it. A picture's exposure
/// does not change it, so that a scene can be made brighter without the sky burning out.
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
  SkyColours sky;               ///< before LightOptions::sky_brightness
  Vec3 ambient{1.0F};           ///< times the ambient term
  Vec3 sun{1.0F};               ///< times the sun's light
  double sun_brightness = 1.0;  ///< the options', 0 where no light comes from the sun
};

/// A day's unless LightOptions::sky_follows_sun says otherwise.
///
/// Sun:     what air lets through of it by the Rayleigh scattering on its way, whose length is that of F. Kasten,
///          A. T. Young, "Revised optical air mass tables and approximation formula" (1989); it goes down within two
///          degrees.
/// Sky:     of a table of elevations, a smooth curve through which goes nowhere beyond two neighbours. From 30 degrees
///          upwards it is the day's; from 18 below the horizon downwards it is night, with a little light of its own.
[[nodiscard]] Daylight daylight_of(const LightOptions& options);

}  // namespace quoin
