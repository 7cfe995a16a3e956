#include "render/path_arguments.h"

#include <algorithm>
#include <cstdint>
#include <memory>
#include <numbers>
#include <string_view>
#include <utility>

#include <quoin/io/file.h>
#include <quoin/io/image_files.h>

#include "options.h"
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
  return is_image ? std::optional(SkyArgument{SkyModel::Image, text}) : std::nullopt;
}

// Reads the sky image that a .vox file names, from the file's folder. The name has the path in MagicaVoxel's folder.
Result<RadianceImage> sky_image_of(const CommonOptions& common, const std::string& name) {
  const auto path = sidecar_path(common.input, name.substr(name.find_last_of("/\\") + 1), common.load.sidecar_files);
  if (!path) return path.error();
  return read_radiance(*path);
}

void take_file_settings(const FileRenderSettings& file, PathPlan& plan) {
  plan.options.environment = file.environment;
  plan.options.lens = file.lens;
  plan.options.max_bounces = file.max_bounces;
  plan.options.max_scatterings = file.max_scatterings;
  plan.is_transparent = file.is_transparent;
  if (!file.not_drawn.empty()) {
    std::string all;
    for (const std::string& each : file.not_drawn) all += (all.empty() ? "" : ", ") + each;
    plan.warnings.push_back("unsupported render settings of the file: " + all);
  }
}

Status take_sky(const RenderArguments& all, Sky& sky, bool is_of_vox, std::vector<std::string>& warnings) {
  const PathArguments& arguments = all.path;
  if (arguments.sky) {
    sky = {.model = arguments.sky->model};
    if (sky.model != SkyModel::Image) return {};
    auto image = read_radiance(arguments.sky->image);
    if (!image) return image.error();
    sky.image = std::make_shared<const RadianceImage>(std::move(*image));
    sky.image_turn_radians = arguments.sky_turn_degrees * kRadians;
    return {};
  }
  if (lacks_image(sky) && is_of_vox) {
    auto image = sky_image_of(all.common, sky.image_file);
    if (image) {
      sky.image = std::make_shared<const RadianceImage>(std::move(*image));
    } else {
      warnings.push_back("using a uniform sky instead of the file's sky \"" + sky.image_file +
                         "\": " + image.error().message);
    }
  }
  if (lacks_image(sky)) sky.model = SkyModel::Uniform;
  return {};
}

// Sets ground and fog. Those of .vox files and of options have no height of their own: they get the scene's bottom and
// top.
void take_ground_and_fog(const RenderArguments& all, const LoadedScene& loaded, bool is_white, bool is_transparent,
                         Environment& environment) {
  const PathArguments& arguments = all.path;
  const bool keeps_heights = loaded.scene.environment && !loaded.render_settings;
  Environment fitted;
  fitted.ground.emplace();
  fitted.fog.emplace();
  fit_environment(loaded.scene.bounds(all.common.instances()), fitted);
  if (arguments.ground == false) {
    environment.ground.reset();
  } else if (arguments.ground && !environment.ground) {
    environment.ground.emplace().height = fitted.ground->height;
    environment.ground->colour = Vec3(is_white ? 1.0F : 0.5F);
  }
  if (environment.ground) {
    environment.ground->only_shadows = is_transparent;
    if (!keeps_heights) environment.ground->height = fitted.ground->height;
  }
  if (environment.fog && !keeps_heights) environment.fog->top = fitted.fog->top;
  if (!arguments.fog) return;
  environment.fog.emplace();
  environment.fog->density = arguments.fog->density;
  environment.fog->colour = Vec3(arguments.fog_colour);
  environment.fog->top = arguments.fog->top.value_or(fitted.fog->top);
}

void take_lens(const PathArguments& arguments, const LoadedScene& loaded, std::optional<int> file_camera,
               PathPlan& plan) {
  if (arguments.lens_radius) plan.options.lens.radius = *arguments.lens_radius;
  plan.focus = arguments.focus;
  const auto looks = std::ranges::find(loaded.cameras, file_camera.value_or(-1), &FileCamera::number);
  if (!plan.focus && looks != loaded.cameras.end() && looks->focus_distance > 0.0) plan.focus = looks->focus_distance;
}

}  // namespace

void add_path_options(CLI::App& command, PathArguments& arguments) {
  set_heading(command, heading::kPathTracing);
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

std::vector<OptionRule> path_rules(const PathArguments& arguments) {
  return {
      {{"--fog-colour"}, needs("--fog")},
      {{"--sun"}, excludes({"--sun-time"})},
      {{"--sky-turn"},
       needs("an image file for --sky",
             [&arguments] { return arguments.sky && arguments.sky->model == SkyModel::Image; })},
  };
}

Result<PathPlan> plan_paths(const RenderArguments& all, const LoadedScene& loaded) {
  const PathArguments& arguments = all.path;
  PathPlan plan;
  PathOptions& options = plan.options;
  const std::optional<Environment>& of_scene = loaded.scene.environment;
  const bool has_settings = loaded.render_settings && arguments.uses_file_look;
  const bool has_environment = !has_settings && of_scene && arguments.uses_file_look;
  if (has_settings) {
    take_file_settings(*loaded.render_settings, plan);
  } else if (has_environment) {
    options.environment = of_scene;
  } else {
    options.environment = of_scene ? Environment::natural(of_scene->sun.direction) : Environment::natural();
  }
  options.width = all.render.width;
  options.height = all.render.height;
  options.samples = all.render.samples;
  if (!has_settings || arguments.bounces) options.max_bounces = arguments.bounces.value_or(kUsualBounces);
  Environment& environment = *options.environment;
  Sun& sun = environment.sun;
  if (arguments.sun_time) {
    const auto at_that_time = sun_direction(*arguments.sun_time);
    if (!at_that_time) return at_that_time.error();
    sun.direction = *at_that_time;
  }
  const bool has_usual_sun = !has_settings && !(has_environment && !is_only_sun(*of_scene));
  if (has_usual_sun || arguments.sun_angle_degrees) {
    sun.angle_radians = arguments.sun_angle_degrees.value_or(kUsualSunAngle) * kRadians;
  }
  if (Status sky = take_sky(all, environment.sky, has_settings, plan.warnings); !sky) return sky.error();
  all.environment.apply_to(environment);
  take_lens(arguments, loaded, all.file_camera, plan);

  if (arguments.tone) environment.tone = arguments.tone;
  if (arguments.bloom) environment.bloom = *arguments.bloom;
  if (arguments.vignette) environment.vignette = *arguments.vignette;
  plan.develop = develop_options(environment);
  plan.is_exposure_automatic = all.is_exposure_automatic;
  if (arguments.is_transparent) plan.is_transparent = true;
  plan.denoise = arguments.denoise;
  const bool is_white = arguments.sky ? arguments.sky->model == SkyModel::Uniform
                                      : has_environment && environment.sky.model == SkyModel::Uniform;
  take_ground_and_fog(all, loaded, is_white, plan.is_transparent, environment);
  if (arguments.focus && !(options.lens.radius > 0.0)) {
    plan.warnings.emplace_back("--focus has no effect: the lens radius is 0; set --lens-radius");
  }
  return plan;
}

}  // namespace quoin::tool
