// The device's state after edits, and its updates for worlds of all sizes.

#include <functional>
#include <random>

#include "render/vulkan/device/vulkan_for_tests.h"

namespace quoin {
namespace {

using render_test::add_type;
using render_test::place;
using render_test::sized;
using render_test::towards;
using vulkan_test::expect_equal;

class VulkanUpdate : public vulkan_test::VulkanTest {
 protected:
  /// Expects the updated image to match the CPU renderer's, and to equal a fresh renderer's image byte for byte. Fresh
  /// renderers take long to create, so by day only the last of several updates is compared with one.
  void expect_current(const Scene& scene, const Camera& camera, const std::string& name, bool is_last) {
    const RenderOptions options = sized(64, 48);
    const RenderedImage updated = taken_as_is(camera, options);
    expect_equal(updated, render_test::taken(scene, camera, options), name);
    if (!is_last && !is_nightly()) return;
    auto fresh = VulkanRenderer::create(test_options());
    if (!fresh) return;
    ASSERT_TRUE(fresh->update(scene));
    const RenderedImage anew = fresh->render(camera, options).value();
    EXPECT_EQ(updated.colour.rgb, anew.colour.rgb) << name;
    EXPECT_EQ(updated.depth.values, anew.depth.values) << name;
  }
};

/// Returns hills of many chunks, with two types in patches.
Grid hills(VoxelType ground, VoxelType stone, int edge) {
  Grid grid;
  for (int x = 0; x < edge; x += 4) {
    for (int z = 0; z < edge; z += 4) {
      const int height = 20 + static_cast<int>(12.0 * std::sin(x * 0.06) + 9.0 * std::cos(z * 0.09));
      grid.fill_box({{x, 0, z}, {x + 4, height + 1, z + 4}}, (x / 16 + z / 16) % 2 == 0 ? ground : stone);
    }
  }
  return grid;
}

TEST_F(VulkanUpdate, UploadsOnlyChanges) {
  Scene scene;
  const VoxelType ground = add_type(scene, {90, 160, 70});
  const VoxelType stone = add_type(scene, {140, 140, 150});
  const VoxelType glass = add_type(scene, {120, 200, 230, 90}, Visibility::Transparent);
  const InstanceHandle instance = place(scene, hills(ground, stone, 512));
  Grid& grid = scene.edit(scene.instances()[instance].grid).grid;
  const Camera camera = towards({150, 70, 210}, {70, 20, 70});
  ASSERT_TRUE(renderer_->update(scene));
  const std::uint64_t all = renderer_->uploaded_bytes();
  ASSERT_TRUE(renderer_->update(scene));
  EXPECT_EQ(renderer_->uploaded_bytes(), 0U) << "nothing changed";
  const auto edited = [&](const char* name, const std::function<void()>& edit, bool is_last = false) {
    edit();
    ASSERT_TRUE(renderer_->update(scene)) << name;
    EXPECT_GT(renderer_->uploaded_bytes(), 0U) << name;
    EXPECT_LT(renderer_->uploaded_bytes(), all / 8) << name;
    expect_current(scene, camera, name, is_last);
  };
  edited("one_voxel", [&] { grid.set({100, 60, 100}, stone); });
  edited("hole", [&] { grid.fill_sphere({70, 8, 90}, 12, kAir); });
  edited("glass", [&] { grid.fill_box({{80, 30, 80}, {101, 51, 83}}, glass); });
  edited("new_chunk_below", [&] { grid.fill_box({{-70, 0, 60}, {-65, 31, 65}}, stone); });
  edited(
      "chunk_away",
      [&] {
        grid.fill_box({{-70, 0, 60}, {-65, 31, 65}}, kAir);
      },
      true);
}

TEST_F(VulkanUpdate, FollowsInstancesAndTypes) {
  Scene scene;
  const VoxelType stone = add_type(scene, {140, 140, 150});
  const VoxelType brick = add_type(scene, {170, 80, 60});
  Grid floor;
  floor.fill_box({{0, 0, 0}, {64, 2, 64}}, stone);
  place(scene, std::move(floor));
  Grid tower;
  tower.fill_box({{0, 0, 0}, {8, 24, 8}}, brick);
  const InstanceHandle first = place(scene, tower.snapshot(), {12, 2, 12});
  const Camera camera = towards({90, 60, 100}, {30, 8, 30});
  const auto then = [&](const char* name, bool is_last = false) {
    ASSERT_TRUE(renderer_->update(scene)) << name;
    expect_current(scene, camera, name, is_last);
  };
  then("two");
  const InstanceHandle second = place(scene, tower.snapshot(), {40, 2, 30});
  then("three");
  scene.edit(first).position.x += 20.25;
  then("moved");
  EXPECT_TRUE(scene.remove_grid(scene.instances()[second].grid));
  then("removed");
  scene.edit(first).visible = false;
  then("hidden");
  scene.edit(first).visible = true;
  VoxelProperties glass = scene.types[brick];
  glass.visibility = Visibility::Transparent;
  glass.colour = {90, 200, 120, 60};
  scene.types.replace(brick, glass);
  then("glass_now");
  scene.edit(scene.instances()[first].grid).grid = tower.snapshot();
  then("assigned");
  const GridHandle grid = scene.instances()[first].grid;
  scene.remove_instance(first);
  scene.edit(grid).grid.set({3, 3, 3}, kAir);
  then("removed_and_edited", true);
}

TEST_F(VulkanUpdate, FollowsOtherSceneWithSameHandles) {
  const Camera camera = towards({40, 30, 50}, {8, 8, 8});
  for (int size = 4; size < 16; size += 5) {
    Scene scene;
    const VoxelType stone = add_type(scene, {140, 140, 150});
    Grid grid;
    grid.fill_box({{0, 0, 0}, {size + 1, size + 1, size + 1}}, stone);
    place(scene, std::move(grid));
    ASSERT_TRUE(renderer_->update(scene));
    expect_current(scene, camera, "scene_" + std::to_string(size), size + 5 >= 16);
  }
}

TEST_F(VulkanUpdate, HoldsWorldsLargerThanBlock) {
  VulkanOptions options = test_options();
  options.block_bytes = 64 << 10;
  auto small = VulkanRenderer::create(options);
  if (!small) GTEST_SKIP() << small.error().message;
  renderer_ = &*small;
  Scene scene;
  const VoxelType ground = add_type(scene, {90, 160, 70});
  const VoxelType stone = add_type(scene, {140, 140, 150});
  place(scene, hills(ground, stone, 640));
  const Camera camera = towards({700, 150, 740}, {300, 10, 300});
  const RenderOptions wanted = sized(96, 64);
  expect_equal(taken(scene, camera, wanted), render_test::taken(scene, camera, wanted), "small_blocks");
  EXPECT_GT(renderer_->uploaded_bytes(), 20 * options.block_bytes);
}

TEST_F(VulkanUpdate, DrawsIslandsFarApart) {
  Scene scene;
  const VoxelType ground = add_type(scene, {90, 160, 70});
  const VoxelType stone = add_type(scene, {140, 140, 150});
  Grid grid = hills(ground, stone, 64);
  grid.fill_sphere({-3e6, 4e6, -5e6}, 20, stone);
  grid.fill_sphere({90, 40, 30}, 20, ground);
  const InstanceHandle instance = place(scene, std::move(grid));
  const RenderOptions options = sized(96, 64);
  const Camera near = towards({150, 70, 160}, {50, 20, 40});
  expect_equal(taken(scene, near, options), render_test::taken(scene, near, options), "island");
  const Camera far = towards({-3e6 + 60, 4e6 + 50, -5e6 + 70}, {-3e6, 4e6, -5e6});
  expect_equal(taken_as_is(far, options), render_test::taken(scene, far, options), "far_island");
  // Beyond the voxel range of single precision: rays still end.
  scene.edit(scene.instances()[instance].grid).grid.set({400'000'000, 21, 43}, stone);
  const Camera across = towards({150.3, 24.7, 20.1}, {400'000'000, 21, 43}, 1.5);
  expect_equal(taken(scene, across, options), render_test::taken(scene, across, options), "across");
  Grid& wide = scene.edit(scene.instances()[instance].grid).grid;
  wide.set({-1'000'000'000, 0, 0}, stone);
  const Status refused = renderer_->update(scene);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::Unsupported);
  EXPECT_NE(refused.error().message.find("2^29"), std::string::npos) << refused.error().message;
  EXPECT_EQ(taken_as_is(near, options).pixels_hit, 0) << "after an error it holds nothing";
  wide.set({-1'000'000'000, 0, 0}, kAir);
  expect_equal(taken(scene, near, options), render_test::taken(scene, near, options), "island_again");
}

TEST_F(VulkanUpdate, DrawsHundredsOfTypesPerChunk) {
  Scene scene;
  std::mt19937 random(3);
  for (int i = 0; i < 700; ++i) {
    add_type(scene, {static_cast<std::uint8_t>(random()), static_cast<std::uint8_t>(random()), 80});
  }
  for (const int types : {1, 3, 14, 200, 700}) {
    Grid grid;
    grid.fill_box({{0, 0, 0}, {64, 10, 64}}, 1);
    grid.edit({{0, 10, 0}, {64, 30, 64}}, [&](IVec3 voxel, VoxelType) {
      const auto type = static_cast<VoxelType>(1 + random() % static_cast<unsigned>(types));
      return (voxel.x + voxel.z) % 16 < voxel.y - 8 ? kAir : type;
    });
    Scene each;
    each.types = scene.types;
    place(each, std::move(grid));
    const Camera camera = towards({90, 60, 80}, {32, 10, 32});
    RenderOptions options = sized(80, 60);
    options.light.occlusion_mode = OcclusionMode::Vertex;
    expect_equal(taken(each, camera, options), render_test::taken(each, camera, options),
                 "types_" + std::to_string(types));
  }
}

}  // namespace
}  // namespace quoin
