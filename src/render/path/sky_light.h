#pragma once

#include <memory>
#include <optional>

#include <quoin/core/vec.h>
#include <quoin/render/path_tracer.h>

#include "light/light_model.h"
#include "render/path/environment_light.h"
#include "render/path/sky_map.h"

namespace quoin::path {

/// Returns true if the skies of both looks are the same; their other settings are ignored.
[[nodiscard]] bool is_same_sky(Look a, const Look& b);

/// The sun and the sky of an image. Cost: 70 ms for a physical sky.
class SkyLight {
 public:
  /// Requires: `check` accepts the options.
  explicit SkyLight(const Look& options);

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
  std::optional<EnvironmentLight> image_;  // of SkyModel::Environment
  bool is_uneven_ = false;
  SineCosine turn_;  // of an environment about the vertical
};

}  // namespace quoin::path
