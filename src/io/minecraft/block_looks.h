#pragma once

#include <cstdint>
#include <string_view>

#include <quoin/grid/voxel_registry.h>

#include "io/minecraft/biomes.h"

// What Minecraft's blocks look like as voxels, by their names: a table of our own making, and rules by the words of a
// name for what is not in it.

namespace quoin::minecraft {

/// What of a place colours a block there: its colour is then multiplied by that of the biome.
enum class Tint : std::uint8_t { None, Grass, Foliage, Water };

/// What a biome colours so, 0xRRGGBB; white for Tint::None.
[[nodiscard]] std::uint32_t colour_of(Tint tint, const BiomeTints& biome);
/// A colour multiplied by that; its alpha stays.
[[nodiscard]] Rgba8 tinted_colour(Rgba8 colour, std::uint32_t tint);

/// How sure a look is.
enum class Knowledge : std::uint8_t {
  Table,    ///< the block is in the table, or is a shape of one that is
  Words,    ///< a word of its name says what it is made of
  Nothing,  ///< its name says nothing: a grey that differs from name to name
};

struct BlockLook {
  Rgba8 colour;  ///< sRGB, alpha below 255 where it is transparent
  bool is_air = false;
  bool is_invisible = false;  ///< air to the eye, and a block to the game: a barrier, a light
  bool collides = true;
  float emission = 0.0F;
  float roughness = 1.0F;
  float ior = 1.5F;
  Tint tint = Tint::None;
  Knowledge knowledge = Knowledge::Table;
};

/// The look of a block. `name`: "minecraft:oak_stairs", or without its namespace; of mods too. `is_lit`, `is_snowy`:
/// its states of those names are "true". Cost: some look-ups in sorted tables.
[[nodiscard]] BlockLook look_of_block(std::string_view name, bool is_lit, bool is_snowy);

}  // namespace quoin::minecraft
