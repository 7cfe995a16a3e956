#include "io/minecraft/bedrock_blocks.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>

#include <quoin/core/assert.h>

// The rules, in this order:
//
//   kBedrockKinds     a block with a state that names its material or colour becomes a block of its own
//   kBedrockNames     other names
//   kBedrockStates    a state of certain blocks becomes properties; the first row that fits is used
//
// Before 1.20.60 of Bedrock, many blocks had such states; since then most have the names of the Java edition.

namespace quoin::minecraft {

namespace {

constexpr std::string_view kGameSpace = "minecraft:";

/// "planks" with wood_type=birch is "birch_planks".
struct BedrockKind {
  std::string_view name;
  std::string_view state;
  std::string_view made;    ///< with the value for '*'
  std::string_view values;  ///< "old=new ..."; other values are kept. A value may be the whole name: "x=/stone"
};

constexpr std::string_view kBedrockColours = "silver=light_gray";

constexpr std::array kBedrockKinds = std::to_array<BedrockKind>({
    {"carpet", "color", "*_carpet", kBedrockColours},
    {"concrete", "color", "*_concrete", kBedrockColours},
    {"concrete_powder", "color", "*_concrete_powder", kBedrockColours},
    {"concretePowder", "color", "*_concrete_powder", kBedrockColours},
    {"coral", "coral_color", "*_coral", "blue=tube pink=brain purple=bubble red=fire yellow=horn"},
    {"coral_block", "coral_color", "*_coral_block", "blue=tube pink=brain purple=bubble red=fire yellow=horn"},
    {"dirt", "dirt_type", "*", "normal=/dirt coarse=/coarse_dirt"},
    {"double_plant", "double_plant_type", "*",
     "sunflower=/sunflower syringa=/lilac grass=/tall_grass fern=/large_fern rose=/rose_bush paeonia=/peony"},
    {"double_stone_slab", "stone_slab_type", "*_slab",
     "wood=petrified_oak nether_brick=nether_brick quartz=quartz smooth_stone=smooth_stone"},
    {"double_wooden_slab", "wood_type", "*_slab", ""},
    {"fence", "wood_type", "*_fence", ""},
    {"leaves", "old_leaf_type", "*_leaves", ""},
    {"leaves2", "new_leaf_type", "*_leaves", ""},
    {"log", "old_log_type", "*_log", ""},
    {"log2", "new_log_type", "*_log", ""},
    {"monster_egg", "monster_egg_stone_type", "infested_*",
     "stone_brick=stone_bricks mossy_stone_brick=mossy_stone_bricks cracked_stone_brick=cracked_stone_bricks"},
    {"planks", "wood_type", "*_planks", ""},
    {"prismarine", "prismarine_block_type", "*", "default=/prismarine dark=/dark_prismarine bricks=/prismarine_bricks"},
    {"quartz_block", "chisel_type", "*",
     "default=/quartz_block chiseled=/chiseled_quartz_block lines=/quartz_pillar smooth=/smooth_quartz"},
    {"red_flower", "flower_type", "*",
     "poppy=/poppy orchid=/blue_orchid allium=/allium houstonia=/azure_bluet tulip_red=/red_tulip "
     "tulip_orange=/orange_tulip tulip_white=/white_tulip tulip_pink=/pink_tulip oxeye=/oxeye_daisy "
     "cornflower=/cornflower lily_of_the_valley=/lily_of_the_valley"},
    {"red_sandstone", "sand_stone_type", "*",
     "default=/red_sandstone heiroglyphs=/chiseled_red_sandstone cut=/cut_red_sandstone smooth=/smooth_red_sandstone"},
    {"sand", "sand_type", "*", "normal=/sand red=/red_sand"},
    {"sandstone", "sand_stone_type", "*",
     "default=/sandstone heiroglyphs=/chiseled_sandstone cut=/cut_sandstone smooth=/smooth_sandstone"},
    {"sapling", "sapling_type", "*_sapling", ""},
    {"shulker_box", "color", "*_shulker_box", kBedrockColours},
    {"stained_glass", "color", "*_stained_glass", kBedrockColours},
    {"stained_glass_pane", "color", "*_stained_glass_pane", kBedrockColours},
    {"stained_hardened_clay", "color", "*_terracotta", kBedrockColours},
    {"stone", "stone_type", "*",
     "stone=/stone granite=/granite granite_smooth=/polished_granite diorite=/diorite "
     "diorite_smooth=/polished_diorite andesite=/andesite andesite_smooth=/polished_andesite"},
    {"stone_slab", "stone_slab_type", "*_slab", "wood=petrified_oak brick=brick stone_brick=stone_brick"},
    {"stone_block_slab", "stone_slab_type", "*_slab", "wood=petrified_oak brick=brick stone_brick=stone_brick"},
    {"stonebrick", "stone_brick_type", "*",
     "default=/stone_bricks mossy=/mossy_stone_bricks cracked=/cracked_stone_bricks chiseled=/chiseled_stone_bricks "
     "smooth=/stone_bricks"},
    {"tallgrass", "tall_grass_type", "*", "default=/short_grass tall=/short_grass fern=/fern snow=/fern"},
    {"wooden_slab", "wood_type", "*_slab", ""},
    {"wool", "color", "*_wool", kBedrockColours},
});

/// Other names. '*' in both stands for the same text.
struct BedrockName {
  std::string_view bedrock;
  std::string_view java;
};
constexpr std::array kBedrockNames = std::to_array<BedrockName>({
    {"bed", "red_bed"},
    {"brick_block", "bricks"},
    {"crimson_standing_sign", "crimson_sign"},
    {"darkoak_standing_sign", "dark_oak_sign"},
    {"darkoak_wall_sign", "dark_oak_wall_sign"},
    {"deadbush", "dead_bush"},
    {"end_bricks", "end_stone_bricks"},
    {"fence_gate", "oak_fence_gate"},
    {"flowing_lava", "lava"},
    {"flowing_water", "water"},
    {"golden_rail", "powered_rail"},
    {"grass", "grass_block"},
    {"grass_path", "dirt_path"},
    {"hardened_clay", "terracotta"},
    {"lit_blast_furnace", "blast_furnace"},
    {"lit_furnace", "furnace"},
    {"lit_pumpkin", "jack_o_lantern"},
    {"lit_redstone_lamp", "redstone_lamp"},
    {"lit_redstone_ore", "redstone_ore"},
    {"lit_smoker", "smoker"},
    {"magma", "magma_block"},
    {"melon_block", "melon"},
    {"mob_spawner", "spawner"},
    {"nether_brick", "nether_bricks"},
    {"normal_stone_stairs", "stone_stairs"},
    {"noteblock", "note_block"},
    {"portal", "nether_portal"},
    {"powered_comparator", "comparator"},
    {"powered_repeater", "repeater"},
    {"red_nether_brick", "red_nether_bricks"},
    {"reeds", "sugar_cane"},
    {"sealantern", "sea_lantern"},
    {"seaLantern", "sea_lantern"},
    {"silver_glazed_terracotta", "light_gray_glazed_terracotta"},
    {"slime", "slime_block"},
    {"snow", "snow_block"},
    {"snow_layer", "snow"},
    {"standing_banner", "white_banner"},
    {"standing_sign", "oak_sign"},
    {"stone_stairs", "cobblestone_stairs"},
    {"trapdoor", "oak_trapdoor"},
    {"trip_wire", "tripwire"},
    {"tripWire", "tripwire"},
    {"undyed_shulker_box", "shulker_box"},
    {"unlit_redstone_torch", "redstone_torch"},
    {"unpowered_comparator", "comparator"},
    {"unpowered_repeater", "repeater"},
    {"wall_banner", "white_wall_banner"},
    {"wall_sign", "oak_wall_sign"},
    {"waterlily", "lily_pad"},
    {"web", "cobweb"},
    {"wooden_button", "oak_button"},
    {"wooden_door", "oak_door"},
    {"wooden_pressure_plate", "oak_pressure_plate"},
    {"yellow_flower", "dandelion"},
    {"*_double_slab", "*_slab"},
    {"*_standing_sign", "*_sign"},
});

/// Properties that follow from the old name alone.
struct BedrockNameProperty {
  std::string_view name;
  std::string_view property;
  std::string_view value;
};
constexpr std::array kBedrockNameProperties = std::to_array<BedrockNameProperty>({
    {"lit_blast_furnace", "lit", "true"},
    {"lit_furnace", "lit", "true"},
    {"lit_redstone_lamp", "lit", "true"},
    {"lit_redstone_ore", "lit", "true"},
    {"lit_smoker", "lit", "true"},
    {"redstone_torch", "lit", "true"},
    {"unlit_redstone_torch", "lit", "false"},
    {"powered_comparator", "powered", "true"},
    {"powered_repeater", "powered", "true"},
    {"unpowered_comparator", "powered", "false"},
    {"unpowered_repeater", "powered", "false"},
    {"double_stone_slab", "type", "double"},
    {"double_wooden_slab", "type", "double"},
    {"*_double_slab", "type", "double"},
});

/// A state of the blocks that match any of the patterns, as properties.
struct BedrockStateRule {
  std::string_view blocks;  ///< patterns of Java names, with blanks between
  std::string_view state;
  /// "value=property:value,property:value ..."; "value=-" for no property; "*=property" keeps the value.
  std::string_view values;
};

constexpr std::string_view kSixFacings =
    "0=facing:down 1=facing:up 2=facing:north 3=facing:south 4=facing:west 5=facing:east";
constexpr std::string_view kFourFacings = "0=facing:south 1=facing:west 2=facing:north 3=facing:east";
constexpr std::string_view kStairFacings = "0=facing:east 1=facing:west 2=facing:south 3=facing:north";
constexpr std::string_view kDropped = "*=-";

constexpr std::array kBedrockStates = std::to_array<BedrockStateRule>({
    {"*_stairs", "weirdo_direction", kStairFacings},
    {"*_stairs", "upside_down_bit", "0=half:bottom 1=half:top"},
    // Numbers of doors begin at the east, and their directions follow the numbers of other blocks.
    {"*_door", "direction", "0=facing:east 1=facing:south 2=facing:west 3=facing:north"},
    {"*_door", "cardinal_direction", "south=facing:east west=facing:south north=facing:west east=facing:north"},
    {"*_door", "upper_block_bit", "0=half:lower 1=half:upper"},
    {"*_door", "door_hinge_bit", "0=hinge:left 1=hinge:right"},
    {"*_trapdoor", "direction", kStairFacings},
    {"*_trapdoor", "upside_down_bit", "0=half:bottom 1=half:top"},
    {"lever", "open_bit", "0=powered:false 1=powered:true"},
    {"*", "open_bit", "0=open:false 1=open:true"},
    {"*_fence_gate", "in_wall_bit", "0=in_wall:false 1=in_wall:true"},
    {"*_slab", "top_slot_bit", "0=type:bottom 1=type:top"},
    {"*_slab", "vertical_half", "bottom=type:bottom top=type:top"},
    {"*", "pillar_axis", "*=axis"},
    {"*", "cardinal_direction", "*=facing"},
    {"*", "block_face", "*=facing"},
    // Sideways, these point away from their direction.
    {"piston sticky_piston end_rod", "facing_direction",
     "0=facing:down 1=facing:up 2=facing:south 3=facing:north 4=facing:east 5=facing:west"},
    {"*", "facing_direction", kSixFacings},
    {"*", "facing_direction",
     "down=facing:down up=facing:up north=facing:north south=facing:south west=facing:west east=facing:east"},
    {"*_bed", "head_piece_bit", "0=part:foot 1=part:head"},
    {"*_bed", "occupied_bit", "0=occupied:false 1=occupied:true"},
    {"lever", "lever_direction",
     "down_east_west=face:ceiling,facing:west east=face:wall,facing:east west=face:wall,facing:west "
     "south=face:wall,facing:south north=face:wall,facing:north up_north_south=face:floor,facing:north "
     "up_east_west=face:floor,facing:west down_north_south=face:ceiling,facing:north"},
    {"*rail", "rail_direction",
     "0=shape:north_south 1=shape:east_west 2=shape:ascending_east 3=shape:ascending_west 4=shape:ascending_north "
     "5=shape:ascending_south 6=shape:south_east 7=shape:south_west 8=shape:north_west 9=shape:north_east"},
    {"*rail", "rail_data_bit", "0=powered:false 1=powered:true"},
    {"*", "direction", kFourFacings},
    {"*_sign *_banner", "ground_sign_direction", "*=rotation"},
    {"*_wall", "wall_connection_type_north", "none=north:none short=north:low tall=north:tall"},
    {"*_wall", "wall_connection_type_south", "none=south:none short=south:low tall=south:tall"},
    {"*_wall", "wall_connection_type_west", "none=west:none short=west:low tall=west:tall"},
    {"*_wall", "wall_connection_type_east", "none=east:none short=east:low tall=east:tall"},
    {"*_wall", "wall_post_bit", "0=up:false 1=up:true"},
    {"water lava", "liquid_depth", "*=level"},
    {"snow", "height", "0=layers:1 1=layers:2 2=layers:3 3=layers:4 4=layers:5 5=layers:6 6=layers:7 7=layers:8"},
    {"snow", "covered_bit", kDropped},
    {"sunflower lilac tall_grass large_fern rose_bush peony", "upper_block_bit", "0=half:lower 1=half:upper"},
    {"*", "redstone_signal", "*=power"},
    {"*", "button_pressed_bit", "0=powered:false 1=powered:true"},
    {"*", "powered_bit", "0=powered:false 1=powered:true"},
    {"*", "output_lit_bit", "0=powered:false 1=powered:true"},
    {"comparator", "output_subtract_bit", "0=mode:compare 1=mode:subtract"},
    {"repeater", "repeater_delay", "0=delay:1 1=delay:2 2=delay:3 3=delay:4"},
    {"farmland", "moisturized_amount", "*=moisture"},
    {"cake", "bite_counter", "*=bites"},
    {"sweet_berry_bush", "growth", "0=age:0 1=age:1 2=age:2 3=age:3 4=age:3 5=age:3 6=age:3 7=age:3"},
    {"beetroots", "growth", "0=age:0 1=age:0 2=age:1 3=age:1 4=age:2 5=age:2 6=age:2 7=age:3"},
    {"*", "growth", "*=age"},
    {"*candle *cake", "lit", "0=lit:false 1=lit:true"},
    {"*candle", "candles", "0=candles:1 1=candles:2 2=candles:3 3=candles:4"},
    {"sea_pickle", "cluster_count", "0=pickles:1 1=pickles:2 2=pickles:3 3=pickles:4"},
    {"*lantern", "hanging", "0=hanging:false 1=hanging:true"},
    {"*campfire", "extinguished", "0=lit:true 1=lit:false"},
    {"*_leaves", "persistent_bit", kDropped},
    {"*_leaves", "update_bit", kDropped},
    {"*_sapling", "age_bit", "0=stage:0 1=stage:1"},
    {"*", "stripped_bit", kDropped},
    {"*", "deprecated", kDropped},
    {"*", "infiniburn_bit", kDropped},
    {"*", "button_facing", kDropped},
});

/// Calls `visit(key, value)` for the pairs of "key=value key=value".
template <class Visit>
void for_each_pair(std::string_view text, Visit visit) {
  while (!text.empty()) {
    const std::size_t blank = std::min(text.find(' '), text.size());
    const std::string_view pair = text.substr(0, blank);
    const std::size_t equals = std::min(pair.find('='), pair.size());
    if (!pair.empty()) visit(pair.substr(0, equals), pair.substr(std::min(equals + 1, pair.size())));
    text.remove_prefix(std::min(blank + 1, text.size()));
  }
}

/// Returns the text for '*' in a pattern with at most one star; nullopt if the pattern does not match.
std::optional<std::string_view> star_of(std::string_view pattern, std::string_view name) {
  const std::size_t star = pattern.find('*');
  if (star == std::string_view::npos) return pattern == name ? std::optional(std::string_view()) : std::nullopt;
  const std::string_view start = pattern.substr(0, star);
  const std::string_view end = pattern.substr(star + 1);
  if (name.size() < start.size() + end.size() || !name.starts_with(start) || !name.ends_with(end)) return std::nullopt;
  return name.substr(start.size(), name.size() - start.size() - end.size());
}

bool matches_any(std::string_view patterns, std::string_view name) {
  bool found = false;
  for_each_pair(patterns, [&](std::string_view pattern, std::string_view) {
    found = found || star_of(pattern, name).has_value();
  });
  return found;
}

std::string with_star(std::string_view text, std::string_view by) {
  const std::size_t star = text.find('*');
  if (star == std::string_view::npos) return std::string(text);
  return std::string(text.substr(0, star)).append(by).append(text.substr(star + 1));
}

const Property* find_state(const std::vector<Property>& states, std::string_view key) {
  const auto found = std::ranges::find(states, key, &Property::first);
  return found == states.end() ? nullptr : &*found;
}

std::string_view without_game(std::string_view name) {
  return name.starts_with(kGameSpace) ? name.substr(kGameSpace.size()) : name;
}

/// Returns the block that a state names; removes the state.
std::optional<std::string> block_of_kind(std::string_view name, std::vector<Property>& states) {
  const auto kind = std::ranges::find(kBedrockKinds, name, &BedrockKind::name);
  if (kind == kBedrockKinds.end()) return std::nullopt;
  const Property* const state = find_state(states, kind->state);
  if (state == nullptr) return std::nullopt;
  std::string value = state->second;
  for_each_pair(kind->values, [&, old = state->second](std::string_view from, std::string_view to) {
    if (from == old) value = std::string(to);
  });
  std::erase_if(states, [&](const Property& each) { return each.first == kind->state; });
  if (value.starts_with('/')) return value.substr(1);
  return kind->made == "*" ? std::optional<std::string>() : with_star(kind->made, value);
}

/// Adds the properties of a state by a rule's values; returns false if no value fits.
bool add_by_rule(const BedrockStateRule& rule, const Property& state, std::vector<Property>& properties) {
  bool fits = false;
  for_each_pair(rule.values, [&](std::string_view value, std::string_view made) {
    if (fits || (value != "*" && value != state.second)) return;
    fits = true;
    if (made == "-") return;
    if (value == "*") {
      properties.emplace_back(made, state.second);
      return;
    }
    while (!made.empty()) {
      const std::size_t comma = std::min(made.find(','), made.size());
      const std::string_view one = made.substr(0, comma);
      const std::size_t colon = one.find(':');
      properties.emplace_back(one.substr(0, colon), one.substr(colon + 1));
      made.remove_prefix(std::min(comma + 1, made.size()));
    }
  });
  return fits;
}

/// Torches on walls are blocks of their own in the Java edition, and face away from the wall.
void settle_torch(std::string& name, const Property& state, std::vector<Property>& properties) {
  constexpr std::array<std::pair<std::string_view, std::string_view>, 4> kOpposite = {
      {{"west", "east"}, {"east", "west"}, {"north", "south"}, {"south", "north"}}};
  const auto wall = std::ranges::find(kOpposite, state.second, &std::pair<std::string_view, std::string_view>::first);
  if (wall == kOpposite.end()) return;
  const std::size_t torch = name.rfind("torch");
  name.insert(torch, "wall_");
  properties.emplace_back("facing", wall->second);
}

/// Buttons have a side in the Bedrock edition, and a kind of side with a direction in the Java edition.
void settle_button(const Property& state, std::vector<Property>& properties) {
  constexpr std::array<std::pair<std::string_view, std::string_view>, 6> kSides = {{{"ceiling", "north"},
                                                                                    {"floor", "north"},
                                                                                    {"wall", "north"},
                                                                                    {"wall", "south"},
                                                                                    {"wall", "west"},
                                                                                    {"wall", "east"}}};
  if (state.second.size() != 1 || state.second[0] < '0' || state.second[0] > '5') return;
  const auto& [face, facing] = kSides[static_cast<std::size_t>(state.second[0] - '0')];
  properties.emplace_back("face", face);
  properties.emplace_back("facing", facing);
}

}  // namespace

BlockText java_block(std::string_view name, const std::vector<Property>& states, std::optional<bool> is_waterlogged) {
  const bool is_of_game = name.starts_with(kGameSpace) || name.find(':') == std::string_view::npos;
  std::vector<Property> rest;
  for (const auto& [key, value] : states) rest.emplace_back(key.substr(key.rfind(':') + 1), value);
  BlockText block{std::string(without_game(name)), {}};
  if (is_of_game) {
    const std::string old = block.name;
    for (const BedrockNameProperty& each : kBedrockNameProperties) {
      if (star_of(each.name, old)) block.properties.emplace_back(each.property, each.value);
    }
    if (auto kind = block_of_kind(old, rest)) {
      block.name = std::move(*kind);
    } else if (const auto other = std::ranges::find_if(
                   kBedrockNames, [&](const BedrockName& each) { return star_of(each.bedrock, old).has_value(); });
               other != kBedrockNames.end()) {
      block.name = with_star(other->java, *star_of(other->bedrock, old));
    }
  }
  for (const Property& state : rest) {
    if (state.first == "torch_facing_direction" && block.name.ends_with("torch")) {
      settle_torch(block.name, state, block.properties);
      continue;
    }
    if (state.first == "facing_direction" && block.name.ends_with("_button")) {
      settle_button(state, block.properties);
      continue;
    }
    const bool is_known = std::ranges::any_of(kBedrockStates, [&](const BedrockStateRule& rule) {
      return rule.state == state.first && matches_any(rule.blocks, block.name) &&
             add_by_rule(rule, state, block.properties);
    });
    if (!is_known) block.properties.push_back(state);
  }
  if (is_waterlogged) block.properties.emplace_back("waterlogged", *is_waterlogged ? "true" : "false");
  // The first of equal properties wins: those of the name.
  std::ranges::stable_sort(block.properties, {}, &Property::first);
  const auto repeated = std::ranges::unique(block.properties, {}, &Property::first);
  block.properties.erase(repeated.begin(), repeated.end());
  if (is_of_game) block.name.insert(0, kGameSpace);
  return block;
}

}  // namespace quoin::minecraft
