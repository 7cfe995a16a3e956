#include "render/image_output.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <fcntl.h>
#include <glm/geometric.hpp>
#include <nlohmann/json.hpp>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <quoin/io/file.h>
#include <quoin/io/image_files.h>

#include "command_files.h"
#include "commands.h"
#include "options.h"
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

namespace {

using Object = nlohmann::json;

constexpr double kUsualFov = 45.0;
constexpr std::size_t kMaxCameras = 1'000'000;

std::optional<DVec3> triple_of(const Object& camera, const char* key) {
  const auto found = camera.find(key);
  if (found == camera.end() || !found->is_array() || found->size() != 3) return std::nullopt;
  DVec3 triple{0.0};
  for (int i = 0; i < 3; ++i) {
    const Object& number = (*found)[static_cast<std::size_t>(i)];
    if (!number.is_number()) return std::nullopt;
    triple[i] = number.get<double>();
  }
  return is_finite(triple) ? std::optional(triple) : std::nullopt;
}

// Returns an error message, or "".
std::string camera_from_json(const Object& object, Camera& out) {
  if (!object.is_object()) return "is not an object";
  for (const auto& [key, value] : object.items()) {
    if (key != "position" && key != "forward" && key != "look_at" && key != "up" && key != "fov" &&
        key != "view_height") {
      return "has the unknown key \"" + key + "\"";
    }
  }
  const auto position = triple_of(object, "position");
  if (!position) return "needs a position of three numbers";
  if (object.contains("forward") == object.contains("look_at")) return "needs either forward or look_at";
  const auto forward = triple_of(object, "forward");
  const auto target = forward ? std::optional(*position + *forward) : triple_of(object, "look_at");
  if (!target) return "needs three numbers for forward or look_at";
  for (const char* key : {"fov", "view_height"}) {
    if (object.contains(key) && !object[key].is_number()) return "needs a number for " + std::string(key);
  }
  const double fov = object.value("fov", kUsualFov);
  const auto camera = look_at(*position, *target, fov * std::numbers::pi / 180.0);
  if (!camera) return camera.error().message;
  out = *camera;
  if (object.contains("up")) {
    const auto up = triple_of(object, "up");
    const DVec3 right = up ? glm::cross(out.forward, *up) : DVec3(0.0);
    const double length = glm::length(right);
    if (!(length > 1e-9)) return "needs three numbers for up, not parallel to the view direction";
    out.right = right / length;
    out.up = glm::cross(out.right, out.forward);
  }
  if (!object.contains("view_height")) return "";
  out.projection = Camera::Projection::Orthographic;
  out.view_height = object["view_height"].get<double>();
  return std::isfinite(out.view_height) && out.view_height > 0.0 ? "" : "needs a view_height above 0";
}

}  // namespace

Result<std::vector<Camera>> read_camera_path(const std::filesystem::path& path) {
  const auto bytes = read_file(path);
  if (!bytes) return bytes.error();
  const auto bad = [&](const std::string& message) { return make_error(ErrorCode::BadFormat, message, path.string()); };
  const auto* const text = reinterpret_cast<const char*>(bytes->data());
  const Object all = Object::parse(text, text + bytes->size(), nullptr, false);
  if (!all.is_array()) return bad("not a JSON array of cameras");
  if (all.empty() || all.size() > kMaxCameras) return bad("must hold 1 to 1,000,000 cameras");
  std::vector<Camera> cameras(all.size());
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (const std::string fault = camera_from_json(all[i], cameras[i]); !fault.empty()) {
      return bad("camera " + std::to_string(i) + " " + fault);
    }
  }
  return cameras;
}

namespace {

namespace fs = std::filesystem;

std::optional<fs::path> find_program(const std::string& name) {
  const char* const path = std::getenv("PATH");
  std::string_view left = path == nullptr ? "/usr/bin:/bin" : path;
  while (!left.empty()) {
    const std::size_t end = std::min(left.find(':'), left.size());
    const fs::path candidate = fs::path(left.substr(0, end)) / name;
    if (::access(candidate.c_str(), X_OK) == 0) return candidate;
    left.remove_prefix(std::min(end + 1, left.size()));
  }
  return std::nullopt;
}

// Runs a program and returns its exit status. Its output goes to standard error, and its input is empty.
Result<int> run(const fs::path& program, std::vector<std::string> words) {
  words.insert(words.begin(), program.string());
  std::vector<char*> arguments;
  arguments.reserve(words.size() + 1);
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_adddup2(&actions, STDERR_FILENO, STDOUT_FILENO);
  pid_t child = 0;
  const int fault = ::posix_spawn(&child, program.c_str(), &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (fault != 0) return make_error(ErrorCode::CannotWrite, std::generic_category().message(fault), program.string());
  int status = 0;
  while (::waitpid(child, &status, 0) < 0) {
    if (errno != EINTR) return make_error(ErrorCode::CannotWrite, "cannot wait for the process", program.string());
  }
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

// Returns the number in OUT-007.png as text: "007".
std::string number_in(const fs::path& image) {
  const std::string stem = image.stem().string();
  return stem.substr(stem.rfind('-') + 1);
}

// Escapes a name so that ffmpeg sees no number pattern in it.
std::string escaped(const std::string& name) {
  std::string out;
  for (const char letter : name) out += letter == '%' ? std::string("%%") : std::string(1, letter);
  return out;
}

}  // namespace

bool is_video(const fs::path& path) {
  return has_ending(path, ".mp4") || has_ending(path, ".webm");
}

fs::path Video::folder() const {
  return fs::path(output_.string() + ".images");
}

fs::path Video::image() const {
  return folder() / "image.png";
}

Status Video::begin(bool resume) const {
  if (!find_program("ffmpeg")) {
    return make_error(ErrorCode::Unsupported,
                      "cannot encode a video: ffmpeg is not installed; numbered images do not need it "
                      "(-o film.png)",
                      output_.string());
  }
  std::error_code code;
  if (!resume) fs::remove_all(folder(), code);
  if (!code) fs::create_directory(folder(), code);
  return code ? make_error(ErrorCode::CannotWrite, code.message(), folder().string()) : Status();
}

Result<std::uint64_t> Video::write(const std::vector<fs::path>& images, double frames_per_second) const {
  const auto ffmpeg = find_program("ffmpeg");
  if (!ffmpeg)
    return make_error(ErrorCode::Unsupported, "cannot encode a video: ffmpeg is no longer installed", output_.string());
  const std::string first = number_in(images.front());
  const std::string pattern = (folder() / ("image-%0" + std::to_string(first.size()) + "d.png")).filename().string();
  const fs::path whole = folder() / ("video" + output_.extension().string());
  std::vector<std::string> words = {
      "-nostdin", "-hide_banner", "-loglevel", "error", "-y", "-framerate", std::to_string(frames_per_second),
      "-start_number", std::to_string(std::stol(first)), "-i", escaped(folder().string()) + "/" + pattern, "-frames:v",
      std::to_string(images.size()),
      // Even width and height, as half-size chroma needs; BT.709 colours, with matching metadata.
      "-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2,scale=out_color_matrix=bt709:out_range=tv", "-pix_fmt", "yuv420p",
      "-colorspace", "bt709", "-color_primaries", "bt709", "-color_trc", "bt709", "-color_range", "tv"};
  const std::vector<std::string> codec =
      has_ending(output_, ".mp4")
          ? std::vector<std::string>{"-c:v", "libx264", "-preset", "slow", "-crf", "16", "-movflags", "+faststart"}
          : std::vector<std::string>{"-c:v", "libvpx-vp9", "-crf", "22", "-b:v", "0", "-row-mt", "1"};
  words.insert(words.end(), codec.begin(), codec.end());
  words.push_back("file:" + whole.string());
  const auto status = run(*ffmpeg, std::move(words));
  if (!status) return status.error();
  std::error_code code;
  if (*status != 0) {
    return make_error(
        ErrorCode::CannotWrite,
        "ffmpeg failed with status " + std::to_string(*status) + "; the images are kept in " + folder().string(),
        output_.string());
  }
  const std::uint64_t bytes = fs::file_size(whole, code);
  if (!code) fs::rename(whole, output_, code);
  if (code) return make_error(ErrorCode::CannotWrite, code.message(), output_.string());
  fs::remove_all(folder(), code);
  return bytes;
}

}  // namespace quoin::tool
