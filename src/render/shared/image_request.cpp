#include "render/shared/image_request.h"

#include <cmath>
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

}  // namespace quoin
