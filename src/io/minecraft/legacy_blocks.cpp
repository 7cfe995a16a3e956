#include "io/minecraft/block_types.h"

#include <algorithm>
#include <array>
#include <string_view>

#include <quoin/core/assert.h>

namespace quoin::minecraft {

namespace {

/// The meaning of a block's four data bits (https://minecraft.wiki/w/Java_Edition_data_values/Pre-flattening).
enum class How : std::uint8_t {
  Plain,        // nothing
  Kinds,        // one of a list of blocks
  Woods8,       // bits 0 to 2: the wood
  Woods4,       // bits 0 and 1: one of a list of woods; other bits: decay of leaves
  Logs,         // as Woods4, bits 2 and 3: the axis of the log
  Pillar,       // bits 2 and 3: its axis
  Dyed,         // a dye
  Slab,         // bits 0 to 2: one of a list, bit 3: the upper half
  DoubleSlab,   // bits 0 to 2: one of a list
  Stairs,       // bits 0 and 1: east, west, south, north; bit 2: upside down
  Facing4,      // 2 to 5: north, south, west, east
  LitFacing4,   // the same, burning
  Facing6,      // 0 to 5: down, up, north, south, west, east
  Piston,       // the same, bit 3: extended
  Horizontal,   // bits 0 and 1: south, west, north, east
  Gate,         // the same, bit 2: open
  Bed,          // the same, bit 3: its head
  Repeater,     // the same, bits 2 and 3: delay
  Torch,        // 1 to 4: on a wall, facing east, west, south, north
  LitTorch,     // the same, burning
  Rail,         // shapes
  Door,         // bit 3: the upper half; of the lower one bits 0 and 1: east, south, west, north, bit 2: open
  Trapdoor,     // bits 0 and 1: north, south, west, east; bit 2: open, bit 3: top
  DoublePlant,  // bits 0 to 2: one of a list, bit 3: the upper half
  Portal,       // 1: along x, 2: along z
  Layers,       // bits 0 to 2: layers of snow, less 1
  Level,        // a number: of water and lava
  Age,          // a number
  Power,        // a number
  Rotation,     // a number: sixteenths of a turn
  Moisture,     // a number
  Bites,        // a number
  Powered,      // 1: pressed
  Lit,          // nothing; it shines
  Data,         // something else
};

struct Legacy {
  int id;
  std::string_view name;  // or its end
  How how = How::Plain;
  std::string_view kinds{};
};

constexpr Legacy kLegacy[] = {
    {1, "", How::Kinds, "stone granite polished_granite diorite polished_diorite andesite polished_andesite"},
    {2, "grass_block"},
    {3, "", How::Kinds, "dirt coarse_dirt podzol"},
    {4, "cobblestone"},
    {5, "_planks", How::Woods8},
    {6, "_sapling", How::Woods8},
    {7, "bedrock"},
    {8, "water", How::Level},
    {9, "water", How::Level},
    {10, "lava", How::Level},
    {11, "lava", How::Level},
    {12, "", How::Kinds, "sand red_sand"},
    {13, "gravel"},
    {14, "gold_ore"},
    {15, "iron_ore"},
    {16, "coal_ore"},
    {17, "_log", How::Logs, "oak spruce birch jungle"},
    {18, "_leaves", How::Woods4, "oak spruce birch jungle"},
    {19, "", How::Kinds, "sponge wet_sponge"},
    {20, "glass"},
    {21, "lapis_ore"},
    {22, "lapis_block"},
    {23, "dispenser", How::Facing6},
    {24, "", How::Kinds, "sandstone chiseled_sandstone cut_sandstone"},
    {25, "note_block"},
    {26, "red_bed", How::Bed},
    {27, "powered_rail", How::Rail},
    {28, "detector_rail", How::Rail},
    {29, "sticky_piston", How::Piston},
    {30, "cobweb"},
    {31, "", How::Kinds, "dead_bush short_grass fern"},
    {32, "dead_bush"},
    {33, "piston", How::Piston},
    {34, "piston_head", How::Facing6},
    {35, "_wool", How::Dyed},
    {36, "moving_piston", How::Facing6},
    {37, "dandelion"},
    {38, "", How::Kinds,
     "poppy blue_orchid allium azure_bluet red_tulip orange_tulip white_tulip pink_tulip oxeye_daisy"},
    {39, "brown_mushroom"},
    {40, "red_mushroom"},
    {41, "gold_block"},
    {42, "iron_block"},
    {43, "_slab", How::DoubleSlab,
     "smooth_stone sandstone petrified_oak cobblestone brick stone_brick nether_brick quartz"},
    {44, "_slab", How::Slab, "smooth_stone sandstone petrified_oak cobblestone brick stone_brick nether_brick quartz"},
    {45, "bricks"},
    {46, "tnt"},
    {47, "bookshelf"},
    {48, "mossy_cobblestone"},
    {49, "obsidian"},
    {50, "torch", How::Torch},
    {51, "fire", How::Age},
    {52, "spawner"},
    {53, "oak_stairs", How::Stairs},
    {54, "chest", How::Facing4},
    {55, "redstone_wire", How::Power},
    {56, "diamond_ore"},
    {57, "diamond_block"},
    {58, "crafting_table"},
    {59, "wheat", How::Age},
    {60, "farmland", How::Moisture},
    {61, "furnace", How::Facing4},
    {62, "furnace", How::LitFacing4},
    {63, "oak_sign", How::Rotation},
    {64, "oak_door", How::Door},
    {65, "ladder", How::Facing4},
    {66, "rail", How::Rail},
    {67, "cobblestone_stairs", How::Stairs},
    {68, "oak_wall_sign", How::Facing4},
    {69, "lever", How::Data},
    {70, "stone_pressure_plate", How::Powered},
    {71, "iron_door", How::Door},
    {72, "oak_pressure_plate", How::Powered},
    {73, "redstone_ore"},
    {74, "redstone_ore", How::Lit},
    {75, "redstone_torch", How::Torch},
    {76, "redstone_torch", How::LitTorch},
    {77, "stone_button", How::Data},
    {78, "snow", How::Layers},
    {79, "ice"},
    {80, "snow_block"},
    {81, "cactus", How::Age},
    {82, "clay"},
    {83, "sugar_cane", How::Age},
    {84, "jukebox"},
    {85, "oak_fence"},
    {86, "carved_pumpkin", How::Horizontal},
    {87, "netherrack"},
    {88, "soul_sand"},
    {89, "glowstone"},
    {90, "nether_portal", How::Portal},
    {91, "jack_o_lantern", How::Horizontal},
    {92, "cake", How::Bites},
    {93, "repeater", How::Repeater},
    {94, "repeater", How::Repeater},
    {95, "_stained_glass", How::Dyed},
    {96, "oak_trapdoor", How::Trapdoor},
    {97, "", How::Kinds,
     "infested_stone infested_cobblestone infested_stone_bricks infested_mossy_stone_bricks "
     "infested_cracked_stone_bricks infested_chiseled_stone_bricks"},
    {98, "", How::Kinds, "stone_bricks mossy_stone_bricks cracked_stone_bricks chiseled_stone_bricks"},
    {99, "brown_mushroom_block", How::Data},
    {100, "red_mushroom_block", How::Data},
    {101, "iron_bars"},
    {102, "glass_pane"},
    {103, "melon"},
    {104, "pumpkin_stem", How::Age},
    {105, "melon_stem", How::Age},
    {106, "vine", How::Data},
    {107, "oak_fence_gate", How::Gate},
    {108, "brick_stairs", How::Stairs},
    {109, "stone_brick_stairs", How::Stairs},
    {110, "mycelium"},
    {111, "lily_pad"},
    {112, "nether_bricks"},
    {113, "nether_brick_fence"},
    {114, "nether_brick_stairs", How::Stairs},
    {115, "nether_wart", How::Age},
    {116, "enchanting_table"},
    {117, "brewing_stand", How::Data},
    {118, "cauldron", How::Level},
    {119, "end_portal"},
    {120, "end_portal_frame", How::Horizontal},
    {121, "end_stone"},
    {122, "dragon_egg"},
    {123, "redstone_lamp"},
    {124, "redstone_lamp", How::Lit},
    {125, "_slab", How::DoubleSlab, "oak spruce birch jungle acacia dark_oak"},
    {126, "_slab", How::Slab, "oak spruce birch jungle acacia dark_oak"},
    {127, "cocoa", How::Data},
    {128, "sandstone_stairs", How::Stairs},
    {129, "emerald_ore"},
    {130, "ender_chest", How::Facing4},
    {131, "tripwire_hook", How::Data},
    {132, "tripwire", How::Data},
    {133, "emerald_block"},
    {134, "spruce_stairs", How::Stairs},
    {135, "birch_stairs", How::Stairs},
    {136, "jungle_stairs", How::Stairs},
    {137, "command_block", How::Facing6},
    {138, "beacon"},
    {139, "", How::Kinds, "cobblestone_wall mossy_cobblestone_wall"},
    {140, "flower_pot", How::Data},
    {141, "carrots", How::Age},
    {142, "potatoes", How::Age},
    {143, "oak_button", How::Data},
    {144, "skeleton_skull", How::Data},
    {145, "anvil", How::Data},
    {146, "trapped_chest", How::Facing4},
    {147, "light_weighted_pressure_plate", How::Power},
    {148, "heavy_weighted_pressure_plate", How::Power},
    {149, "comparator", How::Data},
    {150, "comparator", How::Data},
    {151, "daylight_detector", How::Power},
    {152, "redstone_block"},
    {153, "nether_quartz_ore"},
    {154, "hopper", How::Facing6},
    {155, "", How::Kinds,
     "quartz_block chiseled_quartz_block quartz_pillar quartz_pillar[axis=x] quartz_pillar[axis=z]"},
    {156, "quartz_stairs", How::Stairs},
    {157, "activator_rail", How::Rail},
    {158, "dropper", How::Facing6},
    {159, "_terracotta", How::Dyed},
    {160, "_stained_glass_pane", How::Dyed},
    {161, "_leaves", How::Woods4, "acacia dark_oak"},
    {162, "_log", How::Logs, "acacia dark_oak"},
    {163, "acacia_stairs", How::Stairs},
    {164, "dark_oak_stairs", How::Stairs},
    {165, "slime_block"},
    {166, "barrier"},
    {167, "iron_trapdoor", How::Trapdoor},
    {168, "", How::Kinds, "prismarine prismarine_bricks dark_prismarine"},
    {169, "sea_lantern"},
    {170, "hay_block", How::Pillar},
    {171, "_carpet", How::Dyed},
    {172, "terracotta"},
    {173, "coal_block"},
    {174, "packed_ice"},
    {175, "", How::DoublePlant, "sunflower lilac tall_grass large_fern rose_bush peony"},
    {176, "white_banner", How::Rotation},
    {177, "white_wall_banner", How::Facing4},
    {178, "daylight_detector", How::Power},
    {179, "", How::Kinds, "red_sandstone chiseled_red_sandstone cut_red_sandstone"},
    {180, "red_sandstone_stairs", How::Stairs},
    {181, "_slab", How::DoubleSlab, "red_sandstone"},
    {182, "_slab", How::Slab, "red_sandstone"},
    {183, "spruce_fence_gate", How::Gate},
    {184, "birch_fence_gate", How::Gate},
    {185, "jungle_fence_gate", How::Gate},
    {186, "dark_oak_fence_gate", How::Gate},
    {187, "acacia_fence_gate", How::Gate},
    {188, "spruce_fence"},
    {189, "birch_fence"},
    {190, "jungle_fence"},
    {191, "dark_oak_fence"},
    {192, "acacia_fence"},
    {193, "spruce_door", How::Door},
    {194, "birch_door", How::Door},
    {195, "jungle_door", How::Door},
    {196, "acacia_door", How::Door},
    {197, "dark_oak_door", How::Door},
    {198, "end_rod", How::Facing6},
    {199, "chorus_plant"},
    {200, "chorus_flower", How::Age},
    {201, "purpur_block"},
    {202, "purpur_pillar", How::Pillar},
    {203, "purpur_stairs", How::Stairs},
    {204, "_slab", How::DoubleSlab, "purpur"},
    {205, "_slab", How::Slab, "purpur"},
    {206, "end_stone_bricks"},
    {207, "beetroots", How::Age},
    {208, "dirt_path"},
    {209, "end_gateway"},
    {210, "repeating_command_block", How::Facing6},
    {211, "chain_command_block", How::Facing6},
    {212, "frosted_ice", How::Age},
    {213, "magma_block"},
    {214, "nether_wart_block"},
    {215, "red_nether_bricks"},
    {216, "bone_block", How::Pillar},
    {217, "structure_void"},
    {218, "observer", How::Facing6},
    {219, "white_shulker_box", How::Facing6},
    {220, "orange_shulker_box", How::Facing6},
    {221, "magenta_shulker_box", How::Facing6},
    {222, "light_blue_shulker_box", How::Facing6},
    {223, "yellow_shulker_box", How::Facing6},
    {224, "lime_shulker_box", How::Facing6},
    {225, "pink_shulker_box", How::Facing6},
    {226, "gray_shulker_box", How::Facing6},
    {227, "light_gray_shulker_box", How::Facing6},
    {228, "cyan_shulker_box", How::Facing6},
    {229, "purple_shulker_box", How::Facing6},
    {230, "blue_shulker_box", How::Facing6},
    {231, "brown_shulker_box", How::Facing6},
    {232, "green_shulker_box", How::Facing6},
    {233, "red_shulker_box", How::Facing6},
    {234, "black_shulker_box", How::Facing6},
    {235, "white_glazed_terracotta", How::Horizontal},
    {236, "orange_glazed_terracotta", How::Horizontal},
    {237, "magenta_glazed_terracotta", How::Horizontal},
    {238, "light_blue_glazed_terracotta", How::Horizontal},
    {239, "yellow_glazed_terracotta", How::Horizontal},
    {240, "lime_glazed_terracotta", How::Horizontal},
    {241, "pink_glazed_terracotta", How::Horizontal},
    {242, "gray_glazed_terracotta", How::Horizontal},
    {243, "light_gray_glazed_terracotta", How::Horizontal},
    {244, "cyan_glazed_terracotta", How::Horizontal},
    {245, "purple_glazed_terracotta", How::Horizontal},
    {246, "blue_glazed_terracotta", How::Horizontal},
    {247, "brown_glazed_terracotta", How::Horizontal},
    {248, "green_glazed_terracotta", How::Horizontal},
    {249, "red_glazed_terracotta", How::Horizontal},
    {250, "black_glazed_terracotta", How::Horizontal},
    {251, "_concrete", How::Dyed},
    {252, "_concrete_powder", How::Dyed},
    {255, "structure_block", How::Data},
};

constexpr std::string_view kLegacyWoods = "oak spruce birch jungle acacia dark_oak";
constexpr std::string_view kLegacyDyes =
    "white orange magenta light_blue yellow lime pink gray light_gray cyan purple blue brown green red black";

/// Returns the i-th word of a text, or the first one if there are fewer.
std::string word(std::string_view words, int i) {
  std::string_view rest = words;
  for (; i > 0; --i) {
    const std::size_t space = rest.find(' ');
    if (space == std::string_view::npos) return word(words, 0);
    rest.remove_prefix(space + 1);
  }
  return std::string(rest.substr(0, rest.find(' ')));
}

using Properties = std::vector<Property>;

Property facing(std::string_view words, int i) {
  return {"facing", word(words, i)};
}

constexpr std::string_view kSixFaces = "down up north south west east";
constexpr std::string_view kRound = "south west north east";
constexpr std::string_view kStairsFaces = "east west south north";
constexpr std::string_view kRailShapes =
    "north_south east_west ascending_east ascending_west ascending_north ascending_south south_east south_west "
    "north_west north_east";

std::string truth(bool is_true) {
  return is_true ? "true" : "false";
}

void add_torch(int data, std::string& name, Properties& properties) {
  if (data < 1 || data > 4) return;
  const std::size_t at = name.find("torch");
  name.insert(at, "wall_");
  properties.push_back(facing(kStairsFaces, data - 1));
}

/// Adds the rotation and height stored in the data bits.
void add_turn(How how, int data, std::string& name, Properties& properties) {
  switch (how) {
    case How::Logs:
    case How::Pillar:
      if (data >> 2 == 3) {
        if (how == How::Logs) name.replace(name.size() - 3, 3, "wood");
        return;
      }
      properties.emplace_back("axis", word("y x z", data >> 2));
      return;
    case How::Slab:
      properties.emplace_back("type", (data & 8) != 0 ? "top" : "bottom");
      return;
    case How::DoubleSlab:
      properties.emplace_back("type", "double");
      return;
    case How::Stairs:
      properties.push_back(facing(kStairsFaces, data & 3));
      properties.emplace_back("half", (data & 4) != 0 ? "top" : "bottom");
      return;
    case How::Facing4:
    case How::LitFacing4:
      properties.push_back(facing(kSixFaces, std::clamp(data, 2, 5)));
      return;
    case How::Facing6:
      properties.push_back(facing(kSixFaces, std::min(data & 7, 5)));
      return;
    case How::Piston:
      properties.push_back(facing(kSixFaces, std::min(data & 7, 5)));
      properties.emplace_back("extended", truth((data & 8) != 0));
      return;
    case How::Horizontal:
      properties.push_back(facing(kRound, data & 3));
      return;
    case How::Gate:
      properties.push_back(facing(kRound, data & 3));
      properties.emplace_back("open", truth((data & 4) != 0));
      return;
    case How::Bed:
      properties.push_back(facing(kRound, data & 3));
      properties.emplace_back("part", (data & 8) != 0 ? "head" : "foot");
      return;
    case How::Repeater:
      properties.push_back(facing(kRound, data & 3));
      properties.emplace_back("delay", std::to_string((data >> 2) + 1));
      return;
    case How::Torch:
    case How::LitTorch:
      add_torch(data, name, properties);
      return;
    case How::Rail:
      properties.emplace_back("shape", word(kRailShapes, name == "rail" ? data : data & 7));
      return;
    case How::Door:
      properties.emplace_back("half", (data & 8) != 0 ? "upper" : "lower");
      if ((data & 8) != 0) return;
      properties.push_back(facing("east south west north", data & 3));
      properties.emplace_back("open", truth((data & 4) != 0));
      return;
    case How::Trapdoor:
      properties.push_back(facing("north south west east", data & 3));
      properties.emplace_back("open", truth((data & 4) != 0));
      properties.emplace_back("half", (data & 8) != 0 ? "top" : "bottom");
      return;
    case How::DoublePlant:
      properties.emplace_back("half", (data & 8) != 0 ? "upper" : "lower");
      return;
    case How::Portal:
      properties.emplace_back("axis", data == 2 ? "z" : "x");
      return;
    default:
      return;
  }
}

/// Adds the number stored in the data bits.
void add_number(How how, int data, Properties& properties) {
  const auto put = [&](const char* key, int number) { properties.emplace_back(key, std::to_string(number)); };
  switch (how) {
    case How::Layers:
      return put("layers", (data & 7) + 1);
    case How::Level:
      return put("level", data);
    case How::Age:
      return put("age", data);
    case How::Power:
      return put("power", data);
    case How::Rotation:
      return put("rotation", data);
    case How::Moisture:
      return put("moisture", data);
    case How::Bites:
      return put("bites", data);
    case How::Data:
      return put("data", data);
    case How::Powered:
      properties.emplace_back("powered", truth(data != 0));
      return;
    case How::Lit:
    case How::LitFacing4:
    case How::LitTorch:
      properties.emplace_back("lit", "true");
      return;
    default:
      return;
  }
}

std::string name_of(const Legacy& block, int data) {
  std::string end(block.name);
  switch (block.how) {
    case How::Kinds:
      return word(block.kinds, data);
    case How::Woods8:
      return word(kLegacyWoods, data & 7) + end;
    case How::Woods4:
    case How::Logs:
      return word(block.kinds, data & 3) + end;
    case How::Dyed:
      return word(kLegacyDyes, data) + end;
    case How::Slab:
    case How::DoubleSlab:
    case How::DoublePlant:
      return word(block.kinds, data & 7) + end;
    default:
      return end;
  }
}

}  // namespace

std::pair<std::string, Properties> legacy_block(int id, int data) {
  QUOIN_ASSERT(id >= 0 && id < 4096 && data >= 0 && data < 16, "0 <= id < 4096, 0 <= data < 16");
  if (id == 0) return {"minecraft:air", {}};
  const auto found = std::ranges::lower_bound(kLegacy, id, {}, &Legacy::id);
  if (found == std::end(kLegacy) || found->id != id) {
    return {"legacy:" + std::to_string(id), {{"data", std::to_string(data)}}};
  }
  Properties properties;
  std::string name = name_of(*found, data);
  if (auto block = parse_block(name); block && !block->properties.empty()) {  // a kind with an orientation
    return {"minecraft:" + block->name, std::move(block->properties)};
  }
  add_turn(found->how, data, name, properties);
  add_number(found->how, data, properties);
  return {"minecraft:" + name, std::move(properties)};
}

}  // namespace quoin::minecraft
