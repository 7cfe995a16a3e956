#include "io/vox/write/view_plan.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "core/bytes/text.h"
#include "core/srgb.h"
#include "io/vox/chunks.h"
#include "io/vox/vox_reader.h"

namespace quoin::vox {

namespace {

constexpr double kDegrees = 180.0 / std::numbers::pi;
constexpr double kUsualFov = 45.0;

bool is_same(const FileCamera& a, const FileCamera& b) {
  return a.camera == b.camera && a.focus_distance == b.focus_distance;
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

// Returns true if there are settings other than the sun's.
bool says_more(const FileRenderSettings& all) {
  Environment only_sun;
  only_sun.sun = all.environment.sun;
  only_sun.sky.model = SkyModel::Uniform;
  only_sun.exposure = 1.0;
  only_sun.tone = ToneCurve::Aces;
  return all.environment != only_sun || all.lens != Lens{};
}

bool says_more(const Environment& all) {
  Environment only_sun;
  only_sun.sun = all.sun;
  return all != only_sun;
}

std::string text_of(double x, double y, double z) {
  return to_text(static_cast<float>(x)) + " " + to_text(static_cast<float>(y)) + " " + to_text(static_cast<float>(z));
}

}  // namespace

ViewPlan plan_view(const LoadedScene& loaded, const VoxSource& source, bool is_new) {
  ViewPlan plan;
  plan_cameras(loaded, source, plan);
  const std::optional<Environment>& environment = loaded.scene.environment;
  const std::optional<FileRenderSettings>& settings = loaded.render_settings;
  if (!environment && !settings) return plan;
  const Sun& wanted = environment ? environment->sun : settings->environment.sun;
  const auto before = render_settings_of(source.document);
  if (!before || before->environment.sun != wanted) plan.sun = wanted;
  plan.has_more_settings = is_new && (settings ? says_more(*settings) : says_more(*environment));
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

void set_sun_keys(const Sun& sun, Entries& keys) {
  const SrgbEncoder& encode = SrgbEncoder::shared();
  const DVec3 towards = sun.unit_direction();
  const float most = std::max({sun.colour.x, sun.colour.y, sun.colour.z, 1.0F});
  const auto byte = [&](float channel) { return std::to_string(int{encode(channel / most)}); };
  const double pitch = std::asin(std::clamp(towards.y, -1.0, 1.0));
  const double yaw = std::atan2(towards.x, towards.z);
  keys.set("_type", "_inf");
  keys.set("_i", to_text(static_cast<float>(sun.brightness * static_cast<double>(most))));
  keys.set("_k", byte(sun.colour.x) + " " + byte(sun.colour.y) + " " + byte(sun.colour.z));
  keys.set("_angle", to_text(static_cast<float>(pitch * kDegrees)) + " " + to_text(static_cast<float>(yaw * kDegrees)));
  keys.set("_area", to_text(static_cast<float>(std::tan(sun.angle_radians / 2.0))));
  keys.set("_disk", sun.is_visible ? "1" : "0");
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
