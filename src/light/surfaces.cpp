#include "light/surfaces.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace quoin {

std::optional<float> glass_ior(const VoxelProperties& properties) {
  if (!(properties.ior >= 1.0F) || !std::isfinite(properties.ior)) return std::nullopt;
  return properties.ior;
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
constexpr float kMostScattering = 1e6F;

Surface surface_of(const VoxelProperties& properties, Clouds clouds) {
  Surface surface;
  const Rgba8 c = properties.colour;
  surface.colour = linear_colour(c);
  // What overflows is as bright as can be; negative and NaN emit nothing.
  const float emission =
      properties.emission > 0.0F ? std::min(properties.emission, std::numeric_limits<float>::max() / 4.0F) : 0.0F;
  surface.emitted = surface.colour * emission;
  surface.roughness = properties.roughness >= 0.0F ? std::min(properties.roughness, 1.0F) : 1.0F;
  surface.metalness = properties.metalness >= 0.0F ? std::min(properties.metalness, 1.0F) : 0.0F;
  if (properties.visibility != Visibility::Transparent) return surface;
  set_absorption(static_cast<float>(c.a) / 255.0F, surface);
  surface.ior = std::min(glass_ior(properties).value_or(1.0F), kLargestIor);
  if (clouds == Clouds::AsGlass || !(properties.scattering > 0.0F)) return surface;
  surface.scattering = std::min(properties.scattering, kMostScattering);
  if (!std::isnan(properties.anisotropy)) surface.anisotropy = std::clamp(properties.anisotropy, -0.99F, 0.99F);
  surface.ior = 1.0F;
  surface.log_clarity = -surface.scattering;
  surface.log_transmittance = Vec3(-surface.scattering);
  return surface;
}

}  // namespace

const Surface& Surfaces::of_field(VoxelType material) const {
  static const Surface white{Vec3(1.0F)};
  return material == kAir ? white : (*this)[material];
}

bool Surfaces::update(const VoxelRegistry& types) {
  if (!types.has_changed_since(followed_)) return false;
  ChangeCursor now = followed_;
  const TypeChanges changes = types.changes_since(now);
  followed_ = {};  // stays so when memory runs out
  const auto put = [&](std::size_t type) {
    surfaces_[type] = surface_of(types[static_cast<VoxelType>(type)], clouds_);
  };
  surfaces_.resize(types.size() + 1);
  surfaces_.back() = {};
  surfaces_.back().colour = {1.0F, 0.0F, 1.0F};
  for (std::size_t type = 0; changes.all && type < types.size(); ++type) put(type);
  for (const TypeChange& change : changes.items) put(change.type);
  followed_ = now;
  return true;
}

}  // namespace quoin
