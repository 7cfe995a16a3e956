#pragma once

#include <quoin/core/vec.h>
#include <quoin/scene/environment.h>

namespace quoin::viewer {

/// The sun's position in degrees. Azimuth 0 is south (+Z), positive towards the east (+X); elevation is above the
/// horizon.
struct SunAngles {
  double azimuth = 0.0;    ///< -180 to 180
  double elevation = 0.0;  ///< -90 to 90
};

/// Returns the angles of a direction towards the sun. Requires: `sun` is not zero.
[[nodiscard]] SunAngles sun_angles(DVec3 sun);
/// Returns the unit vector towards the sun.
[[nodiscard]] DVec3 sun_direction(const SunAngles& angles);

/// Returns the lowest elevation that can be set, in degrees: night if the sky follows the sun, else just high enough to
/// light surfaces from above.
[[nodiscard]] double lowest_sun(const Environment& environment);

/// Returns the sun after a drag in pixels: dx turns it, an upward drag raises it, limited to the zenith and
/// `lowest_sun`.
[[nodiscard]] DVec3 drag_sun(const Environment& environment, double dx, double dy);

}  // namespace quoin::viewer
