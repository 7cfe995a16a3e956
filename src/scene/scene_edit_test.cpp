#include <quoin/scene/scene.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <string>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include "core/death_for_tests.h"

namespace quoin {
namespace {

struct Random {
  std::mt19937 engine;
  explicit Random(unsigned seed) : engine(seed) {}
  double share() { return std::uniform_real_distribution<double>(-1.0, 1.0)(engine); }
  DVec3 vector() { return {share(), share(), share()}; }
  DQuat rotation() { return glm::angleAxis(share() * std::numbers::pi, glm::normalize(vector())); }
};

struct Placed {
  Scene scene;
  InstanceHandle handle;

  [[nodiscard]] const Instance& instance() const { return scene.instances()[handle]; }
  [[nodiscard]] const SceneGrid& grid() const { return scene.grids()[instance().grid]; }
};

Placed random_placement(Random& random, double distance) {
  Placed placed;
  SceneGrid grid;
  grid.pivot = random.vector() * 50.0;
  grid.grid.fill_box({{-70, -30, -20}, {11, 31, 67}}, 7);
  for (int i = 0; i < 500; ++i) grid.grid.set(IVec3(random.vector() * 60.0), static_cast<VoxelType>(i % 5));
  Instance instance;
  instance.position = random.vector() * distance;
  instance.rotation = random.rotation();
  instance.voxel_size = std::exp2(2.0 * random.share());
  instance.mirrored = random.engine() % 2 == 0;
  instance.grid = placed.scene.add_grid(std::move(grid));
  placed.handle = placed.scene.add_instance(instance);
  return placed;
}

// Compares every voxel near a position with the shape's definition in the world: the distance of a point outside of it.
// If the distance is less than the rounding, either result is right.
template <class Outside>
void expect_filled(const Placed& placed, const Grid& before, VoxelType type, DVec3 middle, int reach, double rounding,
                   std::int64_t changed, Outside&& outside) {
  GridReader now(placed.grid().grid);
  GridReader old(before);
  const IVec3 centre(glm::floor(middle));
  std::int64_t expected = 0;
  std::int64_t wrong = 0;
  std::int64_t within = 0;
  for (int z = centre.z - reach; z <= centre.z + reach; ++z) {
    for (int y = centre.y - reach; y <= centre.y + reach; ++y) {
      for (int x = centre.x - reach; x <= centre.x + reach; ++x) {
        const double beyond = outside(world_from_grid(placed.instance(), placed.grid(), DVec3(x, y, z) + 0.5));
        const VoxelType found = now.get(x, y, z);
        if (found != old.get(x, y, z)) ++expected;
        if (beyond <= 0.0) ++within;
        if (std::abs(beyond) <= rounding) continue;
        if (found != (beyond < 0.0 ? type : old.get(x, y, z))) ++wrong;
      }
    }
  }
  EXPECT_EQ(wrong, 0);
  EXPECT_EQ(changed, expected);
  EXPECT_GT(within, 0);
}

TEST(SceneEdit, SpheresFillVoxelsByCentre) {
  for (unsigned seed = 1; seed <= 24; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Random random(seed);
    Placed placed = random_placement(random, seed % 2 == 0 ? 1e9 : 100.0);
    const Grid before = placed.grid().grid.snapshot();
    const double size = placed.instance().voxel_size;
    const DVec3 in_grid = random.vector() * 60.0;
    const DVec3 centre = world_from_grid(placed.instance(), placed.grid(), in_grid);
    const double radius = (2.0 + 20.0 * std::abs(random.share())) * size;
    const auto type = static_cast<VoxelType>(seed % 3);
    const std::int64_t changed = fill_sphere(placed.scene, placed.handle, centre, radius, type);
    expect_filled(placed, before, type, in_grid, 26, 1e-5, changed,
                  [&](DVec3 point) { return glm::length(point - centre) - radius; });
  }
}

TEST(SceneEdit, BoxesFillVoxelsByCentre) {
  for (unsigned seed = 1; seed <= 60; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Random random(seed);
    Placed placed = random_placement(random, seed % 2 == 0 ? 1e9 : 100.0);
    const Grid before = placed.grid().grid.snapshot();
    const double size = placed.instance().voxel_size;
    const DVec3 in_grid = random.vector() * 60.0;
    OrientedBox box;
    box.centre = world_from_grid(placed.instance(), placed.grid(), in_grid);
    // Includes plates and beams.
    box.half_size = (1.0 + glm::abs(random.vector()) * DVec3(30.0, 10.0, 3.0)) * size;
    box.rotation = random.rotation();
    if (seed % 5 == 0) box.rotation = placed.instance().rotation;
    const auto type = static_cast<VoxelType>(seed % 3);
    const std::int64_t changed = fill_box(placed.scene, placed.handle, box, type);
    expect_filled(placed, before, type, in_grid, 36, 1e-5, changed, [&](DVec3 point) {
      const DVec3 beyond = glm::abs(glm::conjugate(box.rotation) * (point - box.centre)) - box.half_size;
      return std::max({beyond.x, beyond.y, beyond.z});
    });
  }
}

TEST(SceneEdit, LargeBoxesFillWholeChunks) {
  Random random(3);
  Placed placed = random_placement(random, 0.0);
  placed.scene.edit(placed.instance().grid).grid.clear();
  Instance& instance = placed.scene.edit(placed.handle);
  instance.voxel_size = 1.0;
  OrientedBox box;
  box.half_size = DVec3(150.0, 140.0, 160.0);
  box.rotation = instance.rotation;
  const std::int64_t changed = fill_box(placed.scene, placed.handle, box, 2);
  EXPECT_EQ(changed, std::int64_t{300} * 280 * 320);
  EXPECT_EQ(placed.grid().grid.voxel_count(), changed);
  // A box as large as the world erases all voxels, in time proportional to the existing ones.
  box.half_size = DVec3(1e12);
  EXPECT_EQ(fill_box(placed.scene, placed.handle, box, kAir), changed);
  EXPECT_EQ(placed.grid().grid.chunk_count(), 0U);
}

// A tilted beam of 2,000 voxels in a box of 10^9 voxels.
TEST(SceneEdit, BeamCreatesOnlyChunksOnItsWay) {
  Scene scene;
  Instance instance;
  instance.grid = scene.add_grid({});
  const InstanceHandle handle = scene.add_instance(instance);
  OrientedBox box;
  box.half_size = DVec3(1'000.0, 1.0, 1.0);
  box.rotation = glm::angleAxis(0.7, glm::normalize(DVec3(1.0, 2.0, 3.0)));
  const std::int64_t changed = fill_box(scene, handle, box, 1);
  EXPECT_NEAR(static_cast<double>(changed), 8'000.0, 400.0);
  EXPECT_LT(scene.grids()[instance.grid].grid.chunk_count(), 150U);
}

TEST(SceneEdit, ClearingVisitsOnlyExistingChunks) {
  Scene scene;
  SceneGrid made;
  constexpr int kFar = 1'000'000'000;
  for (const int x : {-kFar, 0, kFar}) {
    for (const int y : {-kFar, kFar}) made.grid.set({x, y, x / 2}, 1);
  }
  Instance instance;
  instance.grid = scene.add_grid(std::move(made));
  const InstanceHandle handle = scene.add_instance(instance);
  const DQuat askew = glm::angleAxis(0.3, glm::normalize(DVec3(1, 2, 3)));
  // A visit of missing chunks would take years.
  EXPECT_EQ(fill_box(scene, handle, {{0, 0, 0}, DVec3(0.2 * kFar), askew}, kAir), 0);
  EXPECT_EQ(fill_box(scene, handle, {{0, kFar, 0}, DVec3(0.2 * kFar), askew}, kAir), 1);
  EXPECT_EQ(fill_box(scene, handle, {{0, 0, 0}, DVec3(3.0 * kFar), askew}, kAir), 5);
}

TEST(SceneEdit, ReachesLastVoxelsOfWorld) {
  Scene scene;
  SceneGrid made;
  made.grid.set({0, 0, 0}, 1);
  Instance instance;
  instance.grid = scene.add_grid(std::move(made));
  const InstanceHandle handle = scene.add_instance(instance);
  const int first = std::numeric_limits<int>::min() + kChunkEdge;
  const int last = std::numeric_limits<int>::max() - kChunkEdge;
  for (const int x : {first, last}) {
    const DVec3 centre(x + 0.5, 0.5, 0.5);
    EXPECT_EQ(fill_box(scene, handle, {centre, DVec3(0.25), {1, 0, 0, 0}}, 3), 1) << x;
    EXPECT_FALSE(set_voxel(scene, handle, centre, 3)) << "it is there";
    EXPECT_EQ(fill_box(scene, handle, {centre, DVec3(2.25), {1, 0, 0, 0}}, kAir), 1) << x;
  }
}

TEST(SceneEdit, SetsVoxelAtPoint) {
  for (unsigned seed = 1; seed <= 50; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Random random(seed);
    Placed placed = random_placement(random, 1e6);
    const IVec3 voxel(random.vector() * 100.0);
    const DVec3 inside = DVec3(voxel) + 0.5 + 0.49 * random.vector();
    const DVec3 point = world_from_grid(placed.instance(), placed.grid(), inside);
    EXPECT_TRUE(set_voxel(placed.scene, placed.handle, point, 99));
    EXPECT_EQ(placed.grid().grid.get(voxel), 99);
    EXPECT_FALSE(set_voxel(placed.scene, placed.handle, point, 99));
  }
}

TEST(SceneEdit, RecordsEditsInJournals) {
  Random random(1);
  Placed placed = random_placement(random, 10.0);
  const DVec3 point = world_from_grid(placed.instance(), placed.grid(), {200.5, 0.5, 0.5});
  ChangeCursor cursor = placed.scene.cursor();
  ChangeCursor in_grid = placed.grid().grid.cursor();
  for (int edit = 0; edit < 3; ++edit) {
    if (edit == 0) {
      EXPECT_TRUE(set_voxel(placed.scene, placed.handle, point, 3));
    }
    if (edit == 1) {
      EXPECT_GT(fill_sphere(placed.scene, placed.handle, point, 20.0, 4), 0);
    }
    if (edit == 2) {
      EXPECT_GT(fill_box(placed.scene, placed.handle, {point, DVec3(9.0), {1, 0, 0, 0}}, 5), 0);
    }
    const SceneChanges changes = placed.scene.changes_since(cursor);
    ASSERT_EQ(changes.grids.size(), 1U);
    EXPECT_EQ(changes.grids[0], placed.instance().grid);
    EXPECT_FALSE(placed.grid().grid.changes_since(in_grid).empty());
  }
  EXPECT_FALSE(set_voxel(placed.scene, placed.handle, point, 5));
  EXPECT_TRUE(placed.scene.changes_since(cursor).empty());
}

TEST(SceneEdit, NonFiniteOrNegativeInputChangesNothing) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  Random random(2);
  Placed placed = random_placement(random, 10.0);
  ChangeCursor cursor = placed.scene.cursor();
  EXPECT_FALSE(set_voxel(placed.scene, placed.handle, {nan, 0, 0}, 3));
  for (const double wrong : {nan, infinity, -1.0}) {
    EXPECT_EQ(fill_sphere(placed.scene, placed.handle, {0, 0, 0}, wrong, 3), 0);
    EXPECT_EQ(fill_box(placed.scene, placed.handle, {{0, 0, 0}, {1, wrong, 1}, {1, 0, 0, 0}}, 3), 0);
  }
  EXPECT_EQ(fill_sphere(placed.scene, placed.handle, {infinity, 0, 0}, 1.0, 3), 0);
  EXPECT_EQ(fill_box(placed.scene, placed.handle, {{0, nan, 0}, {1, 1, 1}, {1, 0, 0, 0}}, 3), 0);
  EXPECT_EQ(fill_box(placed.scene, placed.handle, {{0, 0, 0}, {1, 1, 1}, {nan, 0, 0, 0}}, 3), 0);
  EXPECT_TRUE(placed.scene.changes_since(cursor).empty());
  placed.scene.edit(placed.handle).voxel_size = 0.0;
  EXPECT_FALSE(set_voxel(placed.scene, placed.handle, {0, 0, 0}, 3));
  EXPECT_EQ(fill_sphere(placed.scene, placed.handle, {0, 0, 0}, 5.0, 3), 0);
  EXPECT_EQ(fill_box(placed.scene, placed.handle, {}, 3), 0);
}

TEST(SceneEditDeathTest, AssertsOnInstanceWithoutGrid) {
  Scene scene;
  const InstanceHandle handle = scene.add_instance({});
  QUOIN_EXPECT_MISTAKE(set_voxel(scene, handle, {0, 0, 0}, 1), "the instance's grid is in the scene");
  QUOIN_EXPECT_MISTAKE(fill_sphere(scene, handle, {0, 0, 0}, 1.0, 1), "the instance's grid is in the scene");
  QUOIN_EXPECT_MISTAKE(fill_box(scene, handle, {}, 1), "the instance's grid is in the scene");
}

TEST(SceneEditDeathTest, AssertsOnUnknownInstance) {
  Scene scene;
  QUOIN_EXPECT_MISTAKE(set_voxel(scene, {}, {0, 0, 0}, 1), "the handle names an element");
  QUOIN_EXPECT_MISTAKE(fill_sphere(scene, {}, {0, 0, 0}, 1.0, 1), "the handle names an element");
  QUOIN_EXPECT_MISTAKE(fill_box(scene, {}, {}, 1), "the handle names an element");
}

}  // namespace
}  // namespace quoin
