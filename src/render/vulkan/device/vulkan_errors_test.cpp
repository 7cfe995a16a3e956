// Rejected inputs and their error messages.

#include "render/cpu/environment_for_tests.h"
#include "render/vulkan/device/vulkan_for_tests.h"

namespace quoin {
namespace {

using render_test::add_type;
using render_test::place;
using render_test::sized;
using render_test::towards;

class VulkanErrors : public vulkan_test::VulkanTest {};

TEST(Vulkan, ListsDevicesOrReportsMissingRequirements) {
  const auto devices = vulkan_devices();
  const auto renderer = VulkanRenderer::create();
  if (!devices) {
    EXPECT_EQ(devices.error().code, ErrorCode::Unsupported);
    EXPECT_EQ(devices.error().message.find("vulkan: "), 0U) << devices.error().message;
    ASSERT_FALSE(renderer);
    EXPECT_EQ(renderer.error().message, devices.error().message);
    return;
  }
  EXPECT_FALSE(devices->empty());
  for (const VulkanDeviceInfo& device : *devices) EXPECT_FALSE(device.name.empty() || device.kind.empty());
  if (!renderer) {
    EXPECT_NE(renderer.error().message.find(" lacks "), std::string::npos) << renderer.error().message;
  }
}

TEST_F(VulkanErrors, ChoosesDevicesByNumberOrName) {
  const auto devices = vulkan_devices().value();
  VulkanOptions options;
  options.device = "no such device";
  auto refused = VulkanRenderer::create(options);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::Unsupported);
  EXPECT_EQ(refused.error().message.find("vulkan: no device \"no such device\"; available: 0 " + devices[0].name), 0U)
      << refused.error().message;
  options.device = std::to_string(devices.size());
  EXPECT_FALSE(VulkanRenderer::create(options));
  for (std::size_t i = 0; i < devices.size(); ++i) {
    options.device = std::to_string(i);
    const auto chosen = VulkanRenderer::create(options);
    if (!devices[i].missing.empty()) {
      ASSERT_FALSE(chosen);
      EXPECT_EQ(chosen.error().message, "vulkan: " + devices[i].name + " lacks " + devices[i].missing);
      continue;
    }
    ASSERT_TRUE(chosen);
    EXPECT_EQ(chosen->device().name, devices[i].name);
    std::string capitals = devices[i].name;
    for (char& c : capitals) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    options.device = capitals;
    ASSERT_TRUE(VulkanRenderer::create(options));
  }
}

TEST_F(VulkanErrors, MatchCpuErrors) {
  const Scene scene;
  const CpuRenderer cpu(scene);
  const Camera camera = towards({0, 0, 0}, {1, 0, 0});
  const auto expect_same = [&](const Camera& from, const RenderOptions& options) {
    const auto a = renderer_->render(from, options);
    const auto b = cpu.render(from, options);
    ASSERT_FALSE(a);
    ASSERT_FALSE(b);
    EXPECT_EQ(a.error().code, b.error().code);
    EXPECT_EQ(a.error().message, b.error().message);
  };
  expect_same(camera, sized(0, 5));
  expect_same(camera, sized(1 << 20, 1 << 20));
  RenderOptions options = sized(4, 4);
  options.samples = 0;
  expect_same(camera, options);
  options.samples = 1;
  environment_in(options).sun.direction = DVec3(0.0);
  expect_same(camera, options);
  Camera wrong = camera;
  wrong.up *= 2.0;
  expect_same(wrong, sized(4, 4));
}

// Before the first update and after a failed one, there is no scene for levels of detail.
TEST_F(VulkanErrors, DetailWithoutSceneShowsSky) {
  const Camera camera = towards({20, 20, 40}, {0, 0, 0});
  RenderOptions options = sized(16, 12);
  options.detail.policy.emplace();
  const RenderedImage sky = render_test::taken(Scene(), camera, options);
  EXPECT_EQ(render_test::count_different(taken_as_is(camera, options), sky, 2), 0);
  Scene scene;
  const VoxelType stone = add_type(scene, {140, 140, 150});
  Grid grid;
  grid.fill_box({{0, 0, 0}, {10, 10, 10}}, stone);
  const InstanceHandle instance = place(scene, std::move(grid));
  EXPECT_GT(taken(scene, camera, options).pixels_hit, 0);
  Grid& voxels = scene.edit(scene.instances()[instance].grid).grid;
  voxels.set({-1'000'000'000, 0, 0}, stone);
  ASSERT_FALSE(renderer_->update(scene)) << "too wide";
  EXPECT_EQ(render_test::count_different(taken_as_is(camera, options), sky, 2), 0);
}

TEST_F(VulkanErrors, ProgressCallbackCancelsRendering) {
  Scene scene;
  const VoxelType stone = add_type(scene, {140, 140, 150});
  Grid grid;
  grid.fill_box({{0, 0, 0}, {10, 10, 10}}, stone);
  place(scene, std::move(grid));
  ASSERT_TRUE(renderer_->update(scene));
  const Camera camera = towards({30, 20, 30}, {5, 5, 5});
  RenderOptions options = sized(32, 32);
  options.samples = 6;
  std::vector<double> reported;
  const auto stopped = renderer_->render(camera, options, {}, [&](double fraction) {
    reported.push_back(fraction);
    return reported.size() < 3;
  });
  ASSERT_FALSE(stopped);
  EXPECT_EQ(stopped.error().code, ErrorCode::Cancelled);
  EXPECT_EQ(stopped.error().message, "cancelled");
  EXPECT_EQ(reported.size(), 3U);
  reported.clear();
  ASSERT_TRUE(renderer_->render(camera, options, {}, [&](double fraction) {
    reported.push_back(fraction);
    return true;
  }));
  EXPECT_TRUE(std::is_sorted(reported.begin(), reported.end()));
  EXPECT_EQ(reported.back(), 1.0);
}

}  // namespace
}  // namespace quoin
