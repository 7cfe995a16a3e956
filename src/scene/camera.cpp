#include <quoin/scene/camera.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include <quoin/core/assert.h>

#include "scene/framing.h"

namespace quoin {

namespace {

constexpr double kFramingFov = 30.0 * std::numbers::pi / 180.0;  // narrow enough to keep towers upright
constexpr double kMargin = 0.04;                                 // share of the image's width (height), on each side

struct NamedView {
  std::string_view name;
  View view;
  DVec3 forward;
};

/// `iso` looks along the diagonal of a cube, as isometric drawings do.
constexpr double kThird = 0.57735026918962576451;
const std::array<NamedView, 6> kViews = {{{"front", View::Front, {0, 0, -1}},
                                          {"back", View::Back, {0, 0, 1}},
                                          {"left", View::Left, {1, 0, 0}},
                                          {"right", View::Right, {-1, 0, 0}},
                                          {"top", View::Top, {0, -1, 0}},
                                          {"iso", View::Iso, {-kThird, -kThird, -kThird}}}};

/// Sets the axes for looking along `forward`, a unit vector: upright; with +X to the right straight up and down.
void turn(Camera& camera, DVec3 forward) {
  camera.forward = forward;
  const double level = std::hypot(forward.x, forward.z);
  camera.right = level > 0.0 ? DVec3{-forward.z / level + 0.0, 0.0, forward.x / level} : DVec3{1.0, 0.0, 0.0};
  camera.up = glm::cross(camera.right, camera.forward);
}

/// Returns the box to frame, with a positive volume.
DBox box_to_frame(const DBox& bounds) {
  if (bounds.empty()) return {DVec3{0.0}, DVec3{1.0}};
  return bounds.min == bounds.max ? DBox{bounds.min - 0.5, bounds.max + 0.5} : bounds;
}

/// The camera position, along one image axis and the view direction, such that all corners are visible.
struct Stand {
  double across;   ///< along the image axis, midway between the limits of the two edges
  double forward;  ///< the maximum along the view direction
};

/// Each point at depth f may lie up to `slope * (f - stand)` to either side.
Stand stand_for(const Reach& reach, DVec3 axis, DVec3 forward, double slope) {
  const double greatest = reach(axis - slope * forward);
  const double least = reach(-axis - slope * forward);
  return {0.5 * (greatest - least), -0.5 * (greatest + least) / slope};
}

}  // namespace

Result<Camera> look_along(DVec3 position, DVec3 direction, double vertical_fov_radians) {
  if (!is_finite(position)) return make_error(ErrorCode::InvalidArgument, "camera: position must be finite");
  if (!is_finite(direction)) return make_error(ErrorCode::InvalidArgument, "camera: direction must be finite");
  if (!(vertical_fov_radians > 0.0 && vertical_fov_radians < std::numbers::pi)) {
    return make_error(ErrorCode::InvalidArgument,
                      "camera: field of view must be more than 0 and less than pi radians (180 degrees)");
  }
  // Scaled so that no square is lost.
  const double largest = std::max({std::abs(direction.x), std::abs(direction.y), std::abs(direction.z)});
  if (!(largest > 0.0)) return make_error(ErrorCode::InvalidArgument, "camera: direction must not be 0");
  Camera camera;
  camera.position = position;
  camera.vertical_fov_radians = vertical_fov_radians;
  turn(camera, glm::normalize(direction / largest));
  return camera;
}

Result<Camera> look_at(DVec3 position, DVec3 target, double vertical_fov_radians) {
  if (!is_finite(target)) return make_error(ErrorCode::InvalidArgument, "camera: target must be finite");
  if (position == target) return make_error(ErrorCode::InvalidArgument, "camera: position and target must differ");
  // Halved so that the difference of the largest numbers stays finite.
  return look_along(position, 0.5 * target - 0.5 * position, vertical_fov_radians);
}

glm::dmat4 camera_from_world(const Camera& camera) {
  const glm::dmat3 camera_axes = glm::transpose(glm::dmat3(camera.right, camera.up, -camera.forward));
  glm::dmat4 matrix(camera_axes);
  matrix[3] = glm::dvec4(-(camera_axes * camera.position), 1.0);
  return matrix;
}

namespace {

/// Returns the size of a pixel of an image with the given height: in the plane 1 in front of a perspective camera, or
/// in world units.
double pixel_size(const Camera& camera, int height) {
  QUOIN_ASSERT(height > 0, "a positive image height");
  const bool is_perspective = camera.projection == Camera::Projection::Perspective;
  const double image_height = is_perspective ? 2.0 * std::tan(camera.vertical_fov_radians / 2.0) : camera.view_height;
  return image_height / height;
}

}  // namespace

std::optional<ImagePoint> image_point(const Camera& camera, DVec3 point_in_world, int width, int height) {
  QUOIN_ASSERT(width > 0 && height > 0, "a positive image size");
  const DVec3 from_camera = point_in_world - camera.position;
  double pixel = pixel_size(camera, height);
  if (camera.projection == Camera::Projection::Perspective) {
    const double ahead = glm::dot(from_camera, camera.forward);
    if (!(ahead > 0.0)) return std::nullopt;
    pixel *= ahead;
  }
  const ImagePoint point{0.5 * width + glm::dot(from_camera, camera.right) / pixel,
                         0.5 * height - glm::dot(from_camera, camera.up) / pixel, width, height};
  if (!std::isfinite(point.x) || !std::isfinite(point.y)) return std::nullopt;
  return point;
}

Ray ray_through(const Camera& camera, const ImagePoint& point) {
  const auto [x, y, width, height] = point;
  QUOIN_ASSERT(width > 0 && height > 0, "a positive image size");
  const bool is_perspective = camera.projection == Camera::Projection::Perspective;
  const double pixel = pixel_size(camera, height);
  const DVec3 across = camera.right * ((x - 0.5 * width) * pixel) + camera.up * ((0.5 * height - y) * pixel);
  if (!is_perspective) return {camera.position + across, camera.forward};
  return {camera.position, glm::normalize(camera.forward + across)};
}

std::optional<View> view_of_name(std::string_view name) {
  for (const NamedView& known : kViews) {
    if (known.name == name) return known.view;
  }
  return std::nullopt;
}

DVec3 direction_of(View view) {
  QUOIN_ASSERT(static_cast<std::size_t>(view) < kViews.size(), "one of the views");
  return kViews[static_cast<std::size_t>(view)].forward;
}

DVec3 direction_of(double azimuth_degrees, double elevation_degrees) {
  const double a = azimuth_degrees * std::numbers::pi / 180.0;
  const double e = elevation_degrees * std::numbers::pi / 180.0;
  return glm::normalize(-DVec3(std::sin(a) * std::cos(e), std::sin(e), std::cos(a) * std::cos(e)));
}

Camera frame(DVec3 middle, const Reach& reach, View view, double aspect) {
  return frame(middle, reach, direction_of(view), aspect);
}

std::array<DVec3, 4> framing_directions(DVec3 forward, double aspect) {
  // The middle and the reach are dummies; only the requested directions matter.
  std::array<DVec3, 4> asked{};
  std::size_t count = 0;
  static_cast<void>(frame(
      DVec3(0.0),
      [&](DVec3 direction) {
        QUOIN_ASSERT(count < asked.size(), "a reach is asked of four directions");
        asked[count++] = direction;
        return 1.0;
      },
      forward, aspect));
  return asked;
}

Camera frame(DVec3 middle, const Reach& reach, DVec3 forward, double aspect) {
  QUOIN_ASSERT(aspect > 0.0 && std::isfinite(aspect), "a positive, finite aspect");
  QUOIN_ASSERT(std::abs(glm::length(forward) - 1.0) < 1e-6, "a unit direction");
  Camera camera;
  camera.vertical_fov_radians = kFramingFov;
  turn(camera, forward);
  const double slope = std::tan(0.5 * kFramingFov) * (1.0 - 2.0 * kMargin);
  const Stand level = stand_for(reach, camera.right, camera.forward, slope * aspect);
  const Stand upright = stand_for(reach, camera.up, camera.forward, slope);
  camera.position = middle + level.across * camera.right + upright.across * camera.up +
                    std::min(level.forward, upright.forward) * camera.forward;
  return camera;
}

Camera frame_view(const DBox& bounds, View view, double aspect) {
  QUOIN_ASSERT(bounds.empty() || (is_finite(bounds.min) && is_finite(bounds.max)), "finite bounds");
  const DBox box = box_to_frame(bounds);
  const DVec3 half = 0.5 * (box.max - box.min);
  return frame(
      box.min + half, [half](DVec3 direction) { return glm::dot(glm::abs(direction), half); }, view, aspect);
}

}  // namespace quoin
