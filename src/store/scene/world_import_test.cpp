#include <quoin/store/world_import.h>

#include <filesystem>
#include <vector>

#include <unistd.h>

#include <gtest/gtest.h>

#include <quoin/io/block_packs.h>
#include <quoin/io/file.h>
#include <quoin/store/world_saver.h>

#include "io/minecraft/minecraft_for_tests.h"

namespace quoin {

namespace {

namespace fs = std::filesystem;

/// A temporary folder with regions of Minecraft.
class WorldImport : public testing::Test {
 protected:
  void SetUp() override {
    folder = fs::temp_directory_path() / ("quoin-import-" + std::to_string(::getpid()));
    fs::remove_all(folder);
    fs::create_directories(folder / "region");
    for (int i = 0; i < kRegions; ++i) {
      const auto bytes = minecraft_test::region_with(minecraft_test::chunk_of_stairs(i - 4), i, i);
      ASSERT_TRUE(write_file(bytes, folder / "region" / ("r." + std::to_string(i - 3) + ".1.mca")));
    }
    std::vector<std::byte> broken = minecraft_test::chunk_of_stairs(0);
    broken.resize(50);
    ASSERT_TRUE(write_file(minecraft_test::region_with(broken), folder / "region" / "r.9.9.mca"));
  }
  void TearDown() override { fs::remove_all(folder); }

  [[nodiscard]] std::unique_ptr<ChunkSource> open() const {
    auto source = open_chunk_source(folder);
    EXPECT_TRUE(source);
    return std::move(*source);
  }
  static Scene scene_of(const fs::path& path) {
    const auto world = WorldStore::open(path, WorldAccess::Read);
    EXPECT_TRUE(world);
    auto loaded = load_world(*world);
    EXPECT_TRUE(loaded);
    EXPECT_TRUE(loaded->loaded.warnings.empty());
    return std::move(loaded->loaded.scene);
  }
  static const Grid& grid_of(const Scene& scene) { return scene.grids()[scene.grids().handles().front()].grid; }

  static constexpr int kRegions = 12;
  fs::path folder;
};

TEST_F(WorldImport, ImportsReadableChunksAndNamesOthers) {
  const auto source = open();
  const auto imported = import_world(*source, folder / "out.quoin");
  ASSERT_TRUE(imported) << to_string(imported.error());
  EXPECT_EQ(imported->voxels, 3U * kRegions);
  ASSERT_EQ(imported->broken.size(), 1U);
  EXPECT_NE(imported->broken[0].find("r.9.9.mca: byte 8192"), std::string::npos);
  EXPECT_FALSE(fs::exists(folder / "out.quoin.part"));
  const Scene scene = scene_of(folder / "out.quoin");
  EXPECT_EQ(scene.voxel_count(), 3 * kRegions);
  const Grid& grid = grid_of(scene);
  EXPECT_EQ(scene.types[grid.get(-3 * 512, -64, 512)].name, "minecraft:stone");
  EXPECT_NE(grid.data({-3 * 512 + 1, -64, 512}).state, 0U);
}

TEST_F(WorldImport, KeepsLampsOfLightBlocks) {
  minecraft_test::NbtWriter nbt;
  nbt.compound("").list("sections", 10, 1).byte("Y", 0).compound("block_states").list("palette", 10, 1);
  nbt.string("Name", "minecraft:light").end().end().end().end();
  ASSERT_TRUE(write_file(minecraft_test::region_with(nbt.bytes), folder / "region" / "r.20.20.mca"));
  const auto source = open();
  const auto imported = import_world(*source, folder / "out.quoin");
  ASSERT_TRUE(imported) << to_string(imported.error());
  EXPECT_EQ(imported->skipped_blocks, (std::map<std::string, std::uint64_t>{{"minecraft:light", 4096}}));
  const Scene scene = scene_of(folder / "out.quoin");
  ASSERT_EQ(scene.lamps.size(), 4096U);
  EXPECT_EQ(scene.lamps.front().position, DVec3(20 * 512 + 0.5, 0.5, 20 * 512 + 0.5));
  EXPECT_EQ(scene.lamps.front().range, 15.0);
}

TEST_F(WorldImport, ResumedImportsMatchUninterruptedImports) {
  const auto source = open();
  ASSERT_TRUE(import_world(*source, folder / "whole.quoin", {1}));
  int stopped = 0;
  for (int run = 0; run < 50; ++run) {
    int calls = 0;
    const auto part = import_world(*open(), folder / "parts.quoin", {1}, [&](double) { return calls++ == 0; });
    if (part) {
      EXPECT_GT(part->resumed_parts, 0U);
      break;
    }
    EXPECT_EQ(part.error().code, ErrorCode::Cancelled);
    ++stopped;
  }
  EXPECT_GE(stopped, 2);
  const Scene whole = scene_of(folder / "whole.quoin");
  const Scene parts = scene_of(folder / "parts.quoin");
  ASSERT_EQ(whole.types.size(), parts.types.size());
  for (std::size_t type = 1; type < whole.types.size(); ++type) {
    EXPECT_EQ(whole.types[static_cast<VoxelType>(type)], parts.types[static_cast<VoxelType>(type)]);
  }
  ASSERT_EQ(grid_of(whole).chunk_count(), static_cast<std::size_t>(kRegions));
  EXPECT_EQ(grid_of(parts).chunks(), grid_of(whole).chunks());
  for (const IVec3 place : grid_of(whole).chunks()) {
    EXPECT_TRUE(*grid_of(parts).find_chunk(place) == *grid_of(whole).find_chunk(place));
  }
}

TEST_F(WorldImport, RefusesToResumeWithOtherPacks) {
  const auto packed = [&](const char* name) {
    fs::create_directories(folder / name / "assets");
    const std::vector<fs::path> packs = {folder / name};
    return with_packs(open(), *BlockPacks::open(packs));
  };
  int calls = 0;
  const auto stop = [&](double) { return calls++ == 0; };
  ASSERT_FALSE(import_world(*packed("pack 1"), folder / "out.quoin", {1}, stop));
  for (const bool has_packs : {true, false}) {
    const auto source = has_packs ? packed("pack 2") : open();
    const auto other = import_world(*source, folder / "out.quoin");
    ASSERT_FALSE(other);
    EXPECT_EQ(other.error().code, ErrorCode::InvalidArgument);
    EXPECT_NE(other.error().message.find("with other resource packs"), std::string::npos) << other.error().message;
  }
  EXPECT_TRUE(import_world(*packed("pack 1"), folder / "out.quoin")) << "the same packs";
}

TEST_F(WorldImport, RefusesToResumeWithOtherSource) {
  int calls = 0;
  const auto part = import_world(*open(), folder / "out.quoin", {1}, [&](double) { return calls++ == 0; });
  ASSERT_FALSE(part);
  fs::remove(folder / "region" / "r.0.1.mca");
  const auto other = import_world(*open(), folder / "out.quoin");
  ASSERT_FALSE(other);
  EXPECT_EQ(other.error().code, ErrorCode::InvalidArgument);
}

}  // namespace

}  // namespace quoin
