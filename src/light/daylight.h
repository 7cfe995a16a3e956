#pragma once

#include <quoin/core/vec.h>
#include <quoin/light/light_options.h>

#include "light/sky.h"

namespace quoin {

/// What the sun and the sky give: the one model that every renderer has.
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
