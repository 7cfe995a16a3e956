#include "camera_control.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>

namespace quoin::viewer {
namespace {

constexpr double kTurnPerImage = 2.2;   // radians for a drag over the image height
constexpr double kZoomPerNotch = 0.16;  // change of the distance's logarithm
constexpr double kZoomRate = 14.0;      // decay of a zoom, per second
constexpr double kFlightRate = 9.0;     // approach of the velocity to the keys' velocity, per second
constexpr double kSpeedPerNotch = 0.2;
constexpr double kStraightUp = std::numbers::pi / 2.0;
constexpr double kLongestStep = 1.0;

bool are_finite(double a, double b) {
  return std::isfinite(a) && std::isfinite(b);
}

}  // namespace

CameraControl::CameraControl() {
  camera_.vertical_fov_radians = std::numbers::pi / 6.0;
}

void CameraControl::set(const Camera& camera, const DBox& bounds) {
  if (!is_finite(camera.position) || !is_finite(camera.forward) || !is_finite(camera.right)) return;
  camera_ = camera;
  pitch_ = std::asin(std::clamp(camera.forward.y, -1.0, 1.0));
  const bool is_vertical = std::hypot(camera.forward.x, camera.forward.z) < 1e-9;
  const bool is_upright = is_vertical || (std::abs(camera.right.y) < 1e-9 && camera.up.y >= 0.0);
  yaw_ = is_upright ? std::atan2(camera.right.z, camera.right.x) : std::atan2(camera.forward.x, -camera.forward.z);
  const bool has_bounds = !bounds.empty() && is_finite(bounds.min) && is_finite(bounds.max);
  const DVec3 middle = has_bounds ? 0.5 * bounds.min + 0.5 * bounds.max : DVec3{0.0};
  size_ = has_bounds ? std::max(glm::length(bounds.max - bounds.min), 1.0) : 10.0;
  apply_angles();
  const double ahead = glm::dot(middle - camera_.position, camera_.forward);
  pivot_ = camera_.position + camera_.forward * std::max(ahead, 0.01 * size_);
  speed_ = 0.2 * size_;
  velocity_ = DVec3{0.0};
  zoom_left_ = 0.0;
}

void CameraControl::set_pivot(DVec3 pivot) {
  if (is_finite(pivot)) pivot_ = pivot;
}

void CameraControl::look_level(double vertical_fov_radians) {
  pitch_ = 0.0;
  camera_.projection = Camera::Projection::Perspective;
  set_vertical_fov(vertical_fov_radians);
  apply_angles();
}

void CameraControl::set_vertical_fov(double radians) {
  if (radians > 0.0 && radians < std::numbers::pi) camera_.vertical_fov_radians = radians;
}

void CameraControl::move_to(DVec3 position) {
  if (!is_finite(position)) return;
  pivot_ += position - camera_.position;
  camera_.position = position;
  velocity_ = DVec3{0.0};
  zoom_left_ = 0.0;
}

void CameraControl::face(DVec3 point) {
  const DVec3 way = point - camera_.position;
  const double level = std::hypot(way.x, way.z);
  if (!is_finite(way) || (level == 0.0 && way.y == 0.0)) return;
  if (level > 0.0) yaw_ = std::atan2(way.x, -way.z);
  pitch_ = std::atan2(way.y, level);
  apply_angles();
  pivot_ = point;
}

void CameraControl::apply_angles() {
  const double level = std::cos(pitch_);
  camera_.forward = {std::sin(yaw_) * level, std::sin(pitch_), -std::cos(yaw_) * level};
  camera_.right = {std::cos(yaw_), 0.0, std::sin(yaw_)};
  camera_.up = glm::cross(camera_.right, camera_.forward);
}

void CameraControl::turn(double dx, double dy, int image_height) {
  if (!are_finite(dx, dy) || image_height <= 0) return;
  const double angle = kTurnPerImage / image_height;
  const DVec3 to_pivot = pivot_ - camera_.position;
  const DVec3 in_camera{glm::dot(to_pivot, camera_.right), glm::dot(to_pivot, camera_.up),
                        glm::dot(to_pivot, camera_.forward)};
  const double turned = mode == CameraMode::Orbit ? 2.0 * angle : angle;
  yaw_ = std::remainder(yaw_ + dx * turned, 2.0 * std::numbers::pi);
  pitch_ = std::clamp(pitch_ - dy * turned, -kStraightUp, kStraightUp);
  apply_angles();
  if (mode != CameraMode::Orbit) return;
  camera_.position = pivot_ - (camera_.right * in_camera.x + camera_.up * in_camera.y + camera_.forward * in_camera.z);
}

double CameraControl::units_per_pixel(double distance, int image_height) const {
  const bool is_perspective = camera_.projection == Camera::Projection::Perspective;
  const double height =
      is_perspective ? 2.0 * distance * std::tan(camera_.vertical_fov_radians / 2.0) : camera_.view_height;
  return height / image_height;
}

void CameraControl::pan(double dx, double dy, int image_height) {
  if (!are_finite(dx, dy) || image_height <= 0) return;
  const double distance = std::max(glm::dot(pivot_ - camera_.position, camera_.forward), 0.01 * size_);
  const double scale = units_per_pixel(distance, image_height);
  const DVec3 move = camera_.up * (dy * scale) - camera_.right * (dx * scale);
  camera_.position += move;
  pivot_ += move;
}

void CameraControl::zoom(double notches, std::optional<DVec3> target) {
  if (!std::isfinite(notches)) return;
  zoom_target_ = target && is_finite(*target) ? *target : pivot_;
  zoom_left_ = std::clamp(zoom_left_ - notches * kZoomPerNotch, -8.0, 8.0);
}

void CameraControl::zoom_by(double log_factor) {
  const double nearest = 1e-3 * std::min(size_, 1e3);
  const double farthest = 100.0 * size_;
  double factor = std::exp(log_factor);
  if (camera_.projection == Camera::Projection::Orthographic) {
    camera_.view_height = std::clamp(camera_.view_height * factor, nearest, farthest);
    return;
  }
  const DVec3 offset = camera_.position - zoom_target_;
  const double distance = glm::length(offset);
  if (!(distance > 0.0) || !std::isfinite(distance)) return;
  // A camera already beyond a bound can come back, but not go further.
  factor = std::clamp(factor, std::min(1.0, nearest / distance), std::max(1.0, farthest / distance));
  camera_.position = zoom_target_ + offset * factor;
  pivot_ = zoom_target_ + (pivot_ - zoom_target_) * factor;
}

void CameraControl::change_speed(double notches) {
  if (!std::isfinite(notches)) return;
  speed_ = std::clamp(speed_ * std::exp(notches * kSpeedPerNotch), 1e-3 * size_, 20.0 * size_);
}

void CameraControl::advance(double seconds, const CameraPush& push, double boost) {
  if (!(seconds > 0.0) || !are_finite(seconds, boost)) return;
  seconds = std::min(seconds, kLongestStep);
  DVec3 wanted = camera_.right * push.right + DVec3{0.0, push.up, 0.0} + camera_.forward * push.forward;
  if (!is_finite(wanted)) return;
  const double length = glm::length(wanted);
  if (length > 1.0) wanted /= length;
  wanted *= speed_ * boost;
  // The exact solution of velocity' = rate (wanted - velocity), independent of the frame rate.
  const double kept = std::exp(-kFlightRate * seconds);
  const DVec3 move = wanted * seconds + (velocity_ - wanted) * ((1.0 - kept) / kFlightRate);
  velocity_ = wanted + (velocity_ - wanted) * kept;
  camera_.position += move;
  pivot_ += move;
  if (push.is_zero() && glm::length(velocity_) < 1e-3 * speed_) velocity_ = DVec3{0.0};
  const double zoom_now =
      std::abs(zoom_left_) < 1e-3 ? zoom_left_ : zoom_left_ * (1.0 - std::exp(-kZoomRate * seconds));
  if (zoom_now != 0.0) zoom_by(zoom_now);
  zoom_left_ -= zoom_now;
}

bool CameraControl::is_gliding() const {
  return velocity_ != DVec3{0.0} || zoom_left_ != 0.0;
}

namespace {

// In body heights, for a person of 1.8 m.
constexpr double kWidth = 0.33;
constexpr double kGravity = 9.81 / 1.8;
constexpr double kWalk = 2.4;  // per second
constexpr double kJump = 0.75;
constexpr double kStep = 0.6;

constexpr double kSeconds = 1.0 / 120.0;
constexpr double kLongest = 0.1;
constexpr double kGrowthPerNotch = 0.12;
constexpr double kLeastHeight = 0.5;  // world units

}  // namespace

void Walker::stand(DVec3 feet, const DBox& bounds) {
  const bool has_bounds = !bounds.empty() && is_finite(bounds.min) && is_finite(bounds.max);
  size_ = has_bounds ? std::max(glm::length(bounds.max - bounds.min), 1.0) : 10.0;
  lowest_ = has_bounds ? bounds.min.y : 0.0;
  height_ = std::clamp(0.02 * size_, 1.8, 12.0);
  feet_ = is_finite(feet) ? feet : DVec3{0.0};
  fall_ = 0.0;
  left_over_ = 0.0;
  is_on_floor_ = false;
}

void Walker::grow(double notches) {
  if (!std::isfinite(notches)) return;
  height_ = std::clamp(height_ * std::exp(notches * kGrowthPerNotch), kLeastHeight, std::max(size_, 2.0));
  is_on_floor_ = false;
}

OrientedBox Walker::box() const {
  OrientedBox box;
  box.centre = feet_ + DVec3{0.0, 0.5 * height_, 0.0};
  box.half_size = DVec3{0.5 * kWidth * height_, 0.5 * height_, 0.5 * kWidth * height_};
  return box;
}

// Returns false if the scene cannot be queried now.
bool Walker::step(DVec3 wanted, bool jumps, const Slide& slide) {
  if (jumps && is_on_floor_) fall_ = std::sqrt(2.0 * kGravity * kJump) * height_;
  const double upwards = fall_ - kGravity * height_ * kSeconds;
  SlideOptions options;
  options.floor = FloorOptions{{0.0, 1.0, 0.0}, 50.0, kStep * height_, 0.3 * height_};
  const auto moved = slide(box(), (wanted + DVec3{0.0, upwards, 0.0}) * kSeconds, options);
  if (!moved) return false;
  feet_ = moved->centre - DVec3{0.0, 0.5 * height_, 0.0};
  fall_ = moved->displacement.y / kSeconds;
  is_on_floor_ = moved->is_on_floor;
  if (feet_.y <= lowest_) {
    feet_.y = lowest_;
    fall_ = 0.0;
    is_on_floor_ = true;
  }
  return true;
}

void Walker::advance(double seconds, const CameraPush& push, double boost, CameraControl& camera, const Slide& slide) {
  if (!(seconds > 0.0) || !std::isfinite(boost)) return;
  const Camera& eyes_now = camera.camera();
  // Horizontal: `right` is always horizontal, and the direction ahead is perpendicular to it.
  const DVec3 ahead = glm::cross(DVec3{0.0, 1.0, 0.0}, eyes_now.right);
  DVec3 wanted = eyes_now.right * push.right + ahead * push.forward;
  const double length = glm::length(wanted);
  if (length > 1.0) wanted /= length;
  wanted *= kWalk * height_ * boost;
  left_over_ += std::min(seconds, kLongest);
  for (; left_over_ >= kSeconds; left_over_ -= kSeconds) {
    if (is_on_floor_ && push.is_zero()) continue;
    if (!step(wanted, push.up > 0.0, slide)) break;
  }
  left_over_ = std::min(left_over_, kSeconds);
  camera.move_to(eyes());
}

}  // namespace quoin::viewer
