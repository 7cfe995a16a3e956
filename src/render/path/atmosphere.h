#pragma once

#include <quoin/core/image.h>
#include <quoin/core/vec.h>
#include <quoin/render/path_tracer.h>

namespace quoin::path {

/// A clear sky, and the sun through it, seen from the ground.
struct AtmosphericSky {
  RadianceImage radiance;  ///< of all directions, laid out as in EnvironmentLight; without the sun
  Vec3 sunlight{0.0F};     ///< the transmitted sunlight
};

/// `to_sun`: unit, in the world. `irradiance`: of the sun outside the atmosphere. Below the horizon the image shows
/// ground.
///
/// Source: S. Hillaire, "A scalable and production ready sky and atmosphere rendering technique" (2020): single
///         scattering along the ray, and all further scattering from a table, with its constants for the Earth.
[[nodiscard]] AtmosphericSky atmospheric_sky(DVec3 to_sun, float irradiance, const AirOptions& air);

}  // namespace quoin::path
