#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace quoin::minecraft {

/// A biome's colours (sRGB, 0xRRGGBB) for plants and water.
struct BiomeTints {
  std::uint32_t grass = 0x91BD59;
  std::uint32_t foliage = 0x77AB2F;
  std::uint32_t water = 0x3F76E4;

  bool operator==(const BiomeTints&) const = default;
};

/// Returns the tints of a biome by its name ("minecraft:plains", or a mod's); those of plains if it is unknown.
[[nodiscard]] BiomeTints tints_of_biome(std::string_view name);
/// Returns the name of a biome by its number before 1.18; "plains" if it is unknown.
[[nodiscard]] std::string_view name_of_biome(std::int64_t number);

/// Returns the index of tints in a list, appending new ones. Beyond 255 entries returns the first one's.
[[nodiscard]] std::uint8_t index_of_tints(std::vector<BiomeTints>& all, const BiomeTints& tints);

}  // namespace quoin::minecraft
