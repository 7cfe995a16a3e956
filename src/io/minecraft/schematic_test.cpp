#include "io/minecraft/minecraft.h"

#include <random>

#include <gtest/gtest.h>

#include <quoin/io/file.h>
#include <quoin/io/formats.h>

#include "io/byte_stream.h"
#include "io/minecraft/block_types.h"
#include "io/minecraft/minecraft_for_tests.h"
#include "io/minecraft/nbt.h"

namespace quoin::minecraft {
namespace {

namespace fs = std::filesystem;
using minecraft_test::NbtWriter;

NbtWriter& put_short(NbtWriter& nbt, const char* name, int value) {
  return nbt.tag(2, name).number(static_cast<std::uint64_t>(value), 2);
}
NbtWriter& put_sizes(NbtWriter& nbt, IVec3 size) {
  put_short(nbt, "Width", size.x);
  put_short(nbt, "Height", size.y);
  return put_short(nbt, "Length", size.z);
}
NbtWriter& put_vector(NbtWriter& nbt, const char* name, IVec3 v) {
  return nbt.compound(name).integer("x", v.x).integer("y", v.y).integer("z", v.z).end();
}
NbtWriter& put_palette(NbtWriter& nbt, const char* name) {
  nbt.list(name, 10, 3);
  nbt.string("Name", "minecraft:air").end();
  nbt.string("Name", "minecraft:stone").end();
  return nbt.string("Name", "minecraft:oak_stairs").compound("Properties").string("facing", "west").end().end();
}

// 2 x 2 x 3: stone at (0, 0, 0), stairs at (1, 1, 2).
std::vector<std::byte> sponge(int version) {
  std::vector<std::uint8_t> data(12, 0);
  data[0] = 1;
  data[11] = 2;
  NbtWriter nbt;
  nbt.compound(version == 3 ? "" : "Schematic");
  if (version == 3) nbt.compound("Schematic");
  nbt.integer("Version", version);
  put_sizes(nbt, {2, 2, 3});
  if (version == 3) nbt.compound("Blocks");
  nbt.compound("Palette").integer("minecraft:air", 0).integer("minecraft:stone", 1);
  nbt.integer("minecraft:oak_stairs[facing=west]", 2).end();
  nbt.byte_array(version == 3 ? "Data" : "BlockData", data);
  nbt.list(version == 1 ? "TileEntities" : "BlockEntities", 10, 1).end();
  if (version == 3) nbt.end().end();
  return nbt.end().bytes;
}

std::vector<std::byte> litematic(IVec3 size) {
  NbtWriter nbt;
  nbt.compound("").integer("Version", 6).compound("Regions").compound("tower");
  put_vector(nbt, "Position", {10, 20, 30});
  put_vector(nbt, "Size", size);
  put_palette(nbt, "BlockStatePalette");
  // 33 blocks of two bits: the last block begins the second word.
  return nbt.longs("BlockStates", {1, 2}).end().end().end().bytes;
}

std::vector<std::byte> structure(IVec3 stairs) {
  NbtWriter nbt;
  nbt.compound("").list("size", 3, 3).number(2, 4).number(2, 4).number(3, 4);
  put_palette(nbt, "palette");
  nbt.list("blocks", 10, 2);
  nbt.list("pos", 3, 3).number(0, 4).number(0, 4).number(0, 4).integer("state", 1).end();
  nbt.list("pos", 3, 3);
  for (int axis = 0; axis < 3; ++axis) nbt.number(static_cast<std::uint64_t>(stairs[axis]), 4);
  return nbt.integer("state", 2).end().end().bytes;
}

std::vector<std::byte> mcedit() {
  NbtWriter nbt;
  nbt.compound("Schematic");
  put_sizes(nbt, {2, 2, 3});
  std::vector<std::uint8_t> blocks(12, 0);
  std::vector<std::uint8_t> data(12, 0);
  blocks[0] = 1;
  blocks[11] = 53;
  data[11] = 1;  // towards the west
  return nbt.byte_array("Blocks", blocks).byte_array("Data", data).string("Materials", "Alpha").end().bytes;
}

std::string block_at(const LoadedScene& loaded, IVec3 voxel) {
  const Grid& grid = loaded.scene.grids()[loaded.scene.grids().handles().front()].grid;
  const VoxelType type = grid.get(voxel);
  return type == kAir ? "air" : to_string(block_text(loaded.scene.types[type], grid.data(voxel).state));
}

void expect_house(const Result<LoadedScene>& loaded) {
  ASSERT_TRUE(loaded) << to_string(loaded.error());
  EXPECT_EQ(loaded->scene.voxel_count(), 2);
  EXPECT_EQ(block_at(*loaded, {0, 0, 0}), "minecraft:stone");
  EXPECT_NE(block_at(*loaded, {1, 1, 2}).find("minecraft:oak_stairs[facing=west"), std::string::npos)
      << block_at(*loaded, {1, 1, 2});
}

TEST(Schematic, ReadsSameHouseFromEveryFormat) {
  for (int version = 1; version <= 3; ++version) {
    const auto loaded = read_schematic(sponge(version));
    expect_house(loaded);
    ASSERT_EQ(loaded->warnings.size(), 1U);
    EXPECT_NE(loaded->warnings[0].find("1 block entities"), std::string::npos);
  }
  expect_house(read_schematic(mcedit()));
  expect_house(read_schematic(structure({1, 1, 2})));
}

TEST(Schematic, IsDetectedByContentAndWithinGzip) {
  for (const auto& bytes : {sponge(2), sponge(3), mcedit(), structure({1, 1, 2}), litematic({11, 1, 3})}) {
    EXPECT_EQ(detect_format(bytes), FileFormat::Schematic);
    const std::vector<std::byte> packed = gzipped(bytes, 6);
    EXPECT_EQ(detect_format(packed), FileFormat::Schematic);
    EXPECT_TRUE(load_scene(packed)) << to_string(load_scene(packed).error());
  }
}

TEST(Schematic, ReadsLitematicOfNegativeSize) {
  const auto up = read_schematic(litematic({11, 1, 3}));
  const auto down = read_schematic(litematic({-11, 1, -3}));
  ASSERT_TRUE(up && down);
  for (const auto* loaded : {&*up, &*down}) {
    EXPECT_EQ(loaded->scene.voxel_count(), 2);
    EXPECT_EQ(block_at(*loaded, {0, 0, 0}), "minecraft:stone");
    EXPECT_NE(block_at(*loaded, {10, 0, 2}).find("oak_stairs"), std::string::npos);
  }
  const auto place = [](const LoadedScene& loaded) {
    return loaded.scene.instances()[loaded.scene.instances().handles().front()].position;
  };
  EXPECT_EQ(place(*up), DVec3(10.0, 20.0, 30.0));
  EXPECT_EQ(place(*down), DVec3(0.0, 20.0, 28.0));
}

TEST(Schematic, ReadsBlocksBeyondOneSection) {
  // 70 x 70 x 70 blocks; the type depends on the position.
  constexpr int kEdge = 70;
  std::vector<std::uint8_t> data;
  for (int i = 0; i < kEdge * kEdge * kEdge; ++i) data.push_back(static_cast<std::uint8_t>(i % 3));
  NbtWriter nbt;
  nbt.compound("Schematic").integer("Version", 2);
  put_sizes(nbt, IVec3(kEdge));
  nbt.compound("Palette").integer("minecraft:air", 0).integer("minecraft:stone", 1).integer("minecraft:dirt", 2).end();
  nbt.byte_array("BlockData", data).end();
  const auto loaded = read_schematic(nbt.bytes);
  ASSERT_TRUE(loaded);
  for (const IVec3 voxel : {IVec3(0), IVec3(63, 64, 65), IVec3(69), IVec3(15, 16, 17), IVec3(64, 3, 2)}) {
    const int index = (voxel.y * kEdge + voxel.z) * kEdge + voxel.x;
    const std::array kNames = {"air", "minecraft:stone", "minecraft:dirt"};
    EXPECT_EQ(block_at(*loaded, voxel), kNames.at(static_cast<std::size_t>(index % 3)));
  }
  EXPECT_EQ(loaded->scene.voxel_count(), kEdge * kEdge * kEdge - (kEdge * kEdge * kEdge + 2) / 3);
}

/// 2 x 18 x 1 blocks of grass; `biomes`: by column for versions 2 and 0 (MCEdit's), by block for version 3.
std::vector<std::byte> meadow(int version, const std::vector<std::uint8_t>& biomes) {
  NbtWriter nbt;
  nbt.compound(version == 3 ? "" : "Schematic");
  if (version == 3) nbt.compound("Schematic");
  if (version != 0) nbt.integer("Version", version);
  put_sizes(nbt, {2, 18, 1});
  const std::vector<std::uint8_t> blocks(36, version == 0 ? 2 : 0);
  if (version == 0) return nbt.byte_array("Blocks", blocks).byte_array("Biomes", biomes).end().bytes;
  if (version == 3) nbt.compound("Blocks");
  nbt.compound("Palette").integer("minecraft:grass_block", 0).end();
  nbt.byte_array(version == 3 ? "Data" : "BlockData", blocks);
  if (version == 3) nbt.end().compound("Biomes");
  nbt.compound(version == 3 ? "Palette" : "BiomePalette");
  nbt.integer("minecraft:plains", 0).integer("minecraft:desert", 1).end();
  nbt.byte_array(version == 3 ? "Data" : "BiomeData", biomes);
  if (version == 3) nbt.end().end();
  return nbt.end().bytes;
}

TEST(Schematic, BiomesColourGrass) {
  constexpr std::uint8_t kDesert = 2;  // by number
  std::vector<std::uint8_t> by_block(36, 0);
  for (std::size_t y = 0; y < 16; ++y) by_block[2 * y + 1] = 1;
  for (const auto& file : {meadow(2, {0, 1}), meadow(0, {1, kDesert}), meadow(3, by_block)}) {
    const auto loaded = read_schematic(file);
    ASSERT_TRUE(loaded) << to_string(loaded.error());
    EXPECT_TRUE(loaded->warnings.empty());
    const Grid& grid = loaded->scene.grids()[loaded->scene.grids().handles().front()].grid;
    EXPECT_EQ(grid.voxel_count(), 36);
    const VoxelType plains = grid.get({0, 0, 0});
    EXPECT_NE(grid.get({1, 0, 0}), plains);
    EXPECT_EQ(grid.get({0, 17, 0}), plains);
    // Every slab of 16 layers has its own biome where the file supports this.
    const bool is_by_block = file.size() == meadow(3, by_block).size();
    EXPECT_EQ(grid.get({1, 17, 0}) == plains, is_by_block);
  }
  // Too few biomes, or an unknown one: plains, and a warning.
  for (const auto& file : {meadow(2, {0}), meadow(2, {0, 9}), meadow(0, {1}), meadow(3, {0, 1})}) {
    const auto loaded = read_schematic(file);
    ASSERT_TRUE(loaded) << to_string(loaded.error());
    ASSERT_EQ(loaded->warnings.size(), 1U);
    EXPECT_NE(loaded->warnings[0].find("biomes"), std::string::npos);
    const Grid& grid = loaded->scene.grids()[loaded->scene.grids().handles().front()].grid;
    EXPECT_EQ(grid.get({0, 0, 0}), grid.get({1, 0, 0}));
  }
}

TEST(Schematic, ReportsErrorsInOneLine) {
  EXPECT_EQ(read_schematic(structure({2, 1, 2})).error().code, ErrorCode::BadFormat);
  EXPECT_EQ(read_schematic(litematic({12, 1, 6})).error().code, ErrorCode::BadFormat);
  EXPECT_EQ(read_schematic(litematic({0, 1, 3})).error().code, ErrorCode::BadFormat);
  EXPECT_EQ(read_schematic(litematic({1 << 20, 1 << 20, 1 << 20})).error().code, ErrorCode::LimitExceeded);
  NbtWriter other;
  other.compound("").integer("DataVersion", 7).end();
  const auto refused = read_schematic(other.bytes);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::Unsupported);
  EXPECT_NE(refused.error().message.find("DataVersion"), std::string::npos);
  NbtWriter wide;
  wide.compound("").list("size", 3, 3).number(1 << 14, 4).number(1, 4).number(1 << 14, 4);
  put_palette(wide, "palette");
  EXPECT_EQ(read_schematic(wide.list("blocks", 10, 0).end().bytes).error().code, ErrorCode::LimitExceeded);
}

TEST(Schematic, SurvivesTruncationAndFlippedBits) {
  for (const auto& whole : {sponge(1), sponge(3), mcedit(), structure({1, 1, 2}), litematic({11, 1, 3})}) {
    for (std::size_t size = 0; size < whole.size(); ++size) {
      EXPECT_FALSE(read_schematic(std::span(whole).first(size))) << size;
    }
    for (std::size_t at = 0; at < whole.size(); ++at) {
      for (const int bit : {0, 4, 7}) {
        std::vector<std::byte> turned = whole;
        turned[at] ^= std::byte{1} << bit;
        (void)read_schematic(turned);
      }
    }
  }
}

TEST(Schematic, RealFilesHaveExpectedCounts) {
  const fs::path folder = fs::path(QUOIN_SOURCE_DIR).parent_path() / "shared" / "data" / "mc";
  if (!fs::exists(folder)) GTEST_SKIP() << "real files are not here";
  struct Known {
    const char* file;
    IVec3 size;
    std::int64_t voxels;
  };
  const std::array kKnown = {
      Known{"PrismarineJS+prismarine-schematic/5c99fe__test__schematics__smallhouse1.schem", {21, 28, 20}, 3'201},
      Known{"PrismarineJS+prismarine-schematic/ea3ed7__test__schematics__viking-house1.schematic", {23, 35, 23}, 2'492},
      Known{"vengi-voxel+vengi/data__tests__test.litematic", {79, 29, 70}, 11'722},
      Known{"TelepathicGrunt+StructureTutorialMod/"
            "src__main__resources__data__structure_tutorial__structures__sky_fan.nbt",
            {27, 12, 27},
            420}};
  for (const Known& known : kKnown) {
    const auto loaded = load_scene(folder / known.file);
    ASSERT_TRUE(loaded) << to_string(loaded.error());
    EXPECT_EQ(loaded->scene.voxel_count(), known.voxels) << known.file;
    const SceneGrid& grid = loaded->scene.grids()[loaded->scene.grids().handles().front()];
    EXPECT_EQ(grid.canvas.size(), known.size) << known.file;
  }
}

// A large schematic of layers of one block, except for 40 blocks in the middle.
std::vector<std::byte> large_sponge(int version, bool has_states) {
  constexpr IVec3 kSize(100, 230, 90);
  std::vector<std::uint8_t> data(static_cast<std::size_t>(kSize.x) * kSize.y * kSize.z, 1);
  const std::size_t layer = static_cast<std::size_t>(kSize.x) * kSize.z;
  std::fill_n(data.begin(), 64 * layer, std::uint8_t{0});
  for (std::size_t i = 0; i < 40; ++i) data[(140 + i) * layer + 37 * i] = static_cast<std::uint8_t>(i % 3);
  NbtWriter nbt;
  nbt.compound(version == 3 ? "" : "Schematic");
  if (version == 3) nbt.compound("Schematic");
  nbt.integer("Version", version);
  put_sizes(nbt, kSize);
  if (version == 3) nbt.compound("Blocks");
  nbt.compound("Palette").integer("minecraft:air", 0).integer("minecraft:stone", 1);
  nbt.integer(has_states ? "minecraft:oak_stairs[facing=west]" : "minecraft:dirt", 2).end();
  nbt.byte_array(version == 3 ? "Data" : "BlockData", data);
  if (version == 3) nbt.end().end();
  return nbt.end().bytes;
}

TEST(Schematic, ReadsLongArraysInPages) {
  for (const int version : {2, 3}) {
    for (const bool has_states : {false, true}) {
      const std::vector<std::byte> plain = large_sponge(version, has_states);
      const auto expected = load_scene(plain);
      const auto loaded = load_scene(gzipped(plain, 1));
      ASSERT_TRUE(expected && loaded);
      const Grid& a = expected->scene.grids()[expected->scene.grids().handles()[0]].grid;
      const Grid& b = loaded->scene.grids()[loaded->scene.grids().handles()[0]].grid;
      ASSERT_EQ(a.voxel_count(), b.voxel_count());
      EXPECT_EQ(a.data_count(), b.data_count());
      EXPECT_EQ(a.bounds().min, b.bounds().min);
      EXPECT_EQ(a.bounds().max, b.bounds().max);
      for (int i = 0; i < 40; ++i) {
        const IVec3 at(37 * i % 100, 140 + i, 37 * i / 100);
        EXPECT_EQ(expected->scene.types[a.get(at)].name, loaded->scene.types[b.get(at)].name);
        EXPECT_EQ(a.data(at).state, b.data(at).state);
      }
    }
  }
}

// More than 128 block types, so that indices take one or two bytes: reading by pages equals reading one array.
TEST(Schematic, ReadsLongArraysOfManyBlocksInPages) {
  constexpr IVec3 kSize(130, 41, 290);
  constexpr unsigned kKinds = 200;
  std::mt19937 random(6);
  std::vector<std::uint8_t> data;
  for (int i = 0; i < kSize.x * kSize.y * kSize.z; ++i) {
    // Long runs of one block, others, and blocks that all differ.
    const unsigned index = i / 50'000 % 3 == 0 ? 5 : i / 50'000 % 3 == 1 ? i / 700 % 9 : random() % kKinds;
    if (index >= 128) data.push_back(static_cast<std::uint8_t>(index | 128U));
    data.push_back(static_cast<std::uint8_t>(index >= 128 ? index >> 7 : index));
  }
  NbtWriter nbt;
  nbt.compound("Schematic").integer("Version", 2);
  put_sizes(nbt, kSize);
  nbt.compound("Palette").integer("minecraft:air", 0);
  for (unsigned i = 1; i < kKinds; ++i) nbt.integer("test:block_" + std::to_string(i), static_cast<int>(i));
  const std::vector<std::byte> plain = nbt.end().byte_array("BlockData", data).end().bytes;
  const auto expected = load_scene(plain);
  const auto loaded = load_scene(gzipped(plain, 1));
  ASSERT_TRUE(expected && loaded);
  const Grid& a = expected->scene.grids()[expected->scene.grids().handles()[0]].grid;
  const Grid& b = loaded->scene.grids()[loaded->scene.grids().handles()[0]].grid;
  const VoxelRegistry& types = loaded->scene.types;
  std::size_t at = 0;
  for (int i = 0; i < kSize.x * kSize.y * kSize.z; ++i) {
    unsigned index = data[at++];
    if (index >= 128) index = (index & 127U) | unsigned{data[at++]} << 7U;
    const IVec3 voxel(i % kSize.x, i / (kSize.x * kSize.z), i / kSize.x % kSize.z);
    ASSERT_EQ(a.get(voxel), b.get(voxel)) << i;
    if (index == 0) {
      ASSERT_EQ(b.get(voxel), kAir);
    } else {
      ASSERT_EQ(types[b.get(voxel)].name, "test:block_" + std::to_string(index)) << i;
    }
  }
}

TEST(Schematic, RefusesTruncatedLongArrays) {
  const std::vector<std::byte> plain = large_sponge(2, false);
  for (const std::size_t size : {plain.size() - 1, plain.size() - 1'000'000, plain.size() / 2}) {
    EXPECT_FALSE(load_scene(gzipped(std::span(plain).first(size), 1))) << size;
  }
  std::vector<std::byte> packed = gzipped(plain, 1);
  packed.resize(packed.size() / 2);
  EXPECT_FALSE(load_scene(packed));
}

std::vector<std::byte> bytes_of(const PagedBytes& pages) {
  std::vector<std::byte> all;
  PagedBytes::PageContent page;
  for (std::size_t i = 0; all.size() < pages.size(); ++i) {
    pages.read_page(i, page);
    all.insert(all.end(), page.begin(), page.end());
  }
  all.resize(static_cast<std::size_t>(pages.size()));
  return all;
}

TEST(PagedBytes, PacksPagesOfFewValues) {
  std::mt19937 random(5);
  std::uint64_t held = 0;
  for (const unsigned kinds : {1U, 2U, 3U, 4U, 5U, 16U, 17U, 256U}) {
    std::vector<std::byte> bytes(5 * PagedBytes::kPageBytes + 77);
    for (std::byte& byte : bytes) byte = static_cast<std::byte>(255U - random() % kinds);
    PagedBytes pages;
    pages.append(bytes);
    EXPECT_EQ(bytes_of(pages), bytes) << kinds;
    EXPECT_GE(pages.held_bytes(), held) << kinds;
    held = pages.held_bytes();
    EXPECT_EQ(pages.uniform_page(0).has_value(), kinds == 1);
    if (kinds <= 4) {
      EXPECT_LE(held, 6 * (PagedBytes::kPageBytes / 4 + 16)) << kinds;
    }
  }
}

TEST(PagedBytes, HoldsAppendedBytes) {
  PagedBytes pages;
  std::vector<std::byte> bytes(3 * PagedBytes::kPageBytes + 100, std::byte{7});
  bytes[PagedBytes::kPageBytes + 5] = std::byte{8};
  pages.append(bytes);
  ASSERT_EQ(pages.size(), bytes.size());
  EXPECT_EQ(bytes_of(pages), bytes);
  EXPECT_EQ(pages.uniform(0, PagedBytes::kPageBytes + 5), std::byte{7});
  EXPECT_EQ(pages.uniform(0, PagedBytes::kPageBytes + 6), std::nullopt);
  EXPECT_EQ(pages.uniform(PagedBytes::kPageBytes + 5, PagedBytes::kPageBytes + 6), std::byte{8});
  EXPECT_EQ(pages.uniform(PagedBytes::kPageBytes + 6, bytes.size()), std::byte{7});
}

TEST(Schematic, DescribesUnknownKindInPrintableCharacters) {
  NbtWriter nbt;
  nbt.compound("").integer("a\n\x01", 1).end();
  const auto loaded = load_scene(nbt.bytes);
  ASSERT_FALSE(loaded);
  for (const char c : loaded.error().message) EXPECT_GE(c, ' ');
}

}  // namespace
}  // namespace quoin::minecraft
