#include "render/path/sky_light.h"

#include <cmath>
#include <limits>

#include <glm/geometric.hpp>

#include <quoin/core/assert.h>

#include "light/light_model.h"
#include "render/path/atmosphere.h"

namespace quoin::path {
namespace {

// Rotates about the vertical: -z turns towards +x.
Vec3 turned(Vec3 v, SineCosine by) {
  return {v.x * by.cosine - v.z * by.sine, v.y, v.x * by.sine + v.z * by.cosine};
}

Vec3 turned_back(Vec3 v, SineCosine by) {
  return turned(v, {-by.sine, by.cosine});
}

}  // namespace

bool is_same_sky(Look a, const Look& b) {
  a.background = b.background;
  a.ground = b.ground;
  a.fog = b.fog;
  a.lamp_brightness = b.lamp_brightness;
  a.lens_radius = b.lens_radius;
  a.focus_distance = b.focus_distance;
  a.lens_blades = b.lens_blades;
  a.lens_turn_radians = b.lens_turn_radians;
  a.sun_is_seen = b.sun_is_seen;
  return a == b;
}

SkyLight::SkyLight(const Look& options)
    : model_(options.sky), brightness_(static_cast<float>(options.sky_brightness)), uniform_(options.sky_colour) {
  LightOptions light;
  light.sun = options.sun;
  const DVec3 sun = quoin::to_sun(light);
  to_sun_ = glm::normalize(Vec3(sun));
  const float sine = of_turns(static_cast<float>(options.sun_angle_radians / 4.0 / std::numbers::pi / 2.0)).sine;
  one_less_cos_ = 2.0F * sine * sine;
  const float irradiance = kPi * static_cast<float>(options.sun_brightness);
  switch (model_) {
    case SkyModel::Uniform:
      sunlight_ = Vec3(irradiance);
      break;
    case SkyModel::Gradient: {
      light.sky_follows_sun = true;
      light.sun_brightness = options.sun_brightness;
      const Daylight day = daylight_of(light);
      gradient_ = day.sky;
      sunlight_ = day.sun * (kPi * static_cast<float>(day.sun_brightness));
      break;
    }
    case SkyModel::Physical: {
      AtmosphericSky made = atmospheric_sky(sun, kPi, options.air);
      sunlight_ = made.sunlight * static_cast<float>(options.sun_brightness);
      air_.emplace(EnvironmentLight(std::move(made.radiance)));
      break;
    }
    case SkyModel::Environment: {
      QUOIN_ASSERT(options.environment != nullptr, "an environment image");
      sunlight_ = Vec3(irradiance);
      image_.emplace(*options.environment);
      is_uneven_ = true;
      double turns = options.environment_turn_radians / (2.0 * std::numbers::pi);
      turns -= std::floor(turns);
      turn_ = of_turns(static_cast<float>(turns));
      break;
    }
  }
  sunlight_ *= options.sun_colour;
}

Vec3 SkyLight::sky(Vec3 direction) const {
  if (model_ == SkyModel::Uniform) return uniform_ * brightness_;
  if (model_ == SkyModel::Gradient) return sky_colour(direction.y, gradient_) * brightness_;
  if (model_ == SkyModel::Physical) return air_->at(direction) * brightness_;
  return image_->at(turned_back(direction, turn_)) * brightness_;
}

Vec3 SkyLight::sun(Vec3 direction) const {
  const float density = sun_density(direction);
  return density > 0.0F ? sunlight_ * density : Vec3(0.0F);
}

float SkyLight::sun_density(Vec3 direction) const {
  if (!(one_less_cos_ > 0.0F) || !has_sun()) return 0.0F;
  // 1 - cos from a squared distance: in single precision a small angle's cosine is 1.
  const Vec3 difference = direction - to_sun_;
  return 0.5F * glm::dot(difference, difference) <= one_less_cos_ ? 1.0F / (2.0F * kPi * one_less_cos_) : 0.0F;
}

SkySample SkyLight::sample_sun(Pair u) const {
  if (!(one_less_cos_ > 0.0F)) return sun_sample(to_sun_);
  const float down = u.x * one_less_cos_;
  const float across = std::sqrt(down * (2.0F - down));
  const SineCosine turn = of_turns(u.y);
  const Vec3 direction = Frame(to_sun_).to_world({across * turn.cosine, across * turn.sine, 1.0F - down});
  return sun_sample(glm::normalize(direction));
}

SkySample SkyLight::sun_sample(Vec3 direction) const {
  if (!(one_less_cos_ > 0.0F)) return {direction, sunlight_, std::numeric_limits<float>::infinity()};
  const float density = 1.0F / (2.0F * kPi * one_less_cos_);
  return {direction, sunlight_ * density, density};
}

SkySample SkyLight::sample_sky(Pair u) const {
  QUOIN_ASSERT(image_.has_value(), "an uneven sky");
  SkySample sample = image_->sample(u);
  sample.direction = turned(sample.direction, turn_);
  sample.radiance *= brightness_;
  return sample;
}

float SkyLight::sky_density(Vec3 direction) const {
  QUOIN_ASSERT(image_.has_value(), "an uneven sky");
  return image_->density(turned_back(direction, turn_));
}

}  // namespace quoin::path
