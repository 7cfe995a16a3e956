#include "walker.h"

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>

namespace quoin::viewer {

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
