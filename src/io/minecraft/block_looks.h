#pragma once

#include <cstdint>
#include <string_view>

#include <quoin/grid/voxel_registry.h>

#include "io/minecraft/biomes.h"

// The looks of Minecraft's blocks as voxels, by name: Quoin's own table, and rules by the words of a name for other
// blocks.

namespace quoin::minecraft {

/// The biome colour that a block's colour is multiplied by.
enum class Tint : std::uint8_t { None, Grass, Foliage, Water };

/// Returns a biome's colour of a tint, 0xRRGGBB; white for Tint::None.
[[nodiscard]] std::uint32_t colour_of(Tint tint, const BiomeTints& biome);
/// Returns a colour multiplied by the tint; alpha is unchanged.
[[nodiscard]] Rgba8 tinted_colour(Rgba8 colour, std::uint32_t tint);

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
  Tint tint = Tint::None;
  Knowledge knowledge = Knowledge::Table;
};

/// Returns the look of a block. `name`: "minecraft:oak_stairs", or without its namespace; also of mods. `is_lit`,
/// `is_snowy`: the states of these names are "true". Cost: some look-ups in sorted tables.
[[nodiscard]] BlockLook look_of_block(std::string_view name, bool is_lit, bool is_snowy);

}  // namespace quoin::minecraft
