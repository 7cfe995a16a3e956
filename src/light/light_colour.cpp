#include <quoin/light/light_colour.h>

#include "light/daylight.h"

namespace quoin {
namespace {

constexpr float kOfSky = 0.3F;
constexpr float kOfSun = 0.7F;

}  // namespace

LightLook light_look(const LightOptions& options) {
  const Daylight daylight = daylight_of(options);
  LightLook look;
  look.sky = kOfSky * static_cast<float>(options.sky_brightness) * daylight.ambient +
             kOfSun * static_cast<float>(daylight.sun_brightness) * daylight.sun;
  look.lamps = Vec3(static_cast<float>(options.lamp_brightness));
  look.least = Vec3(static_cast<float>(options.least_light));
  return look;
}

}  // namespace quoin
