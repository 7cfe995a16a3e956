// A town with every family of the own pack, as the tool reads and shows it.

#include "tests/block_town_for_tests.h"

#include <cstddef>
#include <cstdlib>
#include <filesystem>
#include <set>
#include <span>
#include <string>

#include <gtest/gtest.h>
#include <quoin/io/block_packs.h>
#include <quoin/io/file.h>
#include <quoin/io/formats.h>
#include <quoin/io/image_files.h>

#include "io/minecraft/minecraft.h"
#include "tests/tool_for_tests.h"

namespace quoin {
namespace {

constexpr unsigned kTownSeed = 57;

TEST(BlockTown, HasEveryFamily) {
  const block_town::Town town(kTownSeed);
  std::set<std::string> missing;
  for (const std::string& family : block_town::all_families()) {
    if (!town.families().contains(family)) missing.insert(family);
  }
  EXPECT_EQ(missing, std::set<std::string>());
  EXPECT_GT(town.families().size(), 100U);
}

TEST(BlockTown, AllTypesHaveLooks) {
  Scene scene = block_town::Town(kTownSeed).scene();
  const std::filesystem::path own(kBuiltinPack);
  const auto packs = BlockPacks::open(std::span(&own, 1));
  ASSERT_TRUE(packs);
  (*packs)->apply(scene.types);
  EXPECT_EQ(to_string((*packs)->report()), "");
  for (std::size_t i = 1; i < scene.types.size(); ++i) {
    const VoxelProperties& type = scene.types[static_cast<VoxelType>(i)];
    EXPECT_FALSE(type.faces.empty() && type.shapes.empty()) << type.name;
  }
}

class BlockTownTool : public ToolTest {};

TEST_F(BlockTownTool, TorchesLightTheTownAtNight) {
  const auto file = minecraft::write_schematic(block_town::Town(kTownSeed).scene());
  ASSERT_TRUE(file) << file.error().message;
  ASSERT_TRUE(write_file(file->bytes, folder_.file("town.schem")));
  const char* const copy = std::getenv("QUOIN_TOWN");  // to look at it
  ASSERT_TRUE(copy == nullptr || write_file(file->bytes, copy));
  const auto light_of = [&](const std::string& options) {
    const ToolRun made = run("render town.schem -o a.png --size 96x64 --samples 1 -q " + options);
    EXPECT_EQ(made.status, 0) << made.err;
    const auto image = read_alpha_image(folder_.file("a.png"));
    EXPECT_TRUE(image);
    double sum = 0.0;
    for (std::size_t i = 0; i < image->rgba.size(); i += 4) {
      sum += image->rgba[i] + image->rgba[i + 1] + image->rgba[i + 2];
    }
    return sum;
  };
  const double day = light_of("");
  const double night = light_of("--sun 0,-1,0");
  const double dark = light_of("--sun 0,-1,0 --emission-scale 0");
  EXPECT_GT(day, 2 * night);
  EXPECT_GT(night, 1.05 * dark);
}

}  // namespace
}  // namespace quoin
