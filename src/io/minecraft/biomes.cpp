#include "io/minecraft/block_looks.h"

#include <algorithm>
#include <array>
#include <initializer_list>

namespace quoin::minecraft {

namespace {

struct Biome {
  std::string_view name;
  BiomeTints tints;
};

constexpr std::uint32_t kWater = 0x3F76E4;
constexpr std::uint32_t kColdWater = 0x3D57D6;
constexpr std::uint32_t kFrozenWater = 0x3938C9;

constexpr Biome kBiomes[] = {
    {"plains", {0x91BD59, 0x77AB2F, kWater}},
    {"sunflower_plains", {0x91BD59, 0x77AB2F, kWater}},
    {"beach", {0x91BD59, 0x77AB2F, kWater}},
    {"deep_dark", {0x91BD59, 0x77AB2F, kWater}},
    {"dripstone_caves", {0x91BD59, 0x77AB2F, kWater}},
    {"lush_caves", {0x8EB971, 0x71A74D, kWater}},
    {"snowy_plains", {0x80B497, 0x60A17B, kWater}},
    {"ice_spikes", {0x80B497, 0x60A17B, kWater}},
    {"snowy_taiga", {0x80B497, 0x60A17B, kColdWater}},
    {"snowy_beach", {0x83B593, 0x64A278, kColdWater}},
    {"snowy_slopes", {0x80B497, 0x60A17B, kWater}},
    {"frozen_peaks", {0x80B497, 0x60A17B, kWater}},
    {"jagged_peaks", {0x80B497, 0x60A17B, kWater}},
    {"grove", {0x80B497, 0x60A17B, kWater}},
    {"frozen_river", {0x80B497, 0x60A17B, kFrozenWater}},
    {"frozen_ocean", {0x80B497, 0x60A17B, kFrozenWater}},
    {"deep_frozen_ocean", {0x8EB971, 0x71A74D, kFrozenWater}},
    {"desert", {0xBFB755, 0xAEA42A, kWater}},
    {"savanna", {0xBFB755, 0xAEA42A, kWater}},
    {"savanna_plateau", {0xBFB755, 0xAEA42A, kWater}},
    {"windswept_savanna", {0xBFB755, 0xAEA42A, kWater}},
    {"nether_wastes", {0xBFB755, 0xAEA42A, kWater}},
    {"soul_sand_valley", {0xBFB755, 0xAEA42A, kWater}},
    {"crimson_forest", {0xBFB755, 0xAEA42A, kWater}},
    {"warped_forest", {0xBFB755, 0xAEA42A, kWater}},
    {"basalt_deltas", {0xBFB755, 0xAEA42A, kWater}},
    {"badlands", {0x90814D, 0x9E814D, kWater}},
    {"wooded_badlands", {0x90814D, 0x9E814D, kWater}},
    {"eroded_badlands", {0x90814D, 0x9E814D, kWater}},
    {"forest", {0x79C05A, 0x59AE30, kWater}},
    {"flower_forest", {0x79C05A, 0x59AE30, kWater}},
    {"dark_forest", {0x507A32, 0x59AE30, kWater}},
    {"pale_garden", {0x778272, 0x878D76, 0x76889D}},
    {"birch_forest", {0x88BB67, 0x6BA941, kWater}},
    {"old_growth_birch_forest", {0x88BB67, 0x6BA941, kWater}},
    {"taiga", {0x86B783, 0x68A464, kWater}},
    {"old_growth_spruce_taiga", {0x86B783, 0x68A464, kWater}},
    {"old_growth_pine_taiga", {0x86B87F, 0x68A55F, kWater}},
    {"jungle", {0x59C93C, 0x30BB0B, kWater}},
    {"bamboo_jungle", {0x59C93C, 0x30BB0B, kWater}},
    {"sparse_jungle", {0x64C73F, 0x3EB80F, kWater}},
    {"swamp", {0x6A7039, 0x6A7039, 0x617B64}},
    {"mangrove_swamp", {0x6A7039, 0x8DB127, 0x3A7A6A}},
    {"mushroom_fields", {0x55C93F, 0x2BBB0F, kWater}},
    {"windswept_hills", {0x8AB689, 0x6DA36B, kWater}},
    {"windswept_gravelly_hills", {0x8AB689, 0x6DA36B, kWater}},
    {"windswept_forest", {0x8AB689, 0x6DA36B, kWater}},
    {"stony_shore", {0x8AB689, 0x6DA36B, kWater}},
    {"stony_peaks", {0x9ABE4B, 0x82AC1E, kWater}},
    {"meadow", {0x83BB6D, 0x63A948, 0x0E4ECF}},
    {"cherry_grove", {0xB6DB61, 0xB6DB61, 0x5DB7EF}},
    {"river", {0x8EB971, 0x71A74D, kWater}},
    {"ocean", {0x8EB971, 0x71A74D, kWater}},
    {"deep_ocean", {0x8EB971, 0x71A74D, kWater}},
    {"warm_ocean", {0x8EB971, 0x71A74D, 0x43D5EE}},
    {"lukewarm_ocean", {0x8EB971, 0x71A74D, 0x45ADF2}},
    {"deep_lukewarm_ocean", {0x8EB971, 0x71A74D, 0x45ADF2}},
    {"cold_ocean", {0x8EB971, 0x71A74D, kColdWater}},
    {"deep_cold_ocean", {0x8EB971, 0x71A74D, kColdWater}},
    {"the_end", {0x8EB971, 0x71A74D, kWater}},
    {"end_highlands", {0x8EB971, 0x71A74D, kWater}},
    {"end_midlands", {0x8EB971, 0x71A74D, kWater}},
    {"small_end_islands", {0x8EB971, 0x71A74D, kWater}},
    {"end_barrens", {0x8EB971, 0x71A74D, kWater}},
    {"the_void", {0x8EB971, 0x71A74D, kWater}},
};

// Biome names before 1.18, mapped to their present names.
struct Renamed {
  std::string_view before;
  std::string_view now;
};
constexpr Renamed kRenamed[] = {
    {"mountains", "windswept_hills"},
    {"gravelly_mountains", "windswept_gravelly_hills"},
    {"modified_gravelly_mountains", "windswept_gravelly_hills"},
    {"mountain_edge", "windswept_hills"},
    {"wooded_mountains", "windswept_forest"},
    {"wooded_hills", "forest"},
    {"desert_hills", "desert"},
    {"desert_lakes", "desert"},
    {"taiga_hills", "taiga"},
    {"taiga_mountains", "taiga"},
    {"giant_tree_taiga", "old_growth_pine_taiga"},
    {"giant_tree_taiga_hills", "old_growth_pine_taiga"},
    {"giant_spruce_taiga", "old_growth_spruce_taiga"},
    {"giant_spruce_taiga_hills", "old_growth_spruce_taiga"},
    {"snowy_tundra", "snowy_plains"},
    {"snowy_mountains", "snowy_plains"},
    {"snowy_taiga_hills", "snowy_taiga"},
    {"snowy_taiga_mountains", "snowy_taiga"},
    {"jungle_hills", "jungle"},
    {"jungle_edge", "sparse_jungle"},
    {"modified_jungle", "jungle"},
    {"modified_jungle_edge", "sparse_jungle"},
    {"bamboo_jungle_hills", "bamboo_jungle"},
    {"birch_forest_hills", "birch_forest"},
    {"tall_birch_forest", "old_growth_birch_forest"},
    {"tall_birch_hills", "old_growth_birch_forest"},
    {"dark_forest_hills", "dark_forest"},
    {"swamp_hills", "swamp"},
    {"shattered_savanna", "windswept_savanna"},
    {"shattered_savanna_plateau", "windswept_savanna"},
    {"wooded_badlands_plateau", "wooded_badlands"},
    {"badlands_plateau", "badlands"},
    {"modified_badlands_plateau", "badlands"},
    {"modified_wooded_badlands_plateau", "wooded_badlands"},
    {"stone_shore", "stony_shore"},
    {"mushroom_field_shore", "mushroom_fields"},
    {"nether", "nether_wastes"},
};

struct Numbered {
  std::int64_t number;
  std::string_view name;
};
constexpr Numbered kNumbers[] = {
    {0, "ocean"},
    {1, "plains"},
    {2, "desert"},
    {3, "mountains"},
    {4, "forest"},
    {5, "taiga"},
    {6, "swamp"},
    {7, "river"},
    {8, "nether_wastes"},
    {9, "the_end"},
    {10, "frozen_ocean"},
    {11, "frozen_river"},
    {12, "snowy_tundra"},
    {13, "snowy_mountains"},
    {14, "mushroom_fields"},
    {15, "mushroom_field_shore"},
    {16, "beach"},
    {17, "desert_hills"},
    {18, "wooded_hills"},
    {19, "taiga_hills"},
    {20, "mountain_edge"},
    {21, "jungle"},
    {22, "jungle_hills"},
    {23, "jungle_edge"},
    {24, "deep_ocean"},
    {25, "stone_shore"},
    {26, "snowy_beach"},
    {27, "birch_forest"},
    {28, "birch_forest_hills"},
    {29, "dark_forest"},
    {30, "snowy_taiga"},
    {31, "snowy_taiga_hills"},
    {32, "giant_tree_taiga"},
    {33, "giant_tree_taiga_hills"},
    {34, "wooded_mountains"},
    {35, "savanna"},
    {36, "savanna_plateau"},
    {37, "badlands"},
    {38, "wooded_badlands_plateau"},
    {39, "badlands_plateau"},
    {40, "small_end_islands"},
    {41, "end_midlands"},
    {42, "end_highlands"},
    {43, "end_barrens"},
    {44, "warm_ocean"},
    {45, "lukewarm_ocean"},
    {46, "cold_ocean"},
    {47, "warm_ocean"},
    {48, "deep_lukewarm_ocean"},
    {49, "deep_cold_ocean"},
    {50, "deep_frozen_ocean"},
    {127, "the_void"},
    {129, "sunflower_plains"},
    {130, "desert_lakes"},
    {131, "gravelly_mountains"},
    {132, "flower_forest"},
    {133, "taiga_mountains"},
    {134, "swamp_hills"},
    {140, "ice_spikes"},
    {149, "modified_jungle"},
    {151, "modified_jungle_edge"},
    {155, "tall_birch_forest"},
    {156, "tall_birch_hills"},
    {157, "dark_forest_hills"},
    {158, "snowy_taiga_mountains"},
    {160, "giant_spruce_taiga"},
    {161, "giant_spruce_taiga_hills"},
    {162, "modified_gravelly_mountains"},
    {163, "shattered_savanna"},
    {164, "shattered_savanna_plateau"},
    {165, "eroded_badlands"},
    {166, "modified_wooded_badlands_plateau"},
    {167, "modified_badlands_plateau"},
    {168, "bamboo_jungle"},
    {169, "bamboo_jungle_hills"},
    {170, "soul_sand_valley"},
    {171, "crimson_forest"},
    {172, "warped_forest"},
    {173, "basalt_deltas"},
    {174, "dripstone_caves"},
    {175, "lush_caves"},
};

}  // namespace

BiomeTints tints_of_biome(std::string_view name) {
  if (const std::size_t colon = name.find(':'); colon != std::string_view::npos) name.remove_prefix(colon + 1);
  if (const auto renamed = std::ranges::find(kRenamed, name, &Renamed::before); renamed != std::end(kRenamed)) {
    name = renamed->now;
  }
  const auto found = std::ranges::find(kBiomes, name, &Biome::name);
  return found != std::end(kBiomes) ? found->tints : BiomeTints();
}

namespace {

struct ClimateOfTints {
  std::uint32_t grass;
  std::uint32_t foliage;
  Climate climate;
};

/// Temperature and downfall of the biomes with these colours. Source: the Minecraft Wiki, "Biome" and "Color"
/// (https://minecraft.wiki/w/Biome, https://minecraft.wiki/w/Color).
constexpr ClimateOfTints kClimates[] = {
    {0x91BD59, 0x77AB2F, {0.8F, 0.4F}},        // plains
    {0x8EB971, 0x71A74D, {0.5F, 0.5F}},        // river
    {0x80B497, 0x60A17B, {0.0F, 0.5F}},        // snowy plains
    {0x83B593, 0x64A278, {0.05F, 0.3F}},       // snowy beach
    {0xBFB755, 0xAEA42A, {1.0F, 0.0F}},        // desert: 2, clamped
    {0x79C05A, 0x59AE30, {0.7F, 0.8F}},        // forest
    {0x507A32, 0x59AE30, {0.7F, 0.8F, true}},  // dark forest
    {0x88BB67, 0x6BA941, {0.6F, 0.6F}},        // birch forest
    {0x86B783, 0x68A464, {0.25F, 0.8F}},       // taiga
    {0x86B87F, 0x68A55F, {0.3F, 0.8F}},        // old growth pine taiga
    {0x59C93C, 0x30BB0B, {0.95F, 0.9F}},       // jungle
    {0x64C73F, 0x3EB80F, {0.95F, 0.8F}},       // sparse jungle
    {0x55C93F, 0x2BBB0F, {0.9F, 1.0F}},        // mushroom fields
    {0x8AB689, 0x6DA36B, {0.2F, 0.3F}},        // windswept hills
    {0x9ABE4B, 0x82AC1E, {1.0F, 0.3F}},        // stony peaks
    {0x83BB6D, 0x63A948, {0.5F, 0.8F}},        // meadow
};

std::optional<Climate> climate_of(std::uint32_t rgb, std::uint32_t ClimateOfTints::*colour) {
  const auto found = std::ranges::find(kClimates, rgb, colour);
  return found == std::end(kClimates) ? std::nullopt : std::optional(found->climate);
}

}  // namespace

std::optional<Climate> climate_of_grass(std::uint32_t rgb) {
  return climate_of(rgb, &ClimateOfTints::grass);
}

std::optional<Climate> climate_of_foliage(std::uint32_t rgb) {
  return climate_of(rgb, &ClimateOfTints::foliage);
}

std::uint8_t index_of_tints(std::vector<BiomeTints>& all, const BiomeTints& tints) {
  constexpr std::size_t kMost = 255;
  const auto found = std::ranges::find(all, tints);
  if (found != all.end()) return static_cast<std::uint8_t>(found - all.begin());
  if (all.size() >= kMost) return 0;
  all.push_back(tints);
  return static_cast<std::uint8_t>(all.size() - 1);
}

std::string_view name_of_biome(std::int64_t number) {
  const auto found = std::ranges::find(kNumbers, number, &Numbered::number);
  return found != std::end(kNumbers) ? found->name : "plains";
}

std::uint32_t colour_of(Tint tint, const BiomeTints& biome) {
  if (tint == Tint::None) return 0xFFFFFF;
  return tint == Tint::Grass ? biome.grass : tint == Tint::Foliage ? biome.foliage : biome.water;
}

Rgba8 tinted_colour(Rgba8 colour, std::uint32_t tint) {
  const auto times = [tint](std::uint8_t part, int shift) {
    return static_cast<std::uint8_t>((part * (tint >> shift & 255U) + 127U) / 255U);
  };
  return {times(colour.r, 16), times(colour.g, 8), times(colour.b, 0), colour.a};
}

NamedTint tint_of_block(std::string_view name) {
  constexpr BiomeTints kPlains{};
  const auto has_any = [&](std::initializer_list<std::string_view> words) {
    return std::ranges::any_of(words, [&](std::string_view word) { return name.find(word) != std::string_view::npos; });
  };
  if (name == "spruce_leaves") return {0x619961};
  if (name == "birch_leaves") return {0x80A755};
  if (name == "lily_pad") return {0x208030};
  if (name.starts_with("attached_") && name.ends_with("_stem")) return {0xE0C71C};
  if (has_any({"water", "bubble_column"})) return {kPlains.water, Tint::Water};
  if (has_any({"leaves", "vine"})) return {kPlains.foliage, Tint::Foliage};
  if (has_any({"grass", "fern", "sugar_cane", "petals", "wildflowers", "bush"})) return {kPlains.grass, Tint::Grass};
  return {};
}

const StateTint* state_tint_of(std::string_view name) {
  static constexpr StateTint kWire{
      "power",
      [](int power) {
        constexpr std::array<int, 16> kGroups = {0, 1, 1, 4, 4, 4, 7, 7, 7, 10, 10, 10, 13, 13, 13, 15};
        return kGroups[static_cast<std::size_t>(std::clamp(power, 0, 15))];
      },
      [](int power) {
        const float share = static_cast<float>(power) / 15.0F;
        const auto byte = [](float unit) { return static_cast<std::uint8_t>(std::clamp(unit, 0.0F, 1.0F) * 255.0F); };
        return Rgba8{byte(share * 0.6F + (power > 0 ? 0.4F : 0.3F)), byte(share * share * 0.7F - 0.5F),
                     byte(share * share * 0.6F - 0.7F)};
      }};
  static constexpr StateTint kStem{"age", [](int age) { return std::clamp(age, 0, 7); },
                                   [](int age) {
                                     return Rgba8{static_cast<std::uint8_t>(age * 32),
                                                  static_cast<std::uint8_t>(255 - age * 8),
                                                  static_cast<std::uint8_t>(age * 4)};
                                   }};
  if (name == "redstone_wire") return &kWire;
  return name == "melon_stem" || name == "pumpkin_stem" ? &kStem : nullptr;
}

}  // namespace quoin::minecraft
