#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <quoin/core/image.h>
#include <quoin/core/result.h>
#include <quoin/core/vec.h>

namespace quoin {

// What is allowed of a look at most.
inline constexpr double kMaxBrightness = 1e9;  ///< also of colours of light
inline constexpr double kMaxAir = 100.0;       ///< times the Earth's
inline constexpr double kMaxAnisotropy = 0.99;
inline constexpr double kMaxFogDensity = 1e6;
inline constexpr double kMaxSunAngleRadians = 3.0;
inline constexpr int kMaxLensBlades = 64;

/// Where light comes from that comes from infinitely far away.
enum class SkyModel : std::uint8_t {
  Physical,     ///< a clear sky of the Earth by the sun's height, from noon to night; see AirOptions
  Gradient,     ///< the backdrop of LightOptions::sky_follows_sun
  Uniform,      ///< Look::sky_colour from everywhere
  Environment,  ///< Look::environment
};

/// The air of SkyModel::Physical, as multiples of the Earth's. Of at least 0 and at most 100 each.
struct AirOptions {
  double rayleigh = 1.0;        ///< what makes the sky blue and the sunset red
  double mie = 1.0;             ///< haze
  double ozone = 1.0;           ///< what keeps the sky blue at dusk
  double mie_anisotropy = 0.8;  ///< -0.99 to 0.99: how much haze shines about the sun
  Vec3 rayleigh_colour{1.0F};   ///< times what each channel of light is scattered
  Vec3 mie_colour{1.0F};
  Vec3 ozone_colour{1.0F};
  bool operator==(const AirOptions&) const = default;
};

/// A plane below a scene, level in the world.
struct GroundPlane {
  double height = 0.0;  ///< its y in the world
  Vec3 colour{0.5F};    ///< linear, 0 to 1 each; matte
  /// What is seen of it is the background, darker where less light comes than on open ground, and the scene's shadow
  /// in the alpha of a picture without a background. It throws light back at the scene like any ground.
  bool only_shadows = false;
  /// 0 to 1: how far below the horizon, as the sine of the angle, the camera sees it fade into the background.
  double fade = 0.0;
  bool operator==(const GroundPlane&) const = default;
};

/// Fog of the same density everywhere below a height.
struct Fog {
  double density = 0.01;    ///< how often light is scattered on a world unit's way, on average; 0 to 1e6
  Vec3 colour{1.0F};        ///< linear, 0 to 1 each: what is scattered of the light that meets it; the rest is absorbed
  double anisotropy = 0.0;  ///< the mean cosine of the angle by which it is scattered; -0.99 to 0.99
  double top = 0.0;         ///< its y in the world
  bool operator==(const Fog&) const = default;
};

/// What light a picture by paths has, and what lens. See PathTracer.
struct Look {
  DVec3 sun{-0.48, 0.72, 0.5};        ///< from the scene towards the sun; any length but 0
  double sun_angle_radians = 0.0093;  ///< of its disc, across; 0: a point, which is not seen itself; at most 3
  double sun_brightness = 1.0;        ///< 1: a white surface that faces it shows 1, before the air; 0: no sun
  Vec3 sun_colour{1.0F};              ///< linear
  bool sun_is_seen = true;            ///< the disc, by the camera and in mirrors and glass
  SkyModel sky = SkyModel::Physical;
  double sky_brightness = 1.0;                         ///< times the sky's light
  Vec3 sky_colour{1.0F};                               ///< of SkyModel::Uniform, linear
  AirOptions air{};                                    ///< of SkyModel::Physical
  std::shared_ptr<const RadianceImage> environment{};  ///< of SkyModel::Environment: longitude, latitude; +y up, middle
                                                       ///< -z, right half +x; what was drawn is not to be changed
  double environment_turn_radians = 0.0;               ///< about the vertical, from -z towards +x
  std::optional<Vec3> background{};                    ///< linear; what the camera sees in place of sky and sun

  double lamp_brightness = 1.0;  ///< times what lamps and glowing voxels give to others
  std::optional<GroundPlane> ground{};
  std::optional<Fog> fog{};

  double lens_radius = 0.0;     ///< world units; more than 0: what is not in focus is blurred. Perspective cameras only
  double focus_distance = 1.0;  ///< world units along the camera's forward axis; more than 0
  int lens_blades = 0;          ///< 3 to 64: what is out of focus shows a polygon of so many sides; 0: a disc
  double lens_turn_radians = 0.0;  ///< of that polygon

  bool operator==(const Look&) const = default;
};

/// Stands a look's ground below a scene, and has its fog reach up to the scene's top. `bounds`: of the scene, in the
/// world; where they are empty both are at a height of 0.
inline void fit_look(const DBox& bounds, Look& look) {
  if (look.ground) look.ground->height = bounds.empty() ? 0.0 : bounds.min.y;
  if (look.fog) look.fog->top = bounds.empty() ? 0.0 : bounds.max.y;
}

/// How linear light becomes the colours of a screen.
enum class ToneCurve : std::uint8_t {
  Clamp,    ///< 0 to 1 as it is: what LightModel::Rays shows
  Neutral,  ///< Khronos PBR Neutral: colours up to 0.8 as they are, what is brighter rolled off, paler
  Agx,      ///< AgX: as film, soft and pale in what is bright
  Aces,     ///< ACES, in the fit of S. Hill: contrast, as MagicaVoxel's pictures have
};

/// Light that spreads from what is bright, as in lenses and eyes.
struct Bloom {
  double mix = 0.0;        ///< 0 to 1: the share of the spread light
  double radius = 0.02;    ///< of its spread, of the picture's height; 0 to 1
  double aspect = 0.0;     ///< 0: round; up to 1 and down to -1: wide and flat, or narrow and tall
  double threshold = 0.0;  ///< only what is brighter spreads, after the exposure
  bool operator==(const Bloom&) const = default;
};

struct DevelopOptions {
  double exposure = 1.0;  ///< times all light
  ToneCurve tone = ToneCurve::Neutral;
  double vignette = 0.0;  ///< 0 to 1: how much darker the corners are
  double gamma = 2.2;     ///< more than 0: of the colours' curve; 2.2 is that of sRGB as it is, more is paler
  Bloom bloom{};
  bool operator==(const DevelopOptions&) const = default;
};

/// A time at a place, as far as the sun knows it.
struct SunTime {
  int month = 6;
  int day = 21;                   ///< of the month
  double hour = 12.0;             ///< mean solar time of the place, 0 to 24: clocks differ by its place in their zone
  double latitude_degrees = 0.0;  ///< north of the equator, -90 to 90
};

/// Where the sun stands: from the scene towards it, of unit length; +y is up, -z north, +x east. It may be below the
/// horizon. Error: a degree at most, of the years 1950 to 2050; a tenth near the middle of a leap cycle.
///
/// Source: the sun's declination and the equation of time as J. Spencer's Fourier series (1971).
/// Errors: InvalidArgument for a day or hour that there is not, and a latitude beyond the poles.
[[nodiscard]] Result<DVec3> sun_direction(const SunTime& time);

/// What a file says of how it wants to be drawn.
struct FileLook {
  Look look;  ///< without its environment and the height of its ground, which the file does not say
  DevelopOptions develop;
  std::string environment;             ///< of SkyModel::Environment: the name of a picture, as the file has it
  int max_bounces = 8;                 ///< PathOptions::max_bounces
  int max_scatterings = 64;            ///< likewise
  bool is_transparent = false;         ///< without a background
  std::vector<std::string> not_drawn;  ///< the names of settings that Quoin does not draw, with their values
};

}  // namespace quoin
