#include "render/path_arguments.h"

#include <algorithm>
#include <cstdint>
#include <memory>
#include <numbers>
#include <string_view>
#include <utility>

#include <quoin/io/image_files.h>
#include <quoin/io/sidecar_file.h>

#include "options/options.h"
#include "options/parse.h"
#include "render/image_output.h"
#include "render/render_arguments.h"

namespace quoin::tool {
namespace {

constexpr int kMaxBounces = 1'024;
constexpr double kRadians = std::numbers::pi / 180.0;
constexpr int kUsualBounces = 8;
constexpr double kUsualSunAngle = 0.53;

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

std::optional<SkyArgument> read_sky(const std::string& text) {
  if (text == "physical") return SkyArgument{SkyModel::Physical, {}};
  if (text == "gradient") return SkyArgument{SkyModel::Gradient, {}};
  if (text == "uniform") return SkyArgument{SkyModel::Uniform, {}};
  const bool is_image = has_ending(text, ".hdr") || has_ending(text, ".exr");
  return is_image ? std::optional(SkyArgument{SkyModel::Environment, text}) : std::nullopt;
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

Status take_sky(const PathArguments& arguments, const LoadedScene& loaded, const CommonOptions& common,
                PathPlan& plan) {
  PathOptions& options = plan.options;
  if (arguments.sky) {
    const Look plain;
    options.sky = arguments.sky->model;
    options.sky_brightness = plain.sky_brightness;
    options.sky_colour = plain.sky_colour;
    options.air = plain.air;
    options.background.reset();
    if (options.sky != SkyModel::Environment) return {};
    auto image = read_radiance(arguments.sky->image);
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
  if (arguments.lens_radius) plan.options.lens_radius = *arguments.lens_radius;
  plan.focus = arguments.focus;
  const auto looks = std::ranges::find(loaded.cameras, file_camera.value_or(-1), &FileCamera::number);
  if (!plan.focus && looks != loaded.cameras.end() && looks->focus_distance > 0.0) plan.focus = looks->focus_distance;
}

}  // namespace

void add_path_options(CLI::App& command, PathArguments& arguments) {
  command.add_option("--bounces", arguments.bounces, "Maximum number of bounces, 0 to 1024 (default 8)")
      ->check(CLI::Range(0, kMaxBounces));
  add_parsed<SkyArgument>(
      command, "--sky", "NAME|FILE", {read_sky, "physical, gradient, uniform, or an .hdr or .exr file"}, arguments.sky,
      "Sky (default gradient). gradient: as with --light rays. physical: a clear sky for the height of the "
      "sun. uniform: white from all directions, also from below. Or an environment image, .hdr or .exr");
  add_parsed(command, "--sky-turn", "DEGREES", number(), arguments.sky_turn_degrees,
             "Rotation of an environment image around the vertical (default 0)");
  add_parsed(command, "--sun-angle", "DEGREES", number_between(0.0, 170.0, "from 0 to 170"),
             arguments.sun_angle_degrees,
             "Angular diameter of the sun, 0 to 170; greater makes shadows softer (default 0.53)");
  add_parsed<SunTime>(command, "--sun-time", "MM-DD,HOUR,LATITUDE",
                      {read_sun_time, "a day, an hour from 0 to 24 and a latitude from -90 to 90, as in 06-21,18.5,52"},
                      arguments.sun_time,
                      "Sun direction by date, solar time and latitude, as in 06-21,18.5,52. North is -z");
  const auto set_ground = [&arguments](std::int64_t sign) { arguments.ground = sign > 0; };
  command
      .add_flag_function("--ground,!--no-ground", set_ground,
                         "Place the scene on level ground; with --transparent the ground only catches shadows. "
                         "--no-ground leaves out the ground that the file sets")
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeLast);
  command.add_flag("--transparent", arguments.is_transparent, "Write alpha instead of a background");
  add_parsed(command, "--lens-radius", "X", number_from_0(), arguments.lens_radius,
             "Radius of the lens in world units; more than 0 gives depth of field (default 0)");
  command.add_option("--focus", arguments.focus, "Focus distance in world units (default: the middle of the scene)")
      ->type_name("X")
      ->check(positive());
  add_parsed<FogPlace>(
      command, "--fog", "DENSITY[,TOP]", {read_fog, "a density from 0 to 1e6, and a height, as in 0.02,40"},
      arguments.fog, "Fog: density in scattering events per world unit, and upper end (default: the top of the scene)");
  add_parsed<DVec3>(command, "--fog-colour", "R,G,B", {read_colour, "three numbers from 0 to 1, as in 0.8,0.9,1"},
                    arguments.fog_colour, "Linear colour of the fog, 0 to 1 each (default 1,1,1)");
  add_choice<ToneCurve>(command, "--tone",
                        {{"clamp", ToneCurve::Clamp},
                         {"neutral", ToneCurve::Neutral},
                         {"agx", ToneCurve::Agx},
                         {"aces", ToneCurve::Aces}},
                        arguments.tone,
                        "Tone curve: clamp, neutral (Khronos PBR), agx or aces (default neutral; clamp with --sky "
                        "uniform)");
  add_parsed<Bloom>(command, "--bloom", "MIX[,RADIUS[,THRESHOLD]]",
                    {read_bloom, "a share, a radius from 0 to 1, and a threshold, as in 0.2,0.03,1"}, arguments.bloom,
                    "Bloom: share of the light that spreads, radius (share of the image height), minimum brightness "
                    "(default 0,0.02,0)");
  add_parsed(command, "--vignette", "X", number_between(0.0, 1.0, "from 0 to 1"), arguments.vignette,
             "Darkening of the corners, 0 to 1 (default 0)");
  add_choice<bool>(command, "--look", {{"file", true}, {"plain", false}}, arguments.uses_file_look,
                   "Source of settings without an option: file (its render settings and focus) or plain (the defaults "
                   "of quoin) (default file)");
  command.add_flag("--denoise", arguments.denoise, "Remove noise within surfaces and keep their edges");
}

Result<PathPlan> plan_paths(const RenderArguments& all, const RenderOptions& render, const LoadedScene& loaded) {
  const PathArguments& arguments = all.path;
  PathPlan plan;
  PathOptions& options = plan.options;
  const bool has_look = loaded.look && arguments.uses_file_look;
  DVec3 sun = render.light.sun;
  if (arguments.sun_time) {
    const auto at_that_time = sun_direction(*arguments.sun_time);
    if (!at_that_time) return at_that_time.error();
    sun = *at_that_time;
  }
  const NaturalLook natural = natural_look(arguments.sky.value_or(SkyArgument{}).model, sun);
  static_cast<Look&>(options) = natural.look;
  plan.develop = natural.develop;
  options.sun = sun;
  if (has_look) take_file_look(*loaded.look, plan);
  options.width = render.width;
  options.height = render.height;
  options.samples = render.samples;
  if (!has_look || arguments.bounces) options.max_bounces = arguments.bounces.value_or(kUsualBounces);
  if (all.has_sun) {
    options.sun = render.light.sun;
    if (render.light.sun_brightness == 0.0) options.sun_brightness = 0.0;
  }
  if (arguments.sun_time) options.sun = sun;
  if (!has_look || arguments.sun_angle_degrees) {
    options.sun_angle_radians = arguments.sun_angle_degrees.value_or(kUsualSunAngle) * kRadians;
  }
  options.lamp_brightness = render.light.lamp_brightness;
  if (Status sky = take_sky(arguments, loaded, all.common, plan); !sky) return sky.error();
  if (all.sky_brightness) options.sky_brightness = *all.sky_brightness;
  take_lens(arguments, loaded, all.file_camera, plan);

  if (arguments.tone) plan.develop.tone = *arguments.tone;
  if (all.has_exposure) plan.develop.exposure = render.light.exposure;
  if (arguments.bloom) plan.develop.bloom = *arguments.bloom;
  if (arguments.vignette) plan.develop.vignette = *arguments.vignette;
  plan.is_exposure_automatic = all.is_exposure_automatic;
  if (arguments.is_transparent) plan.is_transparent = true;
  plan.denoise = arguments.denoise;

  if (arguments.ground == false) {
    options.ground.reset();
  } else if (arguments.ground && !options.ground) {
    options.ground.emplace().colour = natural.ground_colour;
  }
  if (options.ground) options.ground->only_shadows = plan.is_transparent;
  if (arguments.fog) {
    options.fog.emplace();
    options.fog->density = arguments.fog->density;
    options.fog->colour = Vec3(arguments.fog_colour);
  }
  fit_look(loaded.scene.bounds(all.common.instances()), options);
  if (arguments.fog && arguments.fog->top) options.fog->top = *arguments.fog->top;
  if (arguments.focus && !(options.lens_radius > 0.0)) {
    plan.warnings.emplace_back("--focus has no effect: the lens radius is 0; set --lens-radius");
  }
  return plan;
}

}  // namespace quoin::tool
