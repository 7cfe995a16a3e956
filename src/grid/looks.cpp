#include "grid/looks.h"

#include <utility>

#include <quoin/core/assert.h>

namespace quoin {

namespace {

std::uint64_t key_of(Rgba8 colour, std::uint32_t material) {
  return std::uint64_t{material} << 32 | std::uint64_t{colour.r} << 24 | std::uint64_t{colour.g} << 16 |
         std::uint64_t{colour.b} << 8 | colour.a;
}

// To the middle of what has the same first bits.
std::uint8_t rounded(std::uint8_t channel, int bits_lost) {
  if (bits_lost == 0) return channel;
  const unsigned low = (1U << bits_lost) - 1U;
  return static_cast<std::uint8_t>((channel & ~low) | (low >> 1));
}

Rgba8 rounded(Rgba8 colour, int bits_lost) {
  return {rounded(colour.r, bits_lost), rounded(colour.g, bits_lost), rounded(colour.b, bits_lost), colour.a};
}

}  // namespace

std::uint32_t Looks::number_of(Rgba8 colour, std::uint32_t material) {
  const auto [known, is_new] =
      numbers_.try_emplace(key_of(colour, material), static_cast<std::uint32_t>(looks_.size()));
  if (is_new) looks_.push_back({colour, material});
  return known->second;
}

Result<std::vector<VoxelType>> Looks::add_to(VoxelRegistry& types, std::span<const VoxelProperties> materials,
                                             std::vector<std::string>& warnings) const {
  constexpr int kMostLost = 4;
  const std::size_t first = types.size();
  const std::size_t room = kMaxVoxelTypes + 1 - first;
  for (int lost = 0; lost <= kMostLost; ++lost) {
    std::unordered_map<std::uint64_t, VoxelType> by_key;
    std::vector<VoxelType> found;
    found.reserve(looks_.size());
    for (const Look& look : looks_) {
      const auto next = static_cast<VoxelType>(first + by_key.size());
      found.push_back(by_key.try_emplace(key_of(rounded(look.colour, lost), look.material), next).first->second);
      if (by_key.size() > room) break;
    }
    if (by_key.size() > room) continue;
    if (lost > 0) {
      warnings.push_back("its " + std::to_string(looks_.size()) + " colours were rounded to " +
                         std::to_string(by_key.size()) + ", of " + std::to_string(8 - lost) + " bits a channel");
    }
    for (std::size_t i = 0; i < looks_.size(); ++i) {
      if (found[i] < types.size()) continue;
      VoxelProperties type = materials[looks_[i].material];
      type.colour = rounded(looks_[i].colour, lost);
      type.visibility = type.colour.a < 255 ? Visibility::Transparent : Visibility::Opaque;
      const auto added = types.add(std::move(type));
      if (!added) return added.error();
      QUOIN_ASSERT(*added == found[i], "types are numbered as they come");
    }
    return found;
  }
  return make_error(ErrorCode::LimitExceeded, "too many colours and materials: " + std::to_string(looks_.size()));
}

}  // namespace quoin
