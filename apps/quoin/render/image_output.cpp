#include "render/image_output.h"

#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <glm/geometric.hpp>

#include <quoin/io/file.h>
#include <quoin/io/image_files.h>

#include "command_files.h"
#include "commands.h"
#include "options.h"
#include "render/image_series.h"
#include "render/render_arguments.h"
#include "run_control.h"

namespace quoin::tool {

namespace {

constexpr int kMaxSamples = 4'096;
constexpr std::int64_t kMaxPixels = std::int64_t{1} << 28;
constexpr int kLongestSide = 1'000'000;  // the limit of PNG readers and writers

std::optional<ImageSize> read_size(const std::string& text) {
  const auto size = parse_size(text);
  const bool fits = size && std::max(size->width, size->height) <= kLongestSide &&
                    std::int64_t{size->width} * size->height <= kMaxPixels;
  return fits ? size : std::nullopt;
}

/// Returns the end of the message about -o, or "".
std::string output_reason(const RenderArguments& arguments) {
  const std::filesystem::path& output = arguments.output;
  if (is_video(output)) {
    if (!arguments.is_image_series())
      return ": the video " + output.string() + " needs --turntable, --frames or --path";
    if (arguments.path.is_transparent) return ": videos have no alpha channel";
  } else if (const Status name = check_image_name(output); !name) {
    return ": " + name.error().message;
  }
  if (has_ending(output, ".exr") && arguments.light != LightChoice::Path) return ": .exr needs --light path";
  if (has_ending(output, ".jpg") && arguments.path.is_transparent) return ": .jpg has no alpha channel";
  return is_same_file(output, arguments.common.input) ? ": " + output.string() + " is the input" : "";
}

/// Returns the end of the message about --depth, or "".
std::string depth_reason(const RenderArguments& arguments) {
  const std::string depth = arguments.depth.string();
  if (!has_ending(arguments.depth, ".pfm")) return ": the name must end in .pfm, not \"" + depth + "\"";
  if (is_same_file(arguments.depth, arguments.common.input)) return ": " + depth + " is the input";
  return is_same_file(arguments.depth, arguments.output) ? ": " + depth + " is the same file as -o" : "";
}

}  // namespace

void add_output_options(CLI::App& command, RenderArguments& arguments) {
  set_heading(command, heading::kOutput);
  command
      .add_option("-o,--output", arguments.output,
                  "Image to write: .png, .jpg or .webp; .exr with --light path (linear light, with layers for "
                  "compositing). With an image series also a video, .mp4 or .webm, encoded by ffmpeg")
      ->required()
      ->type_name("FILE")
      ->check(file_name());
  add_parsed<ImageSize>(
      command, "--size", "WxH", {read_size, "WIDTHxHEIGHT of at most 2^28 pixels and 1000000 per side, as in 1280x720"},
      [&render = arguments.render](const ImageSize& size) {
        render.width = size.width;
        render.height = size.height;
      },
      "Image size in pixels (default 1280x720)");
  command.add_option("--samples", arguments.samples, "Samples per pixel, 1 to 4096 (default 4; 64 with --light path)")
      ->check(CLI::Range(1, kMaxSamples));
  command.add_option("--depth", arguments.depth, "Also write the distances from the camera: .pfm")
      ->type_name("FILE")
      ->check(file_name());
  command.add_flag("--watch", arguments.watch, "Render again after each change of the input, until Ctrl-C");
}

std::vector<OptionRule> output_rules(const RenderArguments& a) {
  return {
      {{"-o"}, [&a](const CLI::App&) { return output_reason(a); }},
      {{"--depth"}, [&a](const CLI::App&) { return depth_reason(a); }},
      {{"--watch"}, excludes({"--json"})},
      {{"--watch"}, excludes("standard input", [&a] { return a.common.input == kStandardStream; })},
  };
}

Result<WrittenFiles> write_outputs(const RenderArguments& arguments, const RenderedImage& image,
                                   const PathImages* path_traced, const std::filesystem::path& path) {
  if (was_interrupted()) return make_error(ErrorCode::Cancelled, "cancelled", path.string());
  const bool is_plain = path_traced == nullptr || !(has_ending(path, ".exr") || path_traced->is_transparent());
  const auto bytes = is_plain ? write_image_file(image.colour, path) : path_traced->write(path);
  if (!bytes) return bytes.error();
  WrittenFiles written{{path}, *bytes};
  if (arguments.depth.empty()) return written;
  if (was_interrupted()) return make_error(ErrorCode::Cancelled, "cancelled", arguments.depth.string());
  const auto pfm = write_pfm(image.depth, arguments.depth);
  if (!pfm) return pfm.error();
  written.paths.push_back(arguments.depth);
  written.bytes += *pfm;
  return written;
}

bool has_ending(const std::filesystem::path& path, const std::string& ending) {
  return CLI::detail::to_lower(path.extension().string()) == ending;
}

Status check_image_name(const std::filesystem::path& path) {
  if (has_ending(path, ".png")) return {};
  const auto check = [](bool is_supported, const char* ending, const char* library) -> Status {
    if (is_supported) return {};
    return make_error(ErrorCode::Unsupported, std::string("cannot write ") + ending + ": this build has no " + library);
  };
  if (has_ending(path, ".jpg")) return check(has_jpeg(), ".jpg", "libjpeg");
  if (has_ending(path, ".webp")) return check(has_webp(), ".webp", "libwebp");
  if (has_ending(path, ".exr")) return check(has_exr(), ".exr", "OpenEXR");
  return make_error(ErrorCode::InvalidArgument,
                    "the image name must end in .png, .jpg, .webp or .exr, not \"" + path.string() + "\"");
}

Result<std::uint64_t> write_image_file(const Image& image, const std::filesystem::path& path) {
  if (has_ending(path, ".jpg")) return write_jpeg(image, path);
  return has_ending(path, ".webp") ? write_webp(image, path) : write_png(image, path);
}

Result<std::uint64_t> write_image_file(const AlphaImage& image, const std::filesystem::path& path) {
  return has_ending(path, ".webp") ? write_webp(image, path) : write_png(image, path);
}

namespace {

using Type = ExrChannel::Type;

void add_colour(std::vector<ExrChannel>& channels, const std::string& prefix, const std::vector<Vec3>& of,
                const std::array<const char*, 3>& names, Type type, float scale = 1.0F) {
  for (int i = 0; i < 3; ++i) {
    ExrChannel channel{prefix + names[static_cast<std::size_t>(i)], type, {}, {}};
    channel.values.reserve(of.size());
    for (const Vec3& each : of) channel.values.push_back(each[i] * scale);
    channels.push_back(std::move(channel));
  }
}

// Writes light times the exposure, not clamped, and layers for compositing.
Result<std::uint64_t> write_layers(const PathImage& image, bool is_transparent, float exposure,
                                   const std::filesystem::path& path) {
  std::vector<ExrChannel> channels;
  add_colour(channels, "", is_transparent ? image.scene : image.radiance, {"R", "G", "B"}, Type::Float16, exposure);
  channels.push_back({"A", Type::Float16, image.alpha, {}});
  if (!is_transparent) channels.back().values.assign(image.alpha.size(), 1.0F);
  add_colour(channels, "albedo.", image.albedo, {"R", "G", "B"}, Type::Float16);
  add_colour(channels, "normal.", image.normal, {"X", "Y", "Z"}, Type::Float16);
  channels.push_back({"Z", Type::Float32, image.depth.values, {}});
  channels.push_back({"id.type", Type::Uint32, {}, {image.types.begin(), image.types.end()}});
  channels.push_back({"id.instance", Type::Uint32, {}, image.instances});
  return write_exr(image.width, image.height, channels, path);
}

DVec3 middle_of(const Scene& scene, InstanceFilter filter) {
  const DBox bounds = scene.bounds(filter);
  return bounds.empty() ? DVec3(0.0) : (bounds.min + bounds.max) * 0.5;
}

}  // namespace

PathImages::PathImages(const Scene& scene, InstanceFilter filter, Threads threads, PathPlan plan, bool with_layers)
    : plan_(std::move(plan)), with_layers_(with_layers), middle_(middle_of(scene, filter)) {
  tracer_.emplace(scene, filter, threads);
}

PathImages::PathImages(VulkanRenderer& device, const Scene& scene, InstanceFilter filter, PathPlan plan,
                       bool with_layers)
    : device_(&device), plan_(std::move(plan)), with_layers_(with_layers), middle_(middle_of(scene, filter)) {}

Result<RenderedImage> PathImages::render(const Camera& camera, const RenderOptions& options, Threads threads,
                                         const Progress& progress) {
  PathOptions& wanted = plan_.options;
  wanted.layers = with_layers_ || options.depth;
  wanted.denoise = plan_.denoise;
  const double to_middle = glm::dot(middle_ - camera.position, camera.forward);
  wanted.lens.focus_distance = plan_.focus.value_or(std::max(to_middle, 1e-3));
  auto taken = tracer_ ? tracer_->render(camera, wanted, threads, progress)
                       : device_->render_paths(camera, wanted, threads, progress);
  if (!taken) return taken.error();
  last_ = std::move(*taken);
  if (!exposure_)
    exposure_ = plan_.is_exposure_automatic ? find_exposure(last_, plan_.develop.tone) : plan_.develop.exposure;
  plan_.develop.exposure = *exposure_;
  auto image = develop(last_, plan_.develop);
  if (!image) return image.error();
  RenderedImage rendered;
  rendered.colour = std::move(*image);
  rendered.rays = last_.rays;
  rendered.pixels_hit = last_.pixels_hit;
  if (options.depth) rendered.depth = last_.depth;
  return rendered;
}

Result<std::uint64_t> PathImages::write(const std::filesystem::path& path) const {
  if (has_ending(path, ".exr")) {
    return write_layers(last_, plan_.is_transparent, static_cast<float>(exposure()), path);
  }
  const auto image = develop_with_alpha(last_, plan_.develop);
  if (!image) return image.error();
  return write_image_file(*image, path);
}

}  // namespace quoin::tool
