#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/image.h>
#include <quoin/core/vec.h>
#include <quoin/render/path_tracer.h>

#include "render/light/light_model.h"
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

/// A clear sky, and the sun through it, seen from the ground.
struct AtmosphericSky {
  RadianceImage radiance;  ///< of all directions, laid out as in EnvironmentLight; without the sun
  Vec3 sunlight{0.0F};     ///< the transmitted sunlight
};

/// `to_sun`: unit, in the world. `irradiance`: of the sun outside the atmosphere. Below the horizon the image shows
/// ground.
///
/// Source: S. Hillaire, "A scalable and production ready sky and atmosphere rendering technique" (2020): single
///         scattering along the ray, and all further scattering from a table, with its constants for the Earth.
[[nodiscard]] AtmosphericSky atmospheric_sky(DVec3 to_sun, float irradiance, const AirOptions& air);

/// Light from all directions, looked up without computing angles: the sphere as an octahedron, unfolded to a square.
///
/// Source: T. Engelhardt, C. Dachsbacher, "Octahedron environment maps" (2008).
class SkyMap {
 public:
  explicit SkyMap(const EnvironmentLight& light) : pixels_(static_cast<std::size_t>(kEdge + 1) * (kEdge + 1)) {
    for (int y = 0; y <= kEdge; ++y) {
      for (int x = 0; x <= kEdge; ++x) pixels_[index(x, y)] = light.at(direction_of(x, y));
    }
  }

  [[nodiscard]] Vec3 at(Vec3 direction) const {
    const float size = std::abs(direction.x) + std::abs(direction.y) + std::abs(direction.z);
    float u = direction.x / size;
    float v = direction.z / size;
    if (direction.y < 0.0F) {
      const float folded = (1.0F - std::abs(v)) * (u < 0.0F ? -1.0F : 1.0F);
      v = (1.0F - std::abs(u)) * (v < 0.0F ? -1.0F : 1.0F);
      u = folded;
    }
    const float x = std::clamp(u * 0.5F + 0.5F, 0.0F, 1.0F) * kEdge;
    const float y = std::clamp(v * 0.5F + 0.5F, 0.0F, 1.0F) * kEdge;
    const int i = std::min(static_cast<int>(x), kEdge - 1);
    const int j = std::min(static_cast<int>(y), kEdge - 1);
    const float fx = x - static_cast<float>(i);
    const float fy = y - static_cast<float>(j);
    const Vec3* const row = &pixels_[index(i, j)];
    const Vec3* const next = row + kEdge + 1;
    return (row[0] * (1.0F - fx) + row[1] * fx) * (1.0F - fy) + (next[0] * (1.0F - fx) + next[1] * fx) * fy;
  }

  static constexpr int kEdge = 256;  ///< steps between two corners of the square
  /// [y][x] of the square's corners, kEdge + 1 per row.
  [[nodiscard]] std::span<const Vec3> pixels() const { return pixels_; }

 private:
  static std::size_t index(int x, int y) {
    QUOIN_ASSERT(x >= 0 && x <= kEdge && y >= 0 && y <= kEdge, "a corner of the map");
    return static_cast<std::size_t>(y * (kEdge + 1) + x);
  }
  static Vec3 direction_of(int x, int y) {
    const float u = static_cast<float>(x) / (kEdge / 2.0F) - 1.0F;
    const float v = static_cast<float>(y) / (kEdge / 2.0F) - 1.0F;
    Vec3 direction{u, 1.0F - std::abs(u) - std::abs(v), v};
    if (direction.y < 0.0F) {
      direction.x = (1.0F - std::abs(v)) * (u < 0.0F ? -1.0F : 1.0F);
      direction.z = (1.0F - std::abs(u)) * (v < 0.0F ? -1.0F : 1.0F);
    }
    const float length = std::sqrt(direction.x * direction.x + direction.y * direction.y + direction.z * direction.z);
    return direction / length;
  }

  std::vector<Vec3> pixels_;
};

/// Returns true if both have the same SkyLight.
[[nodiscard]] bool is_same_sky(const Environment& a, const Environment& b);

/// The sun and the sky of an image. Cost: 20 ms for a physical sky.
class SkyLight {
 public:
  /// Requires: `check` accepts the options.
  explicit SkyLight(const Environment& environment);

  /// Returns the light of a ray that leaves the scene: the sky without the sun, and the sun alone. `direction`: unit,
  /// in the world.
  [[nodiscard]] Vec3 sky(Vec3 direction) const;
  [[nodiscard]] Vec3 sun(Vec3 direction) const;

  /// Returns true if there is a sun to sample.
  [[nodiscard]] bool has_sun() const { return largest(sunlight_) > 0.0F; }
  [[nodiscard]] SkySample sample_sun(Pair u) const;
  /// Returns the sun sample for a given direction.
  [[nodiscard]] SkySample sun_sample(Vec3 direction) const;
  /// Returns the irradiance of a surface that faces the sun.
  [[nodiscard]] Vec3 sun_irradiance() const { return sunlight_; }
  /// Returns the probability density of a direction in `sample_sun`.
  [[nodiscard]] float sun_density(Vec3 direction) const;

  /// Returns true if the sky is uneven enough to be importance sampled.
  [[nodiscard]] bool has_uneven_sky() const { return is_uneven_; }
  /// Requires: has_uneven_sky().
  [[nodiscard]] SkySample sample_sky(Pair u) const;
  [[nodiscard]] float sky_density(Vec3 direction) const;

  // For renderers with their own lookup.
  [[nodiscard]] SkyModel model() const { return model_; }
  [[nodiscard]] Vec3 to_sun() const { return to_sun_; }
  /// Returns 1 minus the cosine of the sun disc's half angle; 0: no disc.
  [[nodiscard]] float one_less_cos() const { return one_less_cos_; }
  [[nodiscard]] float brightness() const { return brightness_; }  ///< factor of the sky's light
  [[nodiscard]] Vec3 uniform() const { return uniform_; }
  [[nodiscard]] const SkyColours& gradient() const { return gradient_; }
  [[nodiscard]] SineCosine turn() const { return turn_; }
  [[nodiscard]] const SkyMap* air() const { return air_ ? &*air_ : nullptr; }
  [[nodiscard]] const EnvironmentLight* image() const { return image_ ? &*image_ : nullptr; }

 private:
  SkyModel model_;
  Vec3 to_sun_{0.0F, 1.0F, 0.0F};
  Vec3 sunlight_{0.0F};        // irradiance of a surface that faces the sun
  float one_less_cos_ = 0.0F;  // 1 minus the cosine of the disc's half angle; 0: no disc
  float brightness_ = 1.0F;
  Vec3 uniform_{1.0F};
  SkyColours gradient_;
  std::optional<SkyMap> air_;              // of SkyModel::Physical
  std::optional<EnvironmentLight> image_;  // of SkyModel::Image
  bool is_uneven_ = false;
  SineCosine turn_;  // of an environment about the vertical
};

}  // namespace quoin::path
