#include <algorithm>

#include <gtest/gtest.h>

#include "core/death_for_tests.h"
#include "io/vox/chunks.h"
#include "io/vox/vox_for_tests.h"
#include "io/vox/vox_reader.h"

namespace quoin {
namespace {

using vox_test::Entries;
using vox_test::FileBuilder;

LoadedScene load(const std::vector<std::byte>& bytes, const LoadOptions& options = {}) {
  Result<LoadedScene> loaded = read_vox(bytes, options);
  EXPECT_TRUE(loaded) << to_string(loaded.error());
  return loaded ? std::move(*loaded) : LoadedScene{};
}

const SceneGrid& grid_at(const LoadedScene& loaded, std::size_t i) {
  return loaded.scene.grids()[loaded.scene.grids().handles().at(i)];
}

const Instance& instance_at(const LoadedScene& loaded, std::size_t i) {
  return loaded.scene.instances()[loaded.scene.instances().handles().at(i)];
}

bool warns(const LoadedScene& loaded, std::string_view text) {
  return std::ranges::any_of(loaded.warnings, [&](const std::string& w) { return w.find(text) != std::string::npos; });
}

/// Returns one 1x1x1 model of this colour, placed by `transform`.
FileBuilder one_voxel(std::uint8_t colour = 1) {
  FileBuilder builder;
  builder.model(1, 1, 1, {{0, 0, 0, colour}});
  return builder;
}

TEST(VoxRead, TurnsZUpIntoYUpWithoutMirroring) {
  const LoadedScene loaded = load(FileBuilder().model(3, 4, 5, {{2, 0, 0, 7}, {0, 3, 0, 8}, {0, 0, 4, 9}}).file());
  const SceneGrid& grid = grid_at(loaded, 0);
  EXPECT_EQ(grid.canvas, (IBox{{0, 0, 0}, {3, 5, 4}}));
  EXPECT_EQ(grid.grid.get({2, 0, 3}), 7);
  EXPECT_EQ(grid.grid.get({0, 0, 0}), 8);
  EXPECT_EQ(grid.grid.get({0, 4, 3}), 9);
  EXPECT_EQ(grid.grid.voxel_count(), 3);
}

TEST(VoxRead, CentresModelWithoutNodesOnGround) {
  const LoadedScene loaded = load(FileBuilder().model(4, 6, 5, {{0, 0, 0, 1}, {3, 5, 4, 1}}).file());
  EXPECT_EQ(loaded.format, "vox");
  EXPECT_TRUE(loaded.warnings.empty());
  const DBox bounds = loaded.scene.bounds();
  EXPECT_EQ(bounds.min, DVec3(-2, 0, -3));
  EXPECT_EQ(bounds.max, DVec3(2, 5, 3));
}

TEST(VoxRead, ReadsModelsWithoutNodesAsFrames) {
  FileBuilder builder;
  builder.with("PACK", [](auto& out) { out.u32(2); });
  builder.model(1, 1, 1, {{0, 0, 0, 1}}).model(2, 1, 1, {{0, 0, 0, 2}, {1, 0, 0, 2}});
  const std::vector<std::byte> bytes = builder.file();
  const LoadedScene first = load(bytes);
  EXPECT_TRUE(warns(first, "frame 0 of 0 to 1"));
  ASSERT_EQ(first.scene.instances().size(), 1U);
  EXPECT_EQ(instance_at(first, 0).grid, first.scene.grids().handles()[0]);
  EXPECT_EQ(first.scene.voxel_count(), 3);
  const LoadedScene second = load(bytes, {.frame = 1});
  EXPECT_EQ(instance_at(second, 0).grid, second.scene.grids().handles()[1]);
  const Result<LoadedScene> third = read_vox(bytes, {.frame = 2});
  ASSERT_FALSE(third);
  EXPECT_EQ(third.error().message, "frame 2 does not exist; the last frame is 1");
  EXPECT_FALSE(read_vox(bytes, {.frame = -1}));
}

TEST(VoxRead, ReportsProgressAndCanBeCancelled) {
  FileBuilder builder;
  for (int i = 0; i < 5; ++i) builder.model(1, 1, 1, {{0, 0, 0, 1}});
  const auto bytes = builder.file();
  std::vector<double> reported;
  ASSERT_TRUE(read_vox(bytes, {}, [&](double share) {
    reported.push_back(share);
    return true;
  }));
  ASSERT_EQ(reported.size(), 5U);
  EXPECT_TRUE(std::ranges::is_sorted(reported));
  EXPECT_EQ(reported.back(), 1.0);
  const auto stopped = read_vox(bytes, {}, [](double share) { return share < 0.5; });
  ASSERT_FALSE(stopped);
  EXPECT_EQ(stopped.error().code, ErrorCode::Cancelled);
}

TEST(VoxRead, SharedModelsStayShared) {
  FileBuilder builder = one_voxel();
  builder.transform(0, 1, {{}}).group(1, {2, 4});
  builder.transform(2, 3, {{{"_t", "1 2 3"}}}).transform(4, 3, {{{"_t", "-1 -2 -3"}}}).shape(3, 0);
  const LoadedScene loaded = load(builder.file());
  EXPECT_EQ(loaded.scene.grids().size(), 1U);
  ASSERT_EQ(loaded.scene.instances().size(), 2U);
  EXPECT_EQ(instance_at(loaded, 0).position, DVec3(1, 3, -2));
  EXPECT_EQ(instance_at(loaded, 1).position, DVec3(-1, -3, 2));
}

TEST(VoxRead, ReadsNamesFromParentTransform) {
  FileBuilder builder = one_voxel();
  builder.transform(0, 1, {{}}, {{"_name", "root"}}).group(1, {2, 4});
  builder.transform(2, 3, {{}}, {{"_name", "wheel"}}).shape(3, 0);
  builder.transform(4, 5, {{}}, {{"_name", "bad \xFF\n"}}).shape(5, 0);
  const LoadedScene loaded = load(builder.file());
  EXPECT_EQ(instance_at(loaded, 0).name, "wheel");
  EXPECT_EQ(instance_at(loaded, 1).name, "bad \xEF\xBF\xBD ");
  EXPECT_EQ(grid_at(loaded, 0).name, "wheel");
}

TEST(VoxRead, HiddenNodesAndLayersHideDescendants) {
  FileBuilder builder = one_voxel();
  builder.layer(5, {{"_hidden", "1"}}).layer(6, {{"_hidden", "0"}});
  builder.transform(0, 1, {{}}).group(1, {2, 4, 6, 8});
  builder.transform(2, 3, {{}}, {{"_hidden", "1"}}).group(3, {10});
  builder.transform(10, 11, {{}}).shape(11, 0);
  builder.transform(4, 5, {{}}, {}, 5).shape(5, 0);
  builder.transform(6, 7, {{}}, {}, 6).shape(7, 0);
  builder.transform(8, 9, {{}}, {{"_hidden", "1"}}).shape(9, 0);
  const std::vector<std::byte> bytes = builder.file();
  const LoadedScene loaded = load(bytes);
  ASSERT_EQ(loaded.scene.instances().size(), 4U);
  EXPECT_FALSE(is_shown(loaded.scene, instance_at(loaded, 0)));
  EXPECT_FALSE(is_shown(loaded.scene, instance_at(loaded, 1)));
  EXPECT_TRUE(is_shown(loaded.scene, instance_at(loaded, 2)));
  EXPECT_FALSE(is_shown(loaded.scene, instance_at(loaded, 3)));
  EXPECT_TRUE(loaded.warnings.empty()) << "they are kept";
  const LoadedScene all = load(bytes, {.show_hidden = true});
  EXPECT_TRUE(all.warnings.empty());
  for (std::size_t i = 0; i < 4; ++i) EXPECT_TRUE(is_shown(all.scene, instance_at(all, i)));
}

TEST(VoxRead, PaletteEntryZeroIsColourOne) {
  FileBuilder builder = one_voxel();
  builder.with("RGBA", [](auto& out) {
    for (std::uint32_t i = 0; i < 256; ++i) out.u32(i | 0x7F00'0000U);
  });
  const LoadedScene loaded = load(builder.file());
  ASSERT_EQ(loaded.scene.types.size(), 256U);
  EXPECT_EQ(loaded.scene.types[1].colour, (Rgba8{0, 0, 0, 255}));
  EXPECT_EQ(loaded.scene.types[255].colour, (Rgba8{254, 0, 0, 255}));
  EXPECT_EQ(loaded.scene.types[12].name, "palette 12");
}

TEST(VoxRead, UsesDefaultPaletteWithoutPalette) {
  const LoadedScene loaded = load(one_voxel().file());
  const VoxelRegistry& types = loaded.scene.types;
  EXPECT_EQ(types[1].colour, (Rgba8{255, 255, 255, 255}));
  EXPECT_EQ(types[2].colour, (Rgba8{255, 255, 204, 255}));
  EXPECT_EQ(types[37].colour, (Rgba8{204, 255, 255, 255}));
  EXPECT_EQ(types[215].colour, (Rgba8{0, 0, 51, 255}));
  EXPECT_EQ(types[216].colour, (Rgba8{238, 0, 0, 255}));
  EXPECT_EQ(types[225].colour, (Rgba8{17, 0, 0, 255}));
  EXPECT_EQ(types[226].colour, (Rgba8{0, 238, 0, 255}));
  EXPECT_EQ(types[245].colour, (Rgba8{0, 0, 17, 255}));
  EXPECT_EQ(types[246].colour, (Rgba8{238, 238, 238, 255}));
  EXPECT_EQ(types[255].colour, (Rgba8{17, 17, 17, 255}));
}

/// Returns an IMAP that shows colour index 79 first and 1 in its place, and leaves all others.
std::vector<std::byte> swapping_index_map() {
  std::vector<std::byte> map(256);
  for (std::size_t i = 0; i < 255; ++i) map[i] = static_cast<std::byte>(i + 1);
  map[0] = std::byte{79};
  map[78] = std::byte{1};
  return map;
}

TEST(VoxRead, IndexMapReordersTypesButNoColours) {
  FileBuilder builder;
  builder.model(2, 1, 1, {{0, 0, 0, 79}, {1, 0, 0, 2}}).material(79, {{"_type", "_emit"}, {"_emit", "1"}});
  builder.chunk("IMAP", swapping_index_map());
  const LoadedScene loaded = load(builder.file());
  EXPECT_EQ(grid_at(loaded, 0).grid.get({0, 0, 0}), 1);
  EXPECT_EQ(grid_at(loaded, 0).grid.get({1, 0, 0}), 2);
  EXPECT_EQ(loaded.scene.types[1].colour, vox::default_palette()[79]);
  EXPECT_EQ(loaded.scene.types[1].emission, 1.0F);
  EXPECT_EQ(loaded.scene.types[79].colour, vox::default_palette()[1]);
}

TEST(VoxRead, IgnoresInvalidIndexMap) {
  std::vector<std::byte> map = swapping_index_map();
  map[3] = map[4];
  const LoadedScene loaded = load(one_voxel(79).chunk("IMAP", map).file());
  EXPECT_EQ(grid_at(loaded, 0).grid.get({0, 0, 0}), 79);
  EXPECT_TRUE(warns(loaded, "IMAP"));
}

TEST(VoxRead, KeyFramesMoveAndChangeModels) {
  FileBuilder builder;
  builder.model(1, 1, 1, {{0, 0, 0, 1}}).model(1, 1, 1, {{0, 0, 0, 2}});
  builder.transform(0, 1, {{}}).group(1, {2});
  builder.transform(2, 3, {{{"_f", "10"}, {"_t", "8 0 -7"}, {"_r", "33"}}, {{"_f", "2"}, {"_t", "0 0 0"}}});
  builder.shape(3, {{0, {{"_f", "0"}}}, {1, {{"_f", "5"}}}});
  const std::vector<std::byte> bytes = builder.file();
  const auto at = [&](int frame) { return load(bytes, {.frame = frame}); };
  EXPECT_EQ(instance_at(at(0), 0).position, DVec3(0, 0, 0));
  EXPECT_EQ(instance_at(at(6), 0).position, DVec3(4, -3, 0));
  EXPECT_EQ(instance_at(at(10), 0).position, DVec3(8, -7, 0));
  EXPECT_EQ(instance_at(at(6), 0).rotation, DQuat(1, 0, 0, 0));
  EXPECT_NE(instance_at(at(10), 0).rotation, DQuat(1, 0, 0, 0));
  const LoadedScene early = at(4);
  EXPECT_EQ(instance_at(early, 0).grid, early.scene.grids().handles()[0]);
  const LoadedScene late = at(5);
  EXPECT_EQ(instance_at(late, 0).grid, late.scene.grids().handles()[1]);
  EXPECT_FALSE(warns(late, "nowhere"));
  EXPECT_FALSE(read_vox(bytes, {.frame = 11}));
}

TEST(VoxRead, LoopingNodesRepeatUntilLastFrame) {
  FileBuilder builder = one_voxel();
  builder.with("META", [](auto& out) { out.dict({{"_anim_range", "0 20"}}); });
  builder.transform(0, 1, {{}}).group(1, {2});
  builder.transform(2, 3, {{{"_f", "4"}, {"_t", "0 0 0"}}, {{"_f", "7"}, {"_t", "3 0 0"}}}, {{"_loop", "1"}});
  builder.shape(3, 0);
  const std::vector<std::byte> bytes = builder.file();
  const auto x_at = [&](int frame) { return instance_at(load(bytes, {.frame = frame}), 0).position.x; };
  EXPECT_EQ(x_at(5), 1);
  EXPECT_EQ(x_at(7), 3);
  EXPECT_EQ(x_at(8), 0);
  EXPECT_EQ(x_at(20), 0);
  EXPECT_EQ(x_at(3), 3);
}

TEST(VoxRead, KeepsEmptyAndUnusedModels) {
  FileBuilder builder;
  builder.model(5, 6, 7, {}).model(1, 1, 1, {{0, 0, 0, 1}});
  builder.transform(0, 1, {{}}).group(1, {2}).transform(2, 3, {{}}).shape(3, 0);
  const LoadedScene loaded = load(builder.file());
  ASSERT_EQ(loaded.scene.grids().size(), 2U);
  EXPECT_EQ(grid_at(loaded, 0).canvas, (IBox{{0, 0, 0}, {5, 7, 6}}));
  EXPECT_EQ(loaded.scene.instances().size(), 1U);
  EXPECT_EQ(loaded.scene.voxel_count(), 1);
  EXPECT_EQ(loaded.warnings, std::vector<std::string>{"models without a placement: 1"});
}

TEST(VoxRead, ReadsFileWithoutModelsAsEmptyScene) {
  const LoadedScene loaded = load(FileBuilder().file());
  EXPECT_TRUE(loaded.scene.grids().empty());
  EXPECT_TRUE(warns(loaded, "no model"));
}

TEST(VoxRead, SkipsOutsideAndAirVoxelsWithWarning) {
  const LoadedScene loaded =
      load(FileBuilder().model(2, 2, 2, {{0, 0, 0, 1}, {2, 0, 0, 1}, {0, 255, 0, 1}, {1, 1, 1, 0}}).file());
  EXPECT_EQ(loaded.scene.voxel_count(), 1);
  EXPECT_TRUE(warns(loaded, "size skipped: 2"));
  EXPECT_TRUE(warns(loaded, "air, skipped: 1"));
}

TEST(VoxRead, LastDuplicateVoxelWins) {
  const LoadedScene loaded = load(FileBuilder().model(2, 2, 2, {{0, 0, 0, 1}, {0, 0, 0, 9}}).file());
  EXPECT_EQ(loaded.scene.voxel_count(), 1);
  EXPECT_EQ(grid_at(loaded, 0).grid.get({0, 0, 1}), 9);
}

TEST(VoxRead, AcceptsUnknownChunksAndVersions) {
  const std::array<std::byte, 5> junk{};
  const LoadedScene loaded = load(one_voxel().chunk("zzzz", junk).file(300));
  EXPECT_EQ(loaded.scene.voxel_count(), 1);
  EXPECT_TRUE(warns(loaded, "version 300"));
  EXPECT_TRUE(load(one_voxel().file(200)).warnings.empty());
}

TEST(VoxRead, PlacesAnyNumberOfVoxels) {
  for (const int edge : {3, 12, 30, 70}) {
    std::vector<vox_test::FileVoxel> voxels;
    for (int i = 0; i < edge * edge * edge; ++i) {
      voxels.push_back({static_cast<std::uint8_t>(i % edge), static_cast<std::uint8_t>(i / edge % edge),
                        static_cast<std::uint8_t>(i / edge / edge), static_cast<std::uint8_t>(1 + i % 255)});
    }
    const auto side = static_cast<std::uint32_t>(edge);
    const LoadedScene loaded = load(FileBuilder().model(side, side, side, voxels).file());
    EXPECT_EQ(loaded.scene.voxel_count(), static_cast<std::int64_t>(voxels.size()));
    for (const vox_test::FileVoxel& v : voxels) {
      ASSERT_EQ(grid_at(loaded, 0).grid.get({v[0], v[2], edge - 1 - v[1]}), v[3]);
    }
  }
}

TEST(VoxDeathTest, AssertsOnReadBeyondBytes) {
  const std::vector<std::byte> bytes(4);
  QUOIN_EXPECT_MISTAKE((void)ByteReader(bytes, 0, 5), "a stretch of the bytes");
}

TEST(VoxDeathTest, AssertsOnRegistryWithTypes) {
  VoxelRegistry types;
  ASSERT_TRUE(types.add({}));
  QUOIN_EXPECT_MISTAKE((void)vox::register_palette({}, {}, types), "types hold air only");
}

}  // namespace
}  // namespace quoin
