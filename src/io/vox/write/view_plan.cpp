#include "io/vox/write/view_plan.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <tuple>

#include "core/bytes/text.h"
#include "core/srgb.h"
#include "io/vox/cameras.h"
#include "io/vox/chunk_reader.h"
#include "io/vox/look.h"

namespace quoin::vox {

namespace {

constexpr double kDegrees = 180.0 / std::numbers::pi;
constexpr double kUsualFov = 45.0;

bool is_same(const FileCamera& a, const FileCamera& b) {
  return a.camera == b.camera && a.focus_distance == b.focus_distance;
}

// Returns the sun of a look, const or mutable.
template <class AnyLook>
auto sun_of(AnyLook& look) {
  return std::tie(look.sun, look.sun_angle_radians, look.sun_brightness, look.sun_colour, look.sun_is_seen);
}

std::vector<FileCamera> wanted_cameras(const LoadedScene& loaded, const Document& document) {
  std::vector<FileCamera> all = loaded.cameras;
  const auto is_first = [&](const FileCamera& one) { return one.camera == *loaded.camera; };
  if (!loaded.camera || std::ranges::any_of(all, is_first)) return all;
  std::set<std::int32_t> taken;
  for (const FileCamera& one : all) taken.insert(one.number);
  for (const CameraChunk& one : document.cameras) taken.insert(one.id);
  std::int32_t number = 0;
  while (taken.contains(number)) ++number;
  all.insert(all.begin(), {number, *loaded.camera});
  return all;
}

void plan_cameras(const LoadedScene& loaded, const VoxSource& source, ViewPlan& plan) {
  std::vector<std::string> said_before;
  const std::vector<FileCamera> before =
      cameras_of(source.document, source.scene.bounds(InstanceFilter::All), said_before);
  const std::vector<FileCamera> wanted = wanted_cameras(loaded, source.document);
  for (const FileCamera& one : wanted) {
    const auto known = std::ranges::find(before, one.number, &FileCamera::number);
    if (known != before.end() && is_same(*known, one)) continue;
    if (plan.cameras.emplace(one.number, one).second) plan.order.push_back(one.number);
  }
  for (const FileCamera& one : before) {
    if (std::ranges::find(wanted, one.number, &FileCamera::number) == wanted.end()) plan.removed.push_back(one.number);
  }
}

// Returns true if a look has settings other than the sun's.
bool says_more(const FileLook& all) {
  FileLook only_sun;
  only_sun.look.sky = SkyModel::Uniform;
  sun_of(only_sun.look) = sun_of(all.look);
  only_sun.develop.tone = ToneCurve::Aces;
  return all.look != only_sun.look || all.develop != only_sun.develop || !all.environment.empty();
}

std::string text_of(double x, double y, double z) {
  return to_text(static_cast<float>(x)) + " " + to_text(static_cast<float>(y)) + " " + to_text(static_cast<float>(z));
}

}  // namespace

ViewPlan plan_view(const LoadedScene& loaded, const VoxSource& source, bool is_new) {
  ViewPlan plan;
  plan_cameras(loaded, source, plan);
  Look wanted;
  if (loaded.look) {
    wanted = loaded.look->look;
  } else if (loaded.sun) {
    wanted.sun = *loaded.sun;
  } else {
    return plan;
  }
  const auto before = look_of(source.document);
  if (!before || sun_of(before->look) != sun_of(wanted)) plan.sun = wanted;
  plan.has_more_settings = is_new && loaded.look && says_more(*loaded.look);
  return plan;
}

void set_camera_keys(const FileCamera& file_camera, Entries& keys) {
  const Camera& camera = file_camera.camera;
  const bool is_flat = camera.projection == Camera::Projection::Orthographic;
  const double fov = is_flat ? kUsualFov / kDegrees : camera.vertical_fov_radians;
  const double half = std::tan(fov / 2.0);
  const double radius = is_flat ? camera.view_height / (2.0 * half) : file_camera.focus_distance;
  const DVec3 focus = camera.position + camera.forward * radius;
  const double pitch = std::asin(std::clamp(camera.forward.y, -1.0, 1.0));
  // If the camera looks straight up or down, the yaw is the whole rotation of the image.
  constexpr double kLeast = 1e-6;
  const bool is_upright = std::hypot(camera.forward.x, camera.forward.z) < kLeast;
  const double yaw =
      is_upright ? std::atan2(-camera.right.z, camera.right.x) : std::atan2(-camera.forward.x, -camera.forward.z);
  const DVec3 level(std::cos(yaw), 0.0, -std::sin(yaw));
  const double roll =
      std::atan2(glm::dot(camera.right, glm::cross(level, camera.forward)), glm::dot(camera.right, level));
  DVec3 angle = DVec3(pitch, yaw, roll) * kDegrees;
  // Unused cameras have these values.
  const bool looks_unset = focus == DVec3(0.0) && angle == DVec3(0.0) && (radius == 0.0 || radius == 1.0);
  if (looks_unset) angle.z = 360.0;
  keys.set("_mode", is_flat ? "orth" : "pers");
  keys.set("_focus", text_of(focus.x, -focus.z, focus.y));
  keys.set("_angle", text_of(angle.x, angle.y, angle.z));
  keys.set("_radius", to_text(static_cast<float>(radius)));
  keys.set("_frustum", to_text(static_cast<float>(half)));
  keys.set("_fov", to_text(static_cast<float>(fov * kDegrees)));
}

void set_sun_keys(const Look& look, Entries& keys) {
  const SrgbEncoder& encode = SrgbEncoder::shared();
  const double length = glm::length(look.sun);
  const DVec3 towards = length > 0.0 ? look.sun / length : DVec3(0.0, 1.0, 0.0);
  const float most = std::max({look.sun_colour.x, look.sun_colour.y, look.sun_colour.z, 1.0F});
  const auto byte = [&](float channel) { return std::to_string(int{encode(channel / most)}); };
  const double pitch = std::asin(std::clamp(towards.y, -1.0, 1.0));
  const double yaw = std::atan2(towards.x, towards.z);
  keys.set("_type", "_inf");
  keys.set("_i", to_text(static_cast<float>(look.sun_brightness * static_cast<double>(most))));
  keys.set("_k", byte(look.sun_colour.x) + " " + byte(look.sun_colour.y) + " " + byte(look.sun_colour.z));
  keys.set("_angle", to_text(static_cast<float>(pitch * kDegrees)) + " " + to_text(static_cast<float>(yaw * kDegrees)));
  keys.set("_area", to_text(static_cast<float>(std::tan(look.sun_angle_radians / 2.0))));
  keys.set("_disk", look.sun_is_seen ? "1" : "0");
}

std::optional<std::int32_t> camera_number(std::string_view id, std::span<const std::byte> content) {
  if (id != "rCAM" || content.size() < sizeof(std::int32_t)) return std::nullopt;
  return ChunkReader(content, "rCAM", 0, 0, content.size()).i32();
}

bool is_sun(std::string_view id, std::span<const std::byte> content) {
  if (id != "rOBJ") return false;
  ChunkReader reader(content, "rOBJ", 0, 0, content.size());
  const Dict keys = reader.dict();
  return !reader.failed() && keys.get("_type") == "_inf";
}

}  // namespace quoin::vox
