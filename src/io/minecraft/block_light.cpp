// The light of blocks: the levels that they emit, and the passage of light.
#include <algorithm>
#include <array>
#include <charconv>
#include <iterator>
#include <string_view>

#include "io/minecraft/block_looks.h"

namespace quoin::minecraft {

namespace {

/// A level of some states of a block. The first row whose condition holds counts; a listed block without one is dark.
struct LightRow {
  std::string_view name;
  int level = 0;
  std::string_view key{};    ///< of a property; empty: all states
  std::string_view value{};  ///< that the property has
};

// Levels of version 26.1. Source: the Minecraft Wiki, "Light" (https://minecraft.wiki/w/Light), and the value
// `emitLight` of minecraft-data (https://github.com/PrismarineJS/minecraft-data), which lists the default states.
constexpr LightRow kLights[] = {
    {"amethyst_cluster", 5},
    {"beacon", 15},
    {"blast_furnace", 13, "lit", "true"},
    {"brewing_stand", 1},
    {"brown_mushroom", 1},
    {"calibrated_sculk_sensor", 1},
    {"campfire", 15, "lit", "true"},
    {"candle", 3, "lit", "true"},  // times `candles`
    {"candle_cake", 3, "lit", "true"},
    {"cave_vines", 14, "berries", "true"},
    {"cave_vines_plant", 14, "berries", "true"},
    {"conduit", 15},
    {"copper_bulb", 15, "lit", "true"},
    {"copper_lantern", 15},
    {"copper_torch", 14},
    {"copper_wall_torch", 14},
    {"crying_obsidian", 10},
    {"deepslate_redstone_ore", 9, "lit", "true"},
    {"dragon_egg", 1},
    {"enchanting_table", 7},
    {"end_gateway", 15},
    {"end_portal", 15},
    {"end_portal_frame", 1},
    {"end_rod", 14},
    {"ender_chest", 7},
    {"exposed_copper_bulb", 12, "lit", "true"},
    {"exposed_copper_lantern", 15},
    {"fire", 15},
    {"firefly_bush", 2},
    {"furnace", 13, "lit", "true"},
    {"glow_lichen", 7},
    {"glowstone", 15},
    {"jack_o_lantern", 15},
    {"lantern", 15},
    {"large_amethyst_bud", 4},
    {"lava", 15},
    {"lava_cauldron", 15},
    {"magma_block", 3},
    {"medium_amethyst_bud", 2},
    {"nether_portal", 11},
    {"ochre_froglight", 15},
    {"oxidized_copper_bulb", 4, "lit", "true"},
    {"oxidized_copper_lantern", 15},
    {"pearlescent_froglight", 15},
    {"redstone_lamp", 15, "lit", "true"},
    {"redstone_ore", 9, "lit", "true"},
    {"redstone_torch", 0, "lit", "false"},
    {"redstone_torch", 7},
    {"redstone_wall_torch", 0, "lit", "false"},
    {"redstone_wall_torch", 7},
    {"respawn_anchor", 3, "charges", "1"},
    {"respawn_anchor", 7, "charges", "2"},
    {"respawn_anchor", 11, "charges", "3"},
    {"respawn_anchor", 15, "charges", "4"},
    {"sculk_catalyst", 6},
    {"sculk_sensor", 1},
    {"sea_lantern", 15},
    {"sea_pickle", 3, "waterlogged", "true"},  // and 3 for each of `pickles`
    {"shroomlight", 15},
    {"small_amethyst_bud", 1},
    {"smoker", 13, "lit", "true"},
    {"soul_campfire", 10, "lit", "true"},
    {"soul_fire", 10},
    {"soul_lantern", 10},
    {"soul_torch", 10},
    {"soul_wall_torch", 10},
    {"torch", 14},
    {"trial_spawner", 4, "trial_spawner_state", "waiting_for_players"},
    {"trial_spawner", 8, "trial_spawner_state", "active"},
    {"trial_spawner", 8, "trial_spawner_state", "waiting_for_reward_ejection"},
    {"trial_spawner", 8, "trial_spawner_state", "ejecting_reward"},
    {"vault", 12, "vault_state", "active"},
    {"vault", 12, "vault_state", "unlocking"},
    {"vault", 12, "vault_state", "ejecting"},
    {"vault", 6},
    {"verdant_froglight", 15},
    {"wall_torch", 14},
    {"weathered_copper_bulb", 8, "lit", "true"},
    {"weathered_copper_lantern", 15},
};
static_assert(std::ranges::is_sorted(kLights, {}, &LightRow::name));

/// Returns the name whose rows a block has: without the namespace and wax, and that of candles of all colours.
std::string_view listed_name(std::string_view name) {
  constexpr std::string_view kNamespace = "minecraft:";
  if (name.starts_with(kNamespace)) name.remove_prefix(kNamespace.size());
  if (name.ends_with("_candle")) return "candle";
  if (name.ends_with("_candle_cake")) return "candle_cake";
  constexpr std::string_view kWaxed = "waxed_";
  return name.starts_with(kWaxed) ? name.substr(kWaxed.size()) : name;
}

/// Returns the value of a property from 1 to 4; 1 if it is absent or another.
int count_of(std::span<const std::pair<std::string, std::string>> properties, std::string_view key) {
  const auto found = std::ranges::find(properties, key, &std::pair<std::string, std::string>::first);
  const bool is_count =
      found != properties.end() && found->second.size() == 1 && found->second[0] >= '1' && found->second[0] <= '4';
  return is_count ? found->second[0] - '0' : 1;
}

// The passage of light is the value `filterLight` of the game's blocks, which minecraft-data lists
// (https://github.com/PrismarineJS/minecraft-data, data/pc/1.21.11/blocks.json). 0: as through air. 1: sky light loses
// a level. 15: no light passes. See also "Opacity" in the Minecraft Wiki. Stairs, slabs and the like have 0 too, but
// stop light at faces that they fill; as whole voxels they keep it out.
// The last words of blocks with 1, except liquids and clear blocks:
constexpr std::string_view kFilters[] = {"leaves",         "cobweb",     "beacon",      "spawner",      "vault",
                                         "powder_snow",    "lava",       "end_gateway", "chorus_plant", "chorus_flower",
                                         "shulker_box",    "kelp",       "kelp_plant",  "seagrass",     "coral",
                                         "coral_fan",      "wall_fan",   "sea_pickle",  "conduit",      "sculk_vein",
                                         "mangrove_roots", "resin_clump"};
// Words of blocks with 0 that look solid, since they fill their voxel here:
constexpr std::string_view kOpen[] = {
    "fence",  "wall",    "door",       "trapdoor",      "sign",     "shelf",  "bed",     "chest",     "skull",
    "head",   "lantern", "cauldron",   "anvil",         "campfire", "potted", "pot",     "cake",      "cactus",
    "bell",   "hopper",  "grindstone", "rod",           "egg",      "bud",    "cluster", "composter", "end_portal",
    "statue", "ghast",   "core",       "moving_piston", "torch",    "bars",   "chain",   "grate"};
constexpr std::string_view kNotOpen[] = {"piston_head", "sea_lantern", "jack_o_lantern", "end_portal_frame",
                                         "chain_command_block"};

}  // namespace

std::optional<int> light_level_of_block(std::string_view name,
                                        std::span<const std::pair<std::string, std::string>> properties) {
  name = listed_name(name);
  const auto rows = std::ranges::equal_range(kLights, name, {}, &LightRow::name);
  if (rows.empty()) return std::nullopt;
  const auto holds = [&](const LightRow& row) {
    return row.key.empty() || std::ranges::any_of(properties, [&](const auto& property) {
             return property.first == row.key && property.second == row.value;
           });
  };
  const auto row = std::ranges::find_if(rows, holds);
  if (row == rows.end()) return 0;
  if (name == "candle") return row->level * count_of(properties, "candles");
  if (name == "sea_pickle") return row->level * (1 + count_of(properties, "pickles"));
  return row->level;
}

std::vector<std::string_view> light_properties_of_block(std::string_view name) {
  std::vector<std::string_view> keys;
  name = listed_name(name);
  const auto add = [&](std::string_view key) {
    if (!key.empty() && std::ranges::find(keys, key) == keys.end()) keys.push_back(key);
  };
  for (const LightRow& row : std::ranges::equal_range(kLights, name, {}, &LightRow::name)) add(row.key);
  if (name == "candle") add("candles");
  if (name == "sea_pickle") add("pickles");
  return keys;
}

void set_passage(std::string_view name, BlockLook& look) {
  const auto ends = [&](std::string_view word) { return name.ends_with(word) && has_word(name, word); };
  const auto has = [&](std::string_view word) { return has_word(name, word); };
  const bool is_filter = std::ranges::any_of(kFilters, ends) && name != "muddy_mangrove_roots";
  const bool is_open = std::ranges::any_of(kOpen, has) && std::ranges::find(kNotOpen, name) == std::end(kNotOpen);
  if (is_filter) look.light_cost = 1;
  if (name == "tinted_glass") look.light_cost = kMaxLightCost;
  if (look.colour.a == 255 && (is_filter || is_open)) look.blocks_light = false;
}

}  // namespace quoin::minecraft
