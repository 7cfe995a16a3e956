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

namespace [[gnu::visibility("default")]] quoin {

/// A camera in world space. `right`, `up` and `forward` are perpendicular unit vectors, right-handed:
/// right = forward x up.
struct Camera {
  enum class Projection : std::uint8_t { Perspective, Orthographic };

  DVec3 position{0.0};
  DVec3 right{1.0, 0.0, 0.0};
  DVec3 up{0.0, 1.0, 0.0};
  DVec3 forward{0.0, 0.0, -1.0};
  Projection projection = Projection::Perspective;
  double vertical_fov_radians = 1.0;  ///< perspective: in (0, pi)
  double view_height = 1.0;           ///< orthographic: world units from the image's bottom edge to its top edge

  bool operator==(const Camera&) const = default;
};

inline constexpr int kMaxLensBlades = 64;

/// The lens of a perspective camera.
struct Lens {
  double radius = 0.0;          ///< world units; more than 0: blurs objects out of focus
  double focus_distance = 1.0;  ///< world units along the camera's forward axis; positive
  int blades = 0;               ///< 3 to 64: number of sides of the aperture polygon; 0: a disc
  double turn_radians = 0.0;    ///< rotation of that polygon
  bool operator==(const Lens&) const = default;
};

/// Returns a perspective camera at `position` that looks at `target`. The camera is upright: +Y is up. When it looks
/// straight down, the top of the image points towards -Z; when it looks straight up, towards +Z.
///
/// Errors: InvalidArgument if a number is not finite, `position` equals `target`, or the field of view is outside (0,
///         pi).
[[nodiscard]] Result<Camera> look_at(DVec3 position, DVec3 target, double vertical_fov_radians);

/// Returns a perspective camera at `position` that looks along `direction`, which may have any length.
///
/// Errors: InvalidArgument if a number is not finite, the direction is 0, or the field of view is outside (0, pi).
[[nodiscard]] Result<Camera> look_along(DVec3 position, DVec3 direction, double vertical_fov_radians);

/// Returns the view matrix: x points right, y up and -z forward, as in glTF cameras and
/// glm::perspective(camera.vertical_fov_radians, aspect, near, far).
[[nodiscard]] glm::dmat4 camera_from_world(const Camera& camera);

/// A point in an image of `width` by `height` pixels.
struct ImagePoint {
  double x = 0.0;  ///< pixels from the image's upper left corner; pixel centres are at + 0.5
  double y = 0.0;
  int width = 1;
  int height = 1;
};

/// Returns the ray through a point of the image, in world space. It starts at a perspective camera's position, or in
/// the image plane of an orthographic camera. `direction` is a unit vector, so distances along the ray are world units.
/// Requires: width and height are positive.
[[nodiscard]] Ray ray_through(const Camera& camera, const ImagePoint& point);

/// Returns the image position of a world point: the inverse of `ray_through`, for labels and marks. The result may lie
/// outside the image. Returns nullopt if the point is not finite, or is not in front of a perspective camera.
/// Requires: width and height are positive.
[[nodiscard]] std::optional<ImagePoint> image_point(const Camera& camera, DVec3 point_in_world, int width, int height);

/// Standard views that frame a whole scene. Front looks along -Z and shows faces that point towards +Z.
enum class View : std::uint8_t { Front, Back, Left, Right, Top, Iso };

/// Returns the view with this name ("front", "iso", ...), or nullopt if the name is unknown.
[[nodiscard]] std::optional<View> view_of_name(std::string_view name);

/// Returns the unit direction in which a camera of this view looks.
[[nodiscard]] DVec3 direction_of(View view);
/// Returns the unit direction of a camera placed `azimuth_degrees` to the right of the front (90: towards +X) and
/// `elevation_degrees` above the horizon. View::Iso is 45 and 35.26 degrees.
[[nodiscard]] DVec3 direction_of(double azimuth_degrees, double elevation_degrees);

/// Returns a perspective camera that shows all of `bounds` and leaves a small margin.
///
/// Requires: `bounds` is finite; empty bounds count as the unit cube at the origin. `aspect` (width / height) is finite
///           and positive.
[[nodiscard]] Camera frame_view(const DBox& bounds, View view, double aspect);

/// Returns a camera that frames the voxels of the instances that pass `filter`. It is closer than `frame_view`, because
/// the corners of a bounding box are often empty.
///
/// Requires: `aspect` (width / height) is finite and positive.
/// Cost:     O(instances * chunks of their grids), plus the voxels of the few chunks that touch the image's margin.
[[nodiscard]] Camera frame_scene(const Scene& scene, View view, double aspect,
                                 InstanceFilter filter = InstanceFilter::Visible);

/// Frames several scenes with one shared distance: the frames of a video, or views of one scene from all sides. Each
/// camera is as close as `frame_scene` allows while every scene stays inside the image.
///
///   SceneFraming framing(direction_of(View::Iso), aspect, 36);
///   framing.add(scene);
///   for (int i = 0; i < 36; ++i) render(scene, framing.camera(i));   // one full turn
class SceneFraming {
 public:
  /// Creates a framing with `turns` cameras. Camera 0 looks along `forward`. They are spaced equally around the
  /// vertical axis through the middle of the first scene, each further to the right than the previous one.
  /// Requires: `forward` is unit; `aspect` (width / height) is finite and positive; `turns` is positive.
  SceneFraming(DVec3 forward, double aspect, int turns = 1);
  /// Adds a scene to frame. Cost: `frame_scene` times `turns`.
  void add(const Scene& scene, InstanceFilter filter = InstanceFilter::Visible);
  /// Returns the camera of one turn, which frames all added scenes, or the unit cube at the origin if they are empty.
  /// Requires: 0 <= turn < turns.
  [[nodiscard]] Camera camera(int turn = 0) const;

 private:
  DVec3 forward_;
  double aspect_;
  int turns_;
  std::optional<DVec3> middle_;
  std::array<double, 4> reaches_;
};

}  // namespace quoin
