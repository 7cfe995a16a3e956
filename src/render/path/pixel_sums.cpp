#include "render/path/pixel_sums.h"

#include <algorithm>

#include "render/path/path_math.h"

namespace quoin::path {

void PixelSums::write_to(PathPicture& picture, std::size_t pixel, int samples) const {
  const auto count = static_cast<float>(samples);
  Vec3 passed(1.0F);
  for (int channel = 0; channel < 3; ++channel) {
    if (open[channel] > 0.0F) passed[channel] = std::min(lit[channel] / open[channel], 1.0F);
  }
  picture.scene[pixel] = scene / count;
  picture.radiance[pixel] = (scene + background + caught * passed) / count;
  picture.alpha[pixel] = std::min((scene_share + caught_share * (1.0F - luminance(passed))) / count, 1.0F);
  if (picture.depth.values.empty()) return;
  picture.albedo[pixel] = albedo / count;
  picture.normal[pixel] = normal / count;
  picture.depth.values[pixel] = depth;
  picture.types[pixel] = type;
  picture.instances[pixel] = instance;
}

}  // namespace quoin::path
