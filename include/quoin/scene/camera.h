#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include <glm/mat4x4.hpp>

#include <quoin/core/result.h>
#include <quoin/core/vec.h>
#include <quoin/scene/scene.h>
#include <quoin/trace/ray.h>

namespace quoin {

/// Where a picture is taken from. `right`, `up` and `forward` are unit and perpendicular; right-handed, so
/// right = forward x up.
struct Camera {
  enum class Projection : std::uint8_t { Perspective, Orthographic };

  DVec3 position{0.0};
  DVec3 right{1.0, 0.0, 0.0};
  DVec3 up{0.0, 1.0, 0.0};
  DVec3 forward{0.0, 0.0, -1.0};
  Projection projection = Projection::Perspective;
  double vertical_fov_radians = 1.0;  ///< perspective: more than 0 and less than pi
  double view_height = 1.0;           ///< orthographic: world units from the picture's lower to its upper edge

  bool operator==(const Camera&) const = default;
};

/// A perspective camera at `position` that looks at `target`, upright (+Y up; where it looks straight up or down, the
/// picture's top is towards -Z when looking down and +Z when looking up).
///
/// Errors: InvalidArgument when a number is not finite, `position` equals `target`, or the field of view is not more
///         than 0 and less than pi.
[[nodiscard]] Result<Camera> look_at(DVec3 position, DVec3 target, double vertical_fov_radians);

/// Likewise, one that looks along `direction`, of any length.
///
/// Errors: InvalidArgument when a number is not finite, the direction is 0, or the field of view is as above.
[[nodiscard]] Result<Camera> look_along(DVec3 position, DVec3 direction, double vertical_fov_radians);

/// The view matrix: x to the right, y up, and -z forward, as glTF's cameras and
/// glm::perspective(camera.vertical_fov_radians, aspect, near, far) expect.
[[nodiscard]] glm::dmat4 camera_from_world(const Camera& camera);

/// A point of a picture of `width` by `height` pixels.
struct PicturePoint {
  double x = 0.0;  ///< pixels from the picture's upper left corner; a pixel's centre is at + 0.5
  double y = 0.0;
  int width = 1;
  int height = 1;
};

/// The ray of a point of the picture, in world space: from the camera for a perspective one, from the picture's plane
/// for an orthographic one. `direction` is unit, so distances along it are world units.
/// Requires: width and height are positive.
[[nodiscard]] Ray ray_through(const Camera& camera, const PicturePoint& point);

/// Where a point of the world is seen in such a picture: the inverse of `ray_through`, for labels and marks; perhaps
/// beside the picture. Nothing for what lies behind a perspective camera, beside it, or is not finite.
/// Requires: width and height are positive.
[[nodiscard]] std::optional<PicturePoint> picture_point(const Camera& camera, DVec3 point_in_world, int width,
                                                        int height);

/// The views that frame a whole scene by themselves. Front looks along -Z: what faces +Z is seen.
enum class View : std::uint8_t { Front, Back, Left, Right, Top, Iso };

/// The view of that name ("front", "iso" ...).
[[nodiscard]] std::optional<View> view_of_name(std::string_view name);

/// Where a camera of that view looks: unit.
[[nodiscard]] DVec3 direction_of(View view);
/// The same of a camera that stands so many degrees to the right of the front (90: towards +X) and above the horizon.
/// View::Iso is 45 and 35.26.
[[nodiscard]] DVec3 direction_of(double azimuth_degrees, double elevation_degrees);

/// A perspective camera that has the whole of `bounds` in the picture, filling it but for a margin.
///
/// Requires: `bounds` is finite; an empty one counts as the unit cube at the origin. `aspect` (width / height) is
///           finite and positive.
[[nodiscard]] Camera frame_view(const DBox& bounds, View view, double aspect);

/// As `frame_view`, but for the voxels themselves: closer, since boxes have corners where often nothing is.
/// Of the instances that `filter` lets pass.
///
/// Requires: `aspect` (width / height) is finite and positive.
/// Cost: O(instances * chunks of their grids), and the voxels of the few chunks that touch the picture's margin.
[[nodiscard]] Camera frame_scene(const Scene& scene, View view, double aspect,
                                 InstanceFilter filter = InstanceFilter::Visible);

/// Cameras that have several scenes in their pictures, frames of a film or one scene from all sides, framed alike: as
/// `frame_scene` frames one, so closely that none leaves the picture and the camera keeps its distance.
///
///   SceneFraming framing(direction_of(View::Iso), aspect, 36);
///   framing.add(scene);
///   for (int i = 0; i < 36; ++i) render(scene, framing.camera(i));   // once round it
class SceneFraming {
 public:
  /// `turns`: into how many equal turns to the right, about the vertical through the middle of the first scene, a full
  /// one is divided.
  /// Requires: `forward` is unit; `aspect` (width / height) is finite and positive, and `turns` is positive.
  SceneFraming(DVec3 forward, double aspect, int turns = 1);
  /// Cost: that of frame_scene, for each of the turns.
  void add(const Scene& scene, InstanceFilter filter = InstanceFilter::Visible);
  /// Of all that was added. Nothing counts as the unit cube at the origin. Requires: 0 <= turn < turns.
  [[nodiscard]] Camera camera(int turn = 0) const;

 private:
  DVec3 forward_;
  double aspect_;
  int turns_;
  std::optional<DVec3> middle_;
  std::array<double, 4> reaches_;
};

}  // namespace quoin
