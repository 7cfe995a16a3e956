#include <filesystem>
#include <random>
#include <string>

#include <gtest/gtest.h>

#include <quoin/io/block_packs.h>
#include <quoin/io/chunk_source.h>
#include <quoin/io/file.h>
#include <quoin/io/formats.h>
#include <quoin/store/world_import.h>
#include <quoin/store/world_saver.h>

#include "io/luanti/luanti.h"
#include "io/luanti/luanti_for_tests.h"
#include "store/world/world_for_tests.h"

namespace quoin {

namespace {

namespace fs = std::filesystem;
using luanti_test::Block;
using luanti_test::Bytes;
using luanti_test::Map;
using luanti_test::row_of;

/// Returns a block of air with a stone, a rotated chest and a node from a mod.
Block some_block() {
  Block block;
  block.names = {{0, "air"}, {3, "default:stone"}, {100, "default:chest"}, {2053, "mod:unheard_of"}};
  block.at(1, 2, 3) = {3, 0};
  block.at(15, 0, 15) = {100, 3};
  block.at(0, 15, 0) = {2053, 9};
  return block;
}

const Grid& grid_of(const LoadedScene& loaded) {
  return loaded.scene.grids()[loaded.scene.grids().handles().front()].grid;
}

LoadedScene load(const fs::path& path) {
  auto loaded = load_scene(path);
  EXPECT_TRUE(loaded) << to_string(loaded.error());
  return loaded ? std::move(*loaded) : LoadedScene{};
}

void expect_some_block(const LoadedScene& loaded, IVec3 corner) {
  const Grid& grid = grid_of(loaded);
  const auto name = [&](IVec3 at) { return loaded.scene.types[grid.get(corner + at)].name; };
  EXPECT_EQ(loaded.scene.voxel_count(), 3);
  EXPECT_EQ(name({1, 2, 12}), "default:stone");
  EXPECT_EQ(name({15, 0, 0}), "default:chest");
  EXPECT_EQ(name({0, 15, 15}), "mod:unheard_of");
  EXPECT_EQ(grid.data(corner + IVec3{15, 0, 0}).state, 3U);
  EXPECT_EQ(grid.data(corner + IVec3{0, 15, 15}).state, 9U);
  EXPECT_EQ(grid.data(corner + IVec3{1, 2, 12}).state, 0U);
}

TEST(LuantiMap, ReadsSameNodesFromEveryVersionAndTable) {
  for (const bool by_three : {false, true}) {
    for (int version = 25; version <= 29; ++version) {
      for (const int width : {1, 2}) {
        const WorldFolder folder;
        Map(folder / "map.sqlite", by_three).put({-7, -3, 5}, row_of(some_block(), version, width));
        const LoadedScene loaded = load(folder / "map.sqlite");
        EXPECT_EQ(loaded.format, "luanti_map");
        EXPECT_TRUE(loaded.warnings.empty()) << loaded.warnings.front();
        expect_some_block(loaded, {-7 * 16, -3 * 16, -6 * 16});
      }
    }
  }
}

TEST(LuantiMap, ShowsShapesOfNodesWithPack) {
  const WorldFolder folder;
  Block block;
  block.names = {{0, "air"},
                 {1, "default:water_source"},
                 {2, "default:water_flowing"},
                 {3, "stairs:stair_wood"},
                 {4, "default:fence_wood"},
                 {5, "bad name\n:\xFF"}};
  block.at(1, 1, 1) = {1, 240};
  block.at(2, 1, 1) = {2, 4};
  block.at(4, 4, 4) = {3, 20};  // upside down
  block.at(8, 8, 8) = {4, 0};
  block.at(9, 8, 8) = {4, 0};
  block.at(12, 12, 12) = {5, 255};
  Map(folder / "map.sqlite").put({0, 0, -1}, row_of(block, 29));
  LoadOptions options;
  options.packs = {kBuiltinPack};
  const auto loaded = load_scene(folder / "map.sqlite", options);
  ASSERT_TRUE(loaded);
  const Grid& grid = grid_of(*loaded);
  const auto shape = [&](IVec3 at) { return shape_at(grid, loaded->scene.types, at); };
  EXPECT_EQ(grid.data({2, 1, 14}).state, 3U) << "level 4 is a drop of 3";
  ASSERT_NE(shape({2, 1, 14}), nullptr);
  EXPECT_LT(shape({2, 1, 14})->min.y + 0.1F, shape({2, 1, 14})->max.y);
  EXPECT_GT(shape({1, 1, 14})->max.y, shape({2, 1, 14})->max.y - 0.01F);
  ASSERT_NE(shape({4, 4, 11}), nullptr);
  EXPECT_TRUE(shape({4, 4, 11})->covers_side[static_cast<std::size_t>(Direction::PosY)]);
  EXPECT_FALSE(shape({4, 4, 11})->covers_side[static_cast<std::size_t>(Direction::NegY)]);
  ASSERT_NE(shape({8, 8, 7}), nullptr);
  EXPECT_EQ(shape({8, 8, 7})->max.x, 1.0F) << "the fence joins the next one";
  EXPECT_LT(shape({9, 8, 7})->max.x, 1.0F);
  EXPECT_EQ(shape({12, 12, 3}), nullptr);
  EXPECT_EQ(grid.data({12, 12, 3}).state, 255U);
  // Without a pack the same map has cubes.
  const LoadedScene plain = load(folder / "map.sqlite");
  EXPECT_EQ(shape_at(grid_of(plain), plain.scene.types, {4, 4, 11}), nullptr);
}

TEST(LuantiSchematic, KeepsParam2) {
  const auto schematic = [](bool has_param2) {
    luanti_test::Writer nodes;
    nodes.big(0, 2).big(1, 2).big(0x7F7F, 2);
    if (has_param2) nodes.big(21, 1).big(2, 1);
    luanti_test::Writer file;
    file.text("MTSM").big(4, 2).big(2, 2).big(1, 2).big(1, 2).big(0x7F, 1).big(2, 2);
    for (const std::string_view name : {"stairs:stair_wood", "default:water_flowing"}) {
      file.big(name.size(), 2).text(name);
    }
    return file.append(luanti_test::deflated(nodes.bytes)).bytes;
  };
  const auto loaded = load_scene(schematic(true));
  ASSERT_TRUE(loaded);
  EXPECT_EQ(grid_of(*loaded).data({0, 0, 0}).state, 21U);
  EXPECT_EQ(grid_of(*loaded).data({1, 0, 0}).state, 5U) << "level 2 is a drop of 5";
  const auto cut = load_scene(schematic(false));
  ASSERT_TRUE(cut);
  EXPECT_EQ(grid_of(*cut).data({0, 0, 0}).state, 0U);
}

TEST(LuantiNodes, PassLightAsTheGame) {
  const auto passage = [](const char* name) {
    const VoxelProperties type = models::node_properties(name).value();
    return type.blocks_light.value_or(type.visibility == Visibility::Opaque) ? int{kMaxLightCost}
                                                                             : int{type.light_cost};
  };
  for (const char* name : {"default:stone", "default:tree", "default:snowblock", "default:cactus", "default:bookshelf",
                           "vessels:shelf", "mod:unheard_of"}) {
    EXPECT_EQ(passage(name), kMaxLightCost) << name;
  }
  for (const char* name :
       {"default:water_source", "default:river_water_flowing", "default:leaves", "default:pine_needles", "default:ice",
        "default:lava_source", "default:snow", "stairs:stair_cobble", "stairs:slab_wood", "walls:cobble",
        "beds:bed_bottom", "default:chest_locked"}) {
    EXPECT_EQ(passage(name), 1) << name;
  }
  for (const char* name : {"default:glass", "default:torch", "default:fence_wood", "xpanes:bar_flat",
                           "doors:door_wood_a", "doors:gate_wood_closed", "doors:trapdoor_steel_open"}) {
    EXPECT_EQ(passage(name), 0) << name;
  }
}

TEST(LuantiMap, ReadsNameOfFolder) {
  const WorldFolder folder;
  Map(folder / "map.sqlite").put({0, 0, 0}, row_of(some_block(), 28));
  ASSERT_TRUE(write_file(Bytes(), folder / "world.mt"));
  EXPECT_EQ(detect_format(folder.path()).value(), FileFormat::LuantiMap);
  EXPECT_EQ(open_chunk_source(folder.path()).value()->info().name, folder.path().filename().string());
  const std::string text = "gameid = minetest\n world_name =  Old town \r\nbackend = sqlite3\n";
  ASSERT_TRUE(write_file(std::as_bytes(std::span(text)), folder / "world.mt"));
  const auto source = open_chunk_source(folder.path());
  ASSERT_TRUE(source);
  EXPECT_EQ((*source)->info().name, "Old town");
  EXPECT_EQ((*source)->info().spawn, DVec3(0.0, 0.0, -0.5));
}

TEST(LuantiMap, ReportsUnsupportedBackends) {
  const WorldFolder folder;
  const std::string text = "backend = leveldb\n";
  ASSERT_TRUE(write_file(std::as_bytes(std::span(text)), folder / "world.mt"));
  const auto refused = load_scene(folder.path());
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::Unsupported);
  EXPECT_NE(refused.error().message.find("leveldb"), std::string::npos);
}

TEST(LuantiMap, IsDetectedByTable) {
  const WorldFolder folder;
  Map(folder / "map.sqlite").put({0, 0, 0}, row_of(some_block(), 28));
  auto bytes = read_file(folder / "map.sqlite").value();
  EXPECT_EQ(detect_format(bytes), FileFormat::LuantiMap);
  const auto loaded = load_scene(bytes);
  ASSERT_TRUE(loaded);
  expect_some_block(*loaded, {0, 0, -16});
  bytes[68] = std::byte{1};  // the mark of another program
  EXPECT_FALSE(is_luanti_map(bytes));
  {
    auto other = Connection::open((folder / "other").string(), Connection::Mode::Create).value();
    ASSERT_TRUE(other.run("CREATE TABLE blocks_of_others (pos INT, data BLOB); CREATE TABLE players (blocks INT)"));
  }
  EXPECT_EQ(detect_format(folder / "other").value(), std::nullopt);
  {
    auto other = Connection::open((folder / "without").string(), Connection::Mode::Create).value();
    ASSERT_TRUE(other.run("CREATE TABLE blocks (x INT)"));
  }
  const auto refused = load_scene(folder / "without");
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("the table of blocks is missing"), std::string::npos);
}

TEST(LuantiMap, NamesAndSkipsBrokenBlocks) {
  const WorldFolder folder;
  Bytes cut = row_of(some_block(), 28);
  cut.resize(cut.size() / 2);
  Bytes old = row_of(some_block(), 28);
  old[0] = std::byte{22};
  Block nameless = some_block();
  nameless.at(4, 0, 0) = {5, 0};
  {
    Map map(folder / "map.sqlite");
    map.put({0, 0, 0}, row_of(some_block(), 29));
    map.put({1, 0, 0}, cut);
    map.put({2, 0, 0}, old);
    map.put({3, 0, 0}, row_of(nameless, 29));
    map.put({0, 1, 0}, {});
    map.run("INSERT INTO blocks VALUES (16777216, NULL)");
    map.put_number(std::int64_t{1} << 40, cut);
    map.put_number(-(std::int64_t{1} << 40), cut);
  }
  const LoadedScene loaded = load(folder / "map.sqlite");
  expect_some_block(loaded, {0, 0, -16});
  const auto said = [&](std::string_view text) {
    return std::ranges::any_of(loaded.warnings,
                               [&](const std::string& line) { return line.find(text) != std::string::npos; });
  };
  EXPECT_EQ(loaded.warnings.size(), 6U);
  EXPECT_TRUE(said("2 rows with invalid block positions"));
  EXPECT_TRUE(said("block (1, 0, 0): byte "));
  EXPECT_TRUE(said("block (2, 0, 0): byte 0 of its row: unsupported block version 22"));
  EXPECT_TRUE(said("node 4 has number 5, which has no name"));
  EXPECT_TRUE(said("block (0, 1, 0): byte 0 of its row: the row is empty"));
  EXPECT_TRUE(said("block (0, 0, 1): the row has no data"));
}

TEST(LuantiMap, SurvivesTruncatedAndChangedRows) {
  luanti::MapBlockReader reader;
  luanti::MapBlock block;
  std::minstd_rand random(5);
  for (const int version : {25, 28, 29}) {
    const Bytes sound = row_of(some_block(), version);
    ASSERT_TRUE(reader.read(sound, block));
    for (std::size_t size = 0; size < sound.size(); ++size) {
      const bool has_read = reader.read(std::span(sound).first(size), block).has_value();
      EXPECT_TRUE(!has_read || size + 3 >= sound.size()) << version << " cut to " << size;  // the timers
    }
    for (int i = 0; i < 3000; ++i) {
      Bytes changed = sound;
      changed[random() % changed.size()] = static_cast<std::byte>(random());
      if (!reader.read(changed, block)) continue;
      for (const std::uint16_t node : block.nodes) ASSERT_LT(node, block.names.size());
    }
  }
}

TEST(LuantiMap, ReadsOrRefusesCorpusWithOffset) {
  int read = 0;
  int refused = 0;
  for (const auto& entry : fs::directory_iterator(fs::path(QUOIN_SOURCE_DIR) / "tests" / "corpus" / "luanti")) {
    luanti::MapBlockReader reader;
    luanti::MapBlock block;
    const auto row = read_file(entry.path());
    ASSERT_TRUE(row);
    const auto done = reader.read(*row, block);
    ++(done ? read : refused);
    if (!done) {
      EXPECT_TRUE(done.error().byte_offset) << entry.path();
    }
  }
  EXPECT_EQ(read, 4);
  EXPECT_EQ(refused, 1);
}

TEST(LuantiMap, RefusesFrameThatExpandsTooFar) {
  luanti_test::Writer content;
  content.big(0, 7).big(0, 1).big(0xFFFF, 2).append(Bytes(std::size_t{64} << 20));
  luanti_test::Writer row;
  row.big(29, 1).append(luanti_test::zstd_of(content.bytes));
  luanti::MapBlockReader reader;
  luanti::MapBlock block;
  EXPECT_FALSE(reader.read(row.bytes, block));
}

TEST(LuantiMap, ResumedImportMatchesUninterruptedImport) {
  const WorldFolder folder;
  {
    Map map(folder / "map.sqlite", true);
    for (int i = 0; i < 12; ++i) map.put({8 * i, 4 * (i % 5) - 40, -8 * i}, row_of(some_block(), 25 + i % 5));
  }
  const auto open = [&] { return open_chunk_source(folder / "map.sqlite").value(); };
  ASSERT_TRUE(import_world(*open(), folder / "whole.quoin", {1}));
  int stopped = 0;
  for (; stopped < 50; ++stopped) {
    int calls = 0;
    if (import_world(*open(), folder / "parts.quoin", {1}, [&](double) { return calls++ == 0; })) break;
  }
  EXPECT_GT(stopped, 1);
  const auto scene = [&](const char* name) {
    return load_world(WorldStore::open(folder / name, WorldAccess::Read).value()).value().loaded;
  };
  const LoadedScene whole = scene("whole.quoin");
  const LoadedScene parts = scene("parts.quoin");
  EXPECT_EQ(whole.scene.voxel_count(), 36);
  ASSERT_EQ(grid_of(whole).chunks(), grid_of(parts).chunks());
  for (const IVec3 place : grid_of(whole).chunks()) {
    EXPECT_EQ(*grid_of(whole).find_chunk(place), *grid_of(parts).find_chunk(place));
  }
}

TEST(LuantiMap, RealWorldHasExpectedNodes) {
  const fs::path folder = fs::path(QUOIN_SOURCE_DIR) / "../shared/data/luanti/cornernote+minetest-mesecons-circuits";
  if (!fs::exists(folder)) GTEST_SKIP() << folder << " is not there";
  const auto source = open_chunk_source(folder);
  ASSERT_TRUE(source) << to_string(source.error());
  std::int64_t voxels = 0;
  std::int64_t with_state = 0;
  for (std::size_t i = 0; i < (*source)->parts().size(); ++i) {
    const auto part = (*source)->read_part(i);
    ASSERT_TRUE(part);
    EXPECT_TRUE(part->broken.empty());
    for (const SourceChunk& chunk : part->chunks) {
      voxels += chunk.voxels.non_air_count();
      chunk.voxels.for_each_data([&](IVec3, const VoxelData&) { ++with_state; });
    }
  }
  // Counted by an independent program.
  EXPECT_EQ(voxels, 1'003'917);
  // 2,665 nodes have param2; 369 of them flow at the highest level (state 0). 40 others flow at level 0.
  EXPECT_EQ(with_state, 2'665 - 369 + 40);
  EXPECT_EQ((*source)->types().size() - 1, 46U);
}

}  // namespace

}  // namespace quoin
