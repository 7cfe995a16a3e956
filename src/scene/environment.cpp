#include <quoin/scene/environment.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <type_traits>
#include <utility>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <quoin/core/assert.h>

namespace quoin {
namespace {

bool is_valid(double number, const SettingRange& range) {
  return number >= range.least && number <= range.most;
}
bool is_valid(Vec3 colour, const SettingRange& range) {
  return is_valid(colour.x, range) && is_valid(colour.y, range) && is_valid(colour.z, range);
}
bool is_valid(DVec3 direction, const SettingRange& /*range*/) {
  return is_finite(direction) && direction != DVec3(0.0);
}

template <class T>
std::string find_fault(const std::optional<T>& value, const SettingRange& range);

// Returns the message about a setting without its name (": must be 0 to 1"), or about the first invalid setting of a
// part, with its name in the part; "" if all are valid.
template <class T>
std::string find_fault(const T& value, const SettingRange& range) {
  if constexpr (EnvironmentPart<T>) {
    std::string fault;
    visit_settings(std::type_identity<T>{}, [&](const char* key, auto member, const SettingRange& valid = {}) {
      if (!fault.empty()) return;
      fault = find_fault(value.*member, valid);
      if (!fault.empty()) fault = key + std::string(fault.front() == ':' ? "" : ".") + fault;
    });
    return fault;
  } else if constexpr (requires { is_valid(value, range); }) {
    if (is_valid(value, range)) return "";
    return ": must be " + std::string(range.text) + (std::is_same_v<T, Vec3> ? " each" : "");
  } else {
    return "";  // flags, names and files
  }
}
template <class T>
std::string find_fault(const std::optional<T>& value, const SettingRange& range) {
  return value ? find_fault(*value, range) : "";
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

bool lacks_image(const Sky& sky) {
  if (sky.model != SkyModel::Image) return false;
  const RadianceImage* const image = sky.image.get();
  return image == nullptr || image->width <= 0 || image->height <= 0 ||
         image->rgb.size() != 3 * static_cast<std::size_t>(image->width) * static_cast<std::size_t>(image->height);
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
  std::string fault = find_fault(environment, {});
  return fault.empty() ? Status() : make_error(ErrorCode::InvalidArgument, std::move(fault));
}

Status check(const DevelopOptions& options) {
  Environment environment;
  environment.exposure = options.exposure;
  environment.vignette = options.vignette;
  environment.gamma = options.gamma;
  environment.bloom = options.bloom;
  return check(environment);
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
