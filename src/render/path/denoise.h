#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <quoin/core/parallel.h>
#include <quoin/core/vec.h>
#include <quoin/render/path_tracer.h>

namespace quoin::path {

/// What a pixel shows of one surface: a face's plane in a grid, a field, the ground.
struct SurfacePart {
  std::uint32_t surface = 0;  ///< which; 0: none
  float samples = 0.0F;
  float square = 0.0F;  ///< sum of the squares of the light's luminance
  Vec3 light{0.0F};     ///< sums
  Vec3 albedo{0.0F};
  Vec3 normal{0.0F};  ///< of what is curved; else 0
  Vec3 place{0.0F};   ///< likewise, in view space
};

/// The surfaces of a picture's pixels, each pixel's first few.
///
///   pixel 0: part part part | pixel 1: part part part | ...
class SurfaceParts {
 public:
  static constexpr std::size_t kOfPixel = 3;
  static constexpr std::uint32_t kSky = 4;  ///< the surface of what lies behind fog and clouds where nothing does
  using OfPixel = std::array<SurfacePart, kOfPixel>;

  SurfaceParts(int width, int height)
      : width_(width), height_(height), pixels_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height)) {}

  [[nodiscard]] OfPixel& at(std::size_t pixel) { return pixels_[pixel]; }
  [[nodiscard]] const OfPixel& at(std::size_t pixel) const { return pixels_[pixel]; }
  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }

 private:
  int width_;
  int height_;
  std::vector<OfPixel> pixels_;
};

/// Replaces the light of a picture's surfaces by means over the same surface nearby, where they do not differ by more
/// than their noise. What is none of the parts stays as it is, and so does every edge between surfaces, down to the
/// share that each has of a pixel. `samples`: of each pixel.
///
/// Source: the a-trous wavelets of H. Dammertz et al. (2010), guided by variance as in C. Schied et al. (2017); over
///         the exact parts of pixels instead of whole ones.
void denoise(const SurfaceParts& parts, int samples, Threads threads, PathPicture& picture);

}  // namespace quoin::path
