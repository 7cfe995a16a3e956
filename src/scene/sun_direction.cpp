#include <quoin/scene/look.h>

#include <array>
#include <cmath>
#include <numbers>

namespace quoin {

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
