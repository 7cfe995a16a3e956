#include "render/path/denoise.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <quoin/core/assert.h>

#include "render/path/path_math.h"

namespace quoin::path {
namespace {

constexpr int kLevels = 5;             // with steps of 1 to 16 pixels
constexpr float kLeastAlbedo = 1e-4F;  // lower bound of the divisor of light
constexpr float kAllowed = 2.0F;       // largest difference of light, in standard deviations
constexpr float kCurve = 32.0F;        // exponent of the cosine between normals
constexpr std::array kKernel = {1.0F / 16, 1.0F / 4, 3.0F / 8, 1.0F / 4, 1.0F / 16};

// The incident light of a part, and the variance of its mean.
struct Light {
  Vec3 mean{0.0F};
  float variance = 0.0F;
};
using OfPixel = std::array<Light, SurfaceParts::kOfPixel>;

Vec3 albedo_of(const SurfacePart& part) {
  return glm::max(part.albedo / part.samples, Vec3(kLeastAlbedo));
}

// Returns the similarity of two parts: 0 for different surfaces, 1 on the same flat surface.
float likeness(const SurfacePart& a, const SurfacePart& b) {
  if (a.surface != b.surface) return 0.0F;
  const float length2 = glm::dot(a.normal, a.normal) * glm::dot(b.normal, b.normal);
  if (!(length2 > 0.0F)) return 1.0F;
  const float cosine = glm::dot(a.normal, b.normal) / std::sqrt(length2);
  // The parts must lie side by side, not behind each other: the distance along the normal is at most a third of the
  // distance between them.
  const Vec3 way = b.place / b.samples - a.place / a.samples;
  const float along = glm::dot(way, a.normal) / std::sqrt(glm::dot(a.normal, a.normal));
  if (along * along > glm::dot(way, way) / 9.0F) return 0.0F;
  return cosine > 0.0F ? power(cosine, kCurve) : 0.0F;
}

class Denoiser {
 public:
  Denoiser(const SurfaceParts& parts, Threads threads)
      : parts_(parts), threads_(threads), width_(parts.width()), height_(parts.height()) {
    const auto pixels = static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_);
    now_.resize(pixels);
    next_.resize(pixels);
    begin();
  }

  void smooth() {
    for (int level = 0; level < kLevels; ++level) {
      for_each_part([&](int x, int y, std::size_t slot) { return smoothed(x, y, slot, 1 << level); });
      std::swap(now_, next_);
    }
  }

  [[nodiscard]] Vec3 light(std::size_t pixel, std::size_t slot) const {
    return now_[pixel][slot].mean * albedo_of(parts_.at(pixel)[slot]);
  }

 private:
  [[nodiscard]] std::size_t index(int x, int y) const {
    QUOIN_ASSERT(x >= 0 && x < width_ && y >= 0 && y < height_, "a pixel of the image");
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
  }

  // Sets all lights of `next_`.
  template <class Make>
  void for_each_part(Make&& make) {
    parallel_for(static_cast<std::size_t>(height_), threads_, [&](std::size_t row) {
      const auto y = static_cast<int>(row);
      for (int x = 0; x < width_; ++x) {
        const std::size_t pixel = index(x, y);
        for (std::size_t slot = 0; slot < SurfaceParts::kOfPixel && parts_.at(pixel)[slot].surface != 0; ++slot) {
          next_[pixel][slot] = make(x, y, slot);
        }
      }
    });
  }

  // Calls `visit(part, light, weight)` for the parts of the same surface around a part, itself included.
  template <class Visit>
  void around(int x, int y, std::size_t slot, int radius, int step, Visit&& visit) const {
    const SurfacePart& own = parts_.at(index(x, y))[slot];
    for (int dy = -radius; dy <= radius; ++dy) {
      for (int dx = -radius; dx <= radius; ++dx) {
        const int to_x = x + dx * step;
        const int to_y = y + dy * step;
        if (to_x < 0 || to_y < 0 || to_x >= width_ || to_y >= height_) continue;
        const std::size_t pixel = index(to_x, to_y);
        for (std::size_t i = 0; i < SurfaceParts::kOfPixel; ++i) {
          const SurfacePart& part = parts_.at(pixel)[i];
          if (part.surface == 0) break;
          const float weight = dx == 0 && dy == 0 && i == slot ? 1.0F : likeness(own, part);
          if (weight > 0.0F) visit(part, now_[pixel][i], weight, dx, dy);
        }
      }
    }
  }

  // One pixel's noise estimate is too uncertain, so it is averaged with its neighbours. Differences between pixels are
  // not noise: they may be the edge of a shadow.
  void begin() {
    for_each_part([&](int x, int y, std::size_t slot) {
      const SurfacePart& own = parts_.at(index(x, y))[slot];
      float freedom = 0.0F;
      float squares = 0.0F;
      around(x, y, slot, 1, 1, [&](const SurfacePart& part, const Light&, float weight, int, int) {
        const float scale = 1.0F / luminance(albedo_of(part));
        const float sum = luminance(part.light);
        freedom += weight * (part.samples - 1.0F);
        squares += weight * std::max(part.square - sum * sum / part.samples, 0.0F) * scale * scale;
      });
      const Vec3 mean = own.light / own.samples / albedo_of(own);
      // Single samples give no variance: assumes their own square.
      const float variance = freedom > 0.0F ? squares / freedom : square(luminance(mean));
      return Light{mean, variance / own.samples};
    });
    std::swap(now_, next_);
  }

  [[nodiscard]] Light smoothed(int x, int y, std::size_t slot, int step) const {
    const Light& own = now_[index(x, y)][slot];
    const float own_light = luminance(own.mean);
    // Uses reflected light, not incident light: a channel that the surface mostly absorbs says little about incident
    // light.
    Vec3 sum(0.0F);
    Vec3 whole(0.0F);
    float variances = 0.0F;
    float weights = 0.0F;
    around(x, y, slot, 2, step, [&](const SurfacePart& part, const Light& light, float likeness, int dx, int dy) {
      const float difference = luminance(light.mean) - own_light;
      const float noise = kAllowed * kAllowed * (own.variance + light.variance) + 1e-8F;
      const float near = kKernel[static_cast<std::size_t>(dx + 2)] * kKernel[static_cast<std::size_t>(dy + 2)];
      const float weight = near * likeness * part.samples * exponential(-difference * difference / noise);
      const Vec3 albedo = albedo_of(part);
      sum += light.mean * albedo * weight;
      whole += albedo * weight;
      variances += light.variance * weight * weight;
      weights += weight;
    });
    if (!(weights > 0.0F)) return own;
    return {sum / whole, variances / (weights * weights)};
  }

  const SurfaceParts& parts_;
  Threads threads_;
  int width_;
  int height_;
  std::vector<OfPixel> now_, next_;
};

}  // namespace

void denoise(const SurfaceParts& parts, int samples, Threads threads, PathImage& image) {
  QUOIN_ASSERT(
      image.width == parts.width() && image.height == parts.height() && image.radiance.size() == image.scene.size(),
      "the parts of this image");
  QUOIN_ASSERT(samples > 0, "at least one sample");
  Denoiser denoiser(parts, threads);
  denoiser.smooth();
  const auto count = static_cast<float>(samples);
  for (std::size_t pixel = 0; pixel < image.scene.size(); ++pixel) {
    Vec3 change(0.0F);
    Vec3 of_sky(0.0F);  // not part of the scene
    for (std::size_t slot = 0; slot < SurfaceParts::kOfPixel; ++slot) {
      const SurfacePart& part = parts.at(pixel)[slot];
      if (part.surface == 0) break;
      (part.surface == SurfaceParts::kSky ? of_sky : change) +=
          (denoiser.light(pixel, slot) * part.samples - part.light) / count;
    }
    const Vec3 before = image.scene[pixel];
    image.scene[pixel] = glm::max(before + change, Vec3(0.0F));
    image.radiance[pixel] = glm::max(image.radiance[pixel] + image.scene[pixel] - before + of_sky, Vec3(0.0F));
  }
}

}  // namespace quoin::path
