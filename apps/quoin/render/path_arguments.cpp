#include "render/path_arguments.h"

#include <algorithm>
#include <array>
#include <memory>
#include <numbers>
#include <string_view>
#include <utility>

#include <quoin/io/image_files.h>
#include <quoin/io/sidecar_file.h>

#include "parse.h"
#include "render/text_options.h"

namespace quoin::tool {
namespace {

constexpr int kMaxBounces = 1'024;
constexpr double kRadians = std::numbers::pi / 180.0;
constexpr std::array kPathOptions = {
    "--bounces",     "--sky",   "--sky-turn", "--tone",       "--sun-angle", "--sun-time", "--ground", "--transparent",
    "--lens-radius", "--focus", "--fog",      "--fog-colour", "--bloom",     "--vignette", "--look",   "--denoise"};
// Options of all light models that a scene file can also set.
constexpr std::array kCommonOptions = {"--sun", "--sky-brightness", "--exposure"};
constexpr std::array kOtherLight = {"--preset",      "--ao",          "--ao-rays",         "--ao-affects",
                                    "--ao-distance", "--ao-form",     "--ao-spread",       "--ao-offset",
                                    "--ao-power",    "--lamps",       "--fixed-sky",       "--plain-glass",
                                    "--detail",      "--lod-colours", "--shadow-distance", "--least-light"};

std::optional<double> read_sun_angle(const std::string& text) {
  const auto degrees = parse_number(text);
  return degrees && *degrees >= 0.0 && *degrees <= 170.0 ? degrees : std::nullopt;
}

// Parses `least` to `most` numbers with commas between them.
std::optional<std::vector<double>> read_numbers(const std::string& text, std::size_t least, std::size_t most) {
  std::vector<double> numbers;
  for (std::size_t from = 0; from <= text.size();) {
    const std::size_t end = std::min(text.find(',', from), text.size());
    const auto number = parse_number(std::string_view(text).substr(from, end - from));
    if (!number) return std::nullopt;
    numbers.push_back(*number);
    from = end + 1;
  }
  return numbers.size() >= least && numbers.size() <= most ? std::optional(numbers) : std::nullopt;
}

// Parses month, day, hour and latitude: "06-21,18.5,52".
std::optional<SunTime> read_sun_time(const std::string& text) {
  const std::size_t dash = text.find('-');
  const std::size_t comma = text.find(',');
  if (dash == std::string::npos || comma == std::string::npos || dash > comma) return std::nullopt;
  const auto month = parse_unsigned(std::string_view(text).substr(0, dash));
  const auto day = parse_unsigned(std::string_view(text).substr(dash + 1, comma - dash - 1));
  const auto rest = read_numbers(text.substr(comma + 1), 2, 2);
  if (!month || !day || *month > 12 || *day > 31 || !rest) return std::nullopt;
  SunTime time;
  time.month = static_cast<int>(*month);
  time.day = static_cast<int>(*day);
  time.hour = (*rest)[0];
  time.latitude_degrees = (*rest)[1];
  return sun_direction(time) ? std::optional(time) : std::nullopt;
}

std::optional<FogPlace> read_fog(const std::string& text) {
  const auto numbers = read_numbers(text, 1, 2);
  if (!numbers || !((*numbers)[0] >= 0.0 && (*numbers)[0] <= kMaxFogDensity)) return std::nullopt;
  FogPlace fog;
  fog.density = (*numbers)[0];
  if (numbers->size() > 1) fog.top = (*numbers)[1];
  return fog;
}

std::optional<DVec3> read_colour(const std::string& text) {
  const auto colour = parse_triple(text);
  const auto fits = [](double channel) { return channel >= 0.0 && channel <= 1.0; };
  return colour && fits(colour->x) && fits(colour->y) && fits(colour->z) ? colour : std::nullopt;
}

std::optional<Bloom> read_bloom(const std::string& text) {
  const auto numbers = read_numbers(text, 1, 3);
  if (!numbers) return std::nullopt;
  Bloom bloom;
  bloom.mix = (*numbers)[0];
  if (numbers->size() > 1) bloom.radius = (*numbers)[1];
  if (numbers->size() > 2) bloom.threshold = (*numbers)[2];
  const auto is_share = [](double value) { return value >= 0.0 && value <= 1.0; };
  return is_share(bloom.mix) && is_share(bloom.radius) && bloom.threshold >= 0.0 ? std::optional(bloom) : std::nullopt;
}

std::optional<double> read_share(const std::string& text) {
  const auto number = parse_number(text);
  return number && *number >= 0.0 && *number <= 1.0 ? number : std::nullopt;
}

ToneCurve tone_of(const std::string& name) {
  if (name == "clamp") return ToneCurve::Clamp;
  if (name == "agx") return ToneCurve::Agx;
  return name == "aces" ? ToneCurve::Aces : ToneCurve::Neutral;
}

// Reads the sky image of a .vox file from the folder of that file. MagicaVoxel keeps it in its own folder.
Result<RadianceImage> environment_beside(const CommonOptions& common, const std::string& name) {
  const std::string file = name.substr(name.find_last_of("/\\") + 1);
  const auto path = sidecar_path(common.input, file, common.load.sidecar_files);
  if (!path) return path.error();
  return read_radiance(*path);
}

void take_file_look(const FileLook& file, PathPlan& plan) {
  static_cast<Look&>(plan.options) = file.look;
  plan.develop = file.develop;
  plan.is_transparent = file.is_transparent;
  plan.options.max_bounces = file.max_bounces;
  plan.options.max_scatterings = file.max_scatterings;
  if (!file.not_drawn.empty()) {
    std::string all;
    for (const std::string& each : file.not_drawn) all += (all.empty() ? "" : ", ") + each;
    plan.warnings.push_back("unsupported render settings of the file: " + all);
  }
}

SkyModel sky_of(const PathArguments& arguments) {
  if (arguments.sky == "gradient") return SkyModel::Gradient;
  if (arguments.sky == "uniform") return SkyModel::Uniform;
  return is_sky_file(arguments) ? SkyModel::Environment : SkyModel::Physical;
}

Status take_sky(const PathArguments& arguments, const LoadedScene& loaded, const CommonOptions& common,
                PathPlan& plan) {
  PathOptions& options = plan.options;
  if (arguments.has("--sky")) {
    const Look plain;
    options.sky = sky_of(arguments);
    options.sky_brightness = plain.sky_brightness;
    options.sky_colour = plain.sky_colour;
    options.air = plain.air;
    options.background.reset();
    if (!is_sky_file(arguments)) return {};
    auto image = read_radiance(arguments.sky);
    if (!image) return image.error();
    options.environment = std::make_shared<const RadianceImage>(std::move(*image));
    options.environment_turn_radians = arguments.sky_turn_degrees * kRadians;
  } else if (options.sky == SkyModel::Environment) {
    auto image = environment_beside(common, loaded.look->environment);
    if (image) {
      options.environment = std::make_shared<const RadianceImage>(std::move(*image));
    } else {
      plan.warnings.push_back("using a uniform sky instead of the file's sky \"" + loaded.look->environment +
                              "\": " + image.error().message);
      options.sky = SkyModel::Uniform;
    }
  }
  return {};
}

void take_lens(const PathArguments& arguments, const LoadedScene& loaded, std::optional<int> file_camera,
               PathPlan& plan) {
  if (arguments.has("--lens-radius")) plan.options.lens_radius = arguments.lens_radius;
  plan.focus = arguments.focus;
  const auto looks = std::ranges::find(loaded.cameras, file_camera.value_or(-1), &FileCamera::number);
  if (!plan.focus && looks != loaded.cameras.end() && looks->focus_distance > 0.0) plan.focus = looks->focus_distance;
}

}  // namespace

void add_path_options(CLI::App& command, PathArguments& arguments) {
  command.add_option("--bounces", arguments.bounces, "Maximum number of bounces, 0 to 1024 (default 8)")
      ->check(CLI::Range(0, kMaxBounces));
  command
      .add_option("--sky", arguments.sky,
                  "Sky (default gradient). gradient: as with --light rays. physical: a clear sky for the height of the "
                  "sun. uniform: white from all directions, also from below. Or an environment image, .hdr or .exr")
      ->type_name("NAME|FILE");
  add_text_option(command, "--sky-turn", "DEGREES", "Rotation of an environment image around the vertical (default 0)");
  add_text_option(command, "--sun-angle", "DEGREES",
                  "Angular diameter of the sun, 0 to 170; greater makes shadows softer (default 0.53)");
  add_text_option(command, "--sun-time", "MM-DD,HOUR,LATITUDE",
                  "Sun direction by date, solar time and latitude, as in 06-21,18.5,52. North is -z");
  command.add_flag("--ground,!--no-ground", arguments.has_ground,
                   "Place the scene on level ground; with --transparent the ground only catches shadows");
  command.add_flag("--transparent", arguments.is_transparent, "Write alpha instead of a background");
  add_text_option(command, "--lens-radius", "X",
                  "Radius of the lens in world units; more than 0 gives depth of field (default 0)");
  add_text_option(command, "--focus", "X", "Focus distance in world units (default: the middle of the scene)");
  add_text_option(command, "--fog", "DENSITY[,TOP]",
                  "Fog: density in scattering events per world unit, and upper end (default: the top of the scene)");
  add_text_option(command, "--fog-colour", "R,G,B", "Linear colour of the fog, 0 to 1 each (default 1,1,1)");
  command
      .add_option("--tone", arguments.tone,
                  "Tone curve: clamp, neutral (Khronos PBR), agx or aces (default neutral; clamp with --sky uniform)")
      ->check(CLI::IsMember({"clamp", "neutral", "agx", "aces"}));
  add_text_option(command, "--bloom", "MIX[,RADIUS[,THRESHOLD]]",
                  "Bloom: share of the light that spreads, radius (share of the image height), minimum brightness "
                  "(default 0,0.02,0)");
  add_text_option(command, "--vignette", "X", "Darkening of the corners, 0 to 1 (default 0)");
  command
      .add_option(
          "--look", arguments.look,
          "Source of settings without an option: file (its render settings and focus) or plain (the defaults of "
          "quoin) (default file)")
      ->check(CLI::IsMember({"file", "plain"}));
  command.add_flag("--denoise", arguments.denoise, "Remove noise within surfaces and keep their edges");
}

std::string given_path_option(const CLI::App& command) {
  for (const char* option : kPathOptions) {
    if (command.count(option) > 0) return option;
  }
  return "";
}

std::string find_path_options_error(const CLI::App& command) {
  for (const char* option : kOtherLight) {
    if (command.count(option) > 0) return std::string(option) + " and --light path cannot be used together";
  }
  if (command.count("--fog-colour") > 0 && command.count("--fog") == 0) return "--fog-colour needs --fog";
  if (command.count("--sun-time") > 0 && command.count("--sun") > 0)
    return "--sun and --sun-time cannot be used together";
  return "";
}

std::string read_path_options(const CLI::App& command, PathArguments& arguments) {
  for (const std::string& fault :
       {read_option(command, "--sky-turn", parse_number, "a number", arguments.sky_turn_degrees),
        read_option(command, "--sun-angle", read_sun_angle, "from 0 to 170", arguments.sun_angle_degrees),
        read_option(command, "--sun-time", read_sun_time,
                    "a day, an hour from 0 to 24 and a latitude from -90 to 90, as in 06-21,18.5,52",
                    arguments.sun_time),
        read_option(command, "--fog", read_fog, "a density from 0 to 1e6, and a height, as in 0.02,40", arguments.fog),
        read_option(command, "--fog-colour", read_colour, "three numbers from 0 to 1, as in 0.8,0.9,1",
                    arguments.fog_colour),
        read_option(command, "--bloom", read_bloom, "a share, a radius from 0 to 1, and a threshold, as in 0.2,0.03,1",
                    arguments.bloom),
        read_option(command, "--vignette", read_share, "from 0 to 1", arguments.vignette),
        read_option(command, "--lens-radius", read_not_negative, "a number of at least 0", arguments.lens_radius),
        read_option(command, "--focus", read_positive, "a number above 0", arguments.focus)}) {
    if (!fault.empty()) return fault;
  }
  const auto note = [&](const char* option) {
    if (command.count(option) > 0) arguments.given.insert(option);
  };
  std::ranges::for_each(kPathOptions, note);
  std::ranges::for_each(kCommonOptions, note);
  if (command.count("--sky-turn") > 0 && !is_sky_file(arguments)) return "--sky-turn needs an image file for --sky";
  const std::string ending = CLI::detail::to_lower(std::filesystem::path(arguments.sky).extension().string());
  if (is_sky_file(arguments) && ending != ".hdr" && ending != ".exr") {
    return "--sky: must be physical, gradient, uniform, or an .hdr or .exr file, not \"" + arguments.sky + "\"";
  }
  return "";
}

bool is_sky_file(const PathArguments& arguments) {
  return arguments.sky != "physical" && arguments.sky != "gradient" && arguments.sky != "uniform";
}

Result<PathPlan> plan_paths(const PathArguments& arguments, const RenderOptions& render, const LoadedScene& loaded,
                            InstanceFilter filter, const CommonOptions& common, std::optional<int> file_camera) {
  PathPlan plan;
  PathOptions& options = plan.options;
  const bool has_look = loaded.look && arguments.look == "file";
  DVec3 sun = render.light.sun;
  if (arguments.sun_time) {
    const auto at_that_time = sun_direction(*arguments.sun_time);
    if (!at_that_time) return at_that_time.error();
    sun = *at_that_time;
  }
  const NaturalLook natural = natural_look(sky_of(arguments), sun);
  static_cast<Look&>(options) = natural.look;
  plan.develop = natural.develop;
  options.sun = sun;
  if (has_look) take_file_look(*loaded.look, plan);
  options.width = render.width;
  options.height = render.height;
  options.samples = render.samples;
  if (!has_look || arguments.has("--bounces")) options.max_bounces = arguments.bounces;
  if (arguments.has("--sun")) {
    options.sun = render.light.sun;
    if (render.light.sun_brightness == 0.0) options.sun_brightness = 0.0;
  }
  if (arguments.sun_time) options.sun = sun;
  if (!has_look || arguments.has("--sun-angle")) options.sun_angle_radians = arguments.sun_angle_degrees * kRadians;
  options.lamp_brightness = render.light.lamp_brightness;
  if (Status sky = take_sky(arguments, loaded, common, plan); !sky) return sky.error();
  if (arguments.has("--sky-brightness")) options.sky_brightness = render.light.sky_brightness;
  take_lens(arguments, loaded, file_camera, plan);

  if (arguments.has("--tone")) plan.develop.tone = tone_of(arguments.tone);
  if (arguments.has("--exposure")) plan.develop.exposure = render.light.exposure;
  if (arguments.has("--bloom")) plan.develop.bloom = arguments.bloom;
  if (arguments.has("--vignette")) plan.develop.vignette = arguments.vignette;
  plan.is_exposure_automatic = arguments.is_exposure_automatic;
  if (arguments.has("--transparent")) plan.is_transparent = true;
  plan.denoise = arguments.denoise;

  if (arguments.has("--ground") && !arguments.has_ground) {
    options.ground.reset();
  } else if (arguments.has_ground && !options.ground) {
    options.ground.emplace().colour = natural.ground_colour;
  }
  if (options.ground) options.ground->only_shadows = plan.is_transparent;
  if (arguments.fog) {
    options.fog.emplace();
    options.fog->density = arguments.fog->density;
    options.fog->colour = Vec3(arguments.fog_colour);
  }
  fit_look(loaded.scene.bounds(filter), options);
  if (arguments.fog && arguments.fog->top) options.fog->top = *arguments.fog->top;
  if (arguments.focus && !(options.lens_radius > 0.0)) {
    plan.warnings.emplace_back("--focus has no effect: the lens radius is 0; set --lens-radius");
  }
  return plan;
}

}  // namespace quoin::tool
