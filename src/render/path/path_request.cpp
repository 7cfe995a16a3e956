#include "render/path/path_request.h"

#include <algorithm>
#include <cmath>
#include <string>

#include <glm/geometric.hpp>

#include <quoin/core/assert.h>

#include "render/path/path_math.h"
#include "render/shared/image_request.h"

namespace quoin::path {
namespace {

constexpr int kMaxBounces = 1'024;

Status refuse(const std::string& message) {
  return make_error(ErrorCode::InvalidArgument, message);
}

Status check_lens(const Lens& lens) {
  if (!(lens.radius >= 0.0) || !std::isfinite(lens.radius)) {
    return refuse("lens.radius: must be finite and at least 0");
  }
  if (!(lens.focus_distance > 0.0) || !std::isfinite(lens.focus_distance)) {
    return refuse("lens.focus_distance: must be finite and more than 0");
  }
  if (lens.blades != 0 && (lens.blades < 3 || lens.blades > kMaxLensBlades)) {
    return refuse("lens.blades: must be 0, or 3 to 64");
  }
  return std::isfinite(lens.turn_radians) ? Status() : refuse("lens.turn_radians: must be finite");
}

}  // namespace

Status check(const Camera& camera, const PathOptions& options) {
  QUOIN_ASSERT(std::abs(glm::dot(camera.right, camera.up)) < 1e-3 &&
                   std::abs(glm::dot(camera.right, camera.forward)) < 1e-3 &&
                   std::abs(glm::dot(camera.up, camera.forward)) < 1e-3,
               "the camera's axes are perpendicular");
  if (Status image = check_image(camera, options.width, options.height); !image) return image;
  if (options.samples < 1 || options.samples > kMaxPathSamples) return refuse("samples: must be 1 to 65536");
  if (options.max_bounces < 0 || options.max_bounces > kMaxBounces) return refuse("max_bounces: must be 0 to 1024");
  if (options.max_scatterings < 0 || options.max_scatterings > kMaxBounces) {
    return refuse("max_scatterings: must be 0 to 1024");
  }
  if (Status lens = check_lens(options.lens); !lens) return lens;
  if (!options.environment) return {};
  if (Status around = quoin::check(*options.environment); !around) return around;
  return lacks_image(options.environment->sky) ? refuse("sky.image: must be an image of at least one pixel") : Status();
}

PathImage empty_image(const PathOptions& options) {
  QUOIN_ASSERT(options.width > 0 && options.height > 0, "a positive image size");
  const auto pixels = static_cast<std::size_t>(options.width) * static_cast<std::size_t>(options.height);
  PathImage image;
  image.width = options.width;
  image.height = options.height;
  image.radiance.resize(pixels);
  image.scene.resize(pixels);
  image.alpha.resize(pixels);
  if (!options.layers) return image;
  image.albedo.resize(pixels);
  image.normal.resize(pixels);
  image.depth = {options.width, options.height, std::vector<float>(pixels)};
  image.types.resize(pixels);
  image.instances.resize(pixels);
  return image;
}

void PixelSums::write_to(PathImage& image, std::size_t pixel, int samples) const {
  QUOIN_ASSERT(pixel < image.radiance.size() && samples > 0, "a pixel of the image, with samples");
  const auto count = static_cast<float>(samples);
  Vec3 passed(1.0F);
  for (int channel = 0; channel < 3; ++channel) {
    if (open[channel] > 0.0F) passed[channel] = std::min(lit[channel] / open[channel], 1.0F);
  }
  image.scene[pixel] = scene / count;
  image.radiance[pixel] = (scene + background + caught * passed) / count;
  image.alpha[pixel] = std::min((scene_share + caught_share * (1.0F - luminance(passed))) / count, 1.0F);
  if (image.depth.values.empty()) return;
  image.albedo[pixel] = albedo / count;
  image.normal[pixel] = normal / count;
  image.depth.values[pixel] = depth;
  image.types[pixel] = type;
  image.instances[pixel] = instance;
}

}  // namespace quoin::path
