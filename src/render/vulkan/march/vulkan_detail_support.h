#pragma once

// Scenes of many instances in every detail, drawn by the device and by the CPU.

#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include <glm/gtc/quaternion.hpp>

#include "render/vulkan/device/vulkan_for_tests.h"
#include "render/vulkan/march/renderer_impl.h"

namespace quoin::vulkan_test {

class VulkanDetailTest : public VulkanTest {
 protected:
  void compare(const Camera& camera, const RenderOptions& whole, const std::string& name) {
    const RenderOptions options = of_day(whole);
    const Status updated = renderer_->update(scene_);
    ASSERT_TRUE(updated) << to_string(updated.error());
    auto expected = CpuRenderer(scene_).render(camera, options);
    ASSERT_TRUE(expected) << to_string(expected.error());
    expect_equal(taken_as_is(camera, options), *expected, name);
  }
  [[nodiscard]] std::uint64_t impostor_bytes() const { return renderer_->impl().detail.impostor_bytes(); }
  [[nodiscard]] std::uint64_t halved_bytes() const { return renderer_->impl().detail.halved_bytes(); }

  Scene scene_;
};

// A house's worth of boxes, all of even edges, so that it may be halved; some of them of glass.
inline GridHandle add_blobs(Scene& scene, std::uint32_t seed, int count = 30) {
  if (scene.types.size() == 1) {
    render_test::add_type(scene, {200, 90, 60});
    render_test::add_type(scene, {60, 160, 90});
    render_test::add_type(scene, {90, 120, 220, 120}, Visibility::Transparent);
    render_test::add_type(scene, {255, 220, 120}, Visibility::Opaque, 2.0F);
  }
  std::mt19937 random(seed);
  SceneGrid grid;
  for (int i = 0; i < count; ++i) {
    const auto coordinate = [&] { return 16 * (static_cast<int>(random() % 10) - 5); };
    const IVec3 at{coordinate(), coordinate(), coordinate()};
    grid.grid.fill_box({at, at + IVec3(15 + 16 * static_cast<int>(random() % 3)) + 1},
                       static_cast<VoxelType>(1 + random() % 4));
  }
  grid.pivot = DVec3(1.5, -2.0, 0.25);
  return scene.add_grid(std::move(grid));
}

// Turned, mirrored and scaled ones on a square.
inline void add_crowd(Scene& scene, const std::vector<GridHandle>& grids, int edge, double spacing) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (int i = 0; i < edge * edge; ++i) {
    Instance instance;
    instance.grid = grids[static_cast<std::size_t>(i) % grids.size()];
    instance.position = {spacing * (i % edge), 10.0 * unit(random), spacing * (i / edge)};
    instance.rotation = glm::normalize(DQuat(unit(random), unit(random), unit(random), unit(random)));
    instance.voxel_size = 1.0 + 0.5 * unit(random);
    instance.mirrored = i % 3 == 0;
    scene.add_instance(instance);
  }
}

inline RenderOptions in_detail(int width, int height, int far_pixels) {
  RenderOptions options = render_test::sized(width, height);
  options.detail.policy.emplace().far_pixels = far_pixels;
  return options;
}

}  // namespace quoin::vulkan_test
