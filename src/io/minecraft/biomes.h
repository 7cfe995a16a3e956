#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace quoin::minecraft {

/// The colours (sRGB, 0xRRGGBB) that a biome gives to what grows and flows in it.
struct BiomeTints {
  std::uint32_t grass = 0x91BD59;
  std::uint32_t foliage = 0x77AB2F;
  std::uint32_t water = 0x3F76E4;

  bool operator==(const BiomeTints&) const = default;
};

/// Of a biome by its name ("minecraft:plains", or of mods); those of plains for one that is not known.
[[nodiscard]] BiomeTints tints_of_biome(std::string_view name);
/// The name of a biome by its number, as worlds had it before 1.18; "plains" for one that is not known.
[[nodiscard]] std::string_view name_of_biome(std::int64_t number);

/// The index of tints in a list, which they are added to where they are new; beyond 255 of them the first's.
[[nodiscard]] std::uint8_t index_of_tints(std::vector<BiomeTints>& all, const BiomeTints& tints);

}  // namespace quoin::minecraft
