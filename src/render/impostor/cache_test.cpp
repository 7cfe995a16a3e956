#include <quoin/render/impostor_cache.h>

#include <algorithm>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "bench/workloads.h"
#include "render/impostor/faces.h"

namespace quoin {
namespace {

struct World {
  Scene scene;
  std::vector<GridHandle> grids;
  explicit World(int count) {
    scene.types = workloads::three_types();
    for (int i = 0; i < count; ++i) {
      SceneGrid grid;
      grid.grid.fill_box({{0, 0, 0}, {i + 1, 3, 4}}, 1);
      grids.push_back(scene.add_grid(std::move(grid)));
    }
  }
};

bool shows(const Impostor& impostor, VoxelType type) {
  const std::vector<ImpostorFaces::Face>& faces = impostor.faces().faces;
  return std::any_of(faces.begin(), faces.end(), [&](const ImpostorFaces::Face& face) { return face.type == type; });
}

TEST(ImpostorCache, BuildsWhatIsAskedForSomeAtATime) {
  World world(3);
  ImpostorCache cache;
  for (const GridHandle grid : world.grids) EXPECT_EQ(cache.find(world.scene, grid), nullptr);
  for (const GridHandle grid : world.grids) EXPECT_EQ(cache.find(world.scene, grid), nullptr) << "asked for once";
  EXPECT_EQ(cache.stats().waiting, 3U);
  EXPECT_EQ(cache.build_some(world.scene, 0.0), 2U) << "one at least";
  EXPECT_NE(cache.find(world.scene, world.grids[0]), nullptr);
  EXPECT_EQ(cache.find(world.scene, world.grids[1]), nullptr);
  EXPECT_EQ(cache.build_some(world.scene, 100.0, {2}), 0U);
  EXPECT_NE(cache.find(world.scene, world.grids[2]), nullptr);
  EXPECT_EQ(cache.stats().built, 3U);
  EXPECT_EQ(cache.stats().held, 3U);
  EXPECT_EQ(cache.find(world.scene, GridHandle{}), nullptr);
}

TEST(ImpostorCache, KeepsTheOldOneUntilTheEditedGridsIsReady) {
  World world(2);
  ImpostorCache cache;
  EXPECT_EQ(cache.find(world.scene, world.grids[0]), nullptr);
  EXPECT_EQ(cache.build_some(world.scene, 1.0), 0U);
  const auto old = cache.find(world.scene, world.grids[0]);
  ASSERT_NE(old, nullptr);
  world.scene.edit(world.grids[0]).grid.fill_box({{0, 0, 0}, {6, 6, 6}}, 2);
  EXPECT_EQ(cache.find(world.scene, world.grids[0]), old);
  EXPECT_EQ(cache.build_some(world.scene, 1.0), 0U);
  const auto renewed = cache.find(world.scene, world.grids[0]);
  ASSERT_NE(renewed, nullptr);
  EXPECT_NE(renewed, old);
  EXPECT_TRUE(shows(*renewed, 2));
  EXPECT_FALSE(shows(*old, 2)) << "whoever holds it still has it";
  EXPECT_EQ(cache.stats().held, 1U);
  EXPECT_EQ(cache.stats().bytes, renewed->bytes());
}

TEST(ImpostorCache, SeesGridsThatTookAnothersPlaceAndTypesThatBecameOpaque) {
  World world(1);
  ImpostorCache cache;
  const auto ready = [&] {
    static_cast<void>(cache.find(world.scene, world.grids[0]));
    EXPECT_EQ(cache.build_some(world.scene, 1.0), 0U);
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
  EXPECT_TRUE(ready()->is_empty());
}

TEST(ImpostorCache, SeesTypesThatWereRegisteredAfterTheirVoxels) {
  World world(1);
  const auto type = static_cast<VoxelType>(world.scene.types.size());
  world.scene.edit(world.grids[0]).grid.fill_box({{0, 0, 0}, {1, 3, 4}}, type);
  ImpostorCache cache;
  const auto is_empty = [&] {
    cache.update_types(world.scene.types);
    static_cast<void>(cache.find(world.scene, world.grids[0]));
    EXPECT_EQ(cache.build_some(world.scene, 1.0), 0U);
    return cache.find(world.scene, world.grids[0])->is_empty();
  };
  EXPECT_FALSE(is_empty());
  VoxelProperties glass;
  glass.visibility = Visibility::Transparent;
  EXPECT_EQ(world.scene.types.add(glass).value(), type);
  EXPECT_TRUE(is_empty());
}

TEST(ImpostorCache, DropsWhatWasUsedLongestAgo) {
  World world(3);
  const std::size_t one = Impostor::build(world.scene.grids()[world.grids[2]].grid, world.scene.types).bytes();
  ImpostorCache cache({2 * one});
  for (const std::size_t i : {0U, 1U}) {
    EXPECT_EQ(cache.find(world.scene, world.grids[i]), nullptr);
    EXPECT_EQ(cache.build_some(world.scene, 1.0), 0U);
  }
  EXPECT_NE(cache.find(world.scene, world.grids[0]), nullptr);
  EXPECT_EQ(cache.build_some(world.scene, 1.0), 0U);
  EXPECT_EQ(cache.find(world.scene, world.grids[2]), nullptr);
  EXPECT_EQ(cache.build_some(world.scene, 1.0), 0U);
  EXPECT_EQ(cache.stats().held, 2U);
  EXPECT_EQ(cache.stats().dropped, 1U);
  EXPECT_NE(cache.find(world.scene, world.grids[0]), nullptr);
  EXPECT_NE(cache.find(world.scene, world.grids[2]), nullptr);
  EXPECT_EQ(cache.find(world.scene, world.grids[1]), nullptr);
}

TEST(ImpostorCache, HoldsNothingThatIsLargerThanItsRoom) {
  World world(1);
  ImpostorCache cache({1000});
  EXPECT_EQ(cache.find(world.scene, world.grids[0]), nullptr);
  EXPECT_EQ(cache.build_some(world.scene, 1.0), 0U);
  EXPECT_EQ(cache.find(world.scene, world.grids[0]), nullptr);
  EXPECT_EQ(cache.stats().held, 0U);
  EXPECT_EQ(cache.stats().bytes, 0U);
  EXPECT_EQ(cache.stats().dropped, 1U);
}

TEST(ImpostorCache, ForgetsGridsThatAreGone) {
  World world(2);
  ImpostorCache cache;
  EXPECT_EQ(cache.find(world.scene, world.grids[0]), nullptr);
  world.scene.remove_grid(world.grids[0]);
  EXPECT_EQ(cache.build_some(world.scene, 1.0), 0U);
  EXPECT_EQ(cache.find(world.scene, world.grids[0]), nullptr);
  EXPECT_EQ(cache.stats().built, 0U);
}

TEST(ImpostorCache, MayBeAskedWhileAnotherThreadBuilds) {
  World world(8);
  ImpostorCache cache;
  for (const GridHandle grid : world.grids) EXPECT_EQ(cache.find(world.scene, grid), nullptr);
  std::thread builder([&] { EXPECT_EQ(cache.build_some(world.scene, 100.0, {2}), 0U); });
  for (std::size_t ready = 0; ready < world.grids.size();) {
    ready = 0;
    for (const GridHandle grid : world.grids) ready += cache.find(world.scene, grid) != nullptr;
  }
  builder.join();
  EXPECT_EQ(cache.stats().built, 8U);
}

}  // namespace
}  // namespace quoin
