#include <quoin/map/world_map.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <functional>
#include <limits>
#include <map>
#include <numbers>
#include <set>
#include <string>
#include <vector>

#include <glm/gtc/quaternion.hpp>
#include <gtest/gtest.h>

#include <quoin/io/file.h>
#include <quoin/io/formats.h>
#include <quoin/io/image_files.h>

#include "map/column_surface.h"
#include "map/map_log.h"
#include "map/map_tile.h"

namespace quoin {
namespace {

namespace fs = std::filesystem;

enum Kind : VoxelType { kGround = 1, kWater, kLamp, kGlass, kRoof };

VoxelRegistry types_of_test() {
  VoxelRegistry types;
  (void)types.add({.name = "ground", .colour = {120, 150, 90}});
  (void)types.add(
      {.name = "water", .colour = {40, 80, 200, 120}, .visibility = Visibility::Transparent, .light_cost = 1});
  (void)types.add({.name = "lamp", .colour = {250, 200, 90}, .emission = 1.0F});
  (void)types.add({.name = "glass", .colour = {200, 220, 220, 60}, .visibility = Visibility::Transparent});
  (void)types.add({.name = "roof", .colour = {30, 20, 20}});
  return types;
}

// A world of columns that a function fills, in parts of one chunk. Parts can change, vanish or be damaged.
class TestWorld final : public ChunkSource {
 public:
  using Fill = std::function<void(Chunk& chunk, IVec3 corner)>;

  TestWorld(std::vector<IBox> parts, Fill fill, const std::string& name = "test", const std::string& dimension = {},
            std::vector<std::string> dimensions = {})
      : ChunkSource(info_of(name, dimension, std::move(dimensions)), std::move(parts)), fill_(std::move(fill)) {}

  VoxelRegistry types() const override { return types_of_test(); }
  Result<SourcePart> read_part(std::size_t part) const override {
    if (part == failing) return make_error(ErrorCode::CannotRead, "the disk fails");
    SourcePart result;
    const IVec3 place = parts()[part].min;
    if (part == damaged) result.broken.push_back(make_error(ErrorCode::BadFormat, "damaged", "r.0.0.mca", 17));
    Chunk chunk;
    fill_(chunk, place * kChunkEdge);
    if (chunk.uniform() != kAir && part != damaged) result.chunks.push_back({place, std::move(chunk)});
    return result;
  }
  Result<VisitedColumns> visit_columns(std::size_t part, int top,
                                       FunctionRef<bool(IVec3 voxel, VoxelType type)> visit) const override {
    auto visited = ChunkSource::visit_columns(part, top, visit);
    if (visited && part == 0) visited->signs = signs;
    return visited;
  }
  Result<std::uint64_t> part_stamp(std::size_t part) const override {
    const auto changed = versions.find(part);
    return changed != versions.end() ? changed->second : std::uint64_t{1};
  }

  std::map<std::size_t, std::uint64_t> versions;  // stamps other than 1
  std::size_t failing = ~std::size_t{0};
  std::size_t damaged = ~std::size_t{0};
  std::vector<SourceSign> signs;

 private:
  static ChunkSourceInfo info_of(const std::string& name, const std::string& dimension,
                                 std::vector<std::string> dimensions) {
    ChunkSourceInfo info;
    info.format = "test";
    info.name = name;
    info.dimension = dimension;
    info.dimensions = std::move(dimensions);
    return info;
  }
  Fill fill_;
};

std::vector<IBox> square_of_parts(int first, int end) {
  std::vector<IBox> parts;
  for (int z = first; z < end; ++z) {
    for (int x = first; x < end; ++x) parts.push_back({{x, 0, z}, {x + 1, 1, z + 1}});
  }
  return parts;
}

// Hills with a lake, a lamp and a glass roof.
void fill_hills(Chunk& chunk, IVec3 corner) {
  for (int z = 0; z < kChunkEdge; ++z) {
    for (int x = 0; x < kChunkEdge; ++x) {
      const double far = std::hypot(corner.x + x, corner.z + z);
      const int height = static_cast<int>(16.0 + 10.0 * std::sin(far / 23.0));
      for (int y = 0; y < height; ++y) chunk.set(x, y, z, kGround);
      for (int y = height; y < 12; ++y) chunk.set(x, y, z, kWater);
    }
  }
  if (corner == IVec3(0)) {
    chunk.set(40, 50, 40, kLamp);
    for (int x = 10; x < 20; ++x) chunk.set(x, 60, 12, kGlass);
  }
}

class WorldMap : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(testing::TempDir()) /
              ("quoin_map_" + std::string(testing::UnitTest::GetInstance()->current_test_info()->name()));
    fs::remove_all(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  // All files of a map but the log, which depends on the order of work.
  static std::map<std::string, std::vector<std::byte>> files_in(const fs::path& folder) {
    std::map<std::string, std::vector<std::byte>> files;
    for (const auto& entry : fs::recursive_directory_iterator(folder)) {
      if (!entry.is_regular_file() || entry.path().extension() == ".log") continue;
      files[fs::relative(entry.path(), folder).generic_string()] = *read_file(entry.path());
    }
    return files;
  }
  static std::set<std::string> tiles_in(const fs::path& folder) {
    std::set<std::string> tiles;
    for (const auto& [name, bytes] : files_in(folder)) {
      if (name.starts_with("tiles/")) tiles.insert(name);
    }
    return tiles;
  }
  AlphaImage tile(int z, int x, int y) const {
    const fs::path file = folder_ / "tiles" / std::to_string(z) / std::to_string(x) / (std::to_string(y) + ".png");
    auto image = read_alpha_image(file);
    EXPECT_TRUE(image) << file;
    return image ? std::move(*image) : AlphaImage{256, 256, std::vector<std::uint8_t>(256 * 256 * 4)};
  }
  static std::array<int, 4> pixel(const AlphaImage& image, int x, int y) {
    const auto at = static_cast<std::size_t>(4 * (y * 256 + x));
    return {image.rgba[at], image.rgba[at + 1], image.rgba[at + 2], image.rgba[at + 3]};
  }
  Result<DrawnMap> draw(const ChunkSource& world, unsigned threads = 2, const Progress& progress = {}) const {
    return draw_map(world, folder_, {.tiles = MapTiles::Png, .threads = {threads}}, progress);
  }

  fs::path folder_;
};

TEST_F(WorldMap, PlacesColumnsInTilesOfAllZooms) {
  // One green column at (-1, -300) and one lamp at (700, 20); zooms go on until tiles -1 and 0 are left.
  const TestWorld world({{{-1, 0, -5}, {0, 1, -4}}, {{10, 0, 0}, {11, 1, 1}}}, [](Chunk& chunk, IVec3 corner) {
    if (corner.x < 0) chunk.set(63, 5, 20, kGround);
    if (corner.x > 0) chunk.set(60, 5, 20, kLamp);
  });
  const auto drawn = draw(world);
  ASSERT_TRUE(drawn) << to_string(drawn.error());
  EXPECT_EQ(tiles_in(folder_), (std::set<std::string>{"tiles/18/-1/-2.png", "tiles/18/2/0.png", "tiles/17/-1/-1.png",
                                                      "tiles/17/1/0.png", "tiles/16/-1/-1.png", "tiles/16/0/0.png"}));
  EXPECT_EQ(drawn->tiles_written, 6U);
  EXPECT_EQ(drawn->chunks, 2U);
  EXPECT_EQ(pixel(tile(18, 2, 0), 700 - 512, 20), (std::array{250, 200, 90, 255})) << "lamps are not darkened";
  EXPECT_EQ(pixel(tile(18, 2, 0), 700 - 512, 21)[3], 0);
  const auto green = pixel(tile(18, -1, -2), 255, 512 - 300);
  EXPECT_EQ(green[3], 255);
  EXPECT_GT(green[1], green[0]);
  EXPECT_EQ(pixel(tile(17, 1, 0), (700 - 512) / 2, 10), (std::array{250, 200, 90, 64}));
}

TEST_F(WorldMap, DarkensByReliefSkyAndDepthOfWater) {
  const TestWorld world(square_of_parts(0, 2), [](Chunk& chunk, IVec3 corner) {
    const auto set = [&](int x, int z, int height, VoxelType type) {
      if (chunk_of({x, 0, z}) * kChunkEdge != corner) return;
      for (int y = 0; y < height; ++y) chunk.set(local_of({x, y, z}), type);
    };
    for (int z = 0; z < 128; ++z) {
      for (int x = 0; x < 128; ++x) set(x, z, 10, kGround);
    }
    for (int i = 30; i < 40; ++i) {
      for (int z = 30; z < 40; ++z) set(i, z, 20, kGround);  // a block of ten
    }
    // A basin whose depth grows to the east, filled with water.
    for (int x = 60; x < 90; ++x) {
      for (int z = 60; z < 90; ++z) {
        for (int y = 9 - (x - 60) / 4; y < 10; ++y) {
          if (chunk_of({x, 0, z}) * kChunkEdge == corner) chunk.set(local_of({x, y, z}), kWater);
        }
      }
    }
  });
  ASSERT_TRUE(draw(world));
  const AlphaImage image = tile(18, 0, 0);
  const auto green = [&](int x, int z) { return pixel(image, x, z)[1]; };
  EXPECT_EQ(green(5, 110), 150) << "level ground keeps its colour";
  EXPECT_LT(green(41, 35), green(44, 35)) << "at the foot of a cliff";
  EXPECT_LT(green(44, 35), green(5, 110));
  EXPECT_GT(green(30, 35), green(39, 35)) << "light comes from the west";
  EXPECT_GT(green(35, 30), green(35, 39)) << "and from the north";
  for (int x = 64; x < 86; x += 4) EXPECT_LT(green(x + 4, 75), green(x, 75)) << "deeper at " << x + 4;
  EXPECT_LT(pixel(image, 62, 75)[0], pixel(image, 5, 110)[0]) << "water takes red first";
}

TEST_F(WorldMap, ShowsWhatIsBelowRoof) {
  const TestWorld world(square_of_parts(0, 1), [](Chunk& chunk, IVec3) {
    for (int z = 0; z < 64; ++z) {
      for (int x = 0; x < 64; ++x) {
        chunk.set(x, 4, z, kGround);
        for (int y = 30; y < 60; ++y) chunk.set(x, y, z, kRoof);
        if (x >= 32) {
          for (int y = 0; y < 30; ++y) chunk.set(x, y, z, kRoof);  // solid rock down to the floor
        }
      }
    }
  });
  ASSERT_TRUE(draw_map(world, folder_, {.tiles = MapTiles::Png, .ceiling = 40}));
  const AlphaImage image = tile(18, 0, 0);
  EXPECT_EQ(pixel(image, 8, 8), (std::array{120, 150, 90, 255}));
  EXPECT_EQ(pixel(image, 60, 8)[3], 0) << "nothing is open there";
}

TEST_F(WorldMap, KeepsUnchangedTiles) {
  TestWorld world(square_of_parts(-9, 9), fill_hills);
  const auto first = draw(world);
  ASSERT_TRUE(first);
  const auto files = files_in(folder_);
  const auto again = draw(world, 1);
  ASSERT_TRUE(again);
  EXPECT_EQ(again->tiles_written, 0U);
  EXPECT_EQ(again->tiles_kept, first->tiles_written);
  EXPECT_EQ(again->chunks, 0U) << "nothing is read";
  EXPECT_EQ(files_in(folder_), files);
  // A part in the middle of a tile: this tile and its parents.
  world.versions[static_cast<std::size_t>(9 * 18 + 9 + 1) + 18] = 2;
  const auto one = draw(world);
  ASSERT_TRUE(one);
  EXPECT_EQ(one->tiles_written, 3U);
  EXPECT_EQ(files_in(folder_), files) << "the same content gives the same files";
  // A part at the corner of four tiles darkens all of them.
  world.versions[static_cast<std::size_t>(9 * 18 + 9)] = 2;
  const auto corner = draw(world);
  ASSERT_TRUE(corner);
  EXPECT_EQ(corner->tiles_written, 12U);
  // A stamp of 0 is unknown: the part is drawn by every run.
  world.versions[static_cast<std::size_t>(9 * 18 + 9 + 1) + 18] = 0;
  EXPECT_EQ(draw(world)->tiles_written, 3U);
  EXPECT_EQ(draw(world)->tiles_written, 3U);
}

TEST_F(WorldMap, RemovesTilesOfDeletedParts) {
  ASSERT_TRUE(draw(TestWorld(square_of_parts(-9, 9), fill_hills)));
  const TestWorld smaller(square_of_parts(-9, 5), fill_hills);
  const auto less = draw(smaller);
  ASSERT_TRUE(less);
  EXPECT_GT(less->tiles_removed, 0U);
  const auto files = files_in(folder_);
  fs::remove_all(folder_);
  ASSERT_TRUE(draw(smaller));
  EXPECT_EQ(files_in(folder_), files) << "as if it had always been smaller";
  // A tile whose content vanished is removed too.
  ASSERT_TRUE(fs::exists(folder_ / "tiles/18/0/0.png"));
  TestWorld empty(square_of_parts(-9, 5), [](Chunk&, IVec3) {});
  for (std::size_t i = 0; i < empty.parts().size(); ++i) empty.versions[i] = 2;
  ASSERT_TRUE(draw(empty));
  EXPECT_TRUE(tiles_in(folder_).empty());
}

TEST_F(WorldMap, IsEqualForAnyThreadsAndInterruptions) {
  const TestWorld world(square_of_parts(-6, 6), fill_hills);
  ASSERT_TRUE(draw(world, 1));
  const auto files = files_in(folder_);
  ASSERT_GT(files.size(), 10U);
  fs::remove_all(folder_);
  // Cancelled again and again, a step later each time; the log loses its last bytes meanwhile.
  int runs = 0;
  for (bool is_done = false; !is_done; ++runs) {
    ASSERT_LT(runs, 100);
    int steps = 0;
    const auto drawn = draw(world, 2, [&](double fraction) { return fraction <= 0.1 || ++steps < 3; });
    is_done = drawn.has_value();
    if (is_done) break;
    EXPECT_EQ(drawn.error().code, ErrorCode::Cancelled);
    const fs::path log = folder_ / "state" / "overworld.log";
    if (runs % 2 == 0) fs::resize_file(log, fs::file_size(log) - 3);
  }
  EXPECT_GT(runs, 3);
  EXPECT_EQ(files_in(folder_), files);
}

TEST_F(WorldMap, CanBeCancelledWhileItLooksForChanges) {
  const TestWorld world(square_of_parts(-2, 2), fill_hills);
  const auto drawn = draw(world, 1, [](double) { return false; });
  ASSERT_FALSE(drawn);
  EXPECT_EQ(drawn.error().code, ErrorCode::Cancelled);
  EXPECT_TRUE(tiles_in(folder_).empty());
}

TEST_F(WorldMap, IgnoresDamagedEndOfLog) {
  const TestWorld world(square_of_parts(-2, 2), fill_hills);
  ASSERT_TRUE(draw(world));
  const auto files = files_in(folder_);
  const fs::path file = folder_ / "state" / "overworld.log";
  const auto whole = *read_file(file);
  const auto line_end = std::ranges::find(whole, std::byte{'\n'}) - whole.begin();
  for (std::size_t at = static_cast<std::size_t>(line_end) + 1; at < whole.size(); at += 5) {
    auto bytes = whole;
    bytes[at] ^= std::byte{0x41};
    ASSERT_TRUE(write_file(bytes, file));
    ASSERT_TRUE(draw(world)) << at;
    EXPECT_EQ(files_in(folder_), files) << at;
  }
}

TEST_F(WorldMap, DrawsMissingTilesAgainAndNamesDamagedOnes) {
  TestWorld world(square_of_parts(-6, 6), fill_hills);
  ASSERT_TRUE(draw(world));
  const auto files = files_in(folder_);
  fs::remove(folder_ / "tiles/18/0/0.png");
  ASSERT_TRUE(write_file({}, folder_ / "tiles/18/-1/0.png"));
  const auto drawn = draw(world);
  ASSERT_TRUE(drawn);
  EXPECT_GE(drawn->tiles_written, 4U) << "and the tiles that they are part of";
  EXPECT_EQ(files_in(folder_), files);
  fs::remove_all(folder_ / "tiles");
  ASSERT_TRUE(draw(world));
  EXPECT_EQ(files_in(folder_), files);
  const std::string text = "no image";
  ASSERT_TRUE(write_file(std::as_bytes(std::span(text)), folder_ / "tiles/18/0/0.png"));
  world.versions[static_cast<std::size_t>(6 * 12 + 11)] = 2;  // in the tile to the right
  const auto damaged = draw(world);
  ASSERT_FALSE(damaged);
  EXPECT_EQ(damaged.error().code, ErrorCode::BadFormat);
  EXPECT_NE(damaged.error().message.find("delete it"), std::string::npos);
  fs::remove(damaged.error().path);
  ASSERT_TRUE(draw(world));
  EXPECT_EQ(files_in(folder_), files);
}

TEST_F(WorldMap, WritesNewLogWhenMostRecordsAreOld) {
  TestWorld world(square_of_parts(-2, 2), fill_hills);
  const fs::path log = folder_ / "state" / "overworld.log";
  std::uintmax_t largest = 0;
  bool has_shrunk = false;
  for (std::uint64_t run = 2; run < 200 && !has_shrunk; ++run) {
    world.versions[0] = run;
    ASSERT_TRUE(draw(world, 1));
    has_shrunk = fs::file_size(log) < largest / 2;
    largest = std::max(largest, fs::file_size(log));
  }
  EXPECT_TRUE(has_shrunk);
  EXPECT_EQ(draw(world)->tiles_written, 0U) << "the new log has all tiles";
}

TEST_F(WorldMap, KeepsDimensionsApartAndRemovesDeletedOnes) {
  const std::vector<std::string> all = {"minecraft:overworld", "a:b/c", "a:b-c", "../../x"};
  for (const std::string& dimension : all) {
    ASSERT_TRUE(draw(TestWorld(square_of_parts(0, 1), fill_hills, "test", dimension, all))) << dimension;
  }
  const auto names = [&] {
    std::set<std::string> found;
    for (const auto& entry : fs::directory_iterator(folder_ / "tiles")) found.insert(entry.path().filename().string());
    return found;
  };
  EXPECT_EQ(names(),
            (std::set<std::string>{"18", "dimension-a.3ab.2fc", "dimension-a.3ab-c", "dimension-.2e.2e.2f.2e.2e.2fx"}));
  const std::vector<std::string> fewer = {"minecraft:overworld", "a:b-c"};
  ASSERT_TRUE(draw(TestWorld(square_of_parts(0, 1), fill_hills, "test", "minecraft:overworld", fewer)));
  EXPECT_EQ(names(), (std::set<std::string>{"18", "dimension-a.3ab-c"}));
  const auto layers = *read_file(folder_ / "layers.js");
  EXPECT_EQ(std::string(reinterpret_cast<const char*>(layers.data()), layers.size()).find("2fc"), std::string::npos);
}

TEST_F(WorldMap, FollowsLinkedFolderOfTiles) {
  fs::create_directories(folder_);
  const fs::path elsewhere = folder_ / "elsewhere";
  fs::create_directories(elsewhere);
  fs::create_directory_symlink("elsewhere", folder_ / "tiles");
  ASSERT_TRUE(draw(TestWorld(square_of_parts(0, 1), fill_hills)));
  EXPECT_TRUE(fs::exists(elsewhere / "18/0/0.png"));
  const auto layers = *read_file(folder_ / "layers.js");
  const std::string text(reinterpret_cast<const char*>(layers.data()), layers.size());
  EXPECT_NE(text.find("\"tiles\":\"tiles\""), std::string::npos) << text;
}

TEST_F(WorldMap, DrawsHeightsNearLimits) {
  constexpr int kChunks = 1 << 25;  // the coordinate of the highest chunk, plus 1
  const TestWorld world({{{0, kChunks - 1, 0}, {1, kChunks, 1}}, {{1, -kChunks, 0}, {2, -kChunks + 1, 1}}},
                        [](Chunk& chunk, IVec3) { chunk.fill_row(63, 5, ~std::uint64_t{0}, kLamp); });
  ASSERT_TRUE(draw(world));
  const AlphaImage image = tile(18, 0, 0);
  EXPECT_EQ(pixel(image, 3, 5), (std::array{250, 200, 90, 255}));
  EXPECT_EQ(pixel(image, 70, 5), (std::array{250, 200, 90, 255}));
  fs::remove_all(folder_);
  for (const int ceiling : {std::numeric_limits<int>::max(), std::numeric_limits<int>::min()}) {
    EXPECT_TRUE(draw_map(world, folder_ / std::to_string(ceiling), {.tiles = MapTiles::Png, .ceiling = ceiling}));
  }
}

TEST_F(WorldMap, RefusesFolderOfOtherMap) {
  ASSERT_TRUE(draw(TestWorld(square_of_parts(0, 1), fill_hills)));
  const auto other = draw(TestWorld(square_of_parts(0, 1), fill_hills, "other"));
  ASSERT_FALSE(other);
  EXPECT_EQ(other.error().code, ErrorCode::InvalidArgument);
  EXPECT_NE(other.error().message.find("another world"), std::string::npos);
  const TestWorld world(square_of_parts(0, 1), fill_hills);
  EXPECT_FALSE(draw_map(world, folder_, {.tiles = MapTiles::Png, .ceiling = 9})) << "with another ceiling";
  auto bytes = *read_file(folder_ / "state" / "overworld.log");
  bytes[11 - 1] = std::byte{'9'};
  ASSERT_TRUE(write_file(bytes, folder_ / "state" / "overworld.log"));
  const auto newer = draw(world);
  ASSERT_FALSE(newer);
  EXPECT_NE(newer.error().message.find("another version"), std::string::npos);
}

TEST_F(WorldMap, RefusesSecondDrawer) {
  const TestWorld world(square_of_parts(0, 1), fill_hills);
  std::optional<ErrorCode> second;
  const auto first = draw(world, 1, [&](double) {
    const auto same = draw(world, 1);
    second = same ? std::nullopt : std::optional(same.error().code);
    return true;
  });
  ASSERT_TRUE(first);
  EXPECT_EQ(second, ErrorCode::InvalidArgument);
}

TEST_F(WorldMap, ReportsErrorsAndHoles) {
  TestWorld world(square_of_parts(-2, 2), fill_hills);
  world.failing = 5;
  const auto failed = draw(world);
  ASSERT_FALSE(failed);
  EXPECT_EQ(failed.error().code, ErrorCode::CannotRead);
  world.failing = ~std::size_t{0};
  world.damaged = 5;
  const auto with_hole = draw(world);
  ASSERT_TRUE(with_hole);
  ASSERT_EQ(with_hole->warnings.size(), 1U);
  EXPECT_NE(with_hole->warnings[0].find("a hole in the map: r.0.0.mca"), std::string::npos) << with_hole->warnings[0];
  // A file where the folder of the tiles should be.
  fs::remove_all(folder_);
  fs::create_directories(folder_);
  ASSERT_TRUE(write_file({}, folder_ / "tiles"));
  const auto blocked = draw(world);
  ASSERT_FALSE(blocked);
  EXPECT_EQ(blocked.error().code, ErrorCode::CannotWrite);
}

TEST_F(WorldMap, WritesSignsAsTextOnly) {
  TestWorld world(square_of_parts(0, 1), fill_hills);
  world.signs = {{{5, 20, 9}, "</script><img src=x onerror=alert(1)>\n\"quoted\""}, {{2, 20, 3}, "caf\xC3\xA9"}};
  ASSERT_TRUE(draw(world));
  const auto bytes = *read_file(folder_ / "markers.js");
  const std::string text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  EXPECT_EQ(
      text,
      "window.quoinMarkers = {\"overworld\":[{\"x\":2,\"y\":20,\"z\":3,\"kind\":\"sign\",\"text\":\"caf\xC3\xA9\"},"
      "{\"x\":5,\"y\":20,\"z\":9,\"kind\":\"sign\",\"text\":\"</script><img src=x onerror=alert(1)>\\n"
      "\\\"quoted\\\"\"}]};\n");
  // The signs of tiles that are kept stay.
  ASSERT_TRUE(draw(world));
  EXPECT_EQ(*read_file(folder_ / "markers.js"), bytes);
}

TEST_F(WorldMap, HasNoTilesOfEmptyWorld) {
  const auto drawn = draw(TestWorld({}, fill_hills));
  ASSERT_TRUE(drawn);
  EXPECT_EQ(drawn->tiles_written, 0U);
  EXPECT_TRUE(tiles_in(folder_).empty());
}

// ---- other sources ----

// A flat field with a turned bar on it, and a lamp far away.
Scene small_scene() {
  Scene scene;
  scene.types = types_of_test();
  SceneGrid field;
  field.grid.fill_box({{0, 0, 0}, {100, 4, 100}}, kGround);
  field.grid.set({90, 4, 300}, kLamp);
  scene.add_instance({.grid = scene.add_grid(std::move(field))});
  SceneGrid bar;
  bar.grid.fill_box({{0, 0, 0}, {20, 2, 1}}, kRoof);
  Instance turned;
  turned.grid = scene.add_grid(std::move(bar));
  turned.position = {10.0, 4.0, 60.0};
  turned.rotation = glm::angleAxis(std::numbers::pi / 2.0, DVec3(0.0, 1.0, 0.0));  // along -z
  scene.add_instance(turned);
  return scene;
}

TEST_F(WorldMap, DrawsScenesAndWorldsOnDisk) {
  const Scene scene = small_scene();
  fs::create_directories(folder_);
  for (const char* const name : {"scene.json", "world.quoin"}) {
    const fs::path file = folder_ / name;
    ASSERT_TRUE(save_scene(scene, file)) << name;
    const auto source = open_map_source(file);
    ASSERT_TRUE(source) << to_string(source.error());
    const fs::path out = folder_ / (std::string(name) + "_map");
    const auto drawn = draw_map(**source, out, {.tiles = MapTiles::Png});
    ASSERT_TRUE(drawn) << to_string(drawn.error());
    EXPECT_GT(drawn->tiles_written, 2U);
    const auto image = read_alpha_image(out / "tiles/18/0/0.png");
    ASSERT_TRUE(image);
    EXPECT_EQ(pixel(*image, 50, 50), (std::array{120, 150, 90, 255})) << name;
    EXPECT_EQ(read_alpha_image(out / "tiles/18/0/1.png").has_value(), true);
    // A world shows its largest grid, a scene all of them.
    const bool has_bar = pixel(*image, 10, 50)[0] < 60;
    EXPECT_EQ(has_bar, std::string(name) == "scene.json");
    const auto again = draw_map(**open_map_source(file), out, {.tiles = MapTiles::Png});
    ASSERT_TRUE(again);
    EXPECT_EQ(again->tiles_written, 0U) << name;
  }
}

TEST_F(WorldMap, RefusesScenesWithoutLattice) {
  Scene scene = small_scene();
  const InstanceHandle last = scene.instances().handles().back();
  scene.edit(last).rotation = glm::angleAxis(0.3, DVec3(0.0, 1.0, 0.0));
  fs::create_directories(folder_);
  ASSERT_TRUE(save_scene(scene, folder_ / "scene.json"));
  const auto source = open_map_source(folder_ / "scene.json");
  ASSERT_FALSE(source);
  EXPECT_EQ(source.error().code, ErrorCode::Unsupported);
  EXPECT_FALSE(open_map_source(folder_ / "missing.vox"));
}

// ---- looks ----

TEST(TypeLook, IsThatOfUpperFace) {
  const auto textured = [](std::uint8_t grey, std::uint8_t alpha) {
    AlphaImage image{16, 16, {}};
    for (int i = 0; i < 256; ++i)
      image.rgba.insert(image.rgba.end(), {grey, grey, grey, i % 2 == 0 ? alpha : std::uint8_t{255}});
    return *Texture::from_image("t", image);
  };
  VoxelRegistry types;
  const VoxelFace top{.texture = textured(188, 255), .tint = {255, 0, 0}};
  const VoxelFace side{.texture = textured(10, 255)};
  const VoxelType grass = *types.add({.faces = VoxelFaces(side, top, side)});
  const map::TypeLook of_grass = map::look_from_above(types, grass);
  EXPECT_NEAR(of_grass.colour.x, 0.5F, 0.01F);
  EXPECT_EQ(of_grass.colour.y, 0.0F);
  EXPECT_EQ(of_grass.coverage, 1.0F);
  const VoxelType leaves = *types.add({.visibility = Visibility::Transparent,
                                       .faces = VoxelFace{.texture = textured(90, 0), .alpha = FaceAlpha::Cutout}});
  EXPECT_NEAR(map::look_from_above(types, leaves).coverage, 0.5F, 0.01F);
  const VoxelType slab = *types.add({.colour = {255, 255, 255}, .shapes = VoxelShape::box({0, 0, 0}, {16, 8, 8})});
  const map::TypeLook of_slab = map::look_from_above(types, slab);
  EXPECT_NEAR(of_slab.coverage, 0.5F, 0.01F);
  EXPECT_NEAR(of_slab.colour.x, 1.0F, 0.01F);
  const VoxelType flower = *types.add({.colour = {255, 0, 0}, .shapes = VoxelShape::crossed_plates()});
  const map::TypeLook of_flower = map::look_from_above(types, flower);
  EXPECT_GT(of_flower.coverage, 0.1F);
  EXPECT_LT(of_flower.coverage, 0.5F);
}

}  // namespace
}  // namespace quoin
