#include "render/image_series.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include <glm/geometric.hpp>
#include <nlohmann/json.hpp>

#include <quoin/io/file.h>

#include "render/image_output.h"

namespace quoin::tool {
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
