#include <gtest/gtest.h>

#include <fstream>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include <quoin/io/formats.h>
#include <quoin/io/image_files.h>

#include "io/byte_stream.h"
#include "io/minecraft/minecraft_for_tests.h"
#include "io/minecraft/nbt.h"
#include "tool_for_tests.h"

namespace quoin {

namespace {

constexpr int kEdge = 1'000;
constexpr int kStoneLayers = 500;
constexpr int kMixedLayers = 8;
constexpr int kMixedTypes = 150;

/// Returns the block bytes of a schematic layer.
template <class Index>
std::vector<std::byte> layer_of(Index index) {
  std::vector<std::byte> bytes;
  for (int z = 0; z < kEdge; ++z) {
    for (int x = 0; x < kEdge; ++x) {
      const unsigned value = index(x, z);
      if (value >= 128) bytes.push_back(static_cast<std::byte>(value | 128U));
      bytes.push_back(static_cast<std::byte>(value >= 128 ? value >> 7 : value));
    }
  }
  return bytes;
}

/// Writes a .schem file of 10^9 blocks: stone with ores, a few layers of 150 types, air. Compresses equal layers once,
/// each layer as a gzip member of its own.
void write_large_schematic(const std::filesystem::path& path) {
  const std::vector<std::byte> stone = layer_of([](int x, int z) { return (x + kEdge * z) % 997 == 0 ? 2U : 1U; });
  const std::vector<std::byte> air = layer_of([](int, int) { return 0U; });
  const std::vector<std::byte> mixed =
      layer_of([](int x, int z) { return 1U + static_cast<unsigned>(x * 7 + z * 13) % kMixedTypes; });
  const std::size_t bytes =
      kStoneLayers * stone.size() + kMixedLayers * mixed.size() + (kEdge - kStoneLayers - kMixedLayers) * air.size();
  nbt::DocumentWriter nbt;
  nbt.begin("Schematic");
  nbt.int32("Version", 2);
  for (const char* axis : {"Width", "Height", "Length"}) nbt.int16(axis, kEdge);
  nbt.begin("Palette");
  nbt.int32("minecraft:air", 0);
  nbt.int32("minecraft:stone", 1);
  nbt.int32("minecraft:iron_ore", 2);
  for (int i = 3; i <= kMixedTypes; ++i) nbt.int32("test:block_" + std::to_string(i), i);
  nbt.end();
  nbt.bytes("BlockData", {});
  std::vector<std::byte> head = nbt.document();
  for (std::size_t i = 0; i < 4; ++i) head[head.size() - 1 - i] = static_cast<std::byte>(bytes >> (8 * i));
  std::ofstream out(path, std::ios::binary);
  const auto put = [&](const std::vector<std::byte>& member, int times) {
    const std::vector<std::byte> packed = gzipped(member, 1);
    for (int i = 0; i < times; ++i) {
      out.write(reinterpret_cast<const char*>(packed.data()), static_cast<std::streamsize>(packed.size()));
    }
  };
  put(head, 1);
  put(stone, kStoneLayers);
  put(mixed, kMixedLayers);
  put(air, kEdge - kStoneLayers - kMixedLayers);
  put({std::byte{0}}, 1);
}

class ToolMinecraft : public ToolTest {};

TEST_F(ToolMinecraft, PacksGiveBlocksTextures) {
  // A region with stone and stairs, and a pack with a look for stone.
  namespace fs = std::filesystem;
  const std::vector<std::byte> region = minecraft_test::region_with(minecraft_test::chunk_of_stairs(0));
  std::ofstream(folder_.file("r.0.0.mca"), std::ios::binary)
      << std::string(reinterpret_cast<const char*>(region.data()), region.size());
  const auto write = [&](const std::string& name, const std::string& content) {
    const fs::path path = fs::path(folder_.file("pack")) / "assets/minecraft" / name;
    fs::create_directories(path.parent_path());
    std::ofstream(path, std::ios::binary) << content;
  };
  const std::string face = R"({"texture": "block/t"})";
  write("blockstates/stone.json", R"({"variants": {"": {"model": "block/stone"}}})");
  write("models/block/stone.json", R"({"elements": [{"from": [0, 0, 0], "to": [16, 16, 16], "faces": {"up": )" + face +
                                       R"(, "down": )" + face + R"(, "north": )" + face + R"(, "south": )" + face +
                                       R"(, "west": )" + face + R"(, "east": )" + face + "}}]}");
  AlphaImage image{16, 16, {}};
  for (int i = 0; i < 256; ++i) image.rgba.insert(image.rgba.end(), {200, 30, 20, 255});
  write("textures/block/t.png", "");
  ASSERT_TRUE(write_png(image, fs::path(folder_.file("pack")) / "assets/minecraft/textures/block/t.png"));

  const ToolRun world = run("convert r.0.0.mca plain.quoin -q");
  if (world.err.find("not supported by this build") != std::string::npos) GTEST_SKIP() << world.err;
  ASSERT_EQ(world.status, 0) << world.err;
  const ToolRun converted = run("convert r.0.0.mca w.quoin --pack pack");
  ASSERT_EQ(converted.status, 0) << converted.err;
  EXPECT_NE(converted.err.find("resource packs: 1 block type of 2 without a look: minecraft:oak_stairs"),
            std::string::npos)
      << converted.err;
  const auto colour_in = [&](const char* file) {
    const auto loaded = load_scene(folder_.file(file));
    EXPECT_TRUE(loaded);
    const auto type = loaded->scene.types.find("minecraft:stone");
    return type ? loaded->scene.types[*type].colour : Rgba8{};
  };
  EXPECT_EQ(colour_in("w.quoin"), (Rgba8{200, 30, 20}));
  // Without a pack, and with one for a world that was converted before.
  EXPECT_NE(colour_in("plain.quoin"), (Rgba8{200, 30, 20}));
  ASSERT_EQ(run("convert plain.quoin packed.quoin --pack pack -q").status, 0);
  EXPECT_EQ(colour_in("packed.quoin"), (Rgba8{200, 30, 20}));
  EXPECT_NE(run("info r.0.0.mca --pack pack").err.find("without a look"), std::string::npos);
  // Images show the own pack, also below others, unless it is refused. Worlds keep the looks they were converted with.
  const auto image_of = [&](const std::string& file, const std::string& packs) {
    const ToolRun run_of = run("render " + file + " -o a.png --size 64x48 --samples 1 -q " + packs);
    EXPECT_EQ(run_of.status, 0) << run_of.err;
    EXPECT_EQ(run_of.err, "");
    return text_of(folder_.file("a.png"));
  };
  const std::string own = image_of("r.0.0.mca", "");
  EXPECT_EQ(own, image_of("r.0.0.mca", "--pack builtin"));
  EXPECT_NE(own, image_of("r.0.0.mca", "--pack none"));
  const std::string both = image_of("r.0.0.mca", "--pack pack");
  EXPECT_NE(both, own);
  EXPECT_NE(both, image_of("r.0.0.mca", "--pack none"));
  EXPECT_EQ(image_of("plain.quoin", ""), own);
  EXPECT_NE(image_of("packed.quoin", ""), own);
  const ToolRun refused = run("render r.0.0.mca -o a.png --pack w.quoin");
  EXPECT_EQ(refused.status, 1);
  EXPECT_NE(refused.err.find("w.quoin: byte 0: not a resource pack"), std::string::npos) << refused.err;
}

// A byte array of the blocks with their indices would take 3 GB.
TEST_F(ToolMinecraft, CountsBillionBlocksInLittleMemory) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "sanitizers take more addresses than the limit";
#endif
  write_large_schematic(folder_.file("large.schem"));
  const ToolRun reported = shell("ulimit -v 400000; '" QUOIN_TOOL "' info large.schem --json --threads 1");
  ASSERT_EQ(reported.status, 0) << reported.err;
  const auto info = nlohmann::json::parse(reported.out);
  EXPECT_EQ(info["voxels"], std::int64_t{kEdge} * kEdge * (kStoneLayers + kMixedLayers));
  EXPECT_EQ(info["types"], kMixedTypes);
  EXPECT_EQ(info["grids"][0]["size"], nlohmann::json({kEdge, kEdge, kEdge}));
}

}  // namespace

}  // namespace quoin
