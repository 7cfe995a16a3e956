#include "io/vox/vox_reader.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "core/bytes/text.h"

namespace quoin::vox {

namespace {

/// A camera's keys, with MagicaVoxel's defaults.
struct Keys {
  DVec3 focus{0.0};
  DVec3 angle{0.0};  ///< pitch, yaw, roll, in degrees
  double radius = 0.0;
  double fov = 45.0;
  std::string_view mode = "pers";
};

std::optional<DVec3> parse_three(std::string_view text) {
  std::array<float, 3> numbers{};
  if (!parse_floats(text, numbers)) return std::nullopt;
  return DVec3(numbers[0], numbers[1], numbers[2]);
}

/// Reads a key if the camera has it; reports a fault if it is invalid.
template <class Parse, class Value>
void read_key(const Dict& attributes, std::string_view key, Parse parse, Value& value, std::string& fault) {
  const std::string_view text = attributes.get(key);
  if (text.empty()) return;
  if (const auto read = parse(text)) {
    value = static_cast<Value>(*read);
  } else if (fault.empty()) {
    fault = std::string(key) + " is \"" + printable(text) + "\"";
  }
}

Keys read_keys(const Dict& attributes, std::string& fault) {
  Keys keys;
  read_key(attributes, "_focus", parse_three, keys.focus, fault);
  read_key(attributes, "_angle", parse_three, keys.angle, fault);
  read_key(attributes, "_radius", parse_float, keys.radius, fault);
  read_key(attributes, "_fov", parse_float, keys.fov, fault);
  if (const std::string_view mode = attributes.get("_mode"); !mode.empty()) keys.mode = mode;
  return keys;
}

bool is_orthographic(const Keys& keys) {
  return keys.mode == "orth" || keys.mode == "iso";
}

/// Returns true for an unused camera: older versions write a radius of 1, newer ones 0.
bool was_never_set(const Keys& keys) {
  const bool is_near = keys.radius == 0.0 || keys.radius == 1.0;
  return is_near && keys.focus == DVec3(0.0) && keys.angle == DVec3(0.0);
}

std::string find_error(const Keys& keys) {
  const bool is_known = keys.mode == "pers" || keys.mode == "free" || is_orthographic(keys);
  if (!is_known) return "_mode \"" + printable(keys.mode) + "\" is not supported";
  if (!(keys.fov > 0.0 && keys.fov < 180.0)) return "_fov is not between 0 and 180";
  if (keys.radius < 0.0) return "_radius is below 0";
  if (is_orthographic(keys) && keys.radius == 0.0) return "_radius is 0";
  return {};
}

/// Returns the distance from `focus` of a plane across `forward` that has all of `bounds` in front of it.
double distance_before(const DBox& bounds, DVec3 focus, DVec3 forward) {
  if (bounds.empty()) return 0.0;
  double nearest = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    nearest +=
        std::min(forward[axis] * (bounds.min[axis] - focus[axis]), forward[axis] * (bounds.max[axis] - focus[axis]));
  }
  return 1.0 - nearest;
}

Camera camera_from(const Keys& keys, const DBox& bounds) {
  const DVec3 radians = keys.angle * (std::numbers::pi / 180.0);
  const double level = std::cos(radians.x);
  Camera camera;
  camera.forward = {-std::sin(radians.y) * level, std::sin(radians.x), -std::cos(radians.y) * level};
  const DVec3 right(std::cos(radians.y), 0.0, -std::sin(radians.y));
  const DVec3 up = glm::cross(right, camera.forward);
  camera.right = right * std::cos(radians.z) + up * std::sin(radians.z);
  camera.up = up * std::cos(radians.z) - right * std::sin(radians.z);
  camera.vertical_fov_radians = keys.fov * (std::numbers::pi / 180.0);
  const DVec3 focus(keys.focus.x, keys.focus.z, -keys.focus.y);
  double distance = keys.radius;
  if (is_orthographic(keys)) {
    camera.projection = Camera::Projection::Orthographic;
    camera.view_height = 2.0 * keys.radius * std::tan(camera.vertical_fov_radians / 2.0);
    distance = std::max(distance, distance_before(bounds, focus, camera.forward));
  }
  camera.position = focus - camera.forward * distance;
  return camera;
}

}  // namespace

std::vector<FileCamera> cameras_of(const Document& document, const DBox& bounds, std::vector<std::string>& warnings) {
  std::vector<FileCamera> cameras;
  for (const CameraChunk& chunk : document.cameras) {
    std::string fault;
    const Keys keys = read_keys(chunk.attributes, fault);
    if (fault.empty() && was_never_set(keys)) continue;
    if (fault.empty()) fault = find_error(keys);
    if (fault.empty() && chunk.id < 0) fault = "its id is below 0";
    if (fault.empty() && std::ranges::find(cameras, chunk.id, &FileCamera::number) != cameras.end()) {
      fault = "its id is a duplicate";
    }
    if (fault.empty()) {
      cameras.push_back({chunk.id, camera_from(keys, bounds), keys.radius});
    } else {
      warnings.push_back("camera " + std::to_string(chunk.id) + " skipped: " + fault);
    }
  }
  return cameras;
}

}  // namespace quoin::vox
