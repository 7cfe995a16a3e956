#include "light/surfaces.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/srgb.h"

namespace quoin {

std::optional<float> glass_ior(const VoxelProperties& properties) {
  if (!(properties.ior >= 1.0F) || !std::isfinite(properties.ior)) return std::nullopt;
  return properties.ior;
}

Vec3 linear_colour(Rgba8 colour) {
  return {linear_from_srgb(colour.r), linear_from_srgb(colour.g), linear_from_srgb(colour.b)};
}

void set_absorption(float alpha, Surface& surface) {
  // One voxel covers `alpha` of what lies behind it and tints the rest, the more the more it covers.
  surface.log_clarity = std::log(1.0F - alpha);
  for (int channel = 0; channel < 3; ++channel) {
    surface.log_transmittance[channel] = std::log((1.0F - alpha) * (1.0F - alpha * (1.0F - surface.colour[channel])));
  }
}

namespace {

// Mirrors all but four thousandths, and its square is a number.
constexpr float kLargestIor = 1e3F;

Surface surface_of(const VoxelProperties& properties) {
  Surface surface;
  const Rgba8 c = properties.colour;
  surface.colour = linear_colour(c);
  // What overflows is as bright as can be; negative and NaN emit nothing.
  const float emission =
      properties.emission > 0.0F ? std::min(properties.emission, std::numeric_limits<float>::max() / 4.0F) : 0.0F;
  surface.emitted = surface.colour * emission;
  if (properties.visibility != Visibility::Transparent) return surface;
  set_absorption(static_cast<float>(c.a) / 255.0F, surface);
  surface.ior = std::min(glass_ior(properties).value_or(1.0F), kLargestIor);
  return surface;
}

}  // namespace

Surfaces::Surfaces(const VoxelRegistry& types) {
  for (std::size_t type = 0; type < types.size(); ++type) {
    surfaces_.push_back(surface_of(types[static_cast<VoxelType>(type)]));
  }
  Surface unknown;
  unknown.colour = {1.0F, 0.0F, 1.0F};
  surfaces_.push_back(unknown);
}

}  // namespace quoin
