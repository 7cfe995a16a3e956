#include "io/luanti/luanti_nodes.h"

#include <algorithm>
#include <array>

#include "core/bytes/text.h"
#include "io/minecraft/block_looks.h"

namespace quoin::models {

namespace {

using minecraft::BlockLook;
using minecraft::Knowledge;

/// A node of Luanti's own game, and the Minecraft block that looks like it.
struct Alike {
  std::string_view node;
  std::string_view block;
};

// Sorted. Other nodes are recognised by words in their names.
constexpr std::array kAlike = std::to_array<Alike>({
    {"acacia_leaves", "acacia_leaves"},
    {"acacia_tree", "acacia_log"},
    {"acacia_wood", "acacia_planks"},
    {"apple", "red_wool"},
    {"aspen_leaves", "birch_leaves"},
    {"aspen_tree", "birch_log"},
    {"aspen_wood", "birch_planks"},
    {"brick", "bricks"},
    {"cloud", "white_wool"},
    {"coalblock", "coal_block"},
    {"cobble", "cobblestone"},
    {"copperblock", "copper_block"},
    {"desert_cobble", "red_sandstone"},
    {"desert_sand", "red_sand"},
    {"desert_stone", "red_sandstone"},
    {"diamondblock", "diamond_block"},
    {"dirt_with_coniferous_litter", "podzol"},
    {"dirt_with_dry_grass", "hay_block"},
    {"dirt_with_grass", "grass_block"},
    {"dirt_with_grass_footsteps", "grass_block"},
    {"dirt_with_rainforest_litter", "podzol"},
    {"dirt_with_snow", "snow_block"},
    {"dry_dirt", "coarse_dirt"},
    {"goldblock", "gold_block"},
    {"junglegrass", "fern"},
    {"jungleleaves", "jungle_leaves"},
    {"jungletree", "jungle_log"},
    {"junglewood", "jungle_planks"},
    {"lava_flowing", "lava"},
    {"lava_source", "lava"},
    {"leaves", "oak_leaves"},
    {"mese", "gold_block"},
    {"meselamp", "glowstone"},
    {"mossycobble", "mossy_cobblestone"},
    {"papyrus", "sugar_cane"},
    {"permafrost", "coarse_dirt"},
    {"pine_needles", "spruce_leaves"},
    {"pine_tree", "spruce_log"},
    {"pine_wood", "spruce_planks"},
    {"river_water_flowing", "water"},
    {"river_water_source", "water"},
    {"silver_sand", "white_concrete_powder"},
    {"snowblock", "snow_block"},
    {"steelblock", "iron_block"},
    {"stone_with_coal", "coal_ore"},
    {"stone_with_copper", "copper_ore"},
    {"stone_with_diamond", "diamond_ore"},
    {"stone_with_gold", "gold_ore"},
    {"stone_with_iron", "iron_ore"},
    {"stone_with_mese", "gold_ore"},
    {"stone_with_tin", "iron_ore"},
    {"stonebrick", "stone_bricks"},
    {"tree", "oak_log"},
    {"water_flowing", "water"},
    {"water_source", "water"},
    {"wood", "oak_planks"},
});
static_assert(std::ranges::is_sorted(kAlike, {}, &Alike::node));

BlockLook look_of_node(std::string_view name) {
  constexpr std::string_view kOwnGame = "default:";
  if (name.starts_with(kOwnGame)) {
    const std::string_view rest = name.substr(kOwnGame.size());
    const auto alike = std::ranges::lower_bound(kAlike, rest, {}, &Alike::node);
    if (alike != kAlike.end() && alike->node == rest) return minecraft::look_of_block(alike->block, false, false);
    BlockLook look = minecraft::look_of_block(rest, false, false);
    if (look.knowledge == Knowledge::Table) return look;
  }
  return minecraft::look_of_block(name, false, false);
}

}  // namespace

std::optional<VoxelProperties> node_properties(std::string_view name) {
  if (name == "air" || name == "ignore") return std::nullopt;
  const BlockLook look = look_of_node(name);
  VoxelProperties type;
  type.name = printable(name);
  type.colour = minecraft::tinted_colour(look.colour, minecraft::colour_of(look.tint, {}));
  type.colour.a = std::max<std::uint8_t>(type.colour.a, 1);
  type.visibility = type.colour.a < 255 ? Visibility::Transparent : Visibility::Opaque;
  type.collides = look.collides;
  type.emission = look.emission;
  type.roughness = look.roughness;
  type.ior = look.ior;
  if (look.knowledge != Knowledge::Table) {
    type.attributes[kNodeGuessAttribute] = look.knowledge == Knowledge::Words ? "words" : "nothing";
  }
  return type;
}

}  // namespace quoin::models
