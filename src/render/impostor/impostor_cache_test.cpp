#include <quoin/render/impostor_cache.h>

#include <algorithm>
#include <chrono>
#include <random>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include <quoin/core/memory.h>

#include "bench/workloads.h"
#include "render/impostor/raster/impostor_faces.h"

namespace quoin {
namespace {

constexpr std::size_t kRoom = ImpostorCacheOptions{}.max_bytes;

struct CacheWorld {
  Scene scene;
  std::vector<GridHandle> grids;
  explicit CacheWorld(int count) {
    scene.types = workloads::three_types();
    for (int i = 0; i < count; ++i) {
      SceneGrid grid;
      grid.grid.fill_box({{0, 0, 0}, {i + 1, 3, 4}}, 1);
      grids.push_back(scene.add_grid(std::move(grid)));
    }
  }
};

bool shows(const Impostor& impostor, VoxelType type) {
  const BlockVector<ImpostorFaces::Face>& faces = impostor.faces().faces;
  return std::any_of(faces.begin(), faces.end(), [&](const ImpostorFaces::Face& face) { return face.type == type; });
}

TEST(ImpostorCache, BuildsRequestedImpostors) {
  CacheWorld world(3);
  ImpostorCache cache;
  for (const GridHandle grid : world.grids) static_cast<void>(cache.find(world.scene, grid));
  for (const GridHandle grid : world.grids) static_cast<void>(cache.find(world.scene, grid));  // asks once
  EXPECT_LE(cache.wait(world.scene, 0.0), 3U);
  EXPECT_EQ(cache.wait(world.scene), 0U);
  for (const GridHandle grid : world.grids) EXPECT_NE(cache.find(world.scene, grid), nullptr);
  EXPECT_EQ(cache.stats().built, 3U);
  EXPECT_EQ(cache.stats().held, 3U);
  EXPECT_EQ(cache.find(world.scene, GridHandle{}), nullptr);
}

TEST(ImpostorCache, KeepsOldImpostorUntilRebuilt) {
  CacheWorld world(2);
  ImpostorCache cache;
  EXPECT_EQ(cache.find(world.scene, world.grids[0]), nullptr);
  EXPECT_EQ(cache.wait(world.scene), 0U);
  const auto old = cache.find(world.scene, world.grids[0]);
  ASSERT_NE(old, nullptr);
  world.scene.edit(world.grids[0]).grid.fill_box({{0, 0, 0}, {6, 6, 6}}, 2);
  EXPECT_EQ(cache.find(world.scene, world.grids[0]), old);
  EXPECT_EQ(cache.wait(world.scene), 0U);
  const auto renewed = cache.find(world.scene, world.grids[0]);
  ASSERT_NE(renewed, nullptr);
  EXPECT_NE(renewed, old);
  EXPECT_TRUE(shows(*renewed, 2));
  EXPECT_FALSE(shows(*old, 2)) << "a held impostor does not change";
  EXPECT_EQ(cache.stats().held, 1U);
  EXPECT_EQ(cache.stats().bytes, renewed->bytes());
}

TEST(ImpostorCache, NoticesReplacedGridsAndChangedTypes) {
  CacheWorld world(1);
  ImpostorCache cache;
  const auto ready = [&] {
    static_cast<void>(cache.find(world.scene, world.grids[0]));
    EXPECT_EQ(cache.wait(world.scene), 0U);
    return cache.find(world.scene, world.grids[0]);
  };
  const auto first = ready();
  EXPECT_EQ(ready(), first) << "nothing has changed";
  Grid other;
  other.fill_box({{0, 0, 0}, {1, 3, 4}}, 3);
  world.scene.edit(world.grids[0]).grid = std::move(other);
  const auto second = ready();
  EXPECT_TRUE(shows(*second, 3)) << "of the same version as the one before";
  VoxelProperties glass = world.scene.types[3];
  glass.visibility = Visibility::Transparent;
  world.scene.types.replace(3, glass);
  cache.update_types(world.scene.types);
  EXPECT_TRUE(ready()->empty());
}

TEST(ImpostorCache, NeverReturnsImpostorOfAnotherScene) {
  const CacheWorld first(2);
  CacheWorld second(2);
  // The same handles with other voxels.
  second.scene = first.scene.snapshot();
  second.grids = first.grids;
  for (const GridHandle grid : second.grids) second.scene.edit(grid).grid.fill_box({{0, 0, 0}, {9, 9, 9}}, 2);
  ImpostorCache cache;
  static_cast<void>(cache.find(first.scene, first.grids[0]));
  EXPECT_EQ(cache.wait(first.scene), 0U);
  ASSERT_NE(cache.find(first.scene, first.grids[0]), nullptr);
  EXPECT_EQ(cache.find(second.scene, second.grids[0]), nullptr);
  // The first scene's impostor is requested without waiting, so it may be under way.
  static_cast<void>(cache.find(first.scene, first.grids[0]));
  EXPECT_EQ(cache.find(second.scene, second.grids[0]), nullptr);
  EXPECT_EQ(cache.wait(second.scene), 0U);
  EXPECT_NE(cache.find(second.scene, second.grids[0]), nullptr);
  const ImpostorCache::Stats stats = cache.stats();
  EXPECT_EQ(stats.held, 1U);
  EXPECT_EQ(stats.bytes, cache.find(second.scene, second.grids[0])->bytes());
}

TEST(ImpostorCache, NoticesTypesRegisteredAfterTheirVoxels) {
  CacheWorld world(1);
  const auto type = static_cast<VoxelType>(world.scene.types.size());
  world.scene.edit(world.grids[0]).grid.fill_box({{0, 0, 0}, {1, 3, 4}}, type);
  ImpostorCache cache;
  const auto is_empty = [&] {
    cache.update_types(world.scene.types);
    static_cast<void>(cache.find(world.scene, world.grids[0]));
    EXPECT_EQ(cache.wait(world.scene), 0U);
    return cache.find(world.scene, world.grids[0])->empty();
  };
  EXPECT_FALSE(is_empty());
  VoxelProperties glass;
  glass.visibility = Visibility::Transparent;
  EXPECT_EQ(world.scene.types.add(glass).value(), type);
  EXPECT_TRUE(is_empty());
}

TEST(ImpostorCache, DropsLeastRecentlyUsed) {
  CacheWorld world(3);
  const std::size_t one = Impostor::build(world.scene.grids()[world.grids[2]].grid, world.scene.types).bytes();
  ImpostorCache cache({.max_bytes = 2 * one, .workers = {1}});
  for (const std::size_t i : {0U, 1U}) {
    EXPECT_EQ(cache.find(world.scene, world.grids[i]), nullptr);
    EXPECT_EQ(cache.wait(world.scene), 0U);
  }
  EXPECT_NE(cache.find(world.scene, world.grids[0]), nullptr);
  EXPECT_EQ(cache.wait(world.scene), 0U);
  EXPECT_EQ(cache.find(world.scene, world.grids[2]), nullptr);
  EXPECT_EQ(cache.wait(world.scene), 0U);
  EXPECT_EQ(cache.stats().held, 2U);
  EXPECT_EQ(cache.stats().dropped, 1U);
  EXPECT_NE(cache.find(world.scene, world.grids[0]), nullptr);
  EXPECT_NE(cache.find(world.scene, world.grids[2]), nullptr);
  EXPECT_EQ(cache.find(world.scene, world.grids[1]), nullptr);
}

TEST(ImpostorCache, DropsImpostorLargerThanLimit) {
  CacheWorld world(1);
  ImpostorCache cache({.max_bytes = 1000, .workers = {1}});
  EXPECT_EQ(cache.find(world.scene, world.grids[0]), nullptr);
  EXPECT_EQ(cache.wait(world.scene), 0U);
  EXPECT_EQ(cache.find(world.scene, world.grids[0]), nullptr);
  EXPECT_EQ(cache.stats().held, 0U);
  EXPECT_EQ(cache.stats().bytes, 0U);
  EXPECT_EQ(cache.stats().dropped, 1U);
}

TEST(ImpostorCache, ForgetsRemovedGrids) {
  CacheWorld world(2);
  ImpostorCache cache;
  EXPECT_EQ(cache.find(world.scene, world.grids[0]), nullptr);
  world.scene.remove_grid(world.grids[0]);
  EXPECT_EQ(cache.wait(world.scene), 0U);
  EXPECT_EQ(cache.find(world.scene, world.grids[0]), nullptr);
  EXPECT_EQ(cache.stats().held, 0U);
}

TEST(ImpostorCache, AllowsFindWhileAnotherThreadBuilds) {
  CacheWorld world(8);
  ImpostorCache cache({.max_bytes = kRoom, .workers = {2}});
  std::thread other([&] { EXPECT_EQ(cache.wait(world.scene), 0U); });
  for (std::size_t ready = 0; ready < world.grids.size();) {
    ready = 0;
    for (const GridHandle grid : world.grids) ready += cache.find(world.scene, grid) != nullptr;
  }
  other.join();
  EXPECT_EQ(cache.stats().built, 8U);
}

TEST(ImpostorCache, WorkersBuildWithoutWaitingCallers) {
  CacheWorld world(3);
  ImpostorCache cache({.max_bytes = kRoom, .workers = {1}});
  for (const GridHandle grid : world.grids) static_cast<void>(cache.find(world.scene, grid));
  while (cache.stats().waiting > 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  for (const GridHandle grid : world.grids) EXPECT_NE(cache.find(world.scene, grid), nullptr);
  EXPECT_EQ(cache.wait(world.scene, 0.0), 0U);
}

TEST(ImpostorCache, RebuildsEditedGridFromPreviousImpostor) {
  CacheWorld world(1);
  Grid& grid = world.scene.edit(world.grids[0]).grid;
  grid.fill_box({{0, 0, 0}, {40, 40, 40}}, 1);
  ImpostorCache cache;
  static_cast<void>(cache.find(world.scene, world.grids[0]));
  cache.wait(world.scene);
  std::mt19937 random(3);
  for (int i = 0; i < 40; ++i) {
    const auto coordinate = [&] { return 1 + static_cast<int>(random() % 38); };
    world.scene.edit(world.grids[0])
        .grid.set({coordinate(), coordinate(), coordinate()}, static_cast<VoxelType>(random() % 3));
    // Requests some while the previous one is being built.
    static_cast<void>(cache.find(world.scene, world.grids[0]));
    if (i % 4 == 3) cache.wait(world.scene);
  }
  cache.wait(world.scene);
  const auto found = cache.find(world.scene, world.grids[0]);
  const Impostor fresh = Impostor::build(world.scene.grids()[world.grids[0]].grid, world.scene.types);
  ASSERT_NE(found, nullptr);
  ASSERT_EQ(found->faces().faces.size(), fresh.faces().faces.size());
  for (std::size_t level = 0; level < fresh.faces().levels.size(); ++level) {
    EXPECT_EQ(found->faces().levels[level].views, fresh.faces().levels[level].views);
  }
  EXPECT_GE(cache.stats().rebuilt, 10U);
  EXPECT_EQ(cache.stats().waiting, 0U);
}

TEST(ImpostorCache, BuildsAgainForOtherOptions) {
  CacheWorld world(1);
  ImpostorCache cache;
  const auto ready = [&](int edge) {
    static_cast<void>(cache.find(world.scene, world.grids[0], {edge}));
    cache.wait(world.scene);
    return cache.find(world.scene, world.grids[0], {edge});
  };
  EXPECT_EQ(ready(64)->faces().edge, 64);
  EXPECT_EQ(ready(256)->faces().edge, 256);
  EXPECT_EQ(cache.stats().built, 2U);
}

TEST(ImpostorCache, StopsDuringBuilds) {
  for (int i = 0; i < 10; ++i) {
    CacheWorld world(6);
    ImpostorCache cache({.max_bytes = kRoom, .workers = {2}});
    for (const GridHandle grid : world.grids) static_cast<void>(cache.find(world.scene, grid));
  }
}

// A game's frame only looks up impostors, no matter how many are being built.
TEST(ImpostorCache, FindNeverWaitsForBuild) {
  CacheWorld world(1);
  world.scene.edit(world.grids[0]).grid.fill_box({{0, 0, 0}, {160, 160, 160}}, 1);
  ImpostorCache cache({.max_bytes = kRoom, .workers = {1}});
  std::mt19937 random(5);
  std::vector<double> seconds;
  for (int frame = 0; frame < 200; ++frame) {
    const auto coordinate = [&] { return static_cast<int>(random() % 160); };
    world.scene.edit(world.grids[0]).grid.set({coordinate(), 159, coordinate()}, kAir);
    const auto begin = std::chrono::steady_clock::now();
    static_cast<void>(cache.find(world.scene, world.grids[0]));
    cache.wait(world.scene, 0.0);
    seconds.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  // The median, since other programs may interrupt any frame.
  std::nth_element(seconds.begin(), seconds.begin() + 100, seconds.end());
  EXPECT_LT(seconds[100], 0.001);
}

}  // namespace
}  // namespace quoin
