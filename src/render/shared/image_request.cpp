#include "render/shared/image_request.h"

#include <cmath>
#include <limits>
#include <numbers>

#include <glm/geometric.hpp>

#include <quoin/core/assert.h>

namespace quoin {
namespace {

constexpr std::int64_t kMaxPixels = std::int64_t{1} << 28;

Status check_camera(const Camera& camera) {
  const auto refuse = [](const char* message) { return make_error(ErrorCode::InvalidArgument, message); };
  if (!is_finite(camera.position)) return refuse("camera: position must be finite");
  for (const DVec3 axis : {camera.right, camera.up, camera.forward}) {
    if (!(std::abs(glm::dot(axis, axis) - 1.0) < 1e-3)) return refuse("camera: directions must be unit vectors");
  }
  if (camera.projection == Camera::Projection::Perspective) {
    if (!(camera.vertical_fov_radians > 0.0 && camera.vertical_fov_radians < std::numbers::pi)) {
      return refuse("camera: field of view must be more than 0 and less than pi radians (180 degrees)");
    }
  } else if (!(camera.view_height > 0.0) || !std::isfinite(camera.view_height)) {
    return refuse("camera: view height must be finite and more than 0");
  }
  return {};
}

}  // namespace

Status check_image(const Camera& camera, int width, int height) {
  const auto refuse = [](const char* message) { return make_error(ErrorCode::InvalidArgument, message); };
  if (width <= 0 || height <= 0) return refuse("size: width and height must be positive");
  if (std::int64_t{width} * height > kMaxPixels) return refuse("size: more than 268,435,456 pixels");
  return check_camera(camera);
}

Status check(const Camera& camera, const RenderOptions& options) {
  const auto refuse = [](const char* message) { return make_error(ErrorCode::InvalidArgument, message); };
  if (Status image = check_image(camera, options.width, options.height); !image) return image;
  if (std::isnan(options.detail.impostor_seconds)) return refuse("impostor_seconds: must be a number");
  if (options.detail.impostor_edge < 16 || options.detail.impostor_edge > 1024)
    return refuse("impostor_edge: must be 16 to 1024");
  if (options.samples < 1 || options.samples > 4096) return refuse("samples: must be 1 to 4096");
  if (Status light = check(options.light); !light) return light;
  return options.environment ? check(*options.environment) : Status();
}

RenderedImage empty_image(const RenderOptions& options) {
  QUOIN_ASSERT(options.width > 0 && options.height > 0, "a positive image size");
  const auto pixels = static_cast<std::size_t>(options.width) * static_cast<std::size_t>(options.height);
  RenderedImage image;
  image.colour = {options.width, options.height, std::vector<std::uint8_t>(3 * pixels)};
  if (options.depth) image.depth = {options.width, options.height, std::vector<float>(pixels)};
  return image;
}

namespace {

constexpr std::size_t kLanes = RayPacket::kSize;
constexpr double kSkyFov = 50.0 * std::numbers::pi / 180.0;

}  // namespace

PixelPoint sample_point(int index) {
  QUOIN_ASSERT(index >= 0, "samples count from 0");
  constexpr double kPlastic = 1.32471795724474602596;
  const double x = 0.5 + index / kPlastic;
  const double y = 0.5 + index / (kPlastic * kPlastic);
  return {x - std::floor(x), y - std::floor(y)};
}

CameraRays::CameraRays(const Camera& camera, int width, int height)
    : width_(width),
      height_(height),
      is_perspective_(camera.projection == Camera::Projection::Perspective),
      forward_(camera.forward) {
  QUOIN_ASSERT(width > 0 && height > 0, "a positive image size");
  const double image_height = is_perspective_ ? 2.0 * std::tan(camera.vertical_fov_radians / 2.0) : camera.view_height;
  const double pixel = image_height / height;
  right_ = camera.right * pixel;
  down_ = camera.up * -pixel;
  if (!is_perspective_) sky_scale_ = 2.0 * std::tan(kSkyFov / 2.0) / image_height;
  corner_ = right_ * (-0.5 * width) + down_ * (-0.5 * height);
}

void CameraRays::block(int column, int row, PixelPoint point, RayPacket& rays) const {
  QUOIN_ASSERT(column >= 0 && row >= 0, "a pixel of the image");
  RayPacket::Lanes<double> x;
  RayPacket::Lanes<double> y;
  rays.active = 0;
  for (std::size_t i = 0; i < kLanes; ++i) {
    const int pixel_x = column + static_cast<int>(i) % kBlock;
    const int pixel_y = row + static_cast<int>(i) / kBlock;
    x[i] = pixel_x + point.x;
    y[i] = pixel_y + point.y;
    if (pixel_x < width_ && pixel_y < height_) rays.active |= 1U << i;
  }
  rays.max_t.fill(std::numeric_limits<double>::infinity());
  // The crossing of each ray with the image plane, relative to the image's centre.
  const auto across = [&](int axis, RayPacket::Lanes<double>& out) {
    for (std::size_t i = 0; i < kLanes; ++i) out[i] = corner_[axis] + right_[axis] * x[i] + down_[axis] * y[i];
  };
  if (!is_perspective_) {
    across(0, rays.origin_x), across(1, rays.origin_y), across(2, rays.origin_z);
    rays.direction_x.fill(forward_.x), rays.direction_y.fill(forward_.y), rays.direction_z.fill(forward_.z);
    return;
  }
  rays.origin_x.fill(0.0), rays.origin_y.fill(0.0), rays.origin_z.fill(0.0);
  across(0, rays.direction_x), across(1, rays.direction_y), across(2, rays.direction_z);
  for (std::size_t i = 0; i < kLanes; ++i) {
    const double dx = rays.direction_x[i] + forward_.x;
    const double dy = rays.direction_y[i] + forward_.y;
    const double dz = rays.direction_z[i] + forward_.z;
    const double inverse = 1.0 / std::sqrt(dx * dx + dy * dy + dz * dz);
    rays.direction_x[i] = dx * inverse;
    rays.direction_y[i] = dy * inverse;
    rays.direction_z[i] = dz * inverse;
  }
}

float CameraRays::sky_up(const RayPacket& rays, std::size_t lane) const {
  QUOIN_ASSERT(lane < kLanes, "0 <= lane < kSize");
  if (is_perspective_) return static_cast<float>(rays.direction_y[lane]);
  const DVec3 from_middle{rays.origin_x[lane], rays.origin_y[lane], rays.origin_z[lane]};
  return static_cast<float>(glm::normalize(forward_ + from_middle * sky_scale_).y);
}

}  // namespace quoin
