#pragma once

#include <quoin/core/vec.h>
#include <quoin/light/light_options.h>

namespace quoin::viewer {

/// Where the sun stands, in degrees: 0 is south (+Z), positive towards the east (+X); elevation above the horizon.
struct SunAngles {
  double azimuth = 0.0;    ///< -180 to 180
  double elevation = 0.0;  ///< -90 to 90
};

/// Of a direction towards the sun, of any length but 0.
[[nodiscard]] SunAngles sun_angles(DVec3 sun);
/// The unit vector towards the sun.
[[nodiscard]] DVec3 sun_direction(const SunAngles& angles);

/// How low the sun can be put, in degrees of elevation: to where it is night, if the sky follows it, else as low as it
/// still lights something from above.
[[nodiscard]] double lowest_sun(const LightOptions& light);

/// The sun after a drag by that many pixels: it goes round with dx and up with a drag upwards, never beyond straight up
/// or `lowest_sun`.
[[nodiscard]] DVec3 drag_sun(const LightOptions& light, double dx, double dy);

}  // namespace quoin::viewer
