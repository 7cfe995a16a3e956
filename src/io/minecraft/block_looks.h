#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <quoin/grid/voxel_registry.h>

// The looks of Minecraft's blocks as voxels, by name: Quoin's own table, and rules by the words of a name for other
// blocks.

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
/// The place of a biome in colour maps: 0 to 1, after clamping.
struct Climate {
  float temperature = 0.8F;
  float downfall = 0.4F;
  bool is_dark = false;  ///< grass has the mean of the map's colour and 0x28340A
};

/// Returns the climate of the biomes whose grass or foliage has a colour, by the game's own colour maps; nullopt for
/// colours that do not come from a map (swamps, badlands) or are unknown.
[[nodiscard]] std::optional<Climate> climate_of_grass(std::uint32_t rgb);
[[nodiscard]] std::optional<Climate> climate_of_foliage(std::uint32_t rgb);
/// Returns the name of a biome by its number before 1.18; "plains" if it is unknown.
[[nodiscard]] std::string_view name_of_biome(std::int64_t number);

/// Returns the index of tints in a list, appending new ones. Beyond 255 entries returns the first one's.
[[nodiscard]] std::uint8_t index_of_tints(std::vector<BiomeTints>& all, const BiomeTints& tints);

/// The biome colour that a block's colour is multiplied by.
enum class Tint : std::uint8_t { None, Grass, Foliage, Water };

/// Returns the colour 0xRRGGBB.
[[nodiscard]] constexpr Rgba8 colour_of_rgb(std::uint32_t rgb, std::uint8_t alpha = 255) {
  return {static_cast<std::uint8_t>(rgb >> 16), static_cast<std::uint8_t>(rgb >> 8), static_cast<std::uint8_t>(rgb),
          alpha};
}
/// Returns a biome's colour of a tint, 0xRRGGBB; white for Tint::None.
[[nodiscard]] std::uint32_t colour_of(Tint tint, const BiomeTints& biome);
/// Returns a colour multiplied by the tint; alpha is unchanged.
[[nodiscard]] Rgba8 tinted_colour(Rgba8 colour, std::uint32_t tint);

/// A colour of tinted faces that does not depend on the state, and the biome colour that it is.
struct NamedTint {
  std::uint32_t rgb = 0xFFFFFF;
  Tint kind = Tint::None;
};

/// Returns the tint of a block's faces, in the biome plains. `name`: without a namespace. White for untinted blocks.
/// Source: the Minecraft Wiki, "Block colors" and "Color" (https://minecraft.wiki/w/Block_colors).
[[nodiscard]] NamedTint tint_of_block(std::string_view name);

/// A tint by a number in the state: the power of wires, the age of stems. Near powers have one colour, since a type has
/// few parts.
struct StateTint {
  std::string_view property;
  int (*group)(int value) = nullptr;  ///< returns the value whose colour stands for it
  Rgba8 (*colour)(int value) = nullptr;
};

/// Returns the tint by state of a block; null if it has none. `name`: without a namespace. Source: as tint_of_block.
[[nodiscard]] const StateTint* state_tint_of(std::string_view name);

/// The source of a block's look.
enum class Knowledge : std::uint8_t {
  Table,    ///< the block is in the table, or is a shape of such a block
  Words,    ///< a word of its name gives its material
  Nothing,  ///< the name gives no material: a grey that depends on the name
};

struct BlockLook {
  Rgba8 colour;  ///< sRGB, alpha below 255 where it is transparent
  bool is_air = false;
  bool is_invisible = false;  ///< invisible, but a block in the game: a barrier, a light
  bool collides = true;
  float emission = 0.0F;
  float roughness = 1.0F;
  float ior = 1.5F;
  std::optional<bool> blocks_light{};  ///< as in VoxelProperties
  std::uint8_t light_cost = 0;         ///< as in VoxelProperties
  Tint tint = Tint::None;
  Knowledge knowledge = Knowledge::Table;
};

/// Returns true if a name contains a word at its start or after an underscore.
[[nodiscard]] bool has_word(std::string_view name, std::string_view word);

/// Sets the passage of light of a block (VoxelProperties::light_cost, blocks_light). `name`: without a namespace.
void set_passage(std::string_view name, BlockLook& look);

/// Returns the light level that a block emits in the game, 0 to 15; nullopt for blocks that are not listed. `name`:
/// with or without the namespace "minecraft". Without the property that lights it up, a block is dark, except redstone
/// torches.
[[nodiscard]] std::optional<int> light_level_of_block(std::string_view name,
                                                      std::span<const std::pair<std::string, std::string>> properties);

/// Returns the keys of the properties that decide this level: at most two, and none for blocks that are not listed.
[[nodiscard]] std::vector<std::string_view> light_properties_of_block(std::string_view name);

/// Returns the look of a block. `name`: "minecraft:oak_stairs", or without its namespace; also of mods. `is_lit`,
/// `is_snowy`: the states of these names are "true". Cost: some look-ups in sorted tables.
[[nodiscard]] BlockLook look_of_block(std::string_view name, bool is_lit, bool is_snowy);

/// Sets the properties of a type that a look has, with its colour before tinting. Types with an alpha below 255 are
/// transparent.
inline void set_look(const BlockLook& look, VoxelProperties& type) {
  type.colour = look.colour;
  type.visibility = look.colour.a < 255 ? Visibility::Transparent : Visibility::Opaque;
  type.collides = look.collides;
  type.emission = look.emission;
  type.roughness = look.roughness;
  type.ior = look.ior;
  type.blocks_light = look.blocks_light;
  type.light_cost = look.light_cost;
}

}  // namespace quoin::minecraft
