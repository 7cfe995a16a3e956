#include <array>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

#include <quoin/io/file.h>
#include <quoin/io/formats.h>

#include "core/death_for_tests.h"
#include "io/byte_stream.h"
#include "io/format_driver.h"
#include "io/image/image_codecs.h"
#include "io/models/model_builder.h"

namespace quoin::models {
namespace {

Result<LoadedScene> read_as(FileFormat format, std::span<const std::byte> bytes) {
  return driver_of(format).read({{}, bytes, {}, {}, {}});
}

namespace fs = std::filesystem;

/// Writes numbers in little-endian order.
class Writer {
 public:
  std::vector<std::byte> bytes;
  Writer& number(std::uint64_t value, int size) {
    for (int i = 0; i < size; ++i) bytes.push_back(static_cast<std::byte>(i < 8 ? value >> (8 * i) : 0));
    return *this;
  }
  Writer& big(std::uint64_t value, int size) {
    for (int i = size - 1; i >= 0; --i) bytes.push_back(static_cast<std::byte>(value >> (8 * i)));
    return *this;
  }
  Writer& text(std::string_view value) {
    for (const char c : value) bytes.push_back(static_cast<std::byte>(c));
    return *this;
  }
  Writer& append(std::span<const std::byte> more) {
    bytes.insert(bytes.end(), more.begin(), more.end());
    return *this;
  }
  Writer& u32s(std::initializer_list<std::uint32_t> values) {
    for (const std::uint32_t value : values) number(value, 4);
    return *this;
  }
};

constexpr std::uint32_t kRed = 0xFF0000FF;  // r, g, b, a
constexpr std::uint32_t kBlue = 0xFFFF0000;

// Returns the content as an uncompressed zlib stream.
std::vector<std::byte> zlib_stored(std::span<const std::byte> content) {
  Writer writer;
  writer.number(0x78, 1).number(0x01, 1).number(1, 1);
  writer.number(content.size(), 2).number(~content.size() & 0xFFFF, 2).append(content);
  std::uint32_t a = 1;
  std::uint32_t b = 0;
  for (const std::byte byte : content) {
    a = (a + std::to_integer<std::uint32_t>(byte)) % 65521;
    b = (b + a) % 65521;
  }
  return writer.big(b << 16 | a, 4).bytes;
}

// Each of these files has a red voxel, and a blue voxel next to it at greater x. Voxlap's files have z down, Goxel's
// up.
std::vector<std::byte> binvox() {
  Writer writer;
  writer.text("#binvox 1\ndim 2 2 2\ntranslate 1 2 3\nscale 4\ndata\n");
  return writer.number(1, 1)
      .number(1, 1)
      .number(0, 1)
      .number(3, 1)
      .number(1, 1)
      .number(1, 1)
      .number(0, 1)
      .number(3, 1)
      .bytes;
}
std::vector<std::byte> cub() {
  Writer writer;
  return writer.u32s({2, 1, 1}).number(0x0000FF, 3).number(0xFF0000, 3).bytes;
}
std::vector<std::byte> kv6() {
  Writer writer;
  writer.text("Kvxl").u32s({2, 1, 4, 0, 0, 0, 2});
  writer.number(0x80FF0000, 4).number(3, 2).number(63, 2);  // blue, green, red
  writer.number(0x800000FF, 4).number(3, 2).number(63, 2);
  return writer.u32s({1, 1}).number(1, 2).number(1, 2).bytes;
}
std::vector<std::byte> slab6() {
  Writer writer;
  writer.u32s({2, 1, 4});
  for (int x = 0; x < 2; ++x) {
    for (int z = 0; z < 4; ++z) writer.number(z == 3 ? static_cast<std::uint64_t>(x) : 255, 1);
  }
  for (int i = 0; i < 256; ++i) writer.number(i == 0 ? 63 : i == 1 ? 63 << 16 : 0, 3);
  return writer.bytes;
}
std::vector<std::byte> kvx() {
  Writer slabs;
  slabs.number(3, 1).number(1, 1).number(63, 1).number(0, 1).number(3, 1).number(1, 1).number(63, 1).number(1, 1);
  Writer level;
  level.u32s({2, 1, 4, 0, 0, 0});
  const std::uint32_t first = 3 * 4 + 2 * 2 * 2;
  level.u32s({first, first + 4, first + 8});
  level.number(0, 2).number(4, 2).number(0, 2).number(4, 2).append(slabs.bytes);
  Writer writer;
  writer.number(level.bytes.size(), 4).append(level.bytes);
  for (int i = 0; i < 256; ++i) writer.number(i == 0 ? 63 : i == 1 ? 63 << 16 : 0, 3);
  return writer.bytes;
}
std::vector<std::byte> qb(bool is_packed, bool is_right_handed) {
  Writer writer;
  writer.u32s({0x101, 0, is_right_handed ? 1U : 0U, is_packed ? 1U : 0U, 0, 1});
  writer.number(1, 1).text("m").u32s({2, 1, 1, 0, 0, 5});
  if (is_packed) return writer.u32s({2, 1, kRed, kBlue, 6}).bytes;
  return writer.u32s({kRed, kBlue}).bytes;
}
std::vector<std::byte> qbt(bool has_map) {
  Writer voxels;
  voxels.u32s({has_map ? 0xFF000001 : kRed, has_map ? 0xFF000000 : kBlue});
  const std::vector<std::byte> packed = zlib_stored(voxels.bytes);
  Writer matrix;
  matrix.number(1, 4).text("m").u32s({0, 0, 0, 1, 1, 1, 0, 0, 0, 2, 1, 1});
  matrix.number(packed.size(), 4).append(packed);
  Writer model;
  model.u32s({1, 0}).number(matrix.bytes.size(), 4).append(matrix.bytes);
  Writer writer;
  writer.text("QB 2").number(1, 2).u32s({0, 0, 0}).text("COLORMAP");
  has_map ? writer.u32s({2, kBlue, kRed}) : writer.u32s({0});
  return writer.text("DATATREE").number(1, 4).number(model.bytes.size(), 4).append(model.bytes).bytes;
}
/// A compound of two voxels, made of a matrix that the reader skips; a run of one, whose other bytes have no meaning.
std::vector<std::byte> qbcl() {
  const auto matrix = [](Writer& writer, int kind, std::span<const std::byte> voxels) {
    writer.u32s({static_cast<std::uint32_t>(kind), 1}).number(1, 4).text("m").number(0x0101, 3);
    writer.u32s({2, 1, 1, 0, 0, 0, 0, 0, 0}).number(voxels.size(), 4).append(voxels);
  };
  Writer voxels;
  voxels.number(2, 2).u32s({0x02696001, kRed}).number(1, 2).u32s({0x40FF0000});
  Writer others;
  others.number(0, 2).number(0, 2);
  Writer writer;
  writer.text("QBCL").u32s({0x203, 2, 1, 1, 0x12345678}).u32s({0, 0, 3}).text("tag").u32s({0, 0, 0, 0});
  writer.number(0, 16).u32s({1, 1}).number(5, 4).text("Model").number(0x0101, 3).number(0, 36).number(1, 4);
  matrix(writer, 2, zlib_stored(voxels.bytes));
  writer.number(1, 4);
  matrix(writer, 0, zlib_stored(others.bytes));
  return writer.bytes;
}
std::vector<std::byte> qef() {
  Writer writer;
  return writer
      .text(
          "Qubicle Exchange Format\nVersion 0.2\nwww.minddesk.com\n2 1 1\n2\n1.0 0.0 0.0\n0 0 1\n0 0 0 0 63\n1 0 0 1 "
          "63\n")
      .bytes;
}
std::vector<std::byte> goxel() {
  PngImage image{64, 64, 4, std::vector<std::uint8_t>(64 * 64 * 4, 0)};
  image.pixels[0] = image.pixels[3] = 255;
  image.pixels[6] = image.pixels[7] = 255;
  const auto block = encode_png(image).value();
  Writer layer;
  layer.u32s({1, 0, 0, 0, 0, 0}).number(4, 4).text("name").number(4, 4).text("base").number(0, 4);
  Writer writer;
  writer.text("GOX ").number(2, 4);
  writer.text("BL16").number(block.size(), 4).append(block).number(0, 4);
  return writer.text("LAYR").number(layer.bytes.size(), 4).append(layer.bytes).number(0, 4).bytes;
}
std::vector<std::byte> mts() {
  Writer nodes;
  nodes.big(1, 2).big(2, 2).number(0x7F7F, 2).number(0, 2);
  Writer writer;
  writer.text("MTSM").big(4, 2).big(2, 2).big(1, 2).big(1, 2).number(0x7F, 1).big(3, 2);
  for (const std::string_view name : {"air", "default:stone", "default:dirt"}) writer.big(name.size(), 2).text(name);
  return writer.append(zlib_stored(nodes.bytes)).bytes;
}

struct Kind {
  const char* name;
  std::vector<std::byte> bytes;
  FileFormat format;
  bool has_colours = true;
};
std::vector<Kind> all_kinds() {
  return {{"binvox", binvox(), FileFormat::Binvox, false},
          {"cub", cub(), FileFormat::CubeWorld},
          {"kv6", kv6(), FileFormat::Voxlap},
          {"slab6", slab6(), FileFormat::Voxlap},
          {"kvx", kvx(), FileFormat::Voxlap},
          {"qb", qb(false, true), FileFormat::Qubicle},
          {"qb, packed", qb(true, true), FileFormat::Qubicle},
          {"qb, left-handed", qb(true, false), FileFormat::Qubicle},
          {"qbt", qbt(false), FileFormat::Qubicle},
          {"qbt, with a map", qbt(true), FileFormat::Qubicle},
          {"qbcl", qbcl(), FileFormat::Qubicle},
          {"qef", qef(), FileFormat::Qubicle},
          {"goxel", goxel(), FileFormat::Goxel},
          {"mts", mts(), FileFormat::LuantiSchematic, false}};
}

const SceneGrid& only_grid(const LoadedScene& loaded) {
  return loaded.scene.grids()[loaded.scene.grids().handles().front()];
}
Rgba8 colour_at(const LoadedScene& loaded, IVec3 voxel) {
  return loaded.scene.types[only_grid(loaded).grid.get(voxel)].colour;
}

TEST(Models, ReadsSameVoxelsFromEveryFormat) {
  for (const Kind& kind : all_kinds()) {
    SCOPED_TRACE(kind.name);
    EXPECT_EQ(detect_format(kind.bytes), kind.format);
    const auto loaded = load_scene(kind.bytes);
    ASSERT_TRUE(loaded) << to_string(loaded.error());
    EXPECT_EQ(loaded->scene.voxel_count(), 2);
    const IVec3 first = only_grid(*loaded).bounds().min;
    EXPECT_EQ(only_grid(*loaded).bounds().size(), IVec3(2, 1, 1));
    if (!kind.has_colours) continue;
    EXPECT_EQ(colour_at(*loaded, first), (Rgba8{255, 0, 0, 255}));
    EXPECT_EQ(colour_at(*loaded, first + IVec3(1, 0, 0)), (Rgba8{0, 0, 255, 255}));
  }
}

TEST(Models, KeepsPositions) {
  const auto position = [](const LoadedScene& loaded) {
    return loaded.scene.instances()[loaded.scene.instances().handles().front()].position;
  };
  EXPECT_EQ(position(*load_scene(qb(true, true))), DVec3(0.0, 0.0, 5.0));
  EXPECT_EQ(position(*load_scene(qb(true, false))), DVec3(0.0, 0.0, 5.0)) << "the z axis does not mirror";
  const auto scanned = load_scene(binvox());
  EXPECT_EQ(position(*scanned), DVec3(1.0, 2.0, 3.0));
  EXPECT_EQ(scanned->scene.instances()[scanned->scene.instances().handles().front()].voxel_size, 2.0);
  // Three layers of air above: the voxels rest on the ground.
  for (const auto& bytes : {kv6(), kvx(), slab6()}) {
    EXPECT_EQ(only_grid(*load_scene(bytes)).bounds().min, IVec3(0));
  }
  // -y of a north-facing direction is +z here, offset by one cell.
  EXPECT_EQ(only_grid(*load_scene(goxel())).bounds().min, IVec3(0, 0, -1));
}

TEST(Models, SurvivesTruncationAndFlippedBits) {
  for (const Kind& kind : all_kinds()) {
    SCOPED_TRACE(kind.name);
    const std::size_t step = kind.bytes.size() > 2000 ? 13 : 1;
    for (std::size_t size = 0; size < kind.bytes.size(); size += step) {
      (void)load_scene(std::span(kind.bytes).first(size));
    }
    for (std::size_t at = 0; at < kind.bytes.size(); at += step) {
      for (const int bit : {0, 3, 7}) {
        std::vector<std::byte> turned = kind.bytes;
        turned[at] ^= std::byte{1} << bit;
        (void)load_scene(turned);
      }
    }
  }
}

TEST(Models, RefusesExcessiveHeaderSizes) {
  Writer many;
  many.u32s({0x101, 0, 1, 1, 0, 1}).number(0, 1).u32s({16'384, 16'384, 16'384, 0, 0, 0, 2, 0xFFFFFFFF, kRed, 6});
  EXPECT_EQ(read_as(FileFormat::Qubicle, many.bytes).error().code, ErrorCode::BadFormat);
  Writer wide;
  wide.text("#binvox 1\ndim 16384 16384 16384\ndata\n");
  EXPECT_EQ(read_as(FileFormat::Binvox, wide.bytes).error().code, ErrorCode::LimitExceeded);
  Writer nodes;
  nodes.text("MTSM").big(4, 2).big(65'535, 2).big(1, 2).big(65'535, 2).number(1, 1).big(0, 2).number(0x78, 1);
  EXPECT_EQ(read_as(FileFormat::LuantiSchematic, nodes.bytes).error().code, ErrorCode::LimitExceeded);
}

TEST(Models, DistinguishesWidth10FromNbt) {
  Writer wide;
  wide.u32s({10, 1, 1});
  for (int x = 0; x < 10; ++x) wide.number(0x0000FF, 3);
  EXPECT_EQ(detect_format(wide.bytes), FileFormat::CubeWorld);
  Writer empty;
  empty.number(10, 1).number(0, 3);
  EXPECT_EQ(detect_format(empty.bytes), std::nullopt);
}

TEST(Models, ReportsInvalidSizes) {
  Writer tiny;
  tiny.text("#binvox 1\ndim 1 1 1\ntranslate 0 0 0\nscale 1e-323\ndata\n").number(1, 1).number(1, 1);
  const auto loaded = read_as(FileFormat::Binvox, tiny.bytes);
  ASSERT_TRUE(loaded) << to_string(loaded.error());
  ASSERT_EQ(loaded->warnings.size(), 1U);
}

TEST(Models, PlacesNodesByProbability) {
  for (const int version : {2, 3, 4}) {
    Writer nodes;
    nodes.big(0, 2).big(0, 2).number(128, 1).number(1, 1).number(0, 2);
    Writer writer;
    writer.text("MTSM").big(static_cast<std::uint64_t>(version), 2).big(2, 2).big(1, 2).big(1, 2);
    if (version >= 3) writer.number(0x7F, 1);
    writer.big(1, 2).big(13, 2).text("default:stone").append(zlib_stored(nodes.bytes));
    const auto loaded = read_as(FileFormat::LuantiSchematic, writer.bytes);
    ASSERT_TRUE(loaded) << to_string(loaded.error());
    // Half of 255 before version 4, and the lowest value after it; the highest bit has another meaning there.
    EXPECT_EQ(only_grid(*loaded).grid.get({0, 0, 0}) != kAir, version < 4) << version;
    EXPECT_EQ(only_grid(*loaded).grid.get({1, 0, 0}) != kAir, version >= 4) << version;
  }
}

TEST(Models, ReducesExcessColoursWithWarning) {
  ModelBuilder builder;
  builder.begin({});
  for (int i = 0; i < 70'000; ++i) {
    const Rgba8 colour{static_cast<std::uint8_t>(i), static_cast<std::uint8_t>(i >> 8),
                       static_cast<std::uint8_t>(i >> 16), 255};
    ASSERT_TRUE(builder.put({i % 300, i / 300, 0}, colour));
  }
  const auto loaded = builder.take("test");
  ASSERT_TRUE(loaded) << to_string(loaded.error());
  EXPECT_EQ(loaded->scene.voxel_count(), 70'000);
  ASSERT_EQ(loaded->warnings.size(), 1U);
  EXPECT_NE(loaded->warnings[0].find("70000 colours were reduced"), std::string::npos);
  EXPECT_EQ(loaded->scene.types.size(), kMaxVoxelTypes + 1);
}

TEST(Models, FillsVoxlapMapsBelowSurface) {
  // 512 x 512 columns of one colour at 60, with ground below; one column is a bridge over air.
  Writer map;
  for (int i = 0; i < 512 * 512; ++i) {
    if (i == 5) {
      // A surface from 10 to 11 with a bottom at 13, air from 14, and another surface at 62.
      map.number(4, 1).number(10, 1).number(11, 1).number(0, 1).number(0x80112233, 4).number(0x80112234, 4);
      map.number(0x80112235, 4);
      map.number(0, 1).number(62, 1).number(62, 1).number(14, 1).number(0x80112236, 4);
      continue;
    }
    map.number(0, 1).number(60, 1).number(60, 1).number(0, 1).number(0x80FF0000, 4);
  }
  EXPECT_TRUE(driver_of(FileFormat::Voxlap).detect_whole(map.bytes));
  const auto loaded = read_as(FileFormat::Voxlap, map.bytes);
  ASSERT_TRUE(loaded) << to_string(loaded.error());
  const Grid& grid = only_grid(*loaded).grid;
  EXPECT_EQ(grid.get({0, 63 - 59, 0}), kAir);
  EXPECT_EQ(colour_at(*loaded, {0, 63 - 60, 0}), (Rgba8{255, 0, 0, 255}));
  for (const int z : {61, 63}) EXPECT_NE(grid.get({0, 63 - z, 0}), kAir);
  for (const int z : {10, 11, 12, 13, 62, 63}) EXPECT_NE(grid.get({5, 63 - z, 0}), kAir) << z;
  for (const int z : {9, 14, 61}) EXPECT_EQ(grid.get({5, 63 - z, 0}), kAir) << z;
  map.bytes.pop_back();
  EXPECT_FALSE(driver_of(FileFormat::Voxlap).detect_whole(map.bytes));
}

TEST(Models, RealFilesHaveExpectedCounts) {
  const fs::path folder = fs::path(QUOIN_SOURCE_DIR).parent_path() / "shared" / "data";
  if (!fs::exists(folder)) GTEST_SKIP() << "real files are not here";
  struct Known {
    const char* file;
    std::int64_t voxels;
    std::size_t grids;
  };
  const std::array known_files = {Known{"binvox/maxorange+binvox_renderer/data__bunny.binvox", 3'694, 1},
                                  Known{"kv6/iamgreaser+iceball/pkg__base__kv6__bomb.kv6", 27'552, 1},
                                  Known{"kv6/vengi-voxel+vengi/data__tests__slab6_vox_test.kv6", 1'531, 1},
                                  Known{"kv6/vengi-voxel+vengi/data__tests__slab6_vox_test.kvx", 1'531, 1},
                                  Known{"qb/vengi-voxel+vengi/9fc03f__data__tests__qubicle.qb", 771, 10},
                                  Known{"qb/vengi-voxel+vengi/65bf26__data__tests__robo.qb", 1'291, 3},
                                  Known{"qb/vengi-voxel+vengi/4e1abb__data__tests__rgb.qb", 99, 1},
                                  Known{"qb/vengi-voxel+vengi/8eed5f__data__tests__rgb.qef", 99, 1},
                                  Known{"qb/vengi-voxel+vengi/fd7931__data__tests__rgb.qbcl", 99, 1},
                                  Known{"qb/vengi-voxel+vengi/30db40__data__tests__crabby.qbcl", 100, 2},
                                  Known{"qb/vengi-voxel+vengi/c282ae__data__tests__rgb_small.qbcl", 3, 1},
                                  Known{"cub/vengi-voxel+vengi/data__tests__rgb_small.cub", 3, 1},
                                  Known{"vxl/iamgreaser+iceball/pkg__maps__mesa.vxl", 6'443'387, 1}};
  for (const Known& known : known_files) {
    const auto loaded = load_scene(folder / known.file);
    ASSERT_TRUE(loaded) << known.file << ": " << to_string(loaded.error());
    EXPECT_EQ(loaded->scene.voxel_count(), known.voxels) << known.file;
    EXPECT_EQ(loaded->scene.grids().size(), known.grids) << known.file;
  }
}

TEST(Models, QubicleProjectMatchesItsExport) {
  const fs::path folder = fs::path(QUOIN_SOURCE_DIR).parent_path() / "shared" / "data" / "qb" / "vengi-voxel+vengi";
  if (!fs::exists(folder)) GTEST_SKIP() << "real files are not here";
  const auto project = load_scene(folder / "fd7931__data__tests__rgb.qbcl");
  const auto exported = load_scene(folder / "4e1abb__data__tests__rgb.qb");
  ASSERT_TRUE(project && exported);
  for (int i = 0; i < 32 * 32 * 32; ++i) {
    const IVec3 at{i & 31, i >> 5 & 31, i >> 10};
    const bool is_there = only_grid(*project).grid.get(at) != kAir;
    ASSERT_EQ(is_there, only_grid(*exported).grid.get(at) != kAir) << at.x << ", " << at.y << ", " << at.z;
    if (is_there) {
      ASSERT_EQ(colour_at(*project, at), colour_at(*exported, at)) << at.x << ", " << at.y << ", " << at.z;
    }
  }
}

TEST(ModelBuilderDeathTest, AssertsOnZeroVoxelSize) {
  ModelBuilder builder;
  Model model;
  model.voxel_size = 0.0;
  QUOIN_EXPECT_MISTAKE(builder.begin(model), "0 < voxel_size");
}

TEST(ModelBuilderDeathTest, AssertsOnUnknownMaterial) {
  ModelBuilder builder;
  QUOIN_EXPECT_MISTAKE(builder.use_material(1), "a material that was added");
}

TEST(ModelBuilderDeathTest, AssertsOnInvalidAxis) {
  ModelBuilder builder;
  builder.begin({});
  QUOIN_EXPECT_MISTAKE(static_cast<void>(builder.put(IVec3{0}, {1, 2, 3, 255}, 2, 3)), "0 <= axis < 3");
}

}  // namespace
}  // namespace quoin::models
