#pragma once

#include <optional>

#include <quoin/core/vec.h>
#include <quoin/scene/camera.h>

namespace quoin::viewer {

/// The effect of dragging.
enum class CameraMode : std::uint8_t {
  Fly,    ///< turns the head
  Orbit,  ///< turns about the pivot
  Walk,   ///< turns the head; a Walker moves the camera
};

/// The direction of the pressed keys in the camera's axes, each -1 to 1: right, up (the world's) and forward.
struct CameraPush {
  double right = 0.0;
  double up = 0.0;
  double forward = 0.0;

  [[nodiscard]] bool is_zero() const { return right == 0.0 && up == 0.0 && forward == 0.0; }
  bool operator==(const CameraPush&) const = default;
};

/// A camera controlled by the user: flies and orbits, always upright, with the pitch limited to straight up and down.
///
/// Non-finite numbers change nothing. Time passes only in `advance`; the number of steps makes no difference except
/// rounding.
class CameraControl {
 public:
  CameraControl();

  /// Sets the camera without its roll, stops all motion, and sets the pivot to the point in front of the camera that is
  /// nearest to the middle of `bounds`. `bounds` is the visible scene, which limits speed and distance.
  void set(const Camera& camera, const DBox& bounds);
  [[nodiscard]] const Camera& camera() const { return camera_; }

  CameraMode mode = CameraMode::Orbit;

  [[nodiscard]] DVec3 pivot() const { return pivot_; }
  /// Sets the point that orbiting and zooming keep at its position in the image.
  void set_pivot(DVec3 pivot);

  /// Looks at the horizon, in perspective, with a vertical field of view in radians.
  void look_level(double vertical_fov_radians);
  void set_vertical_fov(double radians);
  /// Moves the camera and the pivot by the same distance, and stops gliding.
  void move_to(DVec3 position);
  /// Turns the camera to a point, which becomes the pivot.
  void face(DVec3 point);

  /// Turns the camera in place or around the pivot, depending on `mode`, by a drag in pixels of an image of that
  /// height.
  void turn(double dx, double dy, int image_height);
  /// Moves the camera so that points at the pivot's distance follow the mouse.
  void pan(double dx, double dy, int image_height);
  /// Zooms towards `target` (by default the pivot) for positive notches; glides there during `advance`.
  void zoom(double notches, std::optional<DVec3> target = std::nullopt);
  /// Changes the flight speed; positive notches are faster.
  void change_speed(double notches);
  [[nodiscard]] double speed() const { return speed_; }  ///< world units per second

  /// Advances time by at most one second, with the keys in `push` held, `boost` times as fast.
  void advance(double seconds, const CameraPush& push, double boost = 1.0);
  /// Returns true if the camera still moves although no key is held.
  [[nodiscard]] bool is_gliding() const;

 private:
  void apply_angles();
  void zoom_by(double log_factor);
  [[nodiscard]] double units_per_pixel(double distance, int image_height) const;

  Camera camera_;
  double yaw_ = 0.0;    // radians; 0 looks along -Z, positive turns to the right
  double pitch_ = 0.0;  // positive looks up
  DVec3 pivot_{0.0, 0.0, -10.0};
  DVec3 zoom_target_{0.0, 0.0, -10.0};
  double zoom_left_ = 0.0;  // logarithm of the distance factor still to apply
  DVec3 velocity_{0.0};
  double speed_ = 10.0;
  double size_ = 10.0;  // of the visible scene: scale for limits
};

}  // namespace quoin::viewer
