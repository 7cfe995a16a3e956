#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/parallel.h>
#include <quoin/core/vec.h>
#include <quoin/render/path_tracer.h>

namespace quoin::path {

/// The part of a pixel that shows one surface: a face's plane in a grid, a field, the ground.
struct SurfacePart {
  std::uint32_t surface = 0;  ///< its id; 0: none
  float samples = 0.0F;
  float square = 0.0F;  ///< sum of the squares of the light's luminance
  Vec3 light{0.0F};     ///< sums
  Vec3 albedo{0.0F};
  Vec3 normal{0.0F};  ///< of curved surfaces; otherwise 0
  Vec3 place{0.0F};   ///< of curved surfaces, in view space; otherwise 0
};

/// The surfaces of an image's pixels, each pixel's first few.
///
///   pixel 0: part part part | pixel 1: part part part | ...
class SurfaceParts {
 public:
  static constexpr std::size_t kOfPixel = 3;
  static constexpr std::uint32_t kSky = 4;  ///< the surface of the background behind fog and clouds that hits no other
                                            ///< surface
  using OfPixel = std::array<SurfacePart, kOfPixel>;

  SurfaceParts(int width, int height)
      : width_(width), height_(height), pixels_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height)) {}

  [[nodiscard]] OfPixel& at(std::size_t pixel) {
    QUOIN_ASSERT(pixel < pixels_.size(), "a pixel of the image");
    return pixels_[pixel];
  }
  [[nodiscard]] const OfPixel& at(std::size_t pixel) const {
    QUOIN_ASSERT(pixel < pixels_.size(), "a pixel of the image");
    return pixels_[pixel];
  }
  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }

 private:
  int width_;
  int height_;
  std::vector<OfPixel> pixels_;
};

/// Replaces the light of an image's surfaces by means over the same surface nearby, within their noise. Does not change
/// light outside the parts. Keeps every edge between surfaces, down to each surface's share of a pixel. `samples`: per
/// pixel.
///
/// Source: the a-trous wavelets of H. Dammertz et al. (2010), guided by variance as in C. Schied et al. (2017); over
/// the exact parts of pixels instead of whole pixels.
void denoise(const SurfaceParts& parts, int samples, Threads threads, PathImage& image);

}  // namespace quoin::path
