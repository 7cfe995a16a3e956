#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include <quoin/core/image.h>
#include <quoin/core/result.h>
#include <quoin/core/vec.h>

namespace quoin {

// Upper limits of the settings of an Environment and its parts.
inline constexpr double kMaxBrightness = 1e9;  ///< also the limit of light colours
inline constexpr double kMaxAir = 100.0;       ///< multiples of the Earth's air
inline constexpr double kMaxAnisotropy = 0.99;
inline constexpr double kMaxFogDensity = 1e6;
inline constexpr double kMaxSunAngleRadians = 3.0;

/// The sun, infinitely far away.
struct Sun {
  DVec3 direction{-0.48, 0.72, 0.5};  ///< from the scene towards the sun; any non-zero length
  double brightness = 1.0;            ///< 1: a white surface facing the sun shows 1, without air; 0: no sun
  Vec3 colour{1.0F};                  ///< linear
  /// Angular diameter of the disc, at most 3; 0: a point, which the camera does not see. Only path tracing draws the
  /// soft shadows of a disc.
  double angle_radians = 0.0093;
  bool is_visible = true;  ///< path tracing shows the disc to the camera and in mirrors and glass
  bool operator==(const Sun&) const = default;

  /// Returns the direction with a length of 1. Requires: it is finite and not 0.
  [[nodiscard]] DVec3 unit_direction() const;
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

/// The source of the sky's light. Only path tracing draws the last three; other renderers draw Gradient for them.
enum class SkyModel : std::uint8_t {
  Fixed,     ///< a gradient of daylight colours, the same at any height of the sun
  Gradient,  ///< a gradient for the sun's height: day, golden hour, dusk, night; a sun below the horizon gives no light
  Physical,  ///< a clear Earth sky for the sun's height, from noon to night; see AirOptions
  Uniform,   ///< Sky::colour from every direction
  Image,     ///< Sky::image
};

struct Sky {
  SkyModel model = SkyModel::Gradient;
  double brightness = 1.0;  ///< factor on the sky's light
  Vec3 colour{1.0F};        ///< of SkyModel::Uniform, linear
  AirOptions air{};         ///< of SkyModel::Physical
  /// An equirectangular image for SkyModel::Image. Its top is +y, its middle -z, and its right half +x. Must not change
  /// after rendering starts.
  std::shared_ptr<const RadianceImage> image{};
  /// The file name of `image`, as the scene's file stores it. `load_scene` does not read this file; see read_radiance.
  std::string image_file{};
  double image_turn_radians = 0.0;   ///< rotation of `image` about the vertical axis, from -z towards +x
  std::optional<Vec3> background{};  ///< linear; path tracing shows it to the camera in place of sky and sun
  bool operator==(const Sky&) const = default;
};

/// A horizontal ground plane below a scene, for path tracing.
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

/// Fog of constant density below a height, for path tracing.
struct Fog {
  double density = 0.01;  ///< mean number of scatterings per world unit, 0 to 1e6
  Vec3 colour{1.0F};      ///< linear, 0 to 1 per channel: the fraction of light that is scattered; the rest is absorbed
  double anisotropy = 0.0;  ///< mean cosine of the scattering angle, -0.99 to 0.99
  double top = 0.0;         ///< world y of the upper limit
  bool operator==(const Fog&) const = default;
};

/// Tone mapping from linear light to display colours.
enum class ToneCurve : std::uint8_t {
  Clamp,    ///< clamps to 0..1, as renderers other than PathTracer always do
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

/// The conversion of a path-traced image from linear light to display colours: see `develop`.
struct DevelopOptions {
  double exposure = 1.0;  ///< factor on all light
  ToneCurve tone = ToneCurve::Neutral;
  double vignette = 0.0;  ///< 0 to 1: darkening of the corners
  double gamma = 2.2;     ///< positive; exponent of the display curve; 2.2 keeps plain sRGB, larger values are paler
  Bloom bloom{};
  bool operator==(const DevelopOptions&) const = default;
};

/// The light and air around a scene, and the exposure and tone of its images. A Scene holds one, all renderers read it,
/// and scene files and worlds store it.
struct Environment {
  Sun sun{};
  Sky sky{};
  std::optional<GroundPlane> ground{};
  std::optional<Fog> fog{};
  double lamp_brightness = 1.0;  ///< factor on the light that lamps and emissive voxels cast
  /// Factor on the light of all surfaces, and in path-traced images also of the background. Default: 1; in path-traced
  /// images a value that suits the sky model and the sun's height.
  std::optional<double> exposure{};
  std::optional<ToneCurve> tone{};  ///< of path-traced images; default: Neutral, or Clamp under a uniform sky
  double vignette = 0.0;            ///< as DevelopOptions; the last three are for path-traced images
  double gamma = 2.2;
  Bloom bloom{};

  bool operator==(const Environment&) const = default;

  /// Returns the environment of renderers for a scene without one: a fixed sky and an exposure of 1. Its images never
  /// change between versions.
  [[nodiscard]] static Environment reference();
  /// Returns the environment of the command-line tool and the viewer for a scene without one: a sun to the side of the
  /// View::Iso camera, so that shadows are visible, and a sky that follows the sun. Equal to Environment{}, with the
  /// sun in the given direction.
  [[nodiscard]] static Environment natural(DVec3 sun = Sun{}.direction);
};

/// Returns true if all settings except the sun's direction are those of Environment::natural().
[[nodiscard]] bool is_only_sun(const Environment& environment);

/// Returns the options for developing a path-traced image under an environment. Without an exposure of its own:
///
///   Fixed, Gradient: 1.3, for a pale background and bright shadows. Under Gradient it rises to four times as much
///                    while the sun sinks from 4 to 14 degrees below the horizon; otherwise the tone curve would leave
///                    the night black.
///   Physical:        2, because shadows under a clear, dark blue sky need it.
///   Uniform, Image:  1.
[[nodiscard]] DevelopOptions develop_options(const Environment& environment);

/// Places an environment's ground at the bottom of a scene and raises its fog to the top. `bounds` are the scene's
/// bounds in world space; for empty bounds both heights become 0.
void fit_environment(const DBox& bounds, Environment& environment);

/// Checks that all settings are valid.
/// Errors: InvalidArgument, with the setting's name, if a number is not finite or out of range: a sun of length 0, a
///         sun's angle outside 0 to 3, a brightness or exposure outside 0 to 1e9, and so on. SkyModel::Image is valid
///         without an image.
[[nodiscard]] Status check(const Environment& environment);
[[nodiscard]] Status check(const DevelopOptions& options);

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

}  // namespace quoin
