#include "render/camera_path.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>
#include <string>

#include <glm/geometric.hpp>

#include <quoin/io/file.h>

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

}  // namespace quoin::tool
