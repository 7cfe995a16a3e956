#include <quoin/scene/environment.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <quoin/core/assert.h>

namespace quoin {
namespace {

Status refuse(const std::string& message) {
  return make_error(ErrorCode::InvalidArgument, message);
}

bool is_brightness(double value) {
  return value >= 0.0 && value <= kMaxBrightness;
}

bool is_colour(Vec3 colour, double most) {
  return is_finite(DVec3(colour)) && std::min({colour.x, colour.y, colour.z}) >= 0.0F &&
         std::max({colour.x, colour.y, colour.z}) <= static_cast<float>(most);
}

bool is_anisotropy(double value) {
  return value >= -kMaxAnisotropy && value <= kMaxAnisotropy;
}

Status check(const Sun& sun) {
  if (!is_finite(sun.direction) || sun.direction == DVec3(0.0)) {
    return refuse("sun.direction: must be finite and not 0,0,0");
  }
  if (!(sun.angle_radians >= 0.0 && sun.angle_radians <= kMaxSunAngleRadians)) {
    return refuse("sun.angle_radians: must be 0 to 3");
  }
  if (!is_brightness(sun.brightness)) return refuse("sun.brightness: must be 0 to 1e9");
  return is_colour(sun.colour, kMaxBrightness) ? Status() : refuse("sun.colour: must be 0 to 1e9 each");
}

Status check(const AirOptions& air) {
  for (const double part : {air.rayleigh, air.mie, air.ozone}) {
    if (!(part >= 0.0 && part <= kMaxAir)) return refuse("sky.air: each factor must be 0 to 100");
  }
  for (const Vec3& colour : {air.rayleigh_colour, air.mie_colour, air.ozone_colour}) {
    if (!is_colour(colour, kMaxAir)) return refuse("sky.air: each colour component must be 0 to 100");
  }
  return is_anisotropy(air.mie_anisotropy) ? Status() : refuse("sky.air: its mie_anisotropy must be -0.99 to 0.99");
}

Status check(const Sky& sky) {
  if (!is_brightness(sky.brightness)) return refuse("sky.brightness: must be 0 to 1e9");
  if (!is_colour(sky.colour, kMaxBrightness)) return refuse("sky.colour: must be 0 to 1e9 each");
  if (sky.background && !is_colour(*sky.background, kMaxBrightness)) {
    return refuse("sky.background: must be 0 to 1e9 each");
  }
  if (!std::isfinite(sky.image_turn_radians)) return refuse("sky.image_turn_radians: must be finite");
  return check(sky.air);
}

Status check(const GroundPlane& ground) {
  if (!std::isfinite(ground.height)) return refuse("ground: its height must be finite");
  if (!is_colour(ground.colour, 1.0)) return refuse("ground: each colour component must be 0 to 1");
  return ground.fade >= 0.0 && ground.fade <= 1.0 ? Status() : refuse("ground: its fade must be 0 to 1");
}

Status check(const Fog& fog) {
  if (!(fog.density >= 0.0 && fog.density <= kMaxFogDensity)) return refuse("fog: its density must be 0 to 1e6");
  if (!is_colour(fog.colour, 1.0)) return refuse("fog: each colour component must be 0 to 1");
  if (!is_anisotropy(fog.anisotropy)) return refuse("fog: its anisotropy must be -0.99 to 0.99");
  return std::isfinite(fog.top) ? Status() : refuse("fog: its top must be finite");
}

// The exposure of a gradient sky, as a multiple of the day's.
double exposure_of_hour(const Sun& sun) {
  constexpr double kDusk = -4.0;  // degrees above the horizon
  constexpr double kNight = -14.0;
  constexpr double kGain = 4.0;
  const double degrees = std::asin(std::clamp(sun.unit_direction().y, -1.0, 1.0)) * 180.0 / std::numbers::pi;
  const double s = std::clamp((kDusk - degrees) / (kDusk - kNight), 0.0, 1.0);
  return 1.0 + (kGain - 1.0) * s * s * (3.0 - 2.0 * s);
}

double usual_exposure(const Environment& environment) {
  constexpr double kGradientExposure = 1.3;
  constexpr double kPhysicalExposure = 2.0;
  switch (environment.sky.model) {
    case SkyModel::Fixed:
      return kGradientExposure;
    case SkyModel::Gradient:
      return kGradientExposure * exposure_of_hour(environment.sun);
    case SkyModel::Physical:
      return kPhysicalExposure;
    case SkyModel::Uniform:
    case SkyModel::Image:
      break;
  }
  return 1.0;
}

}  // namespace

DVec3 Sun::unit_direction() const {
  QUOIN_ASSERT(is_finite(direction) && direction != DVec3(0.0), "a direction");
  // Scaled first: the square of a very small or large number is 0 or infinite.
  const DVec3 size = glm::abs(direction);
  return glm::normalize(direction / std::max({size.x, size.y, size.z}));
}

Environment Environment::reference() {
  Environment environment;
  environment.sun.direction = {0.371, 0.743, 0.223};
  environment.sky.model = SkyModel::Fixed;
  environment.exposure = 1.0;
  return environment;
}

Environment Environment::natural(DVec3 sun) {
  Environment environment;
  environment.sun.direction = sun;
  return environment;
}

bool is_only_sun(const Environment& environment) {
  return environment == Environment::natural(environment.sun.direction);
}

DevelopOptions develop_options(const Environment& environment) {
  const bool is_white = environment.sky.model == SkyModel::Uniform;  // as bright as a white surface
  return {.exposure = environment.exposure.value_or(usual_exposure(environment)),
          .tone = environment.tone.value_or(is_white ? ToneCurve::Clamp : ToneCurve::Neutral),
          .vignette = environment.vignette,
          .gamma = environment.gamma,
          .bloom = environment.bloom};
}

void fit_environment(const DBox& bounds, Environment& environment) {
  if (environment.ground) environment.ground->height = bounds.empty() ? 0.0 : bounds.min.y;
  if (environment.fog) environment.fog->top = bounds.empty() ? 0.0 : bounds.max.y;
}

Status check(const Environment& environment) {
  if (Status sun = check(environment.sun); !sun) return sun;
  if (Status sky = check(environment.sky); !sky) return sky;
  if (Status ground = environment.ground ? check(*environment.ground) : Status(); !ground) return ground;
  if (Status fog = environment.fog ? check(*environment.fog) : Status(); !fog) return fog;
  if (!is_brightness(environment.lamp_brightness)) return refuse("lamp_brightness: must be 0 to 1e9");
  return check(develop_options(environment));
}

Status check(const DevelopOptions& options) {
  if (!std::isfinite(options.exposure) || options.exposure < 0.0) {
    return refuse("exposure: must be finite and at least 0");
  }
  if (!(options.vignette >= 0.0 && options.vignette <= 1.0)) return refuse("vignette: must be 0 to 1");
  if (!(options.gamma > 0.0) || !std::isfinite(options.gamma)) return refuse("gamma: must be finite and more than 0");
  const Bloom& bloom = options.bloom;
  if (!(bloom.mix >= 0.0 && bloom.mix <= 1.0)) return refuse("bloom: its mix must be 0 to 1");
  if (!(bloom.radius >= 0.0 && bloom.radius <= 1.0)) return refuse("bloom: its radius must be 0 to 1");
  if (!(bloom.aspect >= -1.0 && bloom.aspect <= 1.0)) return refuse("bloom: its aspect must be -1 to 1");
  if (!(bloom.threshold >= 0.0) || !std::isfinite(bloom.threshold)) {
    return refuse("bloom: its threshold must be finite and at least 0");
  }
  return {};
}

Result<DVec3> sun_direction(const SunTime& time) {
  constexpr std::array<int, 12> kDays = {31, 29, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31};
  constexpr std::array<int, 12> kDaysBefore = {0, 31, 59, 90, 120, 151, 181, 212, 243, 273, 304, 334};
  const auto refuse = [](const char* message) { return make_error(ErrorCode::InvalidArgument, message); };
  if (time.month < 1 || time.month > 12) return refuse("month: must be 1 to 12");
  const auto month = static_cast<std::size_t>(time.month - 1);
  if (time.day < 1 || time.day > kDays[month]) return refuse("day: out of range for the month");
  if (!(time.hour >= 0.0 && time.hour <= 24.0)) return refuse("hour: must be 0 to 24");
  if (!(std::abs(time.latitude_degrees) <= 90.0)) return refuse("latitude_degrees: must be -90 to 90");

  constexpr double kPi = std::numbers::pi;
  const double days = kDaysBefore[month] + time.day - 1 + (time.hour - 12.0) / 24.0;
  const double a = 2.0 * kPi * days / 365.0;
  const double declination = 0.006918 - 0.399912 * std::cos(a) + 0.070257 * std::sin(a) - 0.006758 * std::cos(2 * a) +
                             0.000907 * std::sin(2 * a) - 0.002697 * std::cos(3 * a) + 0.00148 * std::sin(3 * a);
  const double minutes_ahead = 229.18 * (0.000075 + 0.001868 * std::cos(a) - 0.032077 * std::sin(a) -
                                         0.014615 * std::cos(2 * a) - 0.040849 * std::sin(2 * a));
  const double turn = (time.hour - 12.0 + minutes_ahead / 60.0) * kPi / 12.0;  // since noon, towards the west
  const double latitude = time.latitude_degrees * kPi / 180.0;
  const double up =
      std::sin(latitude) * std::sin(declination) + std::cos(latitude) * std::cos(declination) * std::cos(turn);
  const double north =
      std::cos(latitude) * std::sin(declination) - std::sin(latitude) * std::cos(declination) * std::cos(turn);
  const double west = std::cos(declination) * std::sin(turn);
  return DVec3(-west, up, -north);
}

}  // namespace quoin
