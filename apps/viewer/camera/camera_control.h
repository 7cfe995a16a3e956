#pragma once

#include <functional>
#include <optional>

#include <quoin/core/vec.h>
#include <quoin/scene/camera.h>
#include <quoin/scene/sweep.h>

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
