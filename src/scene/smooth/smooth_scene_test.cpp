#include <quoin/scene/smooth_scene.h>

#include <cstdint>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include <quoin/grid/voxel_field.h>

namespace quoin {
namespace {

struct Made {
  Scene scene;
  VoxelType stone = kAir;
  VoxelType water = kAir;
  GridHandle hill;
  GridHandle boat;
};

VoxelType add(Scene& scene, Visibility visibility) {
  VoxelProperties properties;
  properties.colour = {100, 120, 140, 60};
  properties.visibility = visibility;
  return scene.types.add(properties).value();
}

/// Returns a hill with a pond, twice, and a boat that is a field with a mast of blocks.
Made small_scene() {
  Made made;
  made.stone = add(made.scene, Visibility::Opaque);
  made.water = add(made.scene, Visibility::Transparent);
  SceneGrid hill;
  hill.pivot = {30, 0, 30};
  hill.grid.fill_box({{0, 0, 0}, {90, 20, 60}}, made.stone);
  hill.grid.fill_box({{20, 14, 20}, {40, 20, 40}}, made.water);
  made.hill = made.scene.add_grid(std::move(hill));
  SceneGrid boat;
  boat.field.add_sphere({10, 10, 10}, 6.0, made.stone);
  boat.grid.fill_box({{9, 14, 9}, {11, 40, 11}}, made.stone);
  made.boat = made.scene.add_grid(std::move(boat));
  made.scene.add_instance({"hill", made.hill, {0, 0, 0}});
  made.scene.add_instance({"other", made.hill, {200, 0, 0}});
  made.scene.add_instance({"boat", made.boat, {0, 30, 0}});
  return made;
}

/// Returns the field chunks that rays can hit, for each instance in order.
std::vector<std::uint64_t> impl_of(const Scene& scene) {
  std::vector<std::uint64_t> content;
  for (const InstanceHandle handle : scene.instances().handles()) {
    const Instance& instance = scene.instances()[handle];
    const SceneGrid& grid = scene.grids()[instance.grid];
    EXPECT_EQ(grid.grid.chunk_count(), 0U);
    const DVec3 corner = world_from_grid(instance, grid, DVec3(0.0));
    for (const double number : {corner.x, corner.y, corner.z}) {
      content.push_back(static_cast<std::uint64_t>(static_cast<std::int64_t>(number * 16.0)));
    }
    for (const IVec3 chunk : grid.field.chunks()) {
      content.push_back(static_cast<std::uint64_t>((chunk.z * 1024 + chunk.y) * 1024 + chunk.x));
      content.push_back(grid.field.find_chunk(chunk)->content_hash());
    }
  }
  return content;
}

std::vector<std::uint64_t> made_anew(const Scene& scene) {
  SmoothScene smooth;
  EXPECT_TRUE(smooth.update(scene, {2}));
  return impl_of(smooth.scene());
}

TEST(SmoothScene, ReplacesVoxelsByFields) {
  const Made made = small_scene();
  SmoothScene smooth;
  ASSERT_TRUE(smooth.update(made.scene, {2}));
  const Scene& scene = smooth.scene();
  EXPECT_EQ(scene.voxel_count(), 0);
  EXPECT_EQ(scene.grids().handles().size(), 3U) << "the boat has two";
  EXPECT_EQ(scene.instances().handles().size(), 4U);
  EXPECT_GT(smooth.bytes(), 100'000U);
  // A face of the hill keeps its position.
  const Instance& hill = scene.instances()[scene.instances().handles().front()];
  const SceneGrid& grid = scene.grids()[hill.grid];
  EXPECT_NEAR(grid.field.density_at(grid_from_world(hill, grid, {-30.0 + 50.0, 20.0, 0.0})), 0.0, 1e-6);
  EXPECT_EQ(grid.field.material({45, 5, 45}), made.stone);
  EXPECT_EQ(grid.field.material({30, 18, 30}), made.water);
}

TEST(SmoothScene, FollowsEdits) {
  Made made = small_scene();
  SmoothScene smooth;
  ASSERT_TRUE(smooth.update(made.scene, {2}));
  std::mt19937 random(7);
  const auto below = [&](int most) { return static_cast<int>(random() % static_cast<unsigned>(most)); };
  for (int round = 0; round < 8; ++round) {
    SCOPED_TRACE(round);
    for (int i = 0; i < 3; ++i) {
      const IVec3 at{below(90), below(30), below(60)};
      made.scene.edit(made.hill).grid.fill_box({at, at + 3}, below(2) == 0 ? kAir : made.water);
    }
    if (round == 2) made.scene.edit(made.boat).field.remove_sphere({10, 12, 10}, 4.0);
    if (round == 3) made.scene.edit(made.boat).grid.clear();
    if (round == 4) made.scene.edit(made.scene.instances().handles().front()).position.x = 12.0;
    if (round == 5) made.scene.edit(made.hill).pivot.y = 3.0;
    if (round == 6) {
      VoxelProperties water = made.scene.types[made.water];
      water.visibility = Visibility::Opaque;
      made.scene.types.replace(made.water, water);
    }
    if (round == 7) made.scene.edit(made.scene.instances().handles().back()).visible = false;
    ASSERT_TRUE(smooth.update(made.scene, {2}));
    EXPECT_EQ(impl_of(smooth.scene()), made_anew(made.scene));
  }
}

TEST(SmoothScene, ReportsChunksReachedByEdit) {
  Made made = small_scene();
  SmoothScene smooth;
  ASSERT_TRUE(smooth.update(made.scene, {2}));
  const GridHandle grid = smooth.scene().grids().handles().front();
  ChangeCursor read;
  ASSERT_TRUE(smooth.scene().grids()[grid].field.changes_since(read).all);
  made.scene.edit(made.hill).grid.set({80, 25, 32}, made.stone);
  ASSERT_TRUE(smooth.update(made.scene, {2}));
  ASSERT_NE(smooth.scene().grids().find(grid), nullptr) << "the scene is another";
  const DensityChanges changes = smooth.scene().grids()[grid].field.changes_since(read);
  EXPECT_FALSE(changes.all);
  ASSERT_EQ(changes.items_unless_all().size(), 1U);
  EXPECT_EQ(changes.items_unless_all()[0].chunk, (IVec3{1, 0, 0}));
}

TEST(SmoothScene, ResumesAfterCancellation) {
  const Made made = small_scene();
  SmoothScene smooth;
  int rounds = 0;
  for (;; ++rounds) {
    ASSERT_LT(rounds, 100);
    int asked = 0;
    const Status updated = smooth.update(made.scene, {1}, [&](double) { return ++asked < 3; });
    if (updated) break;
    EXPECT_EQ(updated.error().code, ErrorCode::Cancelled);
    EXPECT_TRUE(smooth.scene().instances().handles().empty());
  }
  EXPECT_GT(rounds, 3);
  EXPECT_EQ(impl_of(smooth.scene()), made_anew(made.scene));
}

TEST(SmoothScene, RejectsLargeContentUntilItShrinks) {
  Made made = small_scene();
  SmoothFieldOptions options;
  options.max_bytes = 1'500'000;
  SmoothScene smooth(options);
  for (int i = 0; i < 2; ++i) {
    const Status refused = smooth.update(made.scene, {2});
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::LimitExceeded);
    EXPECT_EQ(refused.error().message, "the densities of 3 chunks exceed the limit of 1 MiB");
    EXPECT_EQ(smooth.bytes(), 0U);
  }
  made.scene.edit(made.hill).grid.clear();
  ASSERT_TRUE(smooth.update(made.scene, {2}));
  EXPECT_EQ(impl_of(smooth.scene()), made_anew(made.scene));
}

}  // namespace
}  // namespace quoin
