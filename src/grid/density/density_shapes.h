#pragma once

#include <algorithm>
#include <cmath>

#include <quoin/core/assert.h>
#include <quoin/core/vec.h>

#include "grid/long_box.h"

namespace quoin {

// Shapes that edits add, remove or work within. Not sound: a size or place that is negative, infinite or NaN.

class Sphere {
 public:
  Sphere(DVec3 centre, double radius) : centre_(centre), radius_(radius) {}

  [[nodiscard]] bool is_sound() const { return is_finite(centre_) && radius_ >= 0.0 && std::isfinite(radius_); }
  [[nodiscard]] DVec3 min() const { return centre_ - radius_; }
  [[nodiscard]] DVec3 max() const { return centre_ + radius_; }
  /// Negative inside.
  [[nodiscard]] double distance(DVec3 point) const {
    const DVec3 d = point - centre_;
    return std::sqrt(d.x * d.x + d.y * d.y + d.z * d.z) - radius_;
  }

 private:
  DVec3 centre_;
  double radius_;
};

/// A box with rounded edges. The radius is at most half its shortest side.
class RoundedBox {
 public:
  RoundedBox(DVec3 min, DVec3 max, double rounding)
      : min_(min),
        max_(max),
        middle_(0.5 * min + 0.5 * max),
        half_size_(0.5 * max - 0.5 * min),
        rounding_(std::min(rounding, std::min({half_size_.x, half_size_.y, half_size_.z}))),
        is_sound_(is_finite(min) && is_finite(max) && min.x <= max.x && min.y <= max.y && min.z <= max.z &&
                  rounding >= 0.0 && std::isfinite(rounding)) {}

  [[nodiscard]] bool is_sound() const { return is_sound_; }
  [[nodiscard]] DVec3 min() const { return min_; }
  [[nodiscard]] DVec3 max() const { return max_; }
  /// Negative inside.
  [[nodiscard]] double distance(DVec3 point) const {
    QUOIN_ASSERT(is_sound_, "a valid box");
    const DVec3 beyond = glm::abs(point - middle_) - (half_size_ - rounding_);
    const DVec3 outside = glm::max(beyond, DVec3(0.0));
    const double inside = std::min(std::max({beyond.x, beyond.y, beyond.z}), 0.0);
    return std::sqrt(outside.x * outside.x + outside.y * outside.y + outside.z * outside.z) + inside - rounding_;
  }

 private:
  DVec3 min_;
  DVec3 max_;
  DVec3 middle_;
  DVec3 half_size_;
  double rounding_;
  bool is_sound_;
};

class Plane {
 public:
  /// `normal`: of any length except 0.
  Plane(DVec3 point, DVec3 normal) : point_(point) {
    const double largest = std::max({std::abs(normal.x), std::abs(normal.y), std::abs(normal.z)});
    is_sound_ = is_finite(point) && is_finite(normal) && largest > 0.0;
    if (!is_sound_) return;
    const DVec3 scaled = normal / largest;
    normal_ = scaled / std::sqrt(scaled.x * scaled.x + scaled.y * scaled.y + scaled.z * scaled.z);
  }

  [[nodiscard]] bool is_sound() const { return is_sound_; }
  /// Positive on the side that the normal points to.
  [[nodiscard]] double distance(DVec3 point) const {
    QUOIN_ASSERT(is_sound_, "a valid plane");
    // A quarter of each part, so that no sum of finite numbers overflows.
    const DVec3 d = 0.25 * point - 0.25 * point_;
    return 4.0 * (d.x * normal_.x + d.y * normal_.y + d.z * normal_.z);
  }

 private:
  DVec3 point_;
  DVec3 normal_{0.0};
  bool is_sound_ = false;
};

/// A sphere whose effect on an edit fades towards its rim.
class Brush {
 public:
  /// `strength`: at the centre; more than 1 counts as 1.
  Brush(DVec3 centre, double radius, double strength)
      : sphere_(centre, radius), centre_(centre), radius_(radius), strength_(std::min(strength, 1.0)) {}

  [[nodiscard]] bool is_sound() const { return sphere_.is_sound() && radius_ > 0.0 && strength_ > 0.0; }
  [[nodiscard]] const Sphere& sphere() const { return sphere_; }
  /// Returns strength * (1 - (distance / radius)^2)^2 inside, 0 outside.
  [[nodiscard]] double weight(DVec3 point) const {
    QUOIN_ASSERT(is_sound(), "a valid brush");
    const DVec3 d = (point - centre_) / radius_;
    const double left = 1.0 - (d.x * d.x + d.y * d.y + d.z * d.z);
    return left > 0.0 ? strength_ * left * left : 0.0;
  }

 private:
  Sphere sphere_;
  DVec3 centre_;
  double radius_;
  double strength_;
};

}  // namespace quoin
