#pragma once

#include <functional>
#include <optional>

#include <quoin/core/vec.h>
#include <quoin/scene/sweep.h>

#include "camera_control.h"

namespace quoin::viewer {

/// A body that walks in the scene with the camera as its eyes: on blocks and on smooth ground, up steps and slopes,
/// down by its weight. Space jumps.
///
/// Time goes by in steps of 1/120 s, so that the frame rate makes no difference.
class Walker {
 public:
  /// Moves a box as move_and_slide does, or nothing where the scene is not to be asked now: time stands still then.
  using Slide = std::function<std::optional<SlideResult>(const OrientedBox&, DVec3, const SlideOptions&)>;

  /// Begins to walk with the feet at a place, in a scene of such bounds, below which nobody falls.
  void stand(DVec3 feet, const DBox& bounds);
  /// A larger body for positive notches: it sees, steps and jumps that much higher, and walks faster.
  void grow(double notches);
  [[nodiscard]] double height() const { return height_; }  ///< world units
  [[nodiscard]] DVec3 feet() const { return feet_; }
  [[nodiscard]] DVec3 eyes() const { return feet_ + DVec3{0.0, kEyes * height_, 0.0}; }

  /// Lets that much time go by, at most a tenth of a second: walks where `push` says, level, with `camera` as front, a
  /// push up jumps. Moves the camera.
  void advance(double seconds, const CameraPush& push, double boost, CameraControl& camera, const Slide& slide);
  /// Whether time would still change anything when no key is held.
  [[nodiscard]] bool is_moving() const { return !is_on_floor_; }

 private:
  static constexpr double kEyes = 0.92;  // of the height

  [[nodiscard]] OrientedBox box() const;
  bool step(DVec3 wanted, bool jumps, const Slide& slide);

  DVec3 feet_{0.0};
  double height_ = 1.8;
  double lowest_ = 0.0;
  double size_ = 10.0;      // of the scene
  double fall_ = 0.0;       // upwards speed
  double left_over_ = 0.0;  // seconds that were too few for a step
  bool is_on_floor_ = true;
};

}  // namespace quoin::viewer
