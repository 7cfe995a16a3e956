#include "render/light/light_model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <quoin/render/light_options.h>
#include <quoin/render/propagated_light.h>

namespace quoin {
namespace {

// Zenith, horizon, ground and ambient light, three channels each.
using Colours = std::array<float, 12>;

struct Hour {
  float elevation = 0.0F;  // of the sun, degrees
  Colours look{};
};

constexpr Vec3 kZ = sky::kZenith;
constexpr Vec3 kH = sky::kHorizon;
constexpr Vec3 kG = sky::kGround;

// Chosen by eye, from night to day.
constexpr std::array<Hour, 8> kHours = {{
    {-18.0F, {0.004F, 0.007F, 0.022F, 0.012F, 0.016F, 0.035F, 0.006F, 0.007F, 0.011F, 0.14F, 0.18F, 0.34F}},
    {-9.0F, {0.012F, 0.024F, 0.080F, 0.085F, 0.078F, 0.140F, 0.022F, 0.023F, 0.034F, 0.26F, 0.30F, 0.52F}},
    {-4.0F, {0.028F, 0.060F, 0.170F, 0.420F, 0.240F, 0.220F, 0.060F, 0.055F, 0.070F, 0.40F, 0.42F, 0.62F}},
    {0.0F, {0.050F, 0.110F, 0.280F, 0.800F, 0.430F, 0.220F, 0.130F, 0.110F, 0.120F, 0.58F, 0.56F, 0.68F}},
    {3.0F, {0.070F, 0.160F, 0.370F, 0.850F, 0.560F, 0.330F, 0.200F, 0.170F, 0.160F, 0.72F, 0.69F, 0.76F}},
    {10.0F, {0.110F, 0.255F, 0.560F, 0.740F, 0.710F, 0.650F, 0.310F, 0.300F, 0.300F, 0.88F, 0.88F, 0.92F}},
    {30.0F, {kZ.x, kZ.y, kZ.z, kH.x, kH.y, kH.z, kG.x, kG.y, kG.z, 1.0F, 1.0F, 1.0F}},
    {90.0F, {kZ.x, kZ.y, kZ.z, kH.x, kH.y, kH.z, kG.x, kG.y, kG.z, 1.0F, 1.0F, 1.0F}},
}};

// The slope between two hours.
float secant(std::size_t hour, std::size_t channel) {
  const Hour& a = kHours.at(hour);
  const Hour& b = kHours.at(hour + 1);
  return (b.look.at(channel) - a.look.at(channel)) / (b.elevation - a.elevation);
}

// The slope at a table entry: the harmonic mean of the slopes on both sides, so that the curve stays between its
// neighbours.
// Source: F. N. Fritsch, R. E. Carlson, "Monotone piecewise cubic interpolation" (1980).
float slope(std::size_t hour, std::size_t channel) {
  if (hour == 0 || hour + 1 == kHours.size()) return 0.0F;
  const float before = secant(hour - 1, channel);
  const float after = secant(hour, channel);
  return before * after > 0.0F ? 2.0F * before * after / (before + after) : 0.0F;
}

Colours look_at_elevation(float degrees) {
  const float elevation = std::clamp(degrees, kHours.front().elevation, kHours.back().elevation);
  std::size_t hour = 0;
  while (hour + 2 < kHours.size() && elevation >= kHours.at(hour + 1).elevation) ++hour;
  const Hour& from = kHours.at(hour);
  const Hour& to = kHours.at(hour + 1);
  const float width = to.elevation - from.elevation;
  const float s = (elevation - from.elevation) / width;
  const float r = 1.0F - s;
  Colours look{};
  for (std::size_t i = 0; i < look.size(); ++i) {
    // Constant values keep their bits.
    look.at(i) = from.look.at(i) + (to.look.at(i) - from.look.at(i)) * (s * s * (3.0F - 2.0F * s)) +
                 width * s * r * (slope(hour, i) * r - slope(hour + 1, i) * s);
  }
  return look;
}

double smooth_step(double low, double high, double x) {
  const double s = std::clamp((x - low) / (high - low), 0.0, 1.0);
  return s * s * (3.0 - 2.0 * s);
}

// White where the sun stands highest.
Vec3 sun_through_air(double degrees) {
  const DVec3 scattering{0.05, 0.10, 0.21};  // of red, green and blue light in one thickness of air
  const double above = std::max(degrees, 0.0);
  const double air = 1.0 / (std::sin(above * std::numbers::pi / 180.0) + 0.50572 * std::pow(above + 6.07995, -1.6364));
  const double shows = smooth_step(-1.0, 1.0, degrees);
  Vec3 light;
  for (int channel = 0; channel < 3; ++channel) {
    light[channel] = static_cast<float>(shows * std::exp(-scattering[channel] * std::max(air - 1.0, 0.0)));
  }
  return light;
}

}  // namespace

Daylight daylight_of(const Environment& environment) {
  Daylight daylight;
  daylight.sun_brightness = environment.sun.brightness;
  if (environment.sky.model != SkyModel::Fixed) {
    const double sine = environment.sun.unit_direction().y;
    const double degrees = std::asin(std::clamp(sine, -1.0, 1.0)) * 180.0 / std::numbers::pi;
    const Colours look = look_at_elevation(static_cast<float>(degrees));
    daylight.sky = {{look[0], look[1], look[2]}, {look[3], look[4], look[5]}, {look[6], look[7], look[8]}};
    daylight.ambient = {look[9], look[10], look[11]};
    daylight.sun = sun_through_air(degrees);
  }
  daylight.sun *= environment.sun.colour;
  if (daylight.sun == Vec3(0.0F)) daylight.sun_brightness = 0.0;
  return daylight;
}

namespace {

constexpr float kOfSky = 0.3F;
constexpr float kOfSun = 0.7F;

}  // namespace

LightLook light_look(const Environment& environment, double least_light) {
  const Daylight daylight = daylight_of(environment);
  LightLook look;
  look.sky = kOfSky * static_cast<float>(environment.sky.brightness) * daylight.ambient +
             kOfSun * static_cast<float>(daylight.sun_brightness) * daylight.sun;
  look.lamps = Vec3(static_cast<float>(environment.lamp_brightness));
  look.least = Vec3(static_cast<float>(least_light));
  return look;
}

LightOptions natural_light() {
  LightOptions options;
  options.max_lamps = 64;
  options.glass_surfaces = true;
  options.field_occlusion_reach = 3.0;
  return options;
}

Status check(const LightOptions& options) {
  const auto refuse = [](const char* message) { return make_error(ErrorCode::InvalidArgument, message); };
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
  if (!(options.least_light >= 0.0 && options.least_light <= 1e9)) return refuse("least light: must be 0 to 1e9");
  if (options.max_lamps < 0 || options.max_lamps > 1024) return refuse("max_lamps: must be 0 to 1024");
  return {};
}

}  // namespace quoin
