#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>

#include <quoin/core/image.h>
#include <quoin/core/result.h>
#include <quoin/core/vec.h>

namespace [[gnu::visibility("default")]] quoin {

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
  /// The file name of `image`, relative to the scene's file. `load_scene` reads it for scene files and worlds
  /// (LoadOptions::sky_image); for other files see read_radiance.
  std::string image_file{};
  double image_turn_radians = 0.0;   ///< rotation of `image` about the vertical axis, from -z towards +x
  std::optional<Vec3> background{};  ///< linear; path tracing shows it to the camera in place of sky and sun
  bool operator==(const Sky&) const = default;
};

/// Returns true if the model is SkyModel::Image, but `image` has no pixels. Path tracing rejects such a sky.
[[nodiscard]] bool lacks_image(const Sky& sky);

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

/// The numbers that a setting can have; of colours, each component.
struct SettingRange {
  double least = -std::numeric_limits<double>::max();
  double most = std::numeric_limits<double>::max();
  const char* text = "finite";  ///< for messages: "0 to 1"
};

/// The ranges of settings. A direction is finite and not 0.
namespace setting {
inline constexpr SettingRange kFinite{};
inline constexpr SettingRange kNotNegative{.least = 0.0, .text = "finite and at least 0"};
inline constexpr SettingRange kPositive{std::numeric_limits<double>::denorm_min(), kFinite.most,
                                        "finite and more than 0"};
inline constexpr SettingRange kDirection{.text = "finite and not 0,0,0"};
inline constexpr SettingRange kShare{0.0, 1.0, "0 to 1"};
inline constexpr SettingRange kSignedShare{-1.0, 1.0, "-1 to 1"};
inline constexpr SettingRange kBrightness{0.0, kMaxBrightness, "0 to 1e9"};
inline constexpr SettingRange kAir{0.0, kMaxAir, "0 to 100"};
inline constexpr SettingRange kAnisotropy{-kMaxAnisotropy, kMaxAnisotropy, "-0.99 to 0.99"};
inline constexpr SettingRange kFogDensity{0.0, kMaxFogDensity, "0 to 1e6"};
inline constexpr SettingRange kSunAngle{0.0, kMaxSunAngleRadians, "0 to 3"};
}  // namespace setting

/// Calls `visit` for each setting of an Environment, or of a part of it, in the order of scene files: with its key
/// there, a pointer to its member, and the range of its numbers; parts, flags, names and files have no range. `check`,
/// scene files and worlds find the settings here, so that a new setting needs one line.
template <class Visit>
void visit_settings(std::type_identity<Sun>, Visit visit) {
  visit("direction", &Sun::direction, setting::kDirection);
  visit("brightness", &Sun::brightness, setting::kBrightness);
  visit("colour", &Sun::colour, setting::kBrightness);
  visit("angle_radians", &Sun::angle_radians, setting::kSunAngle);
  visit("visible", &Sun::is_visible);
}
template <class Visit>
void visit_settings(std::type_identity<AirOptions>, Visit visit) {
  visit("rayleigh", &AirOptions::rayleigh, setting::kAir);
  visit("mie", &AirOptions::mie, setting::kAir);
  visit("ozone", &AirOptions::ozone, setting::kAir);
  visit("mie_anisotropy", &AirOptions::mie_anisotropy, setting::kAnisotropy);
  visit("rayleigh_colour", &AirOptions::rayleigh_colour, setting::kAir);
  visit("mie_colour", &AirOptions::mie_colour, setting::kAir);
  visit("ozone_colour", &AirOptions::ozone_colour, setting::kAir);
}
template <class Visit>
void visit_settings(std::type_identity<Sky>, Visit visit) {
  visit("model", &Sky::model);
  visit("brightness", &Sky::brightness, setting::kBrightness);
  visit("colour", &Sky::colour, setting::kBrightness);
  visit("air", &Sky::air);
  visit("image_turn_radians", &Sky::image_turn_radians, setting::kFinite);
  visit("background", &Sky::background, setting::kBrightness);
  visit("image", &Sky::image_file);
}
template <class Visit>
void visit_settings(std::type_identity<GroundPlane>, Visit visit) {
  visit("height", &GroundPlane::height, setting::kFinite);
  visit("colour", &GroundPlane::colour, setting::kShare);
  visit("only_shadows", &GroundPlane::only_shadows);
  visit("fade", &GroundPlane::fade, setting::kShare);
}
template <class Visit>
void visit_settings(std::type_identity<Fog>, Visit visit) {
  visit("density", &Fog::density, setting::kFogDensity);
  visit("top", &Fog::top, setting::kFinite);
  visit("colour", &Fog::colour, setting::kShare);
  visit("anisotropy", &Fog::anisotropy, setting::kAnisotropy);
}
template <class Visit>
void visit_settings(std::type_identity<Bloom>, Visit visit) {
  visit("mix", &Bloom::mix, setting::kShare);
  visit("radius", &Bloom::radius, setting::kShare);
  visit("aspect", &Bloom::aspect, setting::kSignedShare);
  visit("threshold", &Bloom::threshold, setting::kNotNegative);
}
template <class Visit>
void visit_settings(std::type_identity<Environment>, Visit visit) {
  visit("sun", &Environment::sun);
  visit("sky", &Environment::sky);
  visit("ground", &Environment::ground);
  visit("fog", &Environment::fog);
  visit("lamp_brightness", &Environment::lamp_brightness, setting::kBrightness);
  visit("exposure", &Environment::exposure, setting::kNotNegative);
  visit("tone", &Environment::tone);
  visit("vignette", &Environment::vignette, setting::kShare);
  visit("gamma", &Environment::gamma, setting::kPositive);
  visit("bloom", &Environment::bloom);
}

/// An Environment, or a part of it with settings of its own.
template <class T>
concept EnvironmentPart = requires { visit_settings(std::type_identity<T>{}, 0); };

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

/// Checks that all settings are in their ranges. SkyModel::Image is valid without an image.
/// Errors: InvalidArgument, with the setting's name: "sky.air.mie: must be 0 to 100".
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
