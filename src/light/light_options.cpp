#include <quoin/light/light_options.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include "light/light_model.h"

namespace quoin {

LightOptions natural_light() {
  LightOptions options;
  options.sun = {-0.48, 0.72, 0.50};
  options.sky_follows_sun = true;
  options.max_lamps = 64;
  options.glass_surfaces = true;
  options.field_occlusion_reach = 3.0;
  return options;
}

namespace {

// Times the exposure of the day.
double night_exposure(DVec3 sun) {
  constexpr double kDusk = -4.0;  // degrees above the horizon
  constexpr double kNight = -14.0;
  constexpr double kGain = 4.0;
  LightOptions light;
  light.sun = sun;
  const double degrees = std::asin(std::clamp(to_sun(light).y, -1.0, 1.0)) * 180.0 / std::numbers::pi;
  const double s = std::clamp((kDusk - degrees) / (kDusk - kNight), 0.0, 1.0);
  return 1.0 + (kGain - 1.0) * s * s * (3.0 - 2.0 * s);
}

}  // namespace

NaturalLook natural_look(SkyModel sky, DVec3 sun) {
  constexpr double kGradientExposure = 1.3;
  constexpr double kPhysicalExposure = 2.0;
  NaturalLook natural;
  natural.look.sun = sun;
  natural.look.sky = sky;
  if (sky == SkyModel::Gradient) natural.develop.exposure = kGradientExposure * night_exposure(sun);
  if (sky == SkyModel::Physical) natural.develop.exposure = kPhysicalExposure;
  if (sky == SkyModel::Uniform) {
    natural.develop.tone = ToneCurve::Clamp;
    natural.ground_colour = Vec3(1.0F);
  }
  return natural;
}

Status check(const LightOptions& options) {
  const auto refuse = [](const char* message) { return make_error(ErrorCode::InvalidArgument, message); };
  if (!is_finite(options.sun)) return refuse("sun: must be finite");
  if (options.sun == DVec3(0.0)) return refuse("sun: must not be 0,0,0");
  if (options.occlusion_rays < 1 || options.occlusion_rays > 4096) {
    return refuse("occlusion rays: must be 1 to 4096");
  }
  if (!std::isfinite(options.occlusion_distance_voxels) || options.occlusion_distance_voxels < 0.0) {
    return refuse("occlusion distance: must be finite and not negative");
  }
  if (!(options.field_occlusion_reach >= 0.0 && options.field_occlusion_reach <= 1024.0)) {
    return refuse("field occlusion reach: must be 0 to 1024");
  }
  if (!(options.shadow_distance_voxels >= 0.0)) return refuse("shadow distance: must not be negative");
  if (!std::isfinite(options.exposure) || options.exposure < 0.0) {
    return refuse("exposure: must be finite and not negative");
  }
  for (const auto& [name, value] : {std::pair{"sun brightness", options.sun_brightness},
                                    {"sky brightness", options.sky_brightness},
                                    {"lamp brightness", options.lamp_brightness},
                                    {"least light", options.least_light}}) {
    if (!(value >= 0.0 && value <= 1e9)) {
      return make_error(ErrorCode::InvalidArgument, std::string(name) + ": must be 0 to 1e9");
    }
  }
  if (options.max_lamps < 0 || options.max_lamps > 1024) return refuse("max_lamps: must be 0 to 1024");
  return {};
}

}  // namespace quoin
