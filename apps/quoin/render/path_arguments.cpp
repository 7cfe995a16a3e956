#include "render/path_arguments.h"

#include <array>
#include <numbers>

#include <quoin/io/picture_files.h>

#include "parse.h"
#include "render/text_options.h"

namespace quoin::tool {
namespace {

constexpr int kMaxBounces = 1'024;
constexpr std::array kPathOptions = {"--bounces", "--sky",         "--sky-turn",    "--tone", "--sun-angle",
                                     "--ground",  "--transparent", "--lens-radius", "--focus"};
constexpr std::array kOtherLight = {
    "--preset",    "--ao",          "--ao-rays",         "--ao-affects",  "--ao-distance", "--ao-form",
    "--ao-spread", "--ao-offset",   "--ao-power",        "--lamps",       "--fixed-sky",   "--plain-glass",
    "--detail",    "--lod-colours", "--shadow-distance", "--least-light", "--backend",     "--device"};

std::optional<double> read_sun_angle(const std::string& text) {
  const auto degrees = parse_number(text);
  return degrees && *degrees >= 0.0 && *degrees <= 170.0 ? degrees : std::nullopt;
}

}  // namespace

ToneCurve PathArguments::tone_curve() const {
  if (tone == "clamp") return ToneCurve::Clamp;
  if (tone == "agx") return ToneCurve::Agx;
  return tone == "aces" ? ToneCurve::Aces : ToneCurve::Neutral;
}

void add_path_options(CLI::App& command, PathArguments& arguments) {
  command
      .add_option("--bounces", arguments.bounces,
                  "Of --light path: how often light is scattered at most on its way, less one (default 8)")
      ->check(CLI::Range(0, kMaxBounces));
  command
      .add_option(
          "--sky", arguments.sky,
          "Of --light path: physical, a clear sky by the sun's height; gradient, that of --light rays; uniform, "
          "white from everywhere; or a picture of all directions, .hdr or .exr (default physical)")
      ->type_name("NAME|FILE");
  add_text_option(command, "--sky-turn", "DEGREES", "Turns a sky that is a file about the vertical (default 0)");
  command
      .add_option("--tone", arguments.tone,
                  "Of --light path: how bright light becomes colours: clamp, neutral (Khronos PBR), agx or aces "
                  "(default neutral)")
      ->check(CLI::IsMember({"clamp", "neutral", "agx", "aces"}));
  add_text_option(command, "--sun-angle", "DEGREES",
                  "Of --light path: how wide the sun is, which makes shadows soft; 0 to 170 (default 0.53)");
  command.add_flag("--ground", arguments.has_ground,
                   "Of --light path: stands the scene on level ground; with --transparent that only catches shadows");
  command.add_flag("--transparent", arguments.is_transparent,
                   "Of --light path: no background: the picture has alpha instead");
  add_text_option(command, "--lens-radius", "X",
                  "Of --light path: world units; with more than 0 what is out of focus is blurred (default 0)");
  add_text_option(command, "--focus", "X",
                  "Of --light path: the distance at which it is sharp (default: that of the scene's middle)");
}

std::string given_path_option(const CLI::App& command) {
  for (const char* option : kPathOptions) {
    if (command.count(option) > 0) return option;
  }
  return "";
}

std::string fault_of_path_options(const CLI::App& command) {
  for (const char* option : kOtherLight) {
    if (command.count(option) > 0) return std::string(option) + ": --light path has none to choose";
  }
  if (command.count("--focus") > 0 && command.count("--lens-radius") == 0) return "--focus needs --lens-radius";
  return "";
}

std::string read_path_options(const CLI::App& command, PathArguments& arguments) {
  for (const std::string& fault :
       {read_option(command, "--sky-turn", parse_number, "a number", arguments.sky_turn_degrees),
        read_option(command, "--sun-angle", read_sun_angle, "from 0 to 170", arguments.sun_angle_degrees),
        read_option(command, "--lens-radius", read_not_negative, "a number of at least 0", arguments.lens_radius),
        read_option(command, "--focus", read_positive, "a number above 0", arguments.focus)}) {
    if (!fault.empty()) return fault;
  }
  if (command.count("--sky-turn") > 0 && !is_sky_file(arguments)) return "--sky-turn needs a --sky that is a file";
  const std::string ending = CLI::detail::to_lower(std::filesystem::path(arguments.sky).extension().string());
  if (is_sky_file(arguments) && ending != ".hdr" && ending != ".exr") {
    return "--sky: must be physical, gradient, uniform, or the name of an .hdr or .exr, not \"" + arguments.sky + "\"";
  }
  return "";
}

bool is_sky_file(const PathArguments& arguments) {
  return arguments.sky != "physical" && arguments.sky != "gradient" && arguments.sky != "uniform";
}

Result<PathOptions> path_options(const PathArguments& arguments, const RenderOptions& render, const Scene& scene,
                                 InstanceFilter filter) {
  constexpr double kRadians = std::numbers::pi / 180.0;
  PathOptions options;
  options.width = render.width;
  options.height = render.height;
  options.samples = render.samples;
  options.max_bounces = arguments.bounces;
  options.sun = render.light.sun;
  options.sun_brightness = render.light.sun_brightness;
  options.sun_angle_radians = arguments.sun_angle_degrees * kRadians;
  options.sky_brightness = render.light.sky_brightness;
  options.lamp_brightness = render.light.lamp_brightness;
  options.lens_radius = arguments.lens_radius;
  if (arguments.sky == "gradient") options.sky = SkyModel::Gradient;
  if (arguments.sky == "uniform") options.sky = SkyModel::Uniform;
  if (is_sky_file(arguments)) {
    auto image = read_radiance(arguments.sky);
    if (!image) return image.error();
    options.sky = SkyModel::Environment;
    options.environment = std::make_shared<const RadianceImage>(std::move(*image));
    options.environment_turn_radians = arguments.sky_turn_degrees * kRadians;
  }
  if (arguments.has_ground) {
    const DBox bounds = scene.bounds(filter);
    options.ground.emplace();
    options.ground->height = bounds.empty() ? 0.0 : bounds.min.y;
    options.ground->only_shadows = arguments.is_transparent;
  }
  return options;
}

}  // namespace quoin::tool
