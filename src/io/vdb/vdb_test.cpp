#include "io/vdb/vdb.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <random>
#include <string>
#include <unistd.h>

#include <gtest/gtest.h>

#include <quoin/io/file.h>
#include <quoin/io/formats.h>

namespace quoin::vdb {

namespace {

namespace fs = std::filesystem;

// The corpus was written by OpenVDB and NanoVDB 10, which also gave the expected counts.
const fs::path kCorpus = fs::path(QUOIN_SOURCE_DIR) / "tests" / "corpus" / "vdb";
constexpr std::int64_t kInSphere = 4139;  // samples, of radius 10 around (2, 4, 6)

LoadedScene load(const fs::path& path, const LoadOptions& options = {}) {
  auto loaded = load_scene(path, options);
  EXPECT_TRUE(loaded) << to_string(loaded.error());
  return loaded ? std::move(*loaded) : LoadedScene{};
}

const SceneGrid& grid_named(const LoadedScene& loaded, std::string_view name) {
  for (const GridHandle handle : loaded.scene.grids().handles()) {
    if (loaded.scene.grids()[handle].name == name) return loaded.scene.grids()[handle];
  }
  ADD_FAILURE() << "there is no grid " << name;
  static const SceneGrid none;
  return none;
}

const Instance& instance_of(const LoadedScene& loaded, std::string_view name) {
  for (const InstanceHandle handle : loaded.scene.instances().handles()) {
    if (loaded.scene.instances()[handle].name == name) return loaded.scene.instances()[handle];
  }
  ADD_FAILURE() << "there is no instance " << name;
  static const Instance none;
  return none;
}

void expect_near(const DVec3& a, const DVec3& b) {
  EXPECT_LT(glm::length(a - b), 1e-9) << a.x << ", " << a.y << ", " << a.z;
}

TEST(Vdb, ReadsLevelSetAsDistanceField) {
  for (const char* name : {"level_set_blosc.vdb", "level_set_blosc.nvdb"}) {
    const LoadedScene loaded = load(kCorpus / name);
    EXPECT_EQ(loaded.format, "vdb");
    const DensityGrid& field = grid_named(loaded, "sphere").field;
    EXPECT_EQ(field.solid_count(), kInSphere) << name;
    EXPECT_EQ(field.band(), 3.0F);
    EXPECT_EQ(field.density({2, 4, 6}), -3.0F);
    EXPECT_EQ(field.density({12, 4, 6}), 0.0F);
    EXPECT_EQ(field.density({14, 4, 6}), 2.0F);
    EXPECT_EQ(field.density({40, 4, 6}), 3.0F);
    const Instance& placed = instance_of(loaded, "sphere");
    EXPECT_EQ(placed.voxel_size, 0.5);
    expect_near(world_from_grid(placed, grid_named(loaded, "sphere"), {2, 4, 6}), {1, 2, 3});
  }
}

TEST(Vdb, ReadsDoublesAsFloats) {
  for (const char* name : {"double_zip.vdb", "double_zip.nvdb"}) {
    EXPECT_EQ(grid_named(load(kCorpus / name), "double").field.solid_count(), 251) << name;
  }
}

TEST(Vdb, ReadsSharedTreesAsInstances) {
  const LoadedScene loaded = load(kCorpus / "instances.vdb");
  EXPECT_EQ(loaded.scene.grids().handles().size(), 1U);
  const SceneGrid& sphere = grid_named(loaded, "sphere");
  expect_near(world_from_grid(instance_of(loaded, "moved"), sphere, {2, 4, 6}), {11, 22, 33});
  // A quarter about y takes x to -z.
  expect_near(world_from_grid(instance_of(loaded, "turned"), sphere, {2, 4, 6}), {3, 2, 6});
}

TEST(Vdb, ReadsMasksAsVoxels) {
  for (const auto& [file, name, count] : {std::tuple{"masks.vdb", "bool", 69'005},
                                          {"masks.vdb", "mask", 2'310},
                                          {"bool_zip.nvdb", "bool", 69'005},
                                          {"mask_zip.nvdb", "mask", 2'310}}) {
    const LoadedScene loaded = load(kCorpus / file);
    EXPECT_EQ(grid_named(loaded, name).grid.voxel_count(), count) << file;
    expect_near(instance_of(loaded, name).position, DVec3(-0.5));
  }
  const LoadedScene loaded = load(kCorpus / "masks.vdb");
  const quoin::Grid& voxels = grid_named(loaded, "bool").grid;
  EXPECT_EQ(voxels.get(1, 2, 3), kAir) << "active, and false";
  EXPECT_NE(voxels.get(4, 4, 4), kAir);
  EXPECT_EQ(voxels.bounds(), (IBox{{-3, -2, -100}, {10, 31, 61}}));
  ASSERT_EQ(loaded.warnings.size(), 1U);
  EXPECT_NE(loaded.warnings[0].find("\"velocity\", of type Tree_vec3s"), std::string::npos);
}

TEST(Vdb, ReadsFogAsSolidAboveIso) {
  LoadOptions options;
  options.iso = 0.5F;
  const LoadedScene loaded = load(kCorpus / "fog_half_zip.vdb", options);
  EXPECT_EQ(grid_named(loaded, "fog").field.solid_count(), 2'553);
  expect_near(world_from_grid(instance_of(loaded, "fog"), grid_named(loaded, "fog"), {10, 12, 14}), {1, 2, 3});
  EXPECT_GT(grid_named(load(kCorpus / "fog_half_zip.vdb"), "fog").field.solid_count(), 2'000);
}

/// Returns a scene of a field, of voxels, and of the same field twice, once turned and mirrored.
Scene some_scene() {
  Scene scene;
  const auto type = scene.types.add({.name = "stone", .colour = {90, 90, 90, 255}});
  EXPECT_TRUE(type);
  SceneGrid smooth;
  smooth.name = "ball";
  smooth.pivot = {3, 0, 0};
  smooth.field.add_sphere({-70, 10, 5}, 40, *type);
  smooth.field.remove_sphere({-40, 10, 5}, 30);
  smooth.field.add_box({300, 0, 0}, {390, 80, 100}, *type);
  const GridHandle ball = scene.add_grid(std::move(smooth));
  SceneGrid blocks;
  blocks.name = "blocks";
  blocks.grid.fill_box({{-130, -3, 5}, {60, 70, 40}}, *type);
  for (int i = 0; i < 300; ++i) blocks.grid.set({i * 7 % 301 - 500, i * 13 % 97, i * 29 % 211}, *type);
  scene.add_instance(
      {.name = "walls", .grid = scene.add_grid(std::move(blocks)), .position = {1, 2, 3}, .voxel_size = 0.25});
  scene.add_instance({.name = "ball", .grid = ball});
  scene.add_instance({.name = "again",
                      .grid = ball,
                      .position = {5, 6, 7},
                      .rotation = glm::angleAxis(0.7, glm::normalize(DVec3(1, 2, 3))),
                      .mirrored = true});
  scene.add_instance({.name = "small", .grid = ball, .voxel_size = 0.1});
  return scene;
}

TEST(Vdb, RoundTripsAScene) {
  const Scene scene = some_scene();
  const auto bytes = write_vdb(scene);
  ASSERT_TRUE(bytes);
  const auto read = load_scene(*bytes);
  ASSERT_TRUE(read) << to_string(read.error());
  EXPECT_TRUE(read->warnings.empty());
  EXPECT_EQ(read->scene.grids().handles().size(), 3U) << "of another size distances differ";
  for (const InstanceHandle handle : scene.instances().handles()) {
    const Instance& before = scene.instances()[handle];
    const SceneGrid& was = scene.grids()[before.grid];
    const Instance& after = instance_of(*read, before.name);
    const SceneGrid& is = read->scene.grids()[after.grid];
    for (const DVec3 point : {DVec3(0), DVec3(1, 0, 0), DVec3(0, 50, 0), DVec3(3, 4, 5)}) {
      expect_near(world_from_grid(after, is, point), world_from_grid(before, was, point));
    }
    ASSERT_EQ(is.grid.chunks(), was.grid.chunks());
    for (const IVec3 place : was.grid.chunks()) EXPECT_EQ(*is.grid.find_chunk(place), *was.grid.find_chunk(place));
    ASSERT_EQ(is.field.chunks(), was.field.chunks());
    for (const IVec3 place : was.field.chunks()) {
      const DensityChunk& a = *is.field.find_chunk(place);
      const DensityChunk& b = *was.field.find_chunk(place);
      for (std::size_t i = 0; i < kChunkVoxels; ++i) {
        const auto n = static_cast<int>(i);
        const IVec3 at{n & 63, n >> 6 & 63, n >> 12};
        ASSERT_EQ(a.get(at), b.get(at)) << before.name << " " << at.x << ", " << at.y << ", " << at.z;
      }
    }
  }
  EXPECT_EQ(*write_vdb(scene), *bytes);
}

TEST(Vdb, ReportsLosses) {
  const Scene scene = some_scene();
  const fs::path path = fs::temp_directory_path() / ("quoin-vdb-" + std::to_string(::getpid()) + ".vdb");
  const auto losses = unsupported_features(scene, path);
  const auto saved = save_scene(scene, path);
  ASSERT_TRUE(losses && saved);
  EXPECT_EQ(saved->warnings, *losses);
  ASSERT_EQ(losses->size(), 1U);
  EXPECT_NE(losses->front().find("types"), std::string::npos);
  EXPECT_EQ(detect_format(path).value(), FileFormat::Vdb);
  fs::remove(path);
}

TEST(Vdb, LeavesOutInstancesWithInvalidTransforms) {
  Scene scene = some_scene();
  const auto expected = write_vdb(scene);
  ASSERT_TRUE(expected);
  EXPECT_EQ(vdb_unsupported_features(scene).size(), 1U);
  const GridHandle grid = scene.grids().handles().front();
  scene.add_instance({.name = "flat", .grid = grid, .voxel_size = 0.0});
  scene.add_instance({.name = "lost", .grid = grid, .position = {std::nan(""), 0.0, 0.0}});
  const auto bytes = write_vdb(scene);
  ASSERT_TRUE(bytes);
  EXPECT_EQ(*bytes, *expected);
  const auto losses = vdb_unsupported_features(scene);
  ASSERT_EQ(losses.size(), 2U);
  EXPECT_EQ(losses.back(), "instances without a valid placement left out, not supported by .vdb: 2");
}

/// Reads bytes that may be damaged; errors must state a position.
void expect_sound(std::span<const std::byte> bytes, const std::string& what) {
  const auto read = is_nvdb(bytes) ? read_nvdb_file(bytes) : read_vdb_file(bytes);
  if (!read) {
    EXPECT_LE(read.error().byte_offset.value_or(bytes.size() + 1), bytes.size()) << what << to_string(read.error());
    return;
  }
  for (const auto& grid : read->grids) {
    EXPECT_TRUE(grid.meaning == Meaning::Mask || grid.values.size() == grid.leaves.size() * kLeafVoxels) << what;
  }
}

TEST(Vdb, SurvivesDamageAnywhere) {
  std::minstd_rand random(3);
  for (const auto& entry : fs::directory_iterator(kCorpus)) {
    const auto sound = read_file(entry.path());
    ASSERT_TRUE(sound);
    for (int i = 0; i < 30; ++i) {
      const std::size_t size = i < 20 ? 12 + static_cast<std::size_t>(i) * 9 : 12 + random() % (sound->size() - 12);
      const std::span<const std::byte> cut(sound->data(), size);
      expect_sound(cut, entry.path().filename().string() + " cut to " + std::to_string(size) + ": ");
    }
    for (int i = 0; i < 60; ++i) {
      auto changed = *sound;
      // Much of a file is zeros: its beginning and end have the most effect.
      const std::size_t at =
          i % 2 == 0 ? random() % 600 : changed.size() - 1 - random() % std::min<std::size_t>(changed.size(), 9'000);
      changed[at] = static_cast<std::byte>(random());
      expect_sound(changed, entry.path().filename().string() + " changed at " + std::to_string(at) + ": ");
    }
  }
}

TEST(Vdb, RefusesOtherVersionsAndStreams) {
  auto bytes = read_file(kCorpus / "instances.vdb").value();
  bytes[8] = std::byte{200};
  EXPECT_EQ(load_scene(bytes).error().code, ErrorCode::Unsupported);
  bytes = read_file(kCorpus / "instances.vdb").value();
  bytes[20] = std::byte{0};
  EXPECT_EQ(load_scene(bytes).error().byte_offset, 20U);
}

TEST(Vdb, SurvivesDamagedBloscFrames) {
  std::vector<std::byte> frame(64);
  std::vector<std::byte> out(2048);
  EXPECT_FALSE(expand_blosc(frame, out));
  std::minstd_rand random(7);
  for (int i = 0; i < 20'000; ++i) {
    for (std::byte& byte : frame) byte = static_cast<std::byte>(random());
    frame[2] = static_cast<std::byte>(random() & 0x31U);  // LZ4, or an unknown method
    frame[3] = std::byte{4};
    frame[4] = std::byte{0};
    frame[5] = std::byte{8};
    frame[6] = frame[7] = frame[10] = frame[11] = std::byte{0};
    static_cast<void>(expand_blosc(frame, out));
  }
}

TEST(Vdb, MatchesOpenVdbOnRealFiles) {
  const fs::path folder = fs::path(QUOIN_SOURCE_DIR) / "../shared/data/vdb";
  if (!fs::exists(folder)) GTEST_SKIP() << folder << " is not there";
  const fs::path sphere = folder / "mjurczyk+openvdb" / "examples__public__assets__sphere.vdb";
  const auto file = read_vdb_file(read_file(sphere).value());
  ASSERT_TRUE(file);
  std::int64_t active = 0;
  for (const Leaf& leaf : file->grids.at(0).leaves) {
    for (const std::uint64_t word : leaf.active) active += std::popcount(word);
  }
  EXPECT_EQ(file->grids[0].leaves.size(), 1451U);
  EXPECT_EQ(active, 270'638);
  EXPECT_EQ(grid_named(load(sphere), "ls_sphere").field.solid_count(), 903'939);
  for (const auto& [name, count] : {std::pair{"data__sphere-div1.vdb", 19}, {"data__sphere-div2.vdb", 33}}) {
    const auto fog = read_vdb_file(read_file(folder / "syoyo+tinyvdbio" / name).value());
    ASSERT_TRUE(fog);
    active = 0;
    for (const Leaf& leaf : fog->grids.at(0).leaves) {
      for (const std::uint64_t word : leaf.active) active += std::popcount(word);
    }
    EXPECT_EQ(active, count);
    // All values equal the background, 0.
    const LoadedScene loaded = load(folder / "syoyo+tinyvdbio" / name);
    ASSERT_EQ(loaded.warnings.size(), 1U);
    EXPECT_NE(loaded.warnings[0].find("the same density everywhere"), std::string::npos);
  }
}

}  // namespace

}  // namespace quoin::vdb
