#include "io/glass_material.h"

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>

#include <quoin/core/assert.h>

namespace quoin {
namespace {

constexpr float kLeastAttenuation = 0.01F;  // glTF's colours may be 0, logarithms of clients not

}  // namespace

GlassMaterial glass_material(const Surface& surface, float thickness) {
  QUOIN_ASSERT(thickness > 0.0F, "a body that has a thickness");
  GlassMaterial glass;
  glass.thickness = thickness;
  if (!std::isfinite(surface.log_clarity)) {
    glass.tint = Vec3(0.0F);
    return glass;
  }
  const float own = 1.0F - std::exp(surface.log_clarity * thickness);
  Vec3 passed;
  float wanted = 0.0F;
  float weight = 0.0F;
  for (int channel = 0; channel < 3; ++channel) {
    glass.tint[channel] = std::exp((surface.log_transmittance[channel] - surface.log_clarity) * thickness);
    passed[channel] = std::exp(surface.log_transmittance[channel] * thickness);
    const float square = surface.colour[channel] * surface.colour[channel];
    wanted += 1.0F - passed[channel] + own * square;
    weight += 1.0F + square;
  }
  glass.alpha = std::clamp(wanted / weight, own, 1.0F);
  if (!(glass.alpha > 0.0F)) return glass;
  glass.transmission = 1.0F - own / glass.alpha;
  for (int channel = 0; channel < 3; ++channel) {
    const float untinted = glass.alpha * glass.transmission * surface.colour[channel];
    if (!(untinted > 0.0F)) continue;
    // What is left over for it, of one alpha for all channels, may be of any hue: some clients attenuate by it what is
    // not covered, too.
    const float least = std::max(passed[channel], kLeastAttenuation);
    glass.attenuation[channel] =
        std::clamp((passed[channel] - (1.0F - glass.alpha)) / untinted, least, std::max(least, 1.0F));
  }
  return glass;
}

std::uint16_t glass_alpha(const LinearRgba16& albedo, float thickness) {
  constexpr float kFull = 65535.0F;
  Surface surface;
  surface.colour = Vec3(albedo[0], albedo[1], albedo[2]) / kFull;
  set_absorption(static_cast<float>(albedo[3]) / kFull, surface);
  return static_cast<std::uint16_t>(std::lround(glass_material(surface, thickness).alpha * kFull));
}

float thickness_of(const MeshView& view) {
  constexpr double kOpen = 1e-3;
  if (view.positions.empty()) return 1.0F;
  const DVec3 origin(view.positions.front());
  double volume = 0.0;
  DVec3 sum(0.0);
  DVec3 shown(0.0);
  for (std::size_t i = 0; i + 2 < view.indices.size(); i += 3) {
    const DVec3 a = DVec3(view.positions[view.indices[i]]) - origin;
    const DVec3 b = DVec3(view.positions[view.indices[i + 1]]) - origin;
    const DVec3 c = DVec3(view.positions[view.indices[i + 2]]) - origin;
    volume += glm::dot(a, glm::cross(b, c)) / 6.0;
    const DVec3 area = glm::cross(b - a, c - a) / 2.0;
    sum += area;
    shown += glm::abs(area) / 2.0;
  }
  const double largest = std::max({shown.x, shown.y, shown.z});
  if (!(volume > 0.0) || !(largest > 0.0) || glm::length(sum) > kOpen * largest) return 1.0F;
  return static_cast<float>(volume / largest);
}

}  // namespace quoin
