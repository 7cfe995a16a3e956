#pragma once

#include <span>
#include <vector>

#include <quoin/core/image.h>
#include <quoin/core/vec.h>

#include "render/path/path_math.h"

namespace quoin::path {

/// Light from infinitely far away, from a direction of the world.
struct SkySample {
  Vec3 direction{0.0F};  ///< towards it, unit
  Vec3 radiance{0.0F};
  float density = 0.0F;  ///< by solid angle; infinite for a sun without a disc
};

/// An emissive image of all directions: +y is up, the image's centre is -z, its left edge is +z, and +x is right of the
/// centre.
class EnvironmentLight {
 public:
  /// `image`: longitude and latitude. Values that are not finite or negative count as 0.
  /// Requires: it has at least one pixel. Cost: O(pixels).
  explicit EnvironmentLight(RadianceImage image);

  /// Returns the light from a direction (unit), interpolated between pixel centres.
  [[nodiscard]] Vec3 at(Vec3 direction) const;
  /// Samples a direction in proportion to brightness.
  [[nodiscard]] SkySample sample(Pair u) const;
  [[nodiscard]] float density(Vec3 direction) const;

  // For renderers with their own lookup.
  [[nodiscard]] const RadianceImage& image() const { return image_; }
  [[nodiscard]] std::span<const float> rows() const { return rows_; }        ///< [height + 1]
  [[nodiscard]] std::span<const float> columns() const { return columns_; }  ///< [height][width + 1]

 private:
  struct Place {
    float x = 0.0F;  // pixels from the left, and from the top
    float y = 0.0F;
  };
  [[nodiscard]] Place place_of(Vec3 direction) const;
  [[nodiscard]] Vec3 pixel(int x, int y) const;
  [[nodiscard]] float density_at(int x, int y, float sine) const;

  RadianceImage image_;
  std::vector<float> rows_;     // cumulative shares of the rows, up to 1; [height + 1]
  std::vector<float> columns_;  // cumulative shares within each row; [height][width + 1]
};

}  // namespace quoin::path
