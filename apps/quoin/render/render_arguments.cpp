#include "render/render_arguments.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <limits>
#include <numbers>

#include "commands.h"
#include "options.h"
#include "render/image_output.h"

namespace quoin::tool {

namespace {

constexpr int kMaxOcclusionRays = 4'096;

const Choices<Preset> kPresets = {{"full", Preset::Full},  {"no-shadows", Preset::NoShadows},
                                  {"no-ao", Preset::NoAo}, {"unlit", Preset::Unlit},
                                  {"ao", Preset::Ao},      {"density", Preset::Density}};

std::string name_of(Preset preset) {
  return std::ranges::find(kPresets, preset, &std::pair<std::string, Preset>::second)->first;
}

/// The value of --sun.
struct SunArgument {
  std::optional<DVec3> direction;  ///< nullopt: off
};

std::optional<SunArgument> read_sun(const std::string& text) {
  if (text == "off") return SunArgument{};
  const auto direction = parse_triple(text);
  if (!direction) return std::nullopt;
  // Scaled so that the length is finite.
  const double largest = std::max({std::abs(direction->x), std::abs(direction->y), std::abs(direction->z)});
  return largest > 0.0 ? std::optional(SunArgument{*direction / largest}) : std::nullopt;
}

/// The value of --exposure.
struct ExposureArgument {
  std::optional<double> factor;  ///< nullopt: auto
};

std::optional<ExposureArgument> read_exposure(const std::string& text) {
  if (text == "auto") return ExposureArgument{};
  const auto factor = number_from_0().parse(text);
  return factor ? std::optional(ExposureArgument{factor}) : std::nullopt;
}

std::optional<double> read_angle(const std::string& text) {
  const auto degrees = parse_number(text);
  return degrees && *degrees > 0.0 && *degrees < 180.0 ? degrees : std::nullopt;
}

std::optional<double> read_rate(const std::string& text) {
  const auto rate = parse_number(text);
  return rate && *rate > 0.0 && *rate <= 1000.0 ? rate : std::nullopt;
}

/// The value of --camera.
struct CameraArgument {
  std::optional<DVec3> position;
  std::optional<int> number;
};

/// Parses "1,2,3" or "file:4".
std::optional<CameraArgument> read_camera(const std::string& text) {
  const std::string prefix = "file:";
  if (!text.starts_with(prefix)) {
    const auto position = parse_triple(text);
    return position ? std::optional(CameraArgument{*position, std::nullopt}) : std::nullopt;
  }
  const auto number = parse_unsigned(std::string_view(text).substr(prefix.size()));
  constexpr std::uint64_t kMost = std::numeric_limits<std::int32_t>::max();
  if (!number || *number > kMost) return std::nullopt;
  return CameraArgument{std::nullopt, static_cast<int>(*number)};
}

/// Parses "0:24".
std::optional<FrameRange> read_frames(const std::string& text) {
  const std::size_t colon = text.find(':');
  if (colon == std::string::npos) return std::nullopt;
  const auto first = parse_number(std::string_view(text).substr(0, colon));
  const auto last = parse_number(std::string_view(text).substr(colon + 1));
  const auto is_frame = [](const std::optional<double>& number) {
    return number && *number >= 0.0 && *number <= 1e6 && *number == std::floor(*number);
  };
  if (!is_frame(first) || !is_frame(last) || *last < *first) return std::nullopt;
  return FrameRange{static_cast<int>(*first), static_cast<int>(*last)};
}

/// The value of --slice.
struct SliceArgument {
  int axis = 1;
  double at = 0.5;
};

/// Parses "y:0.5".
std::optional<SliceArgument> read_slice(const std::string& text) {
  const std::size_t colon = text.find(':');
  const std::size_t axis = std::string("xyz").find(text.substr(0, colon));
  if (colon != 1 || axis == std::string::npos) return std::nullopt;
  const auto at = parse_number(std::string_view(text).substr(2));
  if (!at || *at < 0.0 || *at > 1.0) return std::nullopt;
  return SliceArgument{static_cast<int>(axis), *at};
}

void add_camera_options(CLI::App& command, RenderArguments& arguments) {
  const std::string three = "three numbers, as in 1,-2.5,3";
  Choices<View> views;
  for (const char* name : {"front", "back", "left", "right", "top", "iso"}) {
    views.emplace_back(name, view_of_name(name).value());
  }
  set_heading(command, heading::kCamera);
  add_choice(
      command, "--view", views, arguments.view,
      "Frame the whole scene from the front, back, left, right, top or iso (default: the initial camera of a .json "
      "or .quoin file, else iso)");
  add_parsed(command, "--azimuth", "DEGREES", number(), arguments.azimuth,
             "Camera angle around the whole scene, from the front to the right (default 45)");
  add_parsed(command, "--elevation", "DEGREES", number_between(-90.0, 90.0, "from -90 to 90"), arguments.elevation,
             "Camera angle above the horizon (default 35.26)");
  add_parsed<CameraArgument>(
      command, "--camera", "X,Y,Z|file:N", {read_camera, three + ", or a camera of the file, as in file:0"},
      [&arguments](const CameraArgument& camera) {
        arguments.position = camera.position;
        arguments.file_camera = camera.number;
      },
      "Position of the camera, with --look-at; or camera N of the file, as listed by quoin info");
  add_parsed<DVec3>(command, "--look-at", "X,Y,Z", {parse_triple, three}, arguments.target,
                    "Point in the middle of the image");
  add_parsed<double>(command, "--fov", "DEGREES", {read_angle, "more than 0 and less than 180"}, arguments.fov_degrees,
                     "Vertical field of view of --camera (default 45)");
}

void add_series_options(CLI::App& command, RenderArguments& arguments) {
  set_heading(command, heading::kSeries);
  command
      .add_option("--turntable", arguments.turns,
                  "Render this number of images around the scene, 2 to 100000: OUT-00.png, OUT-01.png, ...")
      ->check(CLI::Range(2, 100'000));
  add_parsed<FrameRange>(command, "--frames", "A:B", {read_frames, "two frames, as in 0:24"}, arguments.frames,
                         "Render each animation frame from A to B with one framing");
  command
      .add_option("--path", arguments.camera_path,
                  "Render an image for each camera in this JSON file, an array of the \"camera\" objects of --json: "
                  "OUT-00.png, OUT-01.png, ...")
      ->type_name("FILE")
      ->check(file_name());
  command.add_flag("--resume", arguments.resume, "Keep existing images of a series and render only the others");
  add_parsed<double>(command, "--fps", "N", {read_rate, "more than 0 and at most 1000"}, arguments.frames_per_second,
                     "Images per second of a video (default 24)");
}

void add_sun_and_sky_options(CLI::App& command, RenderArguments& arguments) {
  add_parsed<SunArgument>(
      command, "--sun", "X,Y,Z|off", {read_sun, "three numbers that are not all 0, as in 1,2,-0.5, or off"},
      [&arguments](const SunArgument& sun) {
        arguments.environment.sun = sun.direction;
        arguments.environment.is_sun_off = !sun.direction;
      },
      "Direction to the sun (default -0.48,0.72,0.5), or off for no sunlight. The sky darkens when the sun is low or "
      "below the horizon; off leaves the sky bright");
  command.add_flag("--fixed-sky", arguments.environment.is_sky_fixed,
                   "Keep the sky and the light colour of a clear day for every sun direction");
  add_parsed(command, "--sky-brightness", "X", number_from_0(), arguments.environment.sky_brightness,
             "Brightness factor of the sky (default 1)");
}

void add_light_options(CLI::App& command, RenderArguments& arguments) {
  LightOptions& light = arguments.render.light;
  set_heading(command, heading::kLight);
  add_choice<LightChoice>(
      command, "--light",
      {{"rays", LightChoice::Rays}, {"path", LightChoice::Path}, {"propagated", LightChoice::Propagated}},
      arguments.light,
      "Light model (default rays). rays: hard shadows and occlusion rays. path: path tracing with indirect "
      "light, soft shadows, gloss and refraction; takes minutes. propagated: light levels that spread from "
      "the sky and from emissive voxels, as in block games, without sun shadows");
  add_choice<Preset>(command, "--preset", kPresets, arguments.preset,
                     "Shading (default full): full, no-shadows, no-ao, unlit (colours only; --ao darkens corners), ao "
                     "(occlusion only, grey), or density (a slice through fields and volumes)");
  add_sun_and_sky_options(command, arguments);
  command
      .add_option(
          "--lamps", light.max_lamps,
          "Maximum number of lamps and emissive voxels that light a surface, 0 to 1024 (default 64). With 0, emissive "
          "voxels light only themselves")
      ->check(CLI::Range(0, 1024));
  add_parsed(command, "--lamp-brightness", "X", number_from_0(), arguments.environment.lamp_brightness,
             "Factor on the light that lamps and emissive voxels cast; their own appearance does not change "
             "(default 1)");
  add_parsed(command, "--emission-scale", "X", number_from_0(), arguments.emission_scale,
             "Factor on voxel emission: appearance and light cast (default 1)");
  add_parsed<ExposureArgument>(
      command, "--exposure", "X|auto", {read_exposure, number_from_0().must_be + ", or auto"},
      [&arguments](const ExposureArgument& exposure) {
        arguments.environment.exposure = exposure.factor;
        arguments.is_exposure_automatic = !exposure.factor;
      },
      "Brightness factor of lit surfaces, with --light path also of the background (default 1; 1.3 with --light path, "
      "2 with --sky physical), or auto with --light path, measured on the first image");
  add_parsed(command, "--shadow-distance", "VOXELS", number_from_0(), light.shadow_distance_voxels,
             "Maximum length of shadows (default: unlimited)");
  add_parsed(command, "--least-light", "X", number_from_0(), light.least_light,
             "Minimum light of --light propagated; with 0 closed rooms are black (default 0)");
  command.add_flag("!--plain-glass", light.glass_surfaces, "Render glass and water without reflections of the sky");
}

void add_occlusion_options(CLI::App& command, LightOptions& light) {
  set_heading(command, heading::kOcclusion);
  add_choice<OcclusionMode>(
      command, "--ao",
      {{"rays", OcclusionMode::Rays}, {"vertex", OcclusionMode::Vertex}, {"smooth", OcclusionMode::Smooth}},
      light.occlusion_mode,
      "Ambient occlusion (default rays). rays: by rays. vertex: as in blocky meshes. smooth: fields and "
      "volumes as in smooth meshes, see --ao-form");
  command
      .add_option("--ao-rays", light.occlusion_rays,
                  "Rays per point with --ao rays, 1 to 4096 (default 9; 16 if --ao-distance is more than 12)")
      ->check(CLI::Range(1, kMaxOcclusionRays));
  add_parsed(command, "--ao-distance", "VOXELS", number_from_0(), light.occlusion_distance_voxels,
             "Length of rays with --ao rays (default 6; on fields 18)");
  add_choice<OcclusionAffects>(
      command, "--ao-affects", {{"ambient", OcclusionAffects::Ambient}, {"all", OcclusionAffects::All}},
      light.occlusion_affects, "Light that occlusion darkens: ambient or all (default ambient)");
  add_field_occlusion_options(command, light.smooth_occlusion);
}

void add_detail_options(CLI::App& command, RenderArguments& arguments) {
  set_heading(command, heading::kDetail);
  add_choice<DetailChoice>(
      command, "--detail",
      {{"near", DetailChoice::Near}, {"radius", DetailChoice::Radius}, {"pixels", DetailChoice::Pixels}},
      arguments.detail,
      "Use coarser cells for far models: near (never), radius (by distance in model radii) or pixels (if a "
      "voxel is smaller than a pixel) (default near)");
  command.add_flag(
      "--lod-colours", arguments.render.detail.colours,
      "Colour models by level of detail, green (near) to blue (far). Without --detail it implies --detail pixels");
}

void add_backend_options(CLI::App& command, RenderArguments& arguments) {
  set_heading(command, heading::kDevice);
  add_choice<Backend>(
      command, "--backend", {{"cpu", Backend::Cpu}, {"vulkan", Backend::Vulkan}}, arguments.backend,
      "Renderer: cpu or vulkan. Their images differ by at most 2 of 255, except in fewer than 1 in 1,000 "
      "pixels (default cpu)");
  const auto named = [](const std::string& text) { return text.empty() ? std::nullopt : std::optional(text); };
  add_parsed<std::string>(command, "--device", "NAME|N", {named, "a number or a name"}, arguments.device,
                          "Vulkan device: its number or a part of its name (default: the best)");
}

std::vector<OptionRule> camera_rules(const RenderArguments& a) {
  const auto is_image_series = [&a] { return a.is_image_series(); };
  return {
      {{"--view", "--camera"}, excludes({"--azimuth", "--elevation"})},
      {{"--turntable"}, excludes({"--camera", "--frames"})},
      {{"--frame"}, excludes({"--frames"})},
      {{"--path"}, excludes({"--view", "--azimuth", "--elevation", "--camera", "--turntable", "--frames"})},
      {{"--fps"}, needs("a video: .mp4 or .webm", [&a] { return is_video(a.output); })},
      {{"--resume"}, needs("an image series: --turntable, --frames or --path", is_image_series)},
      {{"--turntable", "--frames", "--path"}, excludes({"--depth"})},
      {{"--camera"}, needs("--look-at", [&a] { return a.file_camera || a.target; })},
      {{"--look-at"}, needs("--camera X,Y,Z", [&a] { return a.position.has_value(); })},
      {{"--view"}, excludes({"--camera"})},
      {{"--fov"}, needs("--camera and --look-at; views frame the scene", [&a] { return a.position.has_value(); })},
  };
}

std::vector<OptionRule> slice_rules(const RenderArguments& a) {
  const auto is_slice = [&a] { return a.preset == Preset::Density; };
  return {
      {{"--slice"}, needs("--preset density", is_slice)},
      // A slice has no camera, light or rays.
      {{heading::kCamera, heading::kSeries, heading::kLight, heading::kOcclusion, heading::kPathTracing,
        heading::kDetail, heading::kDevice, "--samples", "--depth"},
       excludes("--preset density", is_slice),
       {"--preset"}},
  };
}

/// Returns a reason for presets without `thing`: "light", "shadows".
Reason lacks(const RenderArguments& arguments, std::vector<Preset> presets_with, std::string thing) {
  return [&arguments, presets_with = std::move(presets_with), thing = std::move(thing)](const CLI::App&) {
    return std::ranges::count(presets_with, arguments.preset) > 0
               ? ""
               : ": the preset " + name_of(arguments.preset) + " has no " + thing;
  };
}

std::vector<OptionRule> preset_rules(const RenderArguments& a) {
  const auto occlusion = [&a](const CLI::App& command) {
    const bool is_unlit = a.preset == Preset::Unlit;
    if (is_unlit && command.count("--ao") > 0) return std::string();
    const std::vector<Preset> with = {Preset::Full, Preset::NoShadows, Preset::Ao};
    const std::string reason = lacks(a, with, "ambient occlusion")(command);
    return is_unlit ? reason + " without --ao" : reason;
  };
  const auto is_mode = [&a](OcclusionMode mode) {
    return [&a, mode] { return a.render.light.occlusion_mode == mode; };
  };
  return {
      {{heading::kOcclusion}, occlusion},
      {{"--ao-affects"}, lacks(a, {Preset::Full, Preset::NoShadows}, "light")},
      {{"--ao-rays", "--ao-distance"}, needs("--ao rays", is_mode(OcclusionMode::Rays))},
      {kFieldOcclusion, needs("--ao smooth", is_mode(OcclusionMode::Smooth))},
      {{"--sun", "--exposure", "--lamps", "--lamp-brightness", "--sky-brightness", "--fixed-sky", "--plain-glass"},
       lacks(a, {Preset::Full, Preset::NoShadows, Preset::NoAo}, "light")},
      {{"--shadow-distance"}, lacks(a, {Preset::Full, Preset::NoAo}, "shadows")},
      {{"--lamp-brightness"},
       [&a](const CLI::App&) { return a.render.light.max_lamps == 0 ? " has no effect with --lamps 0" : ""; }},
  };
}

std::vector<OptionRule> light_rules(const RenderArguments& a) {
  const auto is_path = [&a] { return a.light == LightChoice::Path; };
  const auto is_propagated = [&a] { return a.light == LightChoice::Propagated; };
  return {
      {{heading::kPathTracing}, needs("--light path", is_path)},
      {{"--preset", heading::kOcclusion, "--lamps", "--fixed-sky", "--plain-glass", heading::kDetail,
        "--shadow-distance", "--least-light"},
       excludes("--light path", is_path)},
      {{"--exposure"},
       [&a, is_path](const CLI::App&) {
         return a.is_exposure_automatic && !is_path() ? " auto needs --light path" : "";
       }},
      {{"--least-light"}, needs("--light propagated", is_propagated)},
      {{"--light"},
       [&a, is_propagated](const CLI::App&) {
         const bool fits = !is_propagated() || a.preset == Preset::Full || a.preset == Preset::NoAo;
         return fits ? "" : " propagated and --preset " + name_of(a.preset) + " cannot be used together";
       }},
      {{"--lamps", "--ao-affects", "--shadow-distance"}, excludes("--light propagated", is_propagated)},
  };
}

std::vector<OptionRule> backend_rules(const RenderArguments& a) {
  const auto is_vulkan = [&a] { return a.backend == Backend::Vulkan; };
  return {
      {{"--device"}, needs("--backend vulkan", is_vulkan)},
      {{"--ao"},
       [&a, is_vulkan](const CLI::App&) {
         const bool is_refused = is_vulkan() && a.render.light.occlusion_mode == OcclusionMode::Smooth;
         return is_refused ? " smooth and --backend vulkan cannot be used together; use --backend cpu" : "";
       }},
  };
}

std::vector<OptionRule> render_rules(const RenderArguments& arguments) {
  std::vector<OptionRule> rules = raw_rules();
  for (std::vector<OptionRule>& more :
       std::array{field_occlusion_rules(arguments.render.light.smooth_occlusion), output_rules(arguments),
                  camera_rules(arguments), slice_rules(arguments), preset_rules(arguments), light_rules(arguments),
                  path_rules(arguments.path), backend_rules(arguments)}) {
    std::ranges::move(more, std::back_inserter(rules));
  }
  return rules;
}

// A given --ao-distance also applies to fields. Long rays show bands if all pixels share the same directions: use more
// rays, which are rotated from pixel to pixel.
void settle_occlusion_rays(const CLI::App& command, LightOptions& light) {
  constexpr double kFar = 12.0;
  constexpr int kRaysOfFar = 16;
  if (command.count("--ao-distance") == 0) return;
  light.field_occlusion_reach = 1.0;
  if (command.count("--ao-rays") == 0 && light.occlusion_distance_voxels > kFar) light.occlusion_rays = kRaysOfFar;
}

void settle_preset(const CLI::App& command, Preset preset, LightOptions& light) {
  if (preset == Preset::NoAo) light.occlusion_mode = OcclusionMode::Off;
  if (preset == Preset::NoShadows) light.shadows = false;
  if (preset == Preset::Ao) light.shading = Shading::Occlusion;
  if (preset != Preset::Unlit) return;
  light.shading = command.count("--ao") > 0 ? Shading::UnlitWithOcclusion : Shading::Unlit;
}

}  // namespace

void EnvironmentArguments::apply_to(Environment& environment) const {
  if (sun) environment.sun.direction = *sun;
  if (is_sun_off) environment.sun.brightness = 0.0;
  if (is_sky_fixed) environment.sky.model = SkyModel::Fixed;
  environment.sky.brightness = sky_brightness.value_or(environment.sky.brightness);
  environment.lamp_brightness = lamp_brightness.value_or(environment.lamp_brightness);
  if (exposure) environment.exposure = exposure;
}

DVec3 RenderArguments::forward() const {
  if (!azimuth && !elevation) return direction_of(view.value_or(View::Iso));
  const double iso_elevation = std::asin(std::sqrt(1.0 / 3.0)) * 180.0 / std::numbers::pi;
  return direction_of(azimuth.value_or(45.0), elevation.value_or(iso_elevation));
}

void add_render_options(CLI::App& command, RenderArguments& arguments) {
  arguments.render.light = natural_light();
  add_common_options(command, arguments.common, PlainBlocks::OwnPack);
  add_output_options(command, arguments);
  add_camera_options(command, arguments);
  add_series_options(command, arguments);
  add_light_options(command, arguments);
  add_occlusion_options(command, arguments.render.light);
  add_path_options(command, arguments.path);
  add_volume_options(command, arguments.common.load);
  add_parsed<SliceArgument>(
      command, "--slice", "AXIS:X", {read_slice, "x, y or z, and a position from 0 to 1, as in y:0.5"},
      [&slice = arguments.slice](const SliceArgument& place) {
        slice.axis = place.axis;
        slice.at = place.at;
      },
      "Position of the slice of --preset density: axis x, y or z, and 0 to 1 of the bounds (default y:0.5)");
  add_detail_options(command, arguments);
  add_backend_options(command, arguments);
}

Status settle(const CLI::App& command, RenderArguments& arguments) {
  if (Status fits = check_rules(command, render_rules(arguments)); !fits) return fits;
  if (arguments.position) {
    const auto camera = look_at(*arguments.position, *arguments.target, 1.0);
    if (!camera) return camera.error();
  }
  RenderOptions& render = arguments.render;
  render.samples = arguments.samples.value_or(arguments.light == LightChoice::Path ? 64 : 4);
  render.depth = !arguments.depth.empty();
  const auto detail = arguments.detail.value_or(render.detail.colours ? DetailChoice::Pixels : DetailChoice::Near);
  if (detail != DetailChoice::Near) {
    render.detail.policy.emplace().rule =
        detail == DetailChoice::Radius ? DetailPolicy::Rule::ByRadius : DetailPolicy::Rule::ByPixels;
  }
  if (arguments.light == LightChoice::Propagated) render.light.model = LightModel::Propagated;
  settle_occlusion_rays(command, render.light);
  settle_preset(command, arguments.preset, render.light);
  arguments.slice.width = render.width;
  arguments.slice.height = render.height;
  arguments.slice.instances = arguments.common.instances();
  return {};
}

}  // namespace quoin::tool
