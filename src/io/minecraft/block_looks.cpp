#include "io/minecraft/block_looks.h"

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <string>
#include <utility>

// One table, sorted by kind, and rules for names that it lacks. Splitting it would not shorten it, and would make it
// harder to search.

namespace quoin::minecraft {

namespace {

/// The visual kind of a block.
enum class Kind : std::uint8_t {
  Air,
  Invisible,  // invisible, but a block in the game
  Solid,
  Plant,   // thin leaves and stalks without collision: mostly air
  Thin,    // rails, plates and the like: mostly air
  Glass,   // clear except for its colour
  Liquid,  // water
  Clear,   // ice, slime
  Glow,    // solid, and emits light
  Flame,   // emits light, without collision
  Lamp,    // emits light if its state "lit" is true
  Grass,   // solid, tinted by the biome's grass
  Leaves,  // solid, tinted by the biome's foliage
  Herb,    // a plant tinted by the biome's grass
  Vine,    // a plant tinted by the biome's foliage
};

struct Entry {
  std::string_view name;
  std::uint32_t rgb;
  Kind kind = Kind::Solid;
};

using K = Kind;

// Mean colours of the game's textures, rounded by eye; sorted at first use.
constexpr Entry kBlocks[] = {
    {"air", 0, K::Air},
    {"cave_air", 0, K::Air},
    {"void_air", 0, K::Air},
    {"structure_void", 0, K::Invisible},
    {"light", 0, K::Invisible},
    {"barrier", 0, K::Invisible},
    // Stone.
    {"stone", 0x7D7D7D},
    {"smooth_stone", 0x9E9E9E},
    {"granite", 0x956755},
    {"diorite", 0xBCBCBD},
    {"andesite", 0x888888},
    {"cobblestone", 0x7F7F7F},
    {"mossy_cobblestone", 0x6E775E},
    {"bedrock", 0x555555},
    {"stone_bricks", 0x7A7A7A},
    {"mossy_stone_bricks", 0x737969},
    {"cracked_stone_bricks", 0x767676},
    {"chiseled_stone_bricks", 0x777777},
    {"deepslate", 0x505053},
    {"cobbled_deepslate", 0x4D4D51},
    {"polished_deepslate", 0x48494A},
    {"deepslate_bricks", 0x464747},
    {"cracked_deepslate_bricks", 0x414141},
    {"deepslate_tiles", 0x363637},
    {"cracked_deepslate_tiles", 0x343435},
    {"chiseled_deepslate", 0x363637},
    {"reinforced_deepslate", 0x66695F},
    {"tuff", 0x6C6D67},
    {"polished_tuff", 0x616964},
    {"tuff_bricks", 0x62675F},
    {"chiseled_tuff", 0x595E57},
    {"chiseled_tuff_bricks", 0x636861},
    {"calcite", 0xDFE0DC},
    {"dripstone_block", 0x866B5C},
    {"pointed_dripstone", 0x816759, K::Thin},
    {"basalt", 0x4C4C52},
    {"polished_basalt", 0x5F5F62},
    {"smooth_basalt", 0x48484E},
    {"blackstone", 0x2A2329},
    {"gilded_blackstone", 0x382B26},
    {"polished_blackstone", 0x353138},
    {"polished_blackstone_bricks", 0x302B32},
    {"cracked_polished_blackstone_bricks", 0x2C262C},
    {"chiseled_polished_blackstone", 0x363139},
    {"obsidian", 0x0F0B19},
    {"crying_obsidian", 0x200A3C, K::Glow},
    {"end_stone", 0xDBDE9E},
    {"end_stone_bricks", 0xDADFA2},
    {"purpur_block", 0xA97DA9},
    {"purpur_pillar", 0xAB81AB},
    {"netherrack", 0x612626},
    {"nether_bricks", 0x2C151A},
    {"cracked_nether_bricks", 0x28141B},
    {"chiseled_nether_bricks", 0x2F171C},
    {"red_nether_bricks", 0x450709},
    {"quartz_block", 0xEBE5DE},
    {"smooth_quartz", 0xECE6DF},
    {"quartz_bricks", 0xEAE5DD},
    {"quartz_pillar", 0xEBE6E0},
    {"chiseled_quartz_block", 0xE7E2DA},
    {"prismarine", 0x639C97},
    {"prismarine_bricks", 0x63AC9E},
    {"dark_prismarine", 0x335B4B},
    {"sandstone", 0xD8CB9B},
    {"cut_sandstone", 0xD9CE9F},
    {"smooth_sandstone", 0xDFD6AA},
    {"chiseled_sandstone", 0xD8CA9B},
    {"red_sandstone", 0xBA631D},
    {"cut_red_sandstone", 0xBD6620},
    {"smooth_red_sandstone", 0xB5621F},
    {"chiseled_red_sandstone", 0xB7601B},
    {"bricks", 0x966153},
    {"terracotta", 0x985E43},
    {"resin_block", 0xD9641A},
    {"resin_bricks", 0xCE5919},
    {"resin_clump", 0xD9641A, K::Thin},
    // Ground.
    {"grass_block", 0xB8B8B8, K::Grass},
    {"dirt", 0x866043},
    {"coarse_dirt", 0x77553B},
    {"rooted_dirt", 0x90674C},
    {"podzol", 0x5B3F18},
    {"mycelium", 0x6F6365},
    {"dirt_path", 0x947A41},
    {"farmland", 0x8F6746},
    {"mud", 0x3C393D},
    {"packed_mud", 0x8E6A4F},
    {"mud_bricks", 0x896750},
    {"muddy_mangrove_roots", 0x463B2D},
    {"clay", 0xA0A6B3},
    {"gravel", 0x837F7E},
    {"sand", 0xDBCFA3},
    {"suspicious_sand", 0xD9CB9F},
    {"suspicious_gravel", 0x817D7B},
    {"red_sand", 0xBE6621},
    {"soul_sand", 0x513E32},
    {"soul_soil", 0x4B392E},
    {"magma_block", 0xC2601F, K::Glow},
    {"crimson_nylium", 0x831F1F},
    {"warped_nylium", 0x2B7265},
    {"snow_block", 0xF9FEFE},
    {"powder_snow", 0xF8FDFD},
    {"ice", 0x91B7FD, K::Clear},
    {"frosted_ice", 0x8CB5FC, K::Clear},
    {"packed_ice", 0x8DB4FA},
    {"blue_ice", 0x74A7FD},
    {"water", 0xFFFFFF, K::Liquid},
    {"bubble_column", 0xFFFFFF, K::Liquid},
    {"lava", 0xE0661A, K::Glow},
    {"moss_block", 0x596D2D},
    {"moss_carpet", 0x596D2D, K::Thin},
    {"pale_moss_block", 0x6B7069},
    {"pale_moss_carpet", 0x6B7069, K::Thin},
    {"pale_hanging_moss", 0x666B64, K::Plant},
    {"sculk", 0x0C1D24},
    {"sculk_vein", 0x07282F, K::Thin},
    {"sculk_catalyst", 0x0F1F26, K::Glow},
    {"sculk_sensor", 0x074654},
    {"calibrated_sculk_sensor", 0x1C4D62},
    {"sculk_shrieker", 0xC6CDA9},
    // Ores and metals.
    {"coal_ore", 0x696969},
    {"iron_ore", 0x88817A},
    {"copper_ore", 0x7C7D78},
    {"gold_ore", 0x918569},
    {"redstone_ore", 0x8C6D6D},
    {"emerald_ore", 0x6C8873},
    {"lapis_ore", 0x6B758D},
    {"diamond_ore", 0x798D8C},
    {"deepslate_coal_ore", 0x4A4A4C},
    {"deepslate_iron_ore", 0x6A635E},
    {"deepslate_copper_ore", 0x5C5D59},
    {"deepslate_gold_ore", 0x73664E},
    {"deepslate_redstone_ore", 0x684949},
    {"deepslate_emerald_ore", 0x4E6857},
    {"deepslate_lapis_ore", 0x4F5A73},
    {"deepslate_diamond_ore", 0x536A6A},
    {"nether_gold_ore", 0x73362A},
    {"nether_quartz_ore", 0x75413E},
    {"ancient_debris", 0x5F423A},
    {"coal_block", 0x101010},
    {"iron_block", 0xDCDCDC},
    {"raw_iron_block", 0xA6886B},
    {"gold_block", 0xF6D03D},
    {"raw_gold_block", 0xDDA92F},
    {"copper_block", 0xC06B4F},
    {"raw_copper_block", 0x9A6A4F},
    {"exposed_copper", 0xA17D67},
    {"weathered_copper", 0x6C996E},
    {"oxidized_copper", 0x52A284},
    {"cut_copper", 0xBF6A50},
    {"exposed_cut_copper", 0x9A7965},
    {"weathered_cut_copper", 0x6D916B},
    {"oxidized_cut_copper", 0x4F997E},
    {"copper_bulb", 0xC06B4F, K::Lamp},
    {"lapis_block", 0x1E438C},
    {"diamond_block", 0x62EDE4},
    {"emerald_block", 0x2ACB57},
    {"redstone_block", 0xAF1805},
    {"netherite_block", 0x423D3F},
    {"amethyst_block", 0x8561BF},
    {"budding_amethyst", 0x8460BA},
    {"amethyst_cluster", 0xA37ECF, K::Glow},
    {"large_amethyst_bud", 0xA17DCF, K::Glow},
    {"medium_amethyst_bud", 0x9E78CA, K::Thin},
    {"small_amethyst_bud", 0x8363C0, K::Thin},
    // Light.
    {"glowstone", 0xE8B867, K::Glow},
    {"sea_lantern", 0xCFE2DA, K::Glow},
    {"shroomlight", 0xF09246, K::Glow},
    {"jack_o_lantern", 0xD8941F, K::Glow},
    {"ochre_froglight", 0xFAF5CE, K::Glow},
    {"verdant_froglight", 0xE5F4E4, K::Glow},
    {"pearlescent_froglight", 0xF5F0EF, K::Glow},
    {"beacon", 0x76DDD7, K::Glow},
    {"conduit", 0xA08B71, K::Glow},
    {"end_rod", 0xE8DCC8, K::Glow},
    {"lantern", 0xE0A54B, K::Glow},
    {"soul_lantern", 0x6CC4C8, K::Glow},
    {"torch", 0xFFC861, K::Flame},
    {"wall_torch", 0xFFC861, K::Flame},
    {"soul_torch", 0x6CDFE3, K::Flame},
    {"soul_wall_torch", 0x6CDFE3, K::Flame},
    {"redstone_torch", 0xD8301A, K::Lamp},
    {"redstone_wall_torch", 0xD8301A, K::Lamp},
    {"fire", 0xF08A22, K::Flame},
    {"soul_fire", 0x38C5C9, K::Flame},
    {"glow_lichen", 0x708379, K::Plant},
    {"campfire", 0x93703F, K::Lamp},
    {"soul_campfire", 0x5E8B84, K::Lamp},
    {"redstone_lamp", 0xA8713C, K::Lamp},
    {"furnace", 0x6E6E6E, K::Lamp},
    {"blast_furnace", 0x5D5C5D, K::Lamp},
    {"smoker", 0x665D52, K::Lamp},
    {"nether_portal", 0x6A18C6, K::Flame},
    {"end_portal", 0x0B1726, K::Glow},
    {"end_gateway", 0x0B1726, K::Glow},
    {"end_portal_frame", 0x5C8263},
    {"respawn_anchor", 0x27173F},
    {"enchanting_table", 0x803D3D},
    {"ender_chest", 0x2B3D3F},
    // Plants.
    {"short_grass", 0xC0C0C0, K::Herb},
    {"grass", 0xC0C0C0, K::Herb},
    {"tall_grass", 0xB8B8B8, K::Herb},
    {"fern", 0xA8A8A8, K::Herb},
    {"large_fern", 0xA0A0A0, K::Herb},
    {"bush", 0xA8A8A8, K::Herb},
    {"sugar_cane", 0xC8D0B0, K::Herb},
    {"vine", 0xB0B0B0, K::Vine},
    {"oak_leaves", 0xA8A8A8, K::Leaves},
    {"jungle_leaves", 0xB0B0A8, K::Leaves},
    {"acacia_leaves", 0xA8A8A8, K::Leaves},
    {"dark_oak_leaves", 0x989898, K::Leaves},
    {"mangrove_leaves", 0xA0A0A0, K::Leaves},
    {"spruce_leaves", 0x40633F},
    {"birch_leaves", 0x5A7A3C},
    {"azalea_leaves", 0x5A7330},
    {"flowering_azalea_leaves", 0x6D6F45},
    {"cherry_leaves", 0xE5ADC2},
    {"pale_oak_leaves", 0x737A72},
    {"azalea", 0x667D30, K::Plant},
    {"flowering_azalea", 0x707A40, K::Plant},
    {"dead_bush", 0x6B4F29, K::Plant},
    {"dandelion", 0xF0D63A, K::Plant},
    {"torchflower", 0xE38A2F, K::Plant},
    {"poppy", 0xC92B22, K::Plant},
    {"blue_orchid", 0x2FA2D8, K::Plant},
    {"allium", 0xB06DD0, K::Plant},
    {"azure_bluet", 0xD5DCC0, K::Plant},
    {"red_tulip", 0xC73B20, K::Plant},
    {"orange_tulip", 0xD1812C, K::Plant},
    {"white_tulip", 0xDCE3DC, K::Plant},
    {"pink_tulip", 0xD9A6C3, K::Plant},
    {"oxeye_daisy", 0xD9DCC4, K::Plant},
    {"cornflower", 0x4F73D6, K::Plant},
    {"lily_of_the_valley", 0xD6DFD0, K::Plant},
    {"wither_rose", 0x29291F, K::Plant},
    {"sunflower", 0xE6B71E, K::Plant},
    {"lilac", 0x9B7D93, K::Plant},
    {"rose_bush", 0x8C3226, K::Plant},
    {"peony", 0xC28CBB, K::Plant},
    {"pink_petals", 0xF0B3D4, K::Plant},
    {"wildflowers", 0xE3C955, K::Plant},
    {"leaf_litter", 0x8A5B32, K::Plant},
    {"firefly_bush", 0x5C7A3A, K::Plant},
    {"open_eyeblossom", 0xB5B0A5, K::Plant},
    {"closed_eyeblossom", 0x77736C, K::Plant},
    {"cactus_flower", 0xD279A6, K::Plant},
    {"spore_blossom", 0xCF619D, K::Plant},
    {"brown_mushroom", 0x9A7455, K::Plant},
    {"red_mushroom", 0xD24A3E, K::Plant},
    {"crimson_fungus", 0x8D2C1D, K::Plant},
    {"warped_fungus", 0x4A6D57, K::Plant},
    {"crimson_roots", 0x7E082A, K::Plant},
    {"warped_roots", 0x148A7C, K::Plant},
    {"nether_sprouts", 0x139784, K::Plant},
    {"weeping_vines", 0x7B0000, K::Plant},
    {"weeping_vines_plant", 0x841012, K::Plant},
    {"twisting_vines", 0x14907C, K::Plant},
    {"twisting_vines_plant", 0x147F6E, K::Plant},
    {"cave_vines", 0x5A6D29, K::Plant},
    {"cave_vines_plant", 0x566529, K::Plant},
    {"hanging_roots", 0xA1735C, K::Plant},
    {"mangrove_roots", 0x4B3C27},
    {"mangrove_propagule", 0x60AE54, K::Plant},
    {"big_dripleaf", 0x708E34, K::Plant},
    {"big_dripleaf_stem", 0x5C732B, K::Plant},
    {"small_dripleaf", 0x5F782E, K::Plant},
    {"bamboo", 0x5D9023, K::Plant},
    {"cactus", 0x557F2B},
    {"lily_pad", 0x208030, K::Thin},
    {"kelp", 0x57822B, K::Plant},
    {"kelp_plant", 0x57812B, K::Plant},
    {"dried_kelp_block", 0x323B27},
    {"seagrass", 0x337F08, K::Plant},
    {"tall_seagrass", 0x3B8B0E, K::Plant},
    {"sea_pickle", 0x5A6128, K::Glow},
    {"sponge", 0xC4C04B},
    {"wet_sponge", 0xABB546},
    {"wheat", 0xA7973A, K::Plant},
    {"carrots", 0x528F26, K::Plant},
    {"potatoes", 0x549433, K::Plant},
    {"beetroots", 0x5D7A2D, K::Plant},
    {"torchflower_crop", 0x8A9A4A, K::Plant},
    {"pitcher_crop", 0x6A8A5A, K::Plant},
    {"pitcher_plant", 0x7CA0A8, K::Plant},
    {"melon_stem", 0x999999, K::Plant},
    {"pumpkin_stem", 0x9A9A9A, K::Plant},
    {"attached_melon_stem", 0x8E8E5E, K::Plant},
    {"attached_pumpkin_stem", 0x8E8E5E, K::Plant},
    {"sweet_berry_bush", 0x305F3A, K::Plant},
    {"cocoa", 0x8B5829, K::Plant},
    {"nether_wart", 0x6F1213, K::Plant},
    {"chorus_plant", 0x5E395E},
    {"chorus_flower", 0x977997},
    {"pumpkin", 0xC67618},
    {"carved_pumpkin", 0x965411},
    {"melon", 0x72921E},
    {"hay_block", 0xA68A26},
    {"brown_mushroom_block", 0x957051},
    {"red_mushroom_block", 0xC82F2D},
    {"mushroom_stem", 0xCBC4B9},
    {"nether_wart_block", 0x730302},
    {"warped_wart_block", 0x177778},
    {"bee_nest", 0xCBA13F},
    {"beehive", 0xB4915A},
    {"honeycomb_block", 0xE5941D},
    {"honey_block", 0xFBB935, K::Clear},
    {"slime_block", 0x70C05B, K::Clear},
    {"cobweb", 0xE4E9EA, K::Plant},
    {"bone_block", 0xE3DDC6},
    {"turtle_egg", 0xE4E3BF, K::Thin},
    {"sniffer_egg", 0x8A5B45, K::Thin},
    {"frogspawn", 0x6A5A52, K::Thin},
    {"tube_coral_block", 0x3157CF},
    {"brain_coral_block", 0xCF5B9F},
    {"bubble_coral_block", 0xA51AA2},
    {"fire_coral_block", 0xA3232E},
    {"horn_coral_block", 0xD8C842},
    {"tube_coral", 0x3157CF, K::Plant},
    {"brain_coral", 0xCF5B9F, K::Plant},
    {"bubble_coral", 0xA51AA2, K::Plant},
    {"fire_coral", 0xA3232E, K::Plant},
    {"horn_coral", 0xD8C842, K::Plant},
    // Things.
    {"glass", 0xE8F4F6, K::Glass},
    {"tinted_glass", 0x2C262E, K::Glass},
    {"chest", 0xA2762F},
    {"trapped_chest", 0xA2702F},
    {"barrel", 0x86643A},
    {"crafting_table", 0x806B44},
    {"cartography_table", 0x68573F},
    {"fletching_table", 0xC5B485},
    {"smithing_table", 0x393B47},
    {"loom", 0x8E775B},
    {"stonecutter", 0x7B7770},
    {"grindstone", 0x8C8C8C},
    {"composter", 0x70482A},
    {"lectern", 0xAD8A53},
    {"bookshelf", 0x75603D},
    {"chiseled_bookshelf", 0xB2914F},
    {"jukebox", 0x5D4030},
    {"note_block", 0x593A2A},
    {"tnt", 0xB5483A},
    {"spawner", 0x252F3E},
    {"trial_spawner", 0x3E4A5A},
    {"vault", 0x3B4951},
    {"cauldron", 0x4A494A},
    {"water_cauldron", 0x3F5C80},
    {"lava_cauldron", 0xC2601F, K::Glow},
    {"powder_snow_cauldron", 0xC0C4C4},
    {"anvil", 0x444444},
    {"chipped_anvil", 0x484848},
    {"damaged_anvil", 0x484848},
    {"bell", 0xFCE56B},
    {"brewing_stand", 0x7A654E, K::Thin},
    {"hopper", 0x494B4C},
    {"dispenser", 0x7A7979},
    {"dropper", 0x7A7979},
    {"crafter", 0x706263},
    {"observer", 0x646262},
    {"piston", 0x996F43},
    {"sticky_piston", 0x80784C},
    {"piston_head", 0x9A7A4E},
    {"moving_piston", 0x9A7A4E},
    {"lodestone", 0x929497},
    {"target", 0xE2AA9D},
    {"lightning_rod", 0xC46D52, K::Thin},
    {"decorated_pot", 0x7D4634},
    {"flower_pot", 0x7C4535, K::Thin},
    {"cake", 0xF8DEC8},
    {"scaffolding", 0xAA8349, K::Thin},
    {"ladder", 0x7C6036, K::Thin},
    {"iron_bars", 0x898B88, K::Thin},
    {"copper_bars", 0xC06B4F, K::Thin},
    {"chain", 0x333B4B, K::Thin},
    {"iron_chain", 0x333B4B, K::Thin},
    {"copper_chain", 0xC06B4F, K::Thin},
    {"copper_grate", 0xC06B4F, K::Thin},
    {"iron_door", 0xC2C2C1},
    {"iron_trapdoor", 0xCACACA},
    {"rail", 0x7E7058, K::Thin},
    {"powered_rail", 0x8A6D49, K::Thin},
    {"detector_rail", 0x7B6858, K::Thin},
    {"activator_rail", 0x735749, K::Thin},
    {"redstone_wire", 0xB01010, K::Thin},
    {"repeater", 0xA09D9C, K::Thin},
    {"comparator", 0xA6A2A0, K::Thin},
    {"lever", 0x6F5D43, K::Thin},
    {"tripwire", 0x818181, K::Thin},
    {"tripwire_hook", 0x8A7A60, K::Thin},
    {"daylight_detector", 0x82745E},
    {"heavy_weighted_pressure_plate", 0xDCDCDC, K::Thin},
    {"light_weighted_pressure_plate", 0xF6D03D, K::Thin},
    {"command_block", 0xB5866A},
    {"chain_command_block", 0x84A695},
    {"repeating_command_block", 0x8170AF},
    {"structure_block", 0x584A5A},
    {"jigsaw", 0x504552},
    {"dragon_egg", 0x0D0910},
    {"dragon_head", 0x1B1A1D},
    {"skeleton_skull", 0xB9B9B9},
    {"wither_skeleton_skull", 0x2F2F2F},
    {"zombie_head", 0x4A7A38},
    {"creeper_head", 0x5FA552},
    {"player_head", 0x9A6E52},
    {"piglin_head", 0xE2A279},
    {"heavy_core", 0x52565E},
    {"dried_ghast", 0xC8C4C2},
    {"creaking_heart", 0x5A4740},
};

struct Wood {
  std::string_view name;
  std::uint32_t planks;
  std::uint32_t bark;
  std::uint32_t inner;  // without its bark
  std::uint32_t sapling;
};
constexpr Wood kWoods[] = {
    {"dark_oak", 0x432B14, 0x3C2E1A, 0x604A30, 0x3D5A1F}, {"pale_oak", 0xE4DAD7, 0x574E4C, 0xEFE8E6, 0x6F746A},
    {"oak", 0xA2834F, 0x6D5533, 0xB19056, 0x4D6A28},      {"spruce", 0x735531, 0x3A2510, 0x745A34, 0x2D3C25},
    {"birch", 0xC0AF79, 0xD8D7D2, 0xC4B076, 0x7F9E4F},    {"jungle", 0xA07351, 0x554419, 0xAB8455, 0x305110},
    {"acacia", 0xA85A32, 0x676157, 0xAE5D3B, 0x767617},   {"mangrove", 0x763631, 0x54432A, 0x7A3730, 0x60AE54},
    {"cherry", 0xE2B3AC, 0x37212C, 0xDA9BA1, 0xDBA0C4},   {"bamboo", 0xC2AE51, 0x80903B, 0xC2AE51, 0x5D8A2C},
    {"crimson", 0x653147, 0x5D1A1E, 0x89395A, 0x8D2C1D},  {"warped", 0x2B6963, 0x3A3A4E, 0x3A8E8C, 0x4A6D57},
};

struct Dye {
  std::string_view name;
  std::uint32_t cloth;
  std::uint32_t concrete;
  std::uint32_t clay;
};
constexpr Dye kDyes[] = {
    {"light_blue", 0x3AAFD9, 0x2489C7, 0x716D8A}, {"light_gray", 0x8E8E87, 0x7D7D73, 0x876B62},
    {"white", 0xE9ECEC, 0xCFD5D6, 0xD1B2A1},      {"orange", 0xF07613, 0xE06101, 0xA15325},
    {"magenta", 0xBD44B3, 0xA9309F, 0x95586C},    {"yellow", 0xF8C627, 0xF1AF15, 0xBA8523},
    {"lime", 0x70B919, 0x5EA918, 0x677535},       {"pink", 0xED8DAC, 0xD6658F, 0xA14E4E},
    {"gray", 0x3E4447, 0x373A3E, 0x392A23},       {"silver", 0x8E8E87, 0x7D7D73, 0x876B62},
    {"cyan", 0x158991, 0x157788, 0x565B5B},       {"purple", 0x792AAC, 0x64209C, 0x764656},
    {"blue", 0x35399D, 0x2D2F8F, 0x4A3B5B},       {"brown", 0x724728, 0x603C20, 0x4D3323},
    {"green", 0x546D1B, 0x495B24, 0x4C532A},      {"red", 0xA12722, 0x8E2121, 0x8F3D2E},
    {"black", 0x141519, 0x080A0F, 0x251610},
};

// Suffixes of block shapes; longer ones first.
constexpr std::string_view kShapes[] = {
    "_wall_hanging_sign",
    "_hanging_sign",
    "_pressure_plate",
    "_double_slab",
    "_fence_gate",
    "_wall_sign",
    "_trapdoor",
    "_stairs",
    "_button",
    "_fence",
    "_slab",
    "_wall",
    "_door",
    "_sign",
    "_shelf",
    "_pane",
};

/// Returns true if a shape fills little of its voxel.
bool is_thin(std::string_view shape) {
  return shape == "_pressure_plate" || shape == "_button";
}

constexpr std::string_view kPrefixesWithoutLook[] = {"waxed_",  "infested_", "potted_",   "dead_",     "stripped_",
                                                     "smooth_", "cut_",      "chiseled_", "polished_", "cracked_"};

BlockLook look_of(std::uint32_t hex, Kind kind) {
  constexpr std::uint8_t kPlantAlpha = 90;
  constexpr std::uint8_t kThinAlpha = 110;
  constexpr std::uint8_t kGlassAlpha = 60;
  constexpr std::uint8_t kWaterAlpha = 150;
  constexpr std::uint8_t kIceAlpha = 190;
  BlockLook look;
  look.colour = colour_of_rgb(hex);
  switch (kind) {
    case Kind::Air:
    case Kind::Invisible:
      look.is_air = true;
      look.is_invisible = kind == Kind::Invisible;
      break;
    case Kind::Plant:
    case Kind::Herb:
    case Kind::Vine:
      look.colour.a = kPlantAlpha;
      look.collides = false;
      look.ior = 1.0F;
      look.tint = kind == Kind::Herb ? Tint::Grass : kind == Kind::Vine ? Tint::Foliage : Tint::None;
      break;
    case Kind::Thin:
      look.colour.a = kThinAlpha;
      look.ior = 1.0F;
      break;
    case Kind::Glass:
      look.colour.a = kGlassAlpha;
      look.roughness = 0.05F;
      break;
    case Kind::Liquid:
      look.colour.a = kWaterAlpha;
      look.collides = false;
      look.roughness = 0.05F;
      look.ior = 1.33F;
      look.light_cost = 1;
      look.tint = Tint::Water;
      break;
    case Kind::Clear:
      look.colour.a = kIceAlpha;
      look.roughness = 0.2F;
      look.ior = 1.31F;
      look.light_cost = 1;
      break;
    case Kind::Glow:
      look.emission = 1.0F;
      break;
    case Kind::Flame:
      look.colour.a = kThinAlpha;
      look.collides = false;
      look.ior = 1.0F;
      look.emission = 1.0F;
      break;
    case Kind::Grass:
    case Kind::Leaves:
      look.tint = kind == Kind::Grass ? Tint::Grass : Tint::Foliage;
      break;
    case Kind::Solid:
    case Kind::Lamp:
      break;
  }
  return look;
}

const Entry* find_entry(std::string_view name) {
  static const auto sorted = [] {
    std::array<Entry, std::size(kBlocks)> entries;
    std::ranges::copy(kBlocks, entries.begin());
    std::ranges::sort(entries, {}, &Entry::name);
    return entries;
  }();
  const auto found = std::ranges::lower_bound(sorted, name, {}, &Entry::name);
  return found != sorted.end() && found->name == name ? &*found : nullptr;
}

bool take_prefix(std::string_view& name, std::string_view prefix) {
  if (!name.starts_with(prefix) || name.size() == prefix.size()) return false;
  name.remove_prefix(prefix.size());
  return true;
}

std::optional<BlockLook> look_of_wood(std::string_view name) {
  const bool is_stripped = take_prefix(name, "stripped_");
  for (const Wood& wood : kWoods) {
    std::string_view rest = name;
    if (!take_prefix(rest, wood.name)) continue;
    if (rest == "_planks" || rest == "_mosaic") return look_of(wood.planks, Kind::Solid);
    if (rest == "_log" || rest == "_wood" || rest == "_stem" || rest == "_hyphae" || rest == "_block") {
      return look_of(is_stripped ? wood.inner : wood.bark, Kind::Solid);
    }
    if (rest == "_sapling") return look_of(wood.sapling, Kind::Plant);
    if (rest.empty()) return look_of(wood.planks, Kind::Solid);
  }
  return std::nullopt;
}

/// Returns the look of a dyed block: "red_wool".
std::optional<BlockLook> look_of_dyed(std::string_view name) {
  for (const Dye& dye : kDyes) {
    std::string_view rest = name;
    if (!take_prefix(rest, dye.name)) continue;
    if (rest == "_concrete" || rest == "_shulker_box") return look_of(dye.concrete, Kind::Solid);
    if (rest == "_terracotta") return look_of(dye.clay, Kind::Solid);
    if (rest == "_stained_glass" || rest == "_stained_glass_pane") {
      BlockLook look = look_of(dye.cloth, Kind::Glass);
      look.colour.a = 120;
      return look;
    }
    if (rest == "_carpet" || rest == "_candle" || rest == "_banner" || rest == "_wall_banner") {
      return look_of(dye.cloth, Kind::Thin);
    }
    if (rest == "_wool" || rest == "_concrete_powder" || rest == "_bed" || rest == "_glazed_terracotta" ||
        rest == "_candle_cake") {
      return look_of(dye.cloth, Kind::Solid);
    }
  }
  return std::nullopt;
}

bool is_no_material(Kind kind) {
  return kind == Kind::Air || kind == Kind::Invisible || kind == Kind::Plant || kind == Kind::Herb ||
         kind == Kind::Vine || kind == Kind::Flame;
}

/// Returns the entry of that name, or of a name that a shape's may stand for: "brick" for "brick_stairs".
std::optional<BlockLook> look_of_material(std::string_view name, bool is_of_shape) {
  for (const std::string_view ending : {"", "s", "_planks", "_block"}) {
    const std::string full = std::string(name) + std::string(ending);
    const Entry* const entry = find_entry(full);
    // No shape is made of a plant: "bamboo_stairs" are of the wood of that name.
    if (entry != nullptr && !(is_of_shape && is_no_material(entry->kind))) return look_of(entry->rgb, entry->kind);
    if (auto wood = look_of_wood(full)) return wood;
    if (auto dyed = look_of_dyed(full)) return dyed;
  }
  return std::nullopt;
}

BlockLook thinned(BlockLook look) {
  if (look.colour.a == 255) {
    look.colour.a = look_of(0, Kind::Thin).colour.a;
    look.ior = 1.0F;
  }
  return look;
}

std::optional<BlockLook> look_in_table(std::string_view name) {
  if (auto look = look_of_material(name, false)) return look;
  for (const std::string_view shape : kShapes) {
    if (!name.ends_with(shape) || name.size() == shape.size()) continue;
    if (auto look = look_of_material(name.substr(0, name.size() - shape.size()), true)) {
      return is_thin(shape) ? thinned(*look) : *look;
    }
  }
  for (const std::string_view prefix : kPrefixesWithoutLook) {
    std::string_view rest = name;
    if (!take_prefix(rest, prefix)) continue;
    if (auto look = look_in_table(rest)) return look;
  }
  return std::nullopt;
}

// The looks implied by words in a name, the most reliable first.
constexpr Entry kWords[] = {
    {"water", 0xFFFFFF, K::Liquid},
    {"lava", 0xE0661A, K::Glow},
    {"leaves", 0xA8A8A8, K::Leaves},
    {"sapling", 0x4D6A28, K::Plant},
    {"flower", 0xC9879F, K::Plant},
    {"mushroom", 0x9A7455, K::Plant},
    {"fungus", 0x8D5C4D, K::Plant},
    {"vine", 0xB0B0B0, K::Vine},
    {"roots", 0x7A5C44, K::Plant},
    {"kelp", 0x57822B, K::Plant},
    {"coral", 0xCF5B9F},
    {"seagrass", 0x337F08, K::Plant},
    {"crop", 0x7A973A, K::Plant},
    {"bush", 0x4D6A28, K::Plant},
    {"moss", 0x596D2D},
    {"grass", 0xB0B0B0, K::Herb},
    {"fern", 0xA8A8A8, K::Herb},
    {"plant", 0x4D7A28, K::Plant},
    {"torch", 0xFFC861, K::Flame},
    {"fire", 0xF08A22, K::Flame},
    {"lantern", 0xE0A54B, K::Glow},
    {"lamp", 0xE8C88A, K::Glow},
    {"glow", 0xE8C88A, K::Glow},
    {"light", 0xF0E6C8, K::Glow},
    {"glass", 0xE8F4F6, K::Glass},
    {"ice", 0x91B7FD, K::Clear},
    {"snow", 0xF9FEFE},
    {"planks", 0xA2834F},
    {"log", 0x6D5533},
    {"wood", 0x8A6B40},
    {"bark", 0x6D5533},
    {"trunk", 0x6D5533},
    {"tree", 0x6D5533},
    {"bamboo", 0xC2AE51},
    {"thatch", 0xA68A26},
    {"straw", 0xA68A26},
    {"hay", 0xA68A26},
    {"wool", 0xE9ECEC},
    {"carpet", 0xE9ECEC, K::Thin},
    {"bed", 0xA12722},
    {"banner", 0xE9ECEC, K::Thin},
    {"concrete", 0xB0B4B5},
    {"terracotta", 0x985E43},
    {"clay", 0xA0A6B3},
    {"sandstone", 0xD8CB9B},
    {"sand", 0xDBCFA3},
    {"gravel", 0x837F7E},
    {"dirt", 0x866043},
    {"soil", 0x866043},
    {"mud", 0x5C4A3D},
    {"peat", 0x4A3728},
    {"ore", 0x88817A},
    {"cobble", 0x7F7F7F},
    {"brick", 0x966153},
    {"tile", 0x8A8A8A},
    {"marble", 0xE2E2E2},
    {"limestone", 0xC9C3AE},
    {"slate", 0x505053},
    {"granite", 0x956755},
    {"basalt", 0x4C4C52},
    {"quartz", 0xEBE5DE},
    {"obsidian", 0x0F0B19},
    {"stone", 0x7D7D7D},
    {"rock", 0x7D7D7D},
    {"prismarine", 0x639C97},
    {"purpur", 0xA97DA9},
    {"copper", 0xC06B4F},
    {"bronze", 0xB07A45},
    {"brass", 0xC9A646},
    {"gold", 0xF6D03D},
    {"silver", 0xD0D4D8},
    {"steel", 0x8C9096},
    {"iron", 0xDCDCDC},
    {"metal", 0x9A9CA0},
    {"diamond", 0x62EDE4},
    {"emerald", 0x2ACB57},
    {"ruby", 0xC01F3C},
    {"sapphire", 0x2340B8},
    {"amethyst", 0x8561BF},
    {"crystal", 0xBFD9F2, K::Clear},
    {"rail", 0x7E7058, K::Thin},
    {"redstone", 0xAF1805},
    {"chest", 0xA2762F},
    {"barrel", 0x86643A},
    {"bookshelf", 0x75603D},
    {"shelf", 0x8A6B40},
    {"fence", 0xA2834F},
    {"door", 0xA2834F},
    {"sign", 0xA2834F},
    {"ladder", 0x7C6036, K::Thin},
    {"button", 0x8A8A8A, K::Thin},
    {"plate", 0x8A8A8A, K::Thin},
    {"pipe", 0x8C9096, K::Thin},
    {"cable", 0x404040, K::Thin},
    {"machine", 0x8C9096},
    {"furnace", 0x6E6E6E},
    {"skull", 0xB9B9B9},
    {"head", 0x9A6E52},
    {"bone", 0xE3DDC6},
    {"candle", 0xE8D9B0, K::Thin},
    {"pot", 0x7C4535, K::Thin},
    {"air", 0, K::Air},
};

}  // namespace

bool has_word(std::string_view name, std::string_view word) {
  for (std::size_t at = name.find(word); at != std::string_view::npos; at = name.find(word, at + 1)) {
    const bool begins = at == 0 || name[at - 1] == '_' || name[at - 1] == '/';
    const std::size_t end = at + word.size();
    const bool ends = end == name.size() || name[end] == '_' || name[end] == '/' || name.substr(end) == "s";
    if (begins && ends) return true;
  }
  return false;
}

namespace {

std::optional<BlockLook> look_by_words(std::string_view name) {
  std::optional<BlockLook> look;
  for (const Wood& wood : kWoods) {
    if (has_word(name, wood.name) && !has_word(name, "leaves")) {
      const bool is_bark = has_word(name, "log") || has_word(name, "wood") || has_word(name, "stem");
      look = look_of(is_bark ? wood.bark : wood.planks, Kind::Solid);
      break;
    }
  }
  if (!look) {
    const auto found = std::ranges::find_if(kWords, [&](const Entry& each) { return has_word(name, each.name); });
    if (found != std::end(kWords)) look = look_of(found->rgb, found->kind);
  }
  for (const Dye& dye : kDyes) {
    if (!has_word(name, dye.name)) continue;
    const Rgba8 colour = colour_of_rgb(dye.cloth);
    if (!look) return look_of(dye.cloth, Kind::Solid);
    if (look->tint == Tint::None && !look->is_air) {
      look->colour = {colour.r, colour.g, colour.b, look->colour.a};
    }
    break;
  }
  return look;
}

/// Returns a grey that depends on the name.
BlockLook look_of_nothing(std::string_view name) {
  std::uint32_t hash = 2166136261U;
  for (const char c : name) hash = (hash ^ static_cast<std::uint8_t>(c)) * 16777619U;
  hash ^= hash >> 15;
  const std::uint32_t grey = 0x60 + (hash & 0x3FU);
  const auto part = [&](unsigned shift) { return grey + (hash >> shift & 0x1FU); };
  return look_of(part(8) << 16 | part(14) << 8 | part(20), Kind::Solid);
}

bool is_lamp(std::string_view name) {
  const Entry* const entry = find_entry(name);
  return entry != nullptr ? entry->kind == Kind::Lamp : name.ends_with("candle") || name.ends_with("copper_bulb");
}

}  // namespace

BlockLook look_of_block(std::string_view name, bool is_lit, bool is_snowy) {
  constexpr std::string_view kNamespace = "minecraft:";
  const bool is_own = name.starts_with(kNamespace) || name.find(':') == std::string_view::npos;
  if (const std::size_t colon = name.find(':'); colon != std::string_view::npos) name.remove_prefix(colon + 1);
  BlockLook look;
  if (auto known = look_in_table(name)) {
    look = *known;
    look.knowledge = is_own ? Knowledge::Table : Knowledge::Words;
  } else if (auto guessed = look_by_words(name)) {
    look = *guessed;
    look.knowledge = Knowledge::Words;
  } else {
    look = look_of_nothing(name);
    look.knowledge = Knowledge::Nothing;
  }
  set_passage(name, look);
  if (is_lit && is_lamp(name)) look.emission = 1.0F;
  if (is_snowy) {
    look.colour = colour_of_rgb(0xF2F7F7);
    look.tint = Tint::None;
  }
  return look;
}

}  // namespace quoin::minecraft
