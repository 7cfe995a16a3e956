#include "sun.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace quoin::viewer {

namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kDegreesPerPixel = 0.4;
constexpr double kLowest = 2.0;  // a sun at the horizon lights nothing from above
constexpr double kNight = -20.0;
constexpr double kHighest = 89.0;  // the azimuth is still defined

}  // namespace

SunAngles sun_angles(DVec3 sun) {
  return {std::atan2(sun.x, sun.z) / kDegree, std::atan2(sun.y, std::hypot(sun.x, sun.z)) / kDegree};
}

DVec3 sun_direction(const SunAngles& angles) {
  const double level = std::cos(angles.elevation * kDegree);
  return {std::sin(angles.azimuth * kDegree) * level, std::sin(angles.elevation * kDegree),
          std::cos(angles.azimuth * kDegree) * level};
}

double lowest_sun(const Environment& environment) {
  return environment.sky.model == SkyModel::Fixed ? kLowest : kNight;
}

DVec3 drag_sun(const Environment& environment, double dx, double dy) {
  SunAngles angles = sun_angles(environment.sun.direction);
  angles.azimuth = std::remainder(angles.azimuth + dx * kDegreesPerPixel, 360.0);
  angles.elevation = std::clamp(angles.elevation - dy * kDegreesPerPixel, lowest_sun(environment), kHighest);
  return sun_direction(angles);
}

}  // namespace quoin::viewer
