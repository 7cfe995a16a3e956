#include <quoin/io/heights.h>

#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <unistd.h>
#include <vector>

#include <gtest/gtest.h>

#include <quoin/io/file.h>
#include <quoin/io/formats.h>

namespace quoin {

namespace {

namespace fs = std::filesystem;
using Bytes = std::vector<std::byte>;

void put_big(Bytes& bytes, std::uint64_t value, int size) {
  for (int i = size - 1; i >= 0; --i) bytes.push_back(static_cast<std::byte>(value >> (8 * i)));
}

void put_chunk(Bytes& png, std::string_view name, const Bytes& content) {
  put_big(png, content.size(), 4);
  const std::size_t begin = png.size();
  for (const char c : name) png.push_back(static_cast<std::byte>(c));
  png.insert(png.end(), content.begin(), content.end());
  const auto* const covered = reinterpret_cast<const Bytef*>(png.data() + begin);
  put_big(png, crc32(0, covered, static_cast<uInt>(png.size() - begin)), 4);
}

/// Returns a PNG with one row per list, `bits` bits per sample. `kind`: 0 grey, 2 RGB, as in the file.
Bytes png_of(const std::vector<std::vector<unsigned>>& rows, int bits, int kind) {
  Bytes png;
  for (const unsigned char c : std::string_view("\x89PNG\r\n\x1a\n")) png.push_back(static_cast<std::byte>(c));
  Bytes header;
  put_big(header, rows.front().size() / (kind == 2 ? 3 : 1), 4);
  put_big(header, rows.size(), 4);
  for (const int value : {bits, kind, 0, 0, 0}) put_big(header, static_cast<unsigned>(value), 1);
  put_chunk(png, "IHDR", header);
  // A gamma chunk must not change heights.
  Bytes gamma;
  put_big(gamma, 100'000, 4);
  put_chunk(png, "gAMA", gamma);
  Bytes raw;
  for (const auto& row : rows) {
    raw.push_back(std::byte{0});
    for (const unsigned value : row) put_big(raw, value, bits / 8);
  }
  uLongf size = compressBound(static_cast<uLong>(raw.size()));
  Bytes packed(size);
  compress(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(raw.data()),
           static_cast<uLong>(raw.size()));
  packed.resize(size);
  put_chunk(png, "IDAT", packed);
  put_chunk(png, "IEND", {});
  return png;
}

HeightOptions options_of(HeightEncoding encoding) {
  HeightOptions options;
  options.encoding = encoding;
  options.metres_per_pixel = 1.0;
  return options;
}

std::vector<float> metres_of(const Bytes& file, const HeightOptions& options) {
  const auto map = read_height_map(file, options);
  EXPECT_TRUE(map) << to_string(map.error());
  return map ? map->metres : std::vector<float>();
}

HeightMap map_of(int width, int height, float metres) {
  HeightMap map;
  map.width = width;
  map.height = height;
  map.metres.assign(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), metres);
  return map;
}

const SceneGrid& first_content(const Scene& scene) {
  return scene.grids()[scene.grids().handles().front()];
}

Scene scene_of(const HeightMap& map, const HeightOptions& options) {
  auto scene = scene_from_heights(map, options);
  EXPECT_TRUE(scene) << to_string(scene.error());
  return scene ? std::move(*scene) : Scene();
}

TEST(Heights, DecodesEachEncodingByItsFormula) {
  HeightOptions grey = options_of(HeightEncoding::Grey);
  grey.metres_per_level = 0.5;
  EXPECT_EQ(metres_of(png_of({{0, 1}, {300, 65'535}}, 16, 0), grey), (std::vector<float>{0, 0.5F, 150, 32'767.5F}));
  EXPECT_EQ(metres_of(png_of({{0, 7, 255}}, 8, 0), grey), (std::vector<float>{0, 3.5F, 127.5F}));
  const HeightOptions mapbox = options_of(HeightEncoding::Mapbox);
  EXPECT_EQ(metres_of(png_of({{0, 0, 0, 1, 134, 160, 2, 27, 16}}, 8, 2), mapbox),
            (std::vector<float>{-10'000, 0, 3'800}));
  const HeightOptions terrarium = options_of(HeightEncoding::Terrarium);
  EXPECT_EQ(metres_of(png_of({{0, 0, 0, 128, 0, 0, 142, 192, 128}}, 8, 2), terrarium),
            (std::vector<float>{-32'768, 0, 3'776.5F}));
}

TEST(Heights, ReadsImagesAsHeightsOnlyOnRequest) {
  const Bytes grey = png_of({{0, 7, 255}}, 8, 0);
  EXPECT_EQ(detect_format(grey), std::nullopt);
  const auto refused = load_scene(grey);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("--heights"), std::string::npos);
  LoadOptions options;
  options.heights = HeightOptions{};
  EXPECT_FALSE(load_scene(grey, options)) << "as what is not said";
  options.heights->encoding = HeightEncoding::Mapbox;
  EXPECT_FALSE(load_scene(grey, options)) << "it has no colours";
  options.heights->encoding = HeightEncoding::Grey;
  EXPECT_FALSE(load_scene(png_of({{1, 2, 3}}, 8, 2), options)) << "it has colours";
  const auto loaded = load_scene(grey, options);
  ASSERT_TRUE(loaded);
  EXPECT_EQ(loaded->format, "heights");
  EXPECT_EQ(loaded->warnings.size(), 1U) << "of the distance of its pixels";
}

TEST(Heights, ReadsHgtMetresWithVoids) {
  Bytes file;
  for (int i = 0; i < 1201 * 1201; ++i) put_big(file, static_cast<std::uint16_t>(i == 1202 ? -32'768 : i % 7 - 3), 2);
  const auto map = read_height_map(file, {});
  ASSERT_TRUE(map);
  EXPECT_EQ(map->width, 1201);
  EXPECT_NEAR(map->metres_per_pixel, 92.77, 0.01);
  EXPECT_EQ(map->metres[2], -1.0F);
  EXPECT_TRUE(std::isnan(map->metres[1202]));
  EXPECT_EQ(map->warnings.size(), 1U);
  const fs::path path = fs::temp_directory_path() / ("quoin-" + std::to_string(::getpid()) + "-N35E138.hgt");
  ASSERT_TRUE(write_file(file, path));
  EXPECT_EQ(detect_format(path).value(), FileFormat::Heights);
  LoadOptions coarse;
  coarse.heights = HeightOptions{};
  coarse.heights->metres_per_voxel = 1'000.0;
  const auto loaded = load_scene(path, coarse);
  ASSERT_TRUE(loaded);
  EXPECT_EQ(first_content(loaded->scene).grid.bounds().size().x, 112);
  file.pop_back();
  ASSERT_TRUE(write_file(file, path));
  EXPECT_EQ(detect_format(path).value(), std::nullopt);
  EXPECT_FALSE(read_height_map(file, {}));
  fs::remove(path);
}

TEST(Heights, FillsColumnsUpToHeight) {
  HeightMap map = map_of(70, 5, 10.0F);
  map.metres[3] = 12.4F;
  map.metres[4] = 12.6F;
  map.metres[70 * 4 + 69] = std::numeric_limits<float>::quiet_NaN();
  HeightOptions options;
  options.depth = 3;
  const Scene scene = scene_of(map, options);
  const Grid& grid = first_content(scene).grid;
  EXPECT_EQ(grid.voxel_count(), 347 * 3 + 5 + 6);
  EXPECT_EQ(grid.bounds(), (IBox{{0, 7, 0}, {70, 13, 5}}));
  EXPECT_EQ(grid.get(3, 11, 0) != kAir, true);
  EXPECT_EQ(grid.get(3, 12, 0), kAir);
  EXPECT_EQ(grid.get(4, 12, 0) != kAir, true);
  EXPECT_EQ(grid.get(69, 9, 4), kAir) << "a void";
  EXPECT_EQ(scene.types[grid.get(30, 9, 2)].name, "grass");
  EXPECT_EQ(scene.types[grid.get(3, 11, 0)].name, "stone") << "steep";
}

TEST(Heights, AppliesVoxelSizeAndExaggeration) {
  HeightMap map = map_of(9, 3, 100.0F);
  map.metres_per_pixel = 10.0;
  for (int z = 0; z < 3; ++z) map.metres[static_cast<std::size_t>(9 * z + 1)] = 140.0F;
  HeightOptions options;
  options.metres_per_voxel = 5.0;
  options.vertical_exaggeration = 2.0;
  options.depth = 1;
  const Scene scene = scene_of(map, options);
  const Grid& grid = first_content(scene).grid;
  EXPECT_EQ(grid.bounds(), (IBox{{0, 39, 0}, {17, 56, 5}}));
  EXPECT_NE(grid.get(2, 55, 4), kAir);
  EXPECT_NE(grid.get(1, 47, 0), kAir) << "halfway between 40 and 56";
  EXPECT_EQ(grid.get(1, 48, 0), kAir);
  EXPECT_EQ(scene.instances()[scene.instances().handles().front()].voxel_size, 5.0);
}

TEST(Heights, DensitiesMatchDistanceToPlane) {
  HeightMap map = map_of(100, 90, 0.0F);
  for (int z = 0; z < 90; ++z) {
    for (int x = 0; x < 100; ++x)
      map.metres[static_cast<std::size_t>(100 * z + x)] = 20.0F + 0.75F * static_cast<float>(x);
  }
  HeightOptions options;
  options.as_field = true;
  options.depth = 40;
  const Scene scene = scene_of(map, options);
  const DensityGrid& field = first_content(scene).field;
  for (int x = 10; x < 90; x += 7) {
    for (int y = -20; y < 100; ++y) {
      const double distance = (y - 20.0 - 0.75 * x) / 1.25;
      if (y < -10 || std::abs(distance) > 7.9) continue;
      EXPECT_NEAR(field.density({x, y, 33}), distance, 0.01) << x << ", " << y;
    }
  }
  EXPECT_LE(field.density({50, -10, 50}), -8.0F);
  for (const IVec3 outermost :
       {IVec3(0, 0, 50), IVec3(99, 0, 50), IVec3(50, 0, 0), IVec3(50, 0, 89), IVec3(50, -20, 50)}) {
    EXPECT_EQ(field.density(outermost), 0.5F) << outermost.x << ", " << outermost.y << ", " << outermost.z;
  }
  EXPECT_EQ(field.solid_bounds().min, IVec3(1, -19, 1));
}

TEST(Heights, MatchesAtAnyThreadCount) {
  HeightMap map = map_of(200, 150, 0.0F);
  for (std::size_t i = 0; i < map.metres.size(); ++i) map.metres[i] = static_cast<float>((i * 7919) % 97);
  for (const bool as_field : {false, true}) {
    HeightOptions options;
    options.as_field = as_field;
    const auto one = scene_from_heights(map, options, {1});
    const auto four = scene_from_heights(map, options, {4});
    ASSERT_TRUE(one && four);
    const SceneGrid& a = first_content(*one);
    const SceneGrid& b = first_content(*four);
    ASSERT_EQ(a.grid.chunks(), b.grid.chunks());
    for (const IVec3 place : a.grid.chunks()) EXPECT_EQ(*a.grid.find_chunk(place), *b.grid.find_chunk(place));
    ASSERT_EQ(a.field.chunks(), b.field.chunks());
    for (const IVec3 place : a.field.chunks()) EXPECT_EQ(*a.field.find_chunk(place), *b.field.find_chunk(place));
  }
}

TEST(Heights, RefusesOptionsOutOfRange) {
  const HeightMap map = map_of(10, 10, 5.0F);
  for (const double length : {0.0, -1.0, 1e9, std::numeric_limits<double>::quiet_NaN()}) {
    HeightOptions options;
    options.metres_per_voxel = length;
    EXPECT_FALSE(scene_from_heights(map, options)) << length;
  }
  HeightOptions options;
  options.depth = 0;
  EXPECT_FALSE(scene_from_heights(map, options));
  options = {};
  options.metres_per_voxel = 1e-4;
  const auto refused = scene_from_heights(map, options);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::LimitExceeded);
  options = {};
  options.vertical_exaggeration = 1e5;
  HeightMap steep = map;
  steep.metres[0] = 0.0F;
  EXPECT_EQ(scene_from_heights(steep, options).error().code, ErrorCode::LimitExceeded);
  steep.metres.assign(100, std::numeric_limits<float>::quiet_NaN());
  EXPECT_EQ(first_content(*scene_from_heights(steep, {})).grid.voxel_count(), 0);
}

TEST(Heights, RefusesDamagedImages) {
  const Bytes sound = png_of({{0, 1, 2}, {300, 65'535, 9}}, 16, 0);
  const HeightOptions options = options_of(HeightEncoding::Grey);
  for (std::size_t size = 0; size + 12 < sound.size(); ++size) {
    EXPECT_FALSE(read_height_map(std::span(sound).first(size), options)) << size;
  }
  Bytes huge = sound;
  for (std::size_t i = 16; i < 24; ++i) huge[i] = std::byte{0x00};
  huge[18] = huge[22] = std::byte{0x3F};
  EXPECT_FALSE(read_height_map(huge, options));
  int read = 0;
  for (const char* folder : {"png", "heights"}) {
    for (const auto& entry : fs::directory_iterator(fs::path(QUOIN_SOURCE_DIR) / "tests" / "corpus" / folder)) {
      const auto bytes = read_file(entry.path());
      ASSERT_TRUE(bytes);
      for (const auto encoding : {HeightEncoding::Grey, HeightEncoding::Mapbox, HeightEncoding::Terrarium}) {
        const auto map = read_height_map(*bytes, options_of(encoding));
        if (!map) continue;
        ++read;
        EXPECT_EQ(map->metres.size(), static_cast<std::size_t>(map->width) * static_cast<std::size_t>(map->height));
      }
    }
  }
  EXPECT_GT(read, 4);
}

TEST(Heights, ReadsRealTileOfMountFuji) {
  const fs::path path = fs::path(QUOIN_SOURCE_DIR) / "../shared/data/dem/mapbox+martini/test__fixtures__fuji.png";
  if (!fs::exists(path)) GTEST_SKIP() << path << " is not there";
  LoadOptions options;
  options.heights = options_of(HeightEncoding::Mapbox);
  options.heights->metres_per_pixel = 37.03;
  const auto bytes = read_file(path);
  ASSERT_TRUE(bytes);
  const auto map = read_height_map(*bytes, *options.heights);
  ASSERT_TRUE(map);
  EXPECT_EQ(*std::ranges::min_element(map->metres), 13.7F);
  EXPECT_EQ(*std::ranges::max_element(map->metres), 3'751.0F);
  const auto loaded = load_scene(path, options);
  ASSERT_TRUE(loaded);
  // Counted by an independent program.
  EXPECT_EQ(loaded->scene.voxel_count(), 8'676'083);
}

}  // namespace

}  // namespace quoin
