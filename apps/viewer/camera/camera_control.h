#pragma once

#include <optional>

#include <quoin/core/vec.h>
#include <quoin/scene/camera.h>

namespace quoin::viewer {

/// What dragging does.
enum class CameraMode : std::uint8_t {
  Fly,    ///< turns the head
  Orbit,  ///< turns about the pivot
  Walk,   ///< turns the head; a Walker moves the camera
};

/// Where the keys push, in the camera's own axes, each -1 to 1: right, up (of the world) and forward.
struct CameraPush {
  double right = 0.0;
  double up = 0.0;
  double forward = 0.0;

  [[nodiscard]] bool is_zero() const { return right == 0.0 && up == 0.0 && forward == 0.0; }
  bool operator==(const CameraPush&) const = default;
};

/// A camera under the hands of a user: flies and orbits, upright always, never beyond straight up or down.
///
/// Numbers that are not finite change nothing. Time goes by only in `advance`, and how it is cut into steps makes no
/// difference beyond rounding.
class CameraControl {
 public:
  CameraControl();

  /// Takes over a camera (its roll is lost), what is to be seen for the bounds of speed and distance, and a pivot: the
  /// point before the camera that is nearest to the middle of `bounds`. Whatever moved stops.
  void set(const Camera& camera, const DBox& bounds);
  [[nodiscard]] const Camera& camera() const { return camera_; }

  CameraMode mode = CameraMode::Orbit;

  [[nodiscard]] DVec3 pivot() const { return pivot_; }
  /// The point that orbiting and zooming keep in its place in the picture.
  void set_pivot(DVec3 pivot);

  /// Looks to the horizon, in perspective, through an angle of view (radians).
  void look_level(double vertical_fov_radians);
  void set_vertical_fov(double radians);
  /// Moves the camera, and the pivot as far. It glides no further.
  void move_to(DVec3 position);
  /// Turns the head to a point, which becomes the pivot.
  void face(DVec3 point);

  /// Turns the head, or about the pivot, as `mode` says; in pixels of dragging, in a picture of that height.
  void turn(double dx, double dy, int picture_height);
  /// Moves the camera so that what lies at the pivot's distance follows the mouse.
  void pan(double dx, double dy, int picture_height);
  /// Towards `target` (the pivot without one) for positive notches; glides there during `advance`.
  void zoom(double notches, std::optional<DVec3> target = std::nullopt);
  /// Faster flight for positive notches.
  void change_speed(double notches);
  [[nodiscard]] double speed() const { return speed_; }  ///< world units a second

  /// Lets that much time go by, with the keys held as `push` says, `boost` times as fast. At most a second counts.
  void advance(double seconds, const CameraPush& push, double boost = 1.0);
  /// Whether time would still change the picture when no key is held.
  [[nodiscard]] bool is_gliding() const;

 private:
  void apply_angles();
  void zoom_by(double log_factor);
  [[nodiscard]] double units_per_pixel(double distance, int picture_height) const;

  Camera camera_;
  double yaw_ = 0.0;    // radians; 0 looks along -Z, positive turns to the right
  double pitch_ = 0.0;  // positive looks up
  DVec3 pivot_{0.0, 0.0, -10.0};
  DVec3 zoom_target_{0.0, 0.0, -10.0};
  double zoom_left_ = 0.0;  // logarithm of the distance's factor that is still to be applied
  DVec3 velocity_{0.0};
  double speed_ = 10.0;
  double size_ = 10.0;  // of what there is to be seen: scale for bounds
};

}  // namespace quoin::viewer
