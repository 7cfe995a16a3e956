#include "render/render_arguments.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>

#include <quoin/io/file.h>

#include "field_occlusion.h"
#include "parse.h"
#include "render/image_output.h"
#include "render/movie.h"
#include "render/text_options.h"
#include "shell/help.h"
#include "standard_streams.h"
#include "volume_options.h"

namespace quoin::tool {

namespace {

constexpr int kMaxSamples = 4'096;
constexpr std::int64_t kMaxPixels = std::int64_t{1} << 28;
constexpr int kLongestSide = 1'000'000;  // the limit of PNG readers and writers

std::optional<DVec3> read_direction(const std::string& text) {
  const auto direction = parse_triple(text);
  if (!direction) return std::nullopt;
  // Scaled so that the length is finite.
  const double largest = std::max({std::abs(direction->x), std::abs(direction->y), std::abs(direction->z)});
  return largest > 0.0 ? std::optional(*direction / largest) : std::nullopt;
}

std::optional<double> read_angle(const std::string& text) {
  const auto degrees = parse_number(text);
  return degrees && *degrees > 0.0 && *degrees < 180.0 ? degrees : std::nullopt;
}

std::optional<ImageSize> read_size(const std::string& text) {
  const auto size = parse_size(text);
  const bool fits = size && std::max(size->width, size->height) <= kLongestSide &&
                    std::int64_t{size->width} * size->height <= kMaxPixels;
  return fits ? size : std::nullopt;
}

void add_camera_options(CLI::App& command, RenderArguments& arguments) {
  set_heading(command, heading::kCamera);
  command
      .add_option("--view", arguments.view_name,
                  "Frame the whole scene from the front, back, left, right, top or iso (default iso)")
      ->check(CLI::IsMember({"front", "back", "left", "right", "top", "iso"}));
  add_text_option(command, "--azimuth", "DEGREES",
                  "Camera angle around the whole scene, from the front to the right (default 45)");
  add_text_option(command, "--elevation", "DEGREES", "Camera angle above the horizon (default 35.26)");
  add_text_option(command, "--camera", "X,Y,Z|file:N",
                  "Position of the camera, with --look-at; or camera N of the file, as listed by quoin info");
  add_text_option(command, "--look-at", "X,Y,Z", "Point in the middle of the image");
  add_text_option(command, "--fov", "DEGREES", "Vertical field of view of --camera (default 45)");
  set_heading(command, heading::kSeries);
  command
      .add_option("--turntable", arguments.turns,
                  "Render this number of images around the scene, 2 to 100000: OUT-00.png, OUT-01.png, ...")
      ->check(CLI::Range(2, 100'000));
  add_text_option(command, "--frames", "A:B", "Render each animation frame from A to B with one framing");
  command
      .add_option("--path", arguments.camera_path,
                  "Render an image for each camera in this JSON file, an array of the \"camera\" objects of --json: "
                  "OUT-00.png, OUT-01.png, ...")
      ->type_name("FILE")
      ->check(file_name());
  command.add_flag("--resume", arguments.resume, "Keep existing images of a series and render only the others");
  add_text_option(command, "--fps", "N", "Images per second of a video (default 24)");
}

void add_light_options(CLI::App& command, RenderArguments& arguments) {
  set_heading(command, heading::kLight);
  command
      .add_option("--light", arguments.light_model,
                  "Light model (default rays). rays: hard shadows and occlusion rays. path: path tracing with all "
                  "bounces, soft shadows, gloss and refraction, which takes minutes. propagated: light levels that "
                  "spread from the sky and from glowing voxels, as in block games, without sun shadows")
      ->check(CLI::IsMember({"rays", "path", "propagated"}));
  command
      .add_option("--preset", arguments.preset,
                  "Shading (default full): full, no-shadows, no-ao, unlit (colours, times occlusion with --ao), ao "
                  "(occlusion only, grey), or density (a slice through fields and volumes)")
      ->check(CLI::IsMember({"full", "no-shadows", "no-ao", "unlit", "ao", "density"}));
  add_text_option(
      command, "--sun", "X,Y,Z|off",
      "Direction to the sun (default -0.48,0.72,0.5), or off. The sky follows the sun to dusk and night; off "
      "keeps the sky");
  command.add_flag("--fixed-sky", arguments.has_fixed_sky,
                   "Keep the sky and the light colour of a clear day for every sun direction");
  add_text_option(command, "--sky-brightness", "X", "Brightness factor of the sky (default 1)");
  command
      .add_option(
          "--lamps", arguments.render.light.max_lamps,
          "Maximum number of lamps and glowing voxels that light a surface, 0 to 1024 (default 64). With 0 they "
          "only glow themselves")
      ->check(CLI::Range(0, 1024));
  add_text_option(command, "--lamp-brightness", "X", "Brightness factor of the lamps (default 1)");
  add_text_option(command, "--emission-scale", "X", "Brightness factor of glowing voxels (default 1)");
  add_text_option(
      command, "--exposure", "X|auto",
      "Brightness factor of all light (default 1; 1.3 with --light path, 2 with --sky physical), or auto with --light "
      "path, measured on the first image");
  add_text_option(command, "--shadow-distance", "VOXELS", "Maximum length of shadows (default: unlimited)");
  add_text_option(command, "--least-light", "X",
                  "Minimum light of --light propagated; with 0 closed rooms are black (default 0)");
  command.add_flag("--plain-glass", arguments.has_plain_glass, "Render glass and water without reflections of the sky");
  set_heading(command, heading::kOcclusion);
  command
      .add_option("--ao", arguments.occlusion,
                  "Ambient occlusion (default rays). rays: by rays. vertex: as in blocky meshes. smooth: fields and "
                  "volumes as in smooth meshes, see --ao-form")
      ->check(CLI::IsMember({"rays", "vertex", "smooth"}));
  command
      .add_option("--ao-rays", arguments.render.light.occlusion_rays,
                  "Rays per point with --ao rays, 1 to 4096 (default 9; 16 if --ao-distance is more than 12)")
      ->check(CLI::Range(1, kMaxSamples));
  add_text_option(command, "--ao-distance", "VOXELS", "Length of rays with --ao rays (default 6; on fields 18)");
  command
      .add_option("--ao-affects", arguments.occlusion_affects,
                  "Light that occlusion darkens: ambient or all (default ambient)")
      ->check(CLI::IsMember({"ambient", "all"}));
  add_field_occlusion_options(command);
  set_heading(command, heading::kPathTracing);
  add_path_options(command, arguments.path);
}

void add_detail_options(CLI::App& command, RenderArguments& arguments) {
  set_heading(command, heading::kDetail);
  command
      .add_option("--detail", arguments.detail,
                  "Use coarser cells for far models: near (never), radius (by distance in model radii) or pixels (if a "
                  "voxel is smaller than a pixel) (default near)")
      ->check(CLI::IsMember({"near", "radius", "pixels"}));
  command.add_flag(
      "--lod-colours", arguments.render.detail.colours,
      "Colour models by level of detail, green (near) to blue (far). Without --detail it implies --detail pixels");
}

void add_backend_options(CLI::App& command, RenderArguments& arguments) {
  set_heading(command, heading::kDevice);
  command
      .add_option("--backend", arguments.backend,
                  "Renderer: cpu or vulkan. Their images differ in a few pixels at most (default cpu)")
      ->check(CLI::IsMember({"cpu", "vulkan"}));
  command
      .add_option("--device", arguments.device, "Vulkan device: its number or a part of its name (default: the best)")
      ->type_name("NAME|N");
}

std::string find_backend_error(const CLI::App& command, const RenderArguments& arguments) {
  const bool is_vulkan = arguments.backend == "vulkan";
  if (command.count("--device") > 0 && !is_vulkan) return "--device needs --backend vulkan";
  if (is_vulkan && arguments.occlusion == "smooth")
    return "--ao smooth and --backend vulkan cannot be used together; use --backend cpu";
  if (command.count("--device") > 0 && arguments.device.empty()) return "--device: must be a number or a name";
  return "";
}

std::string find_files_error(const RenderArguments& arguments) {
  const std::string out = arguments.output.string();
  const std::string depth = arguments.depth.string();
  if (is_movie(arguments.output)) {
    if (!arguments.is_film()) return "-o: the video " + out + " needs --turntable, --frames or --path";
    if (arguments.path.is_transparent) return "-o: videos have no alpha channel";
  } else if (const std::string fault = find_image_name_error(arguments.output); !fault.empty()) {
    return "-o: " + fault;
  }
  const bool is_path = arguments.light_model == "path";
  if (has_ending(arguments.output, ".exr") && !is_path) return "-o: .exr needs --light path";
  if (has_ending(arguments.output, ".jpg") && arguments.path.is_transparent) return "-o: .jpg has no alpha channel";
  if (is_same_file(arguments.output, arguments.common.input)) return "-o: " + out + " is the input";
  if (depth.empty()) return "";
  if (!has_ending(arguments.depth, ".pfm")) return "--depth: the name must end in .pfm, not \"" + depth + "\"";
  if (is_same_file(arguments.depth, arguments.common.input)) return "--depth: " + depth + " is the input";
  if (is_same_file(arguments.depth, arguments.output)) return "--depth: " + depth + " is the same file as -o";
  return "";
}

/// The value of --camera.
struct CameraPlace {
  std::optional<DVec3> position;
  std::optional<int> number;
};

/// Parses "1,2,3" or "file:4".
std::optional<CameraPlace> read_camera(const std::string& text) {
  const std::string prefix = "file:";
  if (!text.starts_with(prefix)) {
    const auto position = parse_triple(text);
    return position ? std::optional(CameraPlace{*position, std::nullopt}) : std::nullopt;
  }
  const auto number = parse_unsigned(std::string_view(text).substr(prefix.size()));
  constexpr std::uint64_t kMost = std::numeric_limits<std::int32_t>::max();
  if (!number || *number > kMost) return std::nullopt;
  return CameraPlace{std::nullopt, static_cast<int>(*number)};
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

std::optional<double> read_elevation(const std::string& text) {
  const auto degrees = parse_number(text);
  return degrees && std::abs(*degrees) <= 90.0 ? degrees : std::nullopt;
}

std::optional<double> read_rate(const std::string& text) {
  const auto rate = parse_number(text);
  return rate && *rate > 0.0 && *rate <= 1000.0 ? rate : std::nullopt;
}

std::string find_films_error(const CLI::App& command, const RenderArguments& arguments) {
  const auto has = [&](const char* option) { return command.count(option) > 0; };
  for (const char* option : {"--azimuth", "--elevation"}) {
    if (has(option) && has("--view")) return std::string("--view and ") + option + " cannot be used together";
    if (has(option) && has("--camera")) return std::string("--camera and ") + option + " cannot be used together";
  }
  if (has("--turntable") && has("--camera")) return "--turntable and --camera cannot be used together";
  if (has("--turntable") && has("--frames")) return "--turntable and --frames cannot be used together";
  if (has("--frames") && has("--frame")) return "--frame and --frames cannot be used together";
  for (const char* option : {"--view", "--azimuth", "--elevation", "--camera", "--turntable", "--frames"}) {
    if (has("--path") && has(option)) return std::string("--path and ") + option + " cannot be used together";
  }
  if (has("--fps") && !is_movie(arguments.output)) return "--fps needs a video: .mp4 or .webm";
  if (has("--resume") && !has("--turntable") && !has("--frames") && !has("--path")) {
    return "--resume needs an image series: --turntable, --frames or --path";
  }
  for (const char* option : {"--turntable", "--frames", "--path"}) {
    if (has(option) && has("--depth")) return std::string(option) + " and --depth cannot be used together";
  }
  return "";
}

std::string find_watching_error(const RenderArguments& arguments) {
  if (!arguments.watch) return "";
  if (arguments.common.json) return "--watch and --json cannot be used together";
  return arguments.common.input == kStandardStream ? "cannot use --watch with standard input" : "";
}

std::string find_camera_error(const CLI::App& command, const RenderArguments& arguments) {
  const bool has_position = arguments.position.has_value();
  const bool has_target = command.count("--look-at") > 0;
  if (has_position && !has_target) return "--camera needs --look-at";
  if (has_target && !has_position) return "--look-at needs --camera X,Y,Z";
  if (command.count("--camera") > 0 && command.count("--view") > 0)
    return "--view and --camera cannot be used together";
  if (command.count("--fov") > 0 && !has_position) return "--fov needs --camera and --look-at; views frame the scene";
  if (!arguments.position || !arguments.target) return "";
  const auto camera = look_at(*arguments.position, *arguments.target, 1.0);
  return camera ? "" : camera.error().message;
}

std::string find_light_error(const CLI::App& command, const RenderArguments& arguments) {
  const std::string& preset = arguments.preset;
  const bool is_lit = preset == "full" || preset == "no-shadows";
  const bool has_occlusion = is_lit || preset == "ao" || (preset == "unlit" && command.count("--ao") > 0);
  for (const char* option : {"--ao", "--ao-rays", "--ao-distance", "--ao-affects", "--ao-form", "--ao-spread",
                             "--ao-offset", "--ao-power"}) {
    if (command.count(option) > 0 && !has_occlusion) {
      return std::string(option) + ": the preset " + preset + " has no ambient occlusion" +
             (preset == "unlit" ? " without --ao" : "");
    }
  }
  if (command.count("--ao-affects") > 0 && !is_lit) return "--ao-affects: the preset " + preset + " has no light";
  for (const char* option : {"--ao-rays", "--ao-distance"}) {
    if (command.count(option) > 0 && arguments.occlusion != "rays") return std::string(option) + " needs --ao rays";
  }
  if (const char* given = given_field_occlusion(command); given != nullptr && arguments.occlusion != "smooth") {
    return std::string(given) + " needs --ao smooth";
  }
  for (const char* option :
       {"--sun", "--exposure", "--lamps", "--lamp-brightness", "--sky-brightness", "--fixed-sky", "--plain-glass"}) {
    if (command.count(option) > 0 && (preset == "unlit" || preset == "ao")) {
      return std::string(option) + ": the preset " + preset + " has no light";
    }
  }
  const bool has_shadows = preset == "full" || preset == "no-ao";
  if (command.count("--shadow-distance") > 0 && !has_shadows) {
    return "--shadow-distance: the preset " + preset + " has no shadows";
  }
  if (command.count("--lamp-brightness") > 0 && arguments.render.light.max_lamps == 0) {
    return "--lamp-brightness has no effect with --lamps 0";
  }
  return "";
}

std::string find_light_model_error(const CLI::App& command, const RenderArguments& arguments) {
  if (arguments.light_model == "path") return find_path_options_error(command);
  if (const std::string option = given_path_option(command); !option.empty()) return option + " needs --light path";
  if (arguments.path.is_exposure_automatic) return "--exposure auto needs --light path";
  const bool is_propagated = arguments.light_model == "propagated";
  if (command.count("--least-light") > 0 && !is_propagated) return "--least-light needs --light propagated";
  if (!is_propagated) return "";
  if (arguments.preset != "full" && arguments.preset != "no-ao") {
    return "--light propagated and --preset " + arguments.preset + " cannot be used together";
  }
  for (const char* option : {"--lamps", "--ao-affects", "--shadow-distance"}) {
    if (command.count(option) > 0) return std::string(option) + " and --light propagated cannot be used together";
  }
  return "";
}

/// Returns an error message if an option does not fit a slice, which has no camera, light or rays, else "".
std::string find_slice_error(const CLI::App& command, const RenderArguments& arguments) {
  if (arguments.preset != "density") {
    return command.count("--slice") > 0 ? "--slice needs --preset density" : "";
  }
  for (const char* option : {"--view",
                             "--camera",
                             "--look-at",
                             "--fov",
                             "--sun",
                             "--sky-brightness",
                             "--lamps",
                             "--lamp-brightness",
                             "--ao",
                             "--ao-rays",
                             "--ao-affects",
                             "--ao-distance",
                             "--ao-form",
                             "--ao-spread",
                             "--ao-offset",
                             "--ao-power",
                             "--shadow-distance",
                             "--exposure",
                             "--samples",
                             "--depth",
                             "--detail",
                             "--lod-colours",
                             "--backend",
                             "--device",
                             "--fixed-sky",
                             "--azimuth",
                             "--elevation",
                             "--turntable",
                             "--frames",
                             "--path",
                             "--resume",
                             "--plain-glass",
                             "--light",
                             "--least-light",
                             "--emission-scale",
                             "--bounces",
                             "--sky",
                             "--sky-turn",
                             "--tone",
                             "--sun-angle",
                             "--ground",
                             "--transparent",
                             "--lens-radius",
                             "--focus",
                             "--sun-time",
                             "--fog",
                             "--fog-colour",
                             "--bloom",
                             "--vignette",
                             "--look",
                             "--denoise"}) {
    if (command.count(option) > 0) return std::string(option) + " and --preset density cannot be used together";
  }
  return "";
}

bool is_sun_off(const CLI::App& command) {
  return command.count("--sun") > 0 && command.get_option("--sun")->results().back() == "off";
}

bool is_exposure_automatic(const CLI::App& command) {
  return command.count("--exposure") > 0 && command.get_option("--exposure")->results().back() == "auto";
}

struct SlicePlace {
  int axis = 1;
  double at = 0.5;
};

/// Parses "y:0.5".
std::optional<SlicePlace> read_slice(const std::string& text) {
  const std::size_t colon = text.find(':');
  const std::size_t axis = std::string("xyz").find(text.substr(0, colon));
  if (colon != 1 || axis == std::string::npos) return std::nullopt;
  const auto at = parse_number(std::string_view(text).substr(2));
  if (!at || *at < 0.0 || *at > 1.0) return std::nullopt;
  return SlicePlace{static_cast<int>(axis), *at};
}

/// Reads the options that CLI11 leaves as text. Returns the first usage error, or "".
std::string read_texts(const CLI::App& command, RenderArguments& arguments) {
  const std::string three = "three numbers, as in 1,-2.5,3";
  const std::string at_least_0 = "a number of at least 0";
  LightOptions& light = arguments.render.light;
  ImageSize size{arguments.render.width, arguments.render.height};
  SlicePlace slice;
  CameraPlace camera;
  const std::array faults = {
      read_option(command, "--size", read_size,
                  "WIDTHxHEIGHT of at most 2^28 pixels and 1000000 per side, as in 1280x720", size),
      read_option(command, "--camera", read_camera, three + ", or a camera of the file, as in file:0", camera),
      read_option(command, "--look-at", parse_triple, three, arguments.target),
      read_option(command, "--fov", read_angle, "more than 0 and less than 180", arguments.fov_degrees),
      is_sun_off(command) ? ""
                          : read_option(command, "--sun", read_direction,
                                        "three numbers that are not all 0, as in 1,2,-0.5, or off", light.sun),
      read_option(command, "--sky-brightness", read_not_negative, at_least_0, light.sky_brightness),
      read_option(command, "--lamp-brightness", read_not_negative, at_least_0, light.lamp_brightness),
      read_option(command, "--least-light", read_not_negative, at_least_0, light.least_light),
      read_option(command, "--ao-distance", read_not_negative, at_least_0, light.occlusion_distance_voxels),
      read_option(command, "--shadow-distance", read_not_negative, at_least_0, light.shadow_distance_voxels),
      is_exposure_automatic(command)
          ? ""
          : read_option(command, "--exposure", read_not_negative, at_least_0 + ", or auto", light.exposure),
      read_option(command, "--emission-scale", read_not_negative, at_least_0, arguments.emission_scale),
      read_path_options(command, arguments.path),
      read_option(command, "--azimuth", parse_number, "a number", arguments.azimuth),
      read_option(command, "--elevation", read_elevation, "from -90 to 90", arguments.elevation),
      read_option(command, "--frames", read_frames, "two frames, as in 0:24", arguments.frames),
      read_option(command, "--fps", read_rate, "more than 0 and at most 1000", arguments.frames_per_second),
      read_option(command, "--slice", read_slice, "x, y or z, and a position from 0 to 1, as in y:0.5", slice),
      read_field_occlusion(command, light.smooth_occlusion),
      read_volume_options(command, arguments.volume_texts, arguments.volume)};
  arguments.path.is_exposure_automatic = is_exposure_automatic(command);
  arguments.position = camera.position;
  arguments.file_camera = camera.number;
  arguments.slice.axis = slice.axis;
  arguments.slice.at = slice.at;
  arguments.render.width = size.width;
  arguments.render.height = size.height;
  const auto* const wrong =
      std::find_if(faults.begin(), faults.end(), [](const std::string& fault) { return !fault.empty(); });
  return wrong == faults.end() ? "" : *wrong;
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

}  // namespace

DVec3 RenderArguments::forward() const {
  if (!azimuth && !elevation) return direction_of(view);
  const double iso_elevation = std::asin(std::sqrt(1.0 / 3.0)) * 180.0 / std::numbers::pi;
  return direction_of(azimuth.value_or(45.0), elevation.value_or(iso_elevation));
}

void add_render_options(CLI::App& command, RenderArguments& arguments) {
  add_common_options(command, arguments.common);
  arguments.render.light = natural_light();
  arguments.render.samples = 4;
  set_heading(command, heading::kOutput);
  command
      .add_option("-o,--output", arguments.output,
                  "Image to write: .png, .jpg or .webp; .exr with --light path (linear light, with layers for "
                  "compositing). With an image series also a video, .mp4 or .webm, encoded by ffmpeg")
      ->required()
      ->type_name("FILE")
      ->check(file_name());
  add_text_option(command, "--size", "WxH", "Image size in pixels (default 1280x720)");
  command
      .add_option("--samples", arguments.render.samples,
                  "Samples per pixel, 1 to 4096 (default 4; 64 with --light path)")
      ->check(CLI::Range(1, kMaxSamples));
  command.add_option("--depth", arguments.depth, "Also write the distances from the camera: .pfm")
      ->type_name("FILE")
      ->check(file_name());
  command.add_flag("--watch", arguments.watch, "Render again after each change of the input, until Ctrl-C");
  add_camera_options(command, arguments);
  add_light_options(command, arguments);
  add_volume_options(command, arguments.volume_texts);
  add_text_option(
      command, "--slice", "AXIS:X",
      "Position of the slice of --preset density: axis x, y or z, and 0 to 1 of the bounds (default y:0.5)");
  add_detail_options(command, arguments);
  add_backend_options(command, arguments);
}

std::string settle(const CLI::App& command, RenderArguments& arguments) {
  for (const std::string& fault :
       {read_texts(command, arguments), find_files_error(arguments), find_films_error(command, arguments),
        find_camera_error(command, arguments), find_slice_error(command, arguments),
        find_light_error(command, arguments), find_light_model_error(command, arguments),
        find_backend_error(command, arguments), find_watching_error(arguments)}) {
    if (!fault.empty()) return fault;
  }
  if (command.count("--detail") == 0 && arguments.render.detail.colours) arguments.detail = "pixels";
  if (arguments.detail != "near") {
    arguments.render.detail.policy.emplace().rule =
        arguments.detail == "radius" ? DetailPolicy::Rule::ByRadius : DetailPolicy::Rule::ByPixels;
  }
  LoadOptions& load = arguments.common.load;
  load.raw = arguments.volume.raw;
  if (arguments.volume.iso) load.iso = static_cast<float>(*arguments.volume.iso);
  arguments.view = view_of_name(arguments.view_name).value_or(View::Iso);
  arguments.has_view = command.count("--view") > 0 || arguments.azimuth || arguments.elevation || arguments.turns > 1;
  arguments.has_sun = command.count("--sun") > 0;
  LightOptions& light = arguments.render.light;
  if (arguments.light_model == "path" && command.count("--samples") == 0) arguments.render.samples = 64;
  if (is_sun_off(command)) light.sun_brightness = 0.0;
  if (arguments.light_model == "propagated") light.model = LightModel::Propagated;
  if (arguments.has_fixed_sky) light.sky_follows_sun = false;
  if (arguments.has_plain_glass) light.glass_surfaces = false;
  settle_occlusion_rays(command, light);
  if (arguments.occlusion == "vertex") light.occlusion_mode = OcclusionMode::Vertex;
  if (arguments.occlusion == "smooth") light.occlusion_mode = OcclusionMode::Smooth;
  if (arguments.occlusion_affects == "all") light.occlusion_affects = OcclusionAffects::All;
  if (arguments.preset == "no-ao") light.occlusion_mode = OcclusionMode::Off;
  if (arguments.preset == "no-shadows") light.shadows = false;
  if (arguments.preset == "ao") light.shading = Shading::Occlusion;
  if (arguments.preset == "unlit") {
    light.shading = command.count("--ao") > 0 ? Shading::UnlitWithOcclusion : Shading::Unlit;
  }
  arguments.render.depth = !arguments.depth.empty();
  arguments.slice.width = arguments.render.width;
  arguments.slice.height = arguments.render.height;
  arguments.slice.instances = arguments.common.instances();
  return "";
}

}  // namespace quoin::tool
