#include "io/minecraft/minecraft.h"

#include <gtest/gtest.h>

#include <quoin/io/file.h>
#include <quoin/io/formats.h>

#include "core/death_for_tests.h"
#include "io/minecraft/block_looks.h"
#include "io/minecraft/block_types.h"
#include "io/minecraft/minecraft_for_tests.h"
#include "io/minecraft/nbt.h"
#include "io/minecraft/region_file.h"
#include "io/minecraft/sections.h"

namespace quoin {

namespace {

namespace fs = std::filesystem;
using minecraft_test::chunk_of_stairs;
using minecraft_test::NbtWriter;
using minecraft_test::region_with;

fs::path shared_file(const std::string& name) {
  return fs::path(QUOIN_SOURCE_DIR).parent_path() / "shared" / "data" / "mc" / name;
}

TEST(Nbt, FindsValuesByName) {
  NbtWriter writer;
  writer.compound("").integer("a", -7).string("b", "text").list("c", 3, 2).number(5, 4).number(6, 4).end();
  const auto document = nbt::Document::parse(writer.bytes);
  ASSERT_TRUE(document);
  EXPECT_EQ(document->root()["a"].integer(), -7);
  EXPECT_EQ(document->root()["b"].text(), "text");
  EXPECT_EQ(document->root()["c"].count(), 2U);
  EXPECT_EQ(document->root()["c"].integer(1), 6);
  EXPECT_FALSE(document->root()["d"]["e"]);
}

TEST(Nbt, RefusesTruncationAnywhere) {
  const std::vector<std::byte> whole = chunk_of_stairs(0);
  ASSERT_TRUE(nbt::Document::parse(whole));
  for (std::size_t size = 0; size < whole.size(); size += size < 200 ? 1 : 97) {
    EXPECT_FALSE(nbt::Document::parse(std::span(whole).first(size))) << size;
  }
}

TEST(Nbt, RefusesDeepNesting) {
  NbtWriter writer;
  for (int i = 0; i < 600; ++i) writer.compound("");
  const auto document = nbt::Document::parse(writer.bytes);
  ASSERT_FALSE(document);
  EXPECT_EQ(document.error().code, ErrorCode::LimitExceeded);
}

TEST(BlockStates, RoundTrips) {
  const auto block = minecraft::block_state("minecraft:oak_stairs", {{"half", "top"}, {"facing", "east"}});
  EXPECT_EQ(block.name, "minecraft:oak_stairs");
  VoxelProperties type;
  type.name = block.name;
  type.attributes[minecraft::kStatesAttribute] = block.layout;
  EXPECT_EQ(to_string(minecraft::block_text(type, block.state)), "minecraft:oak_stairs[facing=east,half=top]");
}

TEST(BlockStates, PutsPropertiesWithoutBitsIntoName) {
  const auto block = minecraft::block_state("mod:thing", {{"kind", "strange"}, {"lit", "true"}});
  EXPECT_EQ(block.name, "mod:thing[kind=strange,lit=true]");
  EXPECT_EQ(block.bits, 0);
}

TEST(BlockLooks, DerivesShapesAndModsFromMaterials) {
  const auto colour = [](const char* name) { return minecraft::look_of_block(name, false, false).colour; };
  EXPECT_EQ(colour("minecraft:stone_brick_stairs"), colour("minecraft:stone_bricks"));
  EXPECT_EQ(colour("minecraft:oak_slab"), colour("minecraft:oak_planks"));
  EXPECT_EQ(colour("minecraft:waxed_exposed_cut_copper"), colour("minecraft:exposed_cut_copper"));
  EXPECT_EQ(minecraft::look_of_block("mod:palm_log", false, false).knowledge, minecraft::Knowledge::Words);
  EXPECT_EQ(minecraft::look_of_block("mod:xyzzy", false, false).knowledge, minecraft::Knowledge::Nothing);
}

TEST(BlockLooks, PassLightAsTheGame) {
  const auto passage = [](const char* name) {
    VoxelProperties type;
    minecraft::set_look(minecraft::look_of_block(name, false, false), type);
    const bool blocks = type.blocks_light.value_or(type.visibility == Visibility::Opaque);
    return blocks ? int{kMaxLightCost} : int{type.light_cost};
  };
  for (const char* name :
       {"stone", "oak_log", "sea_lantern", "packed_ice", "muddy_mangrove_roots", "oak_stairs", "tuff_slab",
        "tinted_glass", "piston_head", "chain_command_block", "mod:palm_log", "mod:xyzzy"}) {
    EXPECT_EQ(passage(name), kMaxLightCost) << name;
  }
  for (const char* name : {"water", "bubble_column", "oak_leaves", "spruce_leaves", "mod:palm_leaves", "ice", "cobweb",
                           "honey_block", "slime_block", "kelp", "lava", "red_shulker_box", "mangrove_roots"}) {
    EXPECT_EQ(passage(name), 1) << name;
  }
  for (const char* name : {"glass", "red_stained_glass", "torch", "poppy", "rail", "oak_fence", "stone_brick_wall",
                           "iron_door", "chest", "lantern", "red_bed", "potted_cactus", "mod:palm_fence"}) {
    EXPECT_EQ(passage(name), 0) << name;
  }
}

TEST(BlockLooks, HaveTheLightLevelsOfTheGame) {
  using minecraft::light_level_of_block;
  using Properties = std::vector<minecraft::Property>;
  const auto level = [](std::string_view name, const Properties& properties = {}) {
    return light_level_of_block(name, properties).value_or(-1);
  };
  EXPECT_EQ(level("torch"), 14);
  EXPECT_EQ(level("minecraft:lantern"), 15);
  EXPECT_EQ(level("soul_fire"), 10);
  EXPECT_EQ(level("magma_block"), 3);
  EXPECT_EQ(level("furnace", {{"facing", "east"}, {"lit", "true"}}), 13);
  EXPECT_EQ(level("furnace", {{"lit", "false"}}), 0);
  EXPECT_EQ(level("furnace"), 0);
  EXPECT_EQ(level("redstone_torch"), 7);
  EXPECT_EQ(level("redstone_torch", {{"lit", "false"}}), 0);
  for (int count = 1; count <= 4; ++count) {
    EXPECT_EQ(level("lime_candle", {{"candles", std::to_string(count)}, {"lit", "true"}}), 3 * count);
    EXPECT_EQ(level("sea_pickle", {{"pickles", std::to_string(count)}, {"waterlogged", "true"}}), 3 + 3 * count);
    constexpr std::array kCharges{0, 3, 7, 11, 15};
    EXPECT_EQ(level("respawn_anchor", {{"charges", std::to_string(count)}}), kCharges[static_cast<std::size_t>(count)]);
  }
  EXPECT_EQ(level("candle", {{"candles", "9"}, {"lit", "true"}}), 3) << "an unknown number";
  EXPECT_EQ(level("candle", {{"candles", "4"}, {"lit", "false"}}), 0);
  EXPECT_EQ(level("sea_pickle", {{"pickles", "4"}, {"waterlogged", "false"}}), 0);
  EXPECT_EQ(level("waxed_weathered_copper_bulb", {{"lit", "true"}}), 8);
  EXPECT_EQ(level("cave_vines_plant", {{"berries", "true"}}), 14);
  EXPECT_EQ(level("cave_vines_plant", {{"berries", "false"}}), 0);
  for (const char* name : {"stone", "mod:torch", "glow_berries_of_a_mod", ""}) EXPECT_EQ(level(name), -1) << name;
}

TEST(BlockLooks, EmitTheirLevelsAsPropagatedLight) {
  minecraft::BlockTypes blocks;
  const auto emission_of = [&](const char* name, const std::vector<minecraft::Property>& properties) {
    const auto block = blocks.block(name, properties);
    return blocks.types()[block.value().type].emission;
  };
  EXPECT_FLOAT_EQ(emission_of("minecraft:torch", {}), 14.0F / 15.0F);
  EXPECT_FLOAT_EQ(emission_of("minecraft:candle", {{"candles", "2"}, {"lit", "true"}}), 6.0F / 15.0F);
  EXPECT_FLOAT_EQ(emission_of("minecraft:candle", {{"candles", "3"}, {"lit", "true"}}), 9.0F / 15.0F);
  EXPECT_EQ(emission_of("minecraft:candle", {{"candles", "3"}, {"lit", "false"}}), 0.0F);
  EXPECT_EQ(emission_of("minecraft:glowstone", {}), 1.0F);
  EXPECT_EQ(emission_of("mod:glow_stone", {}), 1.0F) << "names that are not listed keep the rule of their words";
  EXPECT_EQ(emission_of("minecraft:stone", {}), 0.0F);
}

TEST(LegacyBlocks, MapsNumbersToModernNames) {
  EXPECT_EQ(minecraft::legacy_block(1, 3).first, "minecraft:diorite");
  EXPECT_EQ(minecraft::legacy_block(35, 14).first, "minecraft:red_wool");
  const auto log = minecraft::legacy_block(17, 5);
  EXPECT_EQ(log.first, "minecraft:spruce_log");
  EXPECT_EQ(log.second, (std::vector<minecraft::Property>{{"axis", "x"}}));
  EXPECT_EQ(minecraft::legacy_block(255 + 16, 0).first, "legacy:271");
}

TEST(MinecraftSource, PlacesBlocksLikeTheGame) {
  const auto source = minecraft::open_minecraft(region_with(chunk_of_stairs(-4), 5, 2));
  ASSERT_TRUE(source);
  ASSERT_EQ((*source)->parts().size(), 1U);
  std::vector<Error> broken;
  const auto chunk = (*source)->read({1, -1, 0}, &broken);
  ASSERT_TRUE(chunk && *chunk);
  EXPECT_TRUE(broken.empty());
  const VoxelRegistry types = (*source)->types();
  EXPECT_EQ((*chunk)->non_air_count(), 3);
  EXPECT_EQ(types[(*chunk)->get(16, 0, 32)].name, "minecraft:stone");
  EXPECT_EQ(types[(*chunk)->get(31, 15, 47)].name, "minecraft:stone");
  const VoxelType stairs = (*chunk)->get(17, 0, 32);
  EXPECT_EQ(to_string(minecraft::block_text(types[stairs], (*chunk)->data({17, 0, 32}).state)),
            "minecraft:oak_stairs[facing=east,half=top]");
  const auto outside = (*source)->read({0, 0, 0});
  EXPECT_TRUE(outside && !*outside);
}

TEST(MinecraftSource, NamesBrokenChunkAndPosition) {
  std::vector<std::byte> chunk = chunk_of_stairs(0);
  chunk.resize(100);
  const auto source = minecraft::open_minecraft(region_with(chunk, 5, 2));
  ASSERT_TRUE(source);
  const auto part = (*source)->read_part(0);
  ASSERT_TRUE(part);
  EXPECT_TRUE(part->chunks.empty());
  ASSERT_EQ(part->broken.size(), 1U);
  EXPECT_EQ(part->broken[0].byte_offset, 8192U);
  EXPECT_NE(part->broken[0].message.find("chunk (5, 2)"), std::string::npos);
}

TEST(MinecraftSource, ReadsLz4OrNamesMissingLibrary) {
  // One uncompressed LZ4 block, and the empty block that ends the stream.
  const std::vector<std::byte> chunk = chunk_of_stairs(0);
  std::vector<std::byte> stream;
  const auto block = [&](const std::vector<std::byte>& content, int method) {
    for (const char c : std::string("LZ4Block")) stream.push_back(static_cast<std::byte>(c));
    stream.push_back(static_cast<std::byte>(method));
    for (const std::size_t number : {content.size(), content.size(), std::size_t{0}}) {
      for (unsigned i = 0; i < 4; ++i) stream.push_back(static_cast<std::byte>(number >> (8 * i)));
    }
    stream.insert(stream.end(), content.begin(), content.end());
  };
  block(chunk, 0x16);
  block({}, 0x16);
  const auto source = minecraft::open_minecraft(region_with(stream, 0, 0, 4));
  ASSERT_TRUE(source);
  const auto part = (*source)->read_part(0);
  ASSERT_TRUE(part);
  if (!part->broken.empty()) {
    EXPECT_NE(part->broken[0].message.find("liblz4-dev"), std::string::npos);
  } else {
    ASSERT_EQ(part->chunks.size(), 1U);
    EXPECT_EQ(part->chunks[0].voxels.non_air_count(), 3);
  }
}

TEST(MinecraftSource, ReadsIndicesThatSpanLongs) {
  // 17 blocks take 5 bits: 320 longs if indices span longs, otherwise 342.
  for (const std::size_t words : {320U, 342U}) {
    NbtWriter nbt;
    nbt.compound("").compound("Level").list("Sections", 10, 1).byte("Y", 0).list("Palette", 10, 17);
    for (int i = 0; i < 17; ++i) nbt.string("Name", "mod:block" + std::to_string(i)).end();
    std::vector<std::uint64_t> longs(words, 0);
    for (std::size_t i = 0; i < 4096; ++i) {
      const std::uint64_t index = i % 17;
      const std::size_t word = words == 342 ? i / 12 : i * 5 / 64;
      const std::size_t bit = words == 342 ? i % 12 * 5 : i * 5 % 64;
      longs[word] |= index << bit;
      if (bit > 59) longs[word + 1] |= index >> (64 - bit);
    }
    nbt.longs("BlockStates", longs).end().end().end();
    const auto source = minecraft::open_minecraft(region_with(nbt.bytes));
    ASSERT_TRUE(source);
    const auto chunk = (*source)->read({0, 0, 0});
    ASSERT_TRUE(chunk && *chunk);
    const VoxelRegistry types = (*source)->types();
    for (int i = 0; i < 4096; i += 7) {
      const VoxelType type = (*chunk)->get(i & 15, i >> 8, i >> 4 & 15);
      ASSERT_EQ(types[type].name, "mod:block" + std::to_string(i % 17)) << i;
    }
  }
}

TEST(MinecraftSource, CountsInvisibleBlocksAndMakesLampsOfLight) {
  NbtWriter nbt;
  nbt.compound("").integer("DataVersion", 2975).list("sections", 10, 1);
  nbt.byte("Y", 2).compound("block_states").list("palette", 10, 3);
  nbt.string("Name", "minecraft:air").end();
  nbt.string("Name", "minecraft:barrier").end();
  nbt.string("Name", "minecraft:light").compound("Properties").string("level", "5").end().end();
  std::vector<std::uint64_t> words(256, 0);
  words[0] = 0x121;  // barrier, light, barrier
  nbt.longs("data", words).end().end().end();
  const auto source = minecraft::open_minecraft(region_with(nbt.bytes, 1, 0));
  ASSERT_TRUE(source);
  const auto part = (*source)->read_part(0);
  ASSERT_TRUE(part);
  EXPECT_TRUE(part->chunks.empty());
  EXPECT_TRUE(part->broken.empty());
  EXPECT_EQ(part->skipped_blocks,
            (std::map<std::string, std::uint64_t>{{"minecraft:barrier", 2}, {"minecraft:light", 1}}));
  ASSERT_EQ(part->lamps.size(), 1U);
  EXPECT_EQ(part->lamps[0].position, DVec3(17.5, 32.5, 0.5));
  EXPECT_EQ(part->lamps[0].range, 5.0);
  const auto loaded = load_source(**source, (*source)->info().chunks);
  ASSERT_TRUE(loaded);
  EXPECT_EQ(loaded->scene.lamps.size(), 1U);
  ASSERT_EQ(loaded->warnings.size(), 1U);
  EXPECT_EQ(loaded->warnings[0], "left out, since they are invisible: 2 minecraft:barrier, 1 minecraft:light");
}

TEST(MinecraftSource, TypeNumbersIgnoreReadingOrder) {
  const auto bytes = region_with(chunk_of_stairs(0));
  const auto a = minecraft::open_minecraft(bytes);
  ASSERT_TRUE(a);
  auto chunk = (*a)->read({0, 0, 0});
  ASSERT_TRUE(chunk && *chunk);
  VoxelRegistry into;
  VoxelProperties mine;
  mine.name = "mine";
  ASSERT_TRUE(into.add(mine));
  SourceTypes numbers(**a);
  ASSERT_TRUE(numbers.renumber(**chunk, into));
  EXPECT_EQ(into[(*chunk)->get(0, 0, 0)].name, "minecraft:stone");
  EXPECT_EQ((*chunk)->get(1, 0, 0), 2);  // by their names
  EXPECT_NE((*chunk)->data({1, 0, 0}).state, 0U);
}

TEST(MinecraftSource, ReadsOrRefusesCorpus) {
  std::size_t read = 0;
  std::size_t broken = 0;
  for (const auto& entry : fs::directory_iterator(fs::path(QUOIN_SOURCE_DIR) / "tests" / "corpus" / "minecraft")) {
    const auto bytes = read_file(entry.path());
    ASSERT_TRUE(bytes);
    const auto source = minecraft::open_minecraft(*bytes);
    if (!source) continue;
    for (std::size_t i = 0; i < (*source)->parts().size(); ++i) {
      const auto part = (*source)->read_part(i);
      ASSERT_TRUE(part) << entry.path();
      read += part->chunks.size();
      broken += part->broken.size();
    }
  }
  EXPECT_EQ(read, 3U);
  EXPECT_EQ(broken, 5U);
}

TEST(LevelFile, ReadsNameAndSpawn) {
  const auto bytes = read_file(fs::path(QUOIN_SOURCE_DIR) / "tests" / "corpus" / "minecraft" / "level_dat");
  ASSERT_TRUE(bytes);
  const auto level = minecraft::parse_level_file(*bytes);
  ASSERT_TRUE(level);
  EXPECT_EQ(level->name, "Home");
  EXPECT_EQ(level->spawn, DVec3(8, 70, -9));
}

struct Known {
  const char* file;
  std::size_t chunks_of_64;
  std::size_t broken;
};

TEST(MinecraftSource, ReadsRealRegionsOfFourVersions) {
  constexpr Known kFiles[] = {
      {"PrismarineJS+prismarine-provider-anvil/test__fixtures__1.12.2__r.0.-1.mca", 18, 0},
      {"PrismarineJS+prismarine-provider-anvil/test__fixtures__1.13.2__r.-1.-1.mca", 32, 0},
      {"PrismarineJS+prismarine-provider-anvil/test__fixtures__1.18.2__r.0.0.mca", 12, 0},
      {"Querz+NBT/src__test__resources__r.0.0.mca", 2, 0},
      {"Querz+NBT/src__test__resources__r.2.2.mca", 0, 3},
      {"dougbinks+enkiMI/example__r.1.0.mca", 2, 0},
  };
  for (const Known& known : kFiles) {
    const fs::path path = shared_file(known.file);
    if (!fs::exists(path)) GTEST_SKIP() << path << " is not there";
    const auto source = open_chunk_source(path);
    ASSERT_TRUE(source) << known.file;
    std::size_t chunks = 0;
    std::size_t broken = 0;
    for (std::size_t i = 0; i < (*source)->parts().size(); ++i) {
      const auto part = (*source)->read_part(i);
      ASSERT_TRUE(part);
      chunks += part->chunks.size();
      broken += part->broken.size();
    }
    EXPECT_EQ(chunks, known.chunks_of_64) << known.file;
    EXPECT_EQ(broken, known.broken) << known.file;
    if (known.chunks_of_64 > 0) {
      const auto format = detect_format(path);
      EXPECT_TRUE(format && *format == FileFormat::Minecraft) << known.file;
    }
  }
}

TEST(NbtDeathTest, AssertsOnElementOutOfRange) {
  NbtWriter writer;
  writer.compound("").list("c", 3, 2).number(5, 4).number(6, 4).end();
  const auto document = nbt::Document::parse(writer.bytes);
  ASSERT_TRUE(document);
  QUOIN_EXPECT_MISTAKE(static_cast<void>(document->root()["c"].integer(2)), "an element of an array or a list");
}

TEST(MinecraftSectionsDeathTest, AssertsOnEmptyPalette) {
  QUOIN_EXPECT_MISTAKE(static_cast<void>(minecraft::bits_of_palette(0, 4)), "a palette with entries");
}

TEST(MinecraftSectionsDeathTest, AssertsOnIndicesAbove16Bits) {
  const auto document = nbt::Document::parse(chunk_of_stairs(0));
  ASSERT_TRUE(document);
  std::vector<std::uint16_t> out(1);
  QUOIN_EXPECT_MISTAKE(static_cast<void>(minecraft::unpack_indices(document->root(), 17, out)), "1 <= bits <= 16");
}

}  // namespace

}  // namespace quoin
