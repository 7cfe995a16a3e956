#include "scene/surfaces.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>

#include <quoin/core/assert.h>

namespace quoin {

std::optional<float> glass_ior(const VoxelProperties& properties) {
  if (!(properties.ior >= 1.0F) || !std::isfinite(properties.ior)) return std::nullopt;
  return properties.ior;
}

float emission_of(const VoxelProperties& properties) {
  return properties.emission > 0.0F ? std::min(properties.emission, std::numeric_limits<float>::max() / 4.0F) : 0.0F;
}

void set_absorption(float alpha, Surface& surface) {
  QUOIN_ASSERT(alpha >= 0.0F && alpha <= 1.0F, "0 <= alpha <= 1");
  // One voxel covers `alpha` of the background and tints the rest. The tint increases with `alpha`.
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
  surface.emitted = surface.colour * emission_of(properties);
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

// The shares of three neighbouring samples of an axis at a place. `off`: from the middle sample to the place, -0.5 to
// 0.5.
std::array<float, 3> shares_along(float off) {
  return {0.25F - 0.5F * off, 0.5F, 0.25F + 0.5F * off};
}

// The materials of the solid samples around a point, each once, with the sum of its samples' shares.
class MaterialShares {
 public:
  MaterialShares(const DensityGrid& field, IVec3 cell, const DVec3& inside) {
    std::array<std::array<float, 3>, 3> along;
    IVec3 first{0};
    for (int axis = 0; axis < 3; ++axis) {
      const int nearer = inside[axis] < 0.5 ? 0 : 1;
      first[axis] = cell[axis] + nearer - 1;
      along[static_cast<std::size_t>(axis)] = shares_along(static_cast<float>(inside[axis] - nearer));
    }
    for (int i = 0; i < 27; ++i) {
      const IVec3 step{i % 3, i / 3 % 3, i / 9};
      const IVec3 sample = first + step;
      if (i == 0 || chunk_of(sample) != at_) find_chunk(field, chunk_of(sample));
      if (chunk_ == nullptr) continue;
      const IVec3 local = local_of(sample);
      if (step.x == 0 || local.x == 0) solid_ = chunk_->solid_row(local.y, local.z);
      if ((solid_ >> local.x & 1U) == 0) continue;
      const auto share_of = [&](int axis) {
        return along[static_cast<std::size_t>(axis)][static_cast<std::size_t>(step[axis])];
      };
      add(only_ ? *only_ : chunk_->materials().get(local), share_of(0) * share_of(1) * share_of(2));
    }
  }

  struct Share {
    VoxelType material = kAir;
    float share = 0.0F;
  };
  [[nodiscard]] std::span<const Share> all() const { return {shares_.data(), count_}; }

 private:
  void find_chunk(const DensityGrid& field, IVec3 at) {
    at_ = at;
    chunk_ = field.find_chunk(at);
    only_ = chunk_ == nullptr ? std::nullopt : chunk_->materials().uniform();
  }
  void add(VoxelType material, float share) {
    std::size_t i = 0;
    while (i < count_ && shares_[i].material != material) ++i;
    QUOIN_ASSERT(i < shares_.size(), "one material per sample");
    if (i == count_) shares_[count_++].material = material;
    shares_[i].share += share;
  }

  IVec3 at_{0};  // of the chunk
  const DensityChunk* chunk_ = nullptr;
  std::optional<VoxelType> only_;  // the material of all its samples
  std::uint64_t solid_ = 0;        // of the row read last
  std::array<Share, 27> shares_;
  std::size_t count_ = 0;
};

}  // namespace

Surface Surfaces::blend_of_field(const DensityGrid& field, IVec3 cell, const DVec3& inside, VoxelType nearest) const {
  const MaterialShares shares(field, cell, inside);
  float total = 0.0F;
  for (const MaterialShares::Share& each : shares.all()) total += each.share;
  if (shares.all().size() < 2 || !(total > 0.0F)) return of_field(nearest);
  Surface blend = of_field(nearest);
  blend.colour = blend.emitted = Vec3(0.0F);
  blend.roughness = blend.metalness = 0.0F;
  for (const MaterialShares::Share& each : shares.all()) {
    const Surface& surface = of_field(each.material);
    const float share = each.share / total;
    blend.colour += share * surface.colour;
    blend.emitted += share * surface.emitted;
    blend.roughness += share * surface.roughness;
    blend.metalness += share * surface.metalness;
  }
  return blend;
}

const Surface& Surfaces::of_field(VoxelType material) const {
  static const Surface white{Vec3(1.0F)};
  return material == kAir ? white : (*this)[material];
}

bool Surfaces::update(const VoxelRegistry& types) {
  PendingChanges changes(followed_, types);
  if (changes->empty()) return false;
  const auto put = [&](std::size_t type) {
    QUOIN_ASSERT(type + 1 < surfaces_.size(), "a registered type");
    surfaces_[type] = surface_of(types[static_cast<VoxelType>(type)], clouds_);
  };
  surfaces_.resize(types.size() + 1);
  surfaces_.back() = {};
  surfaces_.back().colour = {1.0F, 0.0F, 1.0F};
  for (std::size_t type = 0; changes->all && type < types.size(); ++type) put(type);
  for (const TypeChange& change : changes->items_unless_all()) put(change.type);
  changes.commit();
  return true;
}

}  // namespace quoin
