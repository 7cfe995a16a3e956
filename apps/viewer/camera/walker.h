#pragma once

#include <functional>
#include <optional>

#include <quoin/core/vec.h>
#include <quoin/scene/sweep.h>

#include "camera_control.h"

namespace quoin::viewer {

/// A body that walks in the scene with the camera as its eyes: on blocks and smooth ground, up steps and slopes, with
/// gravity. Space jumps.
///
/// Time advances in steps of 1/120 s, so the frame rate makes no difference.
class Walker {
 public:
  /// Calls move_and_slide. Returns empty while the scene cannot be queried; the walker's time stands still then.
  using Slide = std::function<std::optional<SlideResult>(const OrientedBox&, DVec3, const SlideOptions&)>;

  /// Starts walking with the feet at a point. The walker cannot fall below the scene's `bounds`.
  void stand(DVec3 feet, const DBox& bounds);
  /// Scales the body, larger for positive notches: eye height, step height, jump height and speed grow with it.
  void grow(double notches);
  [[nodiscard]] double height() const { return height_; }  ///< world units
  [[nodiscard]] DVec3 feet() const { return feet_; }
  [[nodiscard]] DVec3 eyes() const { return feet_ + DVec3{0.0, kEyes * height_, 0.0}; }

  /// Advances time by at most 0.1 s: walks horizontally in the direction of `push` relative to `camera`, jumps if
  /// `push` points up, and moves the camera.
  void advance(double seconds, const CameraPush& push, double boost, CameraControl& camera, const Slide& slide);
  /// Returns true if the body still moves although no key is held.
  [[nodiscard]] bool is_moving() const { return !is_on_floor_; }

 private:
  static constexpr double kEyes = 0.92;  // fraction of the height

  [[nodiscard]] OrientedBox box() const;
  bool step(DVec3 wanted, bool jumps, const Slide& slide);

  DVec3 feet_{0.0};
  double height_ = 1.8;
  double lowest_ = 0.0;
  double size_ = 10.0;      // of the scene
  double fall_ = 0.0;       // upwards speed
  double left_over_ = 0.0;  // seconds not yet simulated, less than a step
  bool is_on_floor_ = true;
};

}  // namespace quoin::viewer
