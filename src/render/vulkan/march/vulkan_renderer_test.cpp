#include <quoin/render/vulkan_renderer.h>

#include "render/vulkan/device/vulkan_for_tests.h"
#include "tests/golden_views.h"

namespace quoin {
namespace {

using vulkan_test::expect_equal;
using vulkan_test::VulkanTest;

class VulkanGolden : public VulkanTest {};

TEST_F(VulkanGolden, ImagesMatchCpu) {
  const Scene scene = golden::terrain_scene();
  const CpuRenderer cpu(scene);
  for (const golden::GoldenView& view : golden::kViews) {
    const RenderOptions options = of_day(golden::options_for(view));
    const Camera camera = golden::camera_for(view);
    expect_equal(taken(scene, camera, options), cpu.render(camera, options).value(), view.name);
  }
}

}  // namespace
}  // namespace quoin
