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

// Upper limits of the settings in Look, AirOptions and Fog.
inline constexpr double kMaxBrightness = 1e9;  ///< also the limit of light colours
inline constexpr double kMaxAir = 100.0;       ///< multiples of the Earth's air
inline constexpr double kMaxAnisotropy = 0.99;
inline constexpr double kMaxFogDensity = 1e6;
inline constexpr double kMaxSunAngleRadians = 3.0;
inline constexpr int kMaxLensBlades = 64;

/// The source of environment light.
enum class SkyModel : std::uint8_t {
  Physical,     ///< a clear Earth sky for the sun's height, from noon to night; see AirOptions
  Gradient,     ///< the gradient of LightOptions::sky_follows_sun
  Uniform,      ///< Look::sky_colour from every direction
  Environment,  ///< Look::environment, an image
};

/// The air of SkyModel::Physical, as multiples of the Earth's air, each in [0, 100].
struct AirOptions {
  double rayleigh = 1.0;        ///< Rayleigh scattering: a blue sky and red sunsets
  double mie = 1.0;             ///< Mie scattering: haze
  double ozone = 1.0;           ///< ozone absorption: a blue sky at dusk
  double mie_anisotropy = 0.8;  ///< -0.99 to 0.99: glow of the haze around the sun
  Vec3 rayleigh_colour{1.0F};   ///< scale of Rayleigh scattering per colour channel
  Vec3 mie_colour{1.0F};
  Vec3 ozone_colour{1.0F};
  bool operator==(const AirOptions&) const = default;
};

/// A horizontal ground plane below a scene.
struct GroundPlane {
  double height = 0.0;  ///< world y
  Vec3 colour{0.5F};    ///< linear albedo, 0 to 1 per channel; matte
  /// Shows only the background on the plane, darkened where less light arrives than on open ground. In an image without
  /// a background, the alpha channel holds the scene's shadow. The plane still reflects light onto the scene.
  bool only_shadows = false;
  /// 0 to 1: the sine of the angle below the horizon over which the plane fades into the background.
  double fade = 0.0;
  bool operator==(const GroundPlane&) const = default;
};

/// Fog of constant density below a height.
struct Fog {
  double density = 0.01;  ///< mean number of scatterings per world unit, 0 to 1e6
  Vec3 colour{1.0F};      ///< linear, 0 to 1 per channel: the fraction of light that is scattered; the rest is absorbed
  double anisotropy = 0.0;  ///< mean cosine of the scattering angle, -0.99 to 0.99
  double top = 0.0;         ///< world y of the upper limit
  bool operator==(const Fog&) const = default;
};

/// Lighting and lens settings of a path-traced image. See PathTracer.
struct Look {
  DVec3 sun{-0.48, 0.72, 0.5};  ///< from the scene towards the sun; any non-zero length
  /// Angular diameter of the disc, at most 3; 0: a point, which the camera does not see.
  double sun_angle_radians = 0.0093;
  double sun_brightness = 1.0;  ///< 1: a white surface facing the sun shows 1, without air; 0: no sun
  Vec3 sun_colour{1.0F};        ///< linear
  bool sun_is_seen = true;      ///< shows the disc to the camera and in mirrors and glass
  SkyModel sky = SkyModel::Physical;
  double sky_brightness = 1.0;  ///< factor on the sky's light
  Vec3 sky_colour{1.0F};        ///< for SkyModel::Uniform, linear
  AirOptions air{};             ///< for SkyModel::Physical
  /// For SkyModel::Environment: an equirectangular image. Its top is +y, its middle -z, and its right half +x. Must not
  /// change after rendering starts.
  std::shared_ptr<const RadianceImage> environment{};
  double environment_turn_radians = 0.0;  ///< rotation about the vertical axis, from -z towards +x
  std::optional<Vec3> background{};       ///< linear; replaces sky and sun for the camera only

  double lamp_brightness = 1.0;  ///< factor on the light that lamps and emissive voxels cast
  std::optional<GroundPlane> ground{};
  std::optional<Fog> fog{};

  double lens_radius = 0.0;        ///< world units; more than 0: blurs objects out of focus. Perspective cameras only
  double focus_distance = 1.0;     ///< world units along the camera's forward axis; positive
  int lens_blades = 0;             ///< 3 to 64: number of sides of the aperture polygon; 0: a disc
  double lens_turn_radians = 0.0;  ///< rotation of that polygon

  bool operator==(const Look&) const = default;
};

/// Places a look's ground at the bottom of a scene and raises its fog to the top. `bounds` are the scene's bounds in
/// world space; for empty bounds both heights become 0.
inline void fit_look(const DBox& bounds, Look& look) {
  if (look.ground) look.ground->height = bounds.empty() ? 0.0 : bounds.min.y;
  if (look.fog) look.fog->top = bounds.empty() ? 0.0 : bounds.max.y;
}

/// Tone mapping from linear light to display colours.
enum class ToneCurve : std::uint8_t {
  Clamp,    ///< clamps to 0..1, as LightModel::Rays does
  Neutral,  ///< Khronos PBR Neutral: keeps colours up to 0.8, compresses and desaturates brighter light
  Agx,      ///< AgX: film-like, soft and desaturated in highlights
  Aces,     ///< ACES, S. Hill's fit: high contrast, as in MagicaVoxel's images
};

/// Glow around bright areas, as in lenses and eyes.
struct Bloom {
  double mix = 0.0;        ///< 0 to 1: the fraction of glow in the image
  double radius = 0.02;    ///< radius of the glow as a fraction of the image height; 0 to 1
  double aspect = 0.0;     ///< 0: round; towards 1: wide and flat; towards -1: narrow and tall
  double threshold = 0.0;  ///< only light brighter than this, after exposure, glows
  bool operator==(const Bloom&) const = default;
};

struct DevelopOptions {
  double exposure = 1.0;  ///< factor on all light
  ToneCurve tone = ToneCurve::Neutral;
  double vignette = 0.0;  ///< 0 to 1: darkening of the corners
  double gamma = 2.2;     ///< positive; exponent of the display curve; 2.2 keeps plain sRGB, larger values are paler
  Bloom bloom{};
  bool operator==(const DevelopOptions&) const = default;
};

/// A date, time and latitude for computing the sun's position.
struct SunTime {
  int month = 6;
  int day = 21;                   ///< of the month
  double hour = 12.0;             ///< local mean solar time, 0 to 24; clock time differs within a time zone
  double latitude_degrees = 0.0;  ///< north of the equator, -90 to 90
};

/// Returns the unit direction from the scene towards the sun. +y is up, -z is north, +x is east. The sun may be below
/// the horizon. The error is at most 1 degree for the years 1950 to 2050, and about 0.1 degree near the middle of a
/// leap cycle.
///
/// Source: J. Spencer's Fourier series (1971) for the sun's declination and the equation of time.
/// Errors: InvalidArgument if the day, hour or latitude is out of range.
[[nodiscard]] Result<DVec3> sun_direction(const SunTime& time);

/// The render settings stored in a file.
struct FileLook {
  Look look;  ///< without `environment` and the ground's height, which the file does not store
  DevelopOptions develop;
  std::string environment;             ///< for SkyModel::Environment: the image's name as stored in the file
  int max_bounces = 8;                 ///< PathOptions::max_bounces
  int max_scatterings = 64;            ///< PathOptions::max_scatterings
  bool is_transparent = false;         ///< renders without a background
  std::vector<std::string> not_drawn;  ///< names and values of settings that Quoin does not render
};

}  // namespace quoin
