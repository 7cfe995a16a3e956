// Windows without a display: what is shown cannot be seen here (tests/viewer looks), but everything is done, and the
// validation layer watches.

#include <quoin/render_vk/vulkan_window.h>

#include <array>
#include <cstring>

#include <dlfcn.h>

#include "render_vk/api.h"
#include "render_vk/vulkan_for_tests.h"

namespace quoin {
namespace {

using vulkan_test::VulkanTest;

// A surface of no display.
std::uint64_t make_headless(void* instance) {
  const auto loader = vulkan::Api::load();
  if (!loader) return 0;
  const auto make = reinterpret_cast<PFN_vkCreateHeadlessSurfaceEXT>(
      loader->vkGetInstanceProcAddr(static_cast<VkInstance>(instance), "vkCreateHeadlessSurfaceEXT"));
  if (make == nullptr) return 0;
  const auto info = vulkan::info_of<VkHeadlessSurfaceCreateInfoEXT>(VK_STRUCTURE_TYPE_HEADLESS_SURFACE_CREATE_INFO_EXT);
  VkSurfaceKHR surface = VK_NULL_HANDLE;
  if (make(static_cast<VkInstance>(instance), &info, nullptr, &surface) != VK_SUCCESS) return 0;
  std::uint64_t number = 0;
  std::memcpy(&number, &surface, sizeof surface);
  return number;
}

class VulkanWindowTest : public VulkanTest {
 protected:
  void SetUp() override {
    VulkanTest::SetUp();
    if (IsSkipped()) return;
    VulkanOptions options = test_options();
    if (!is_validated_) options.on_validation_message = {};
    options.surface = {{"VK_KHR_surface", "VK_EXT_headless_surface"}, make_headless};
    auto made = VulkanRenderer::create(options);
    if (!made) GTEST_SKIP() << made.error().message;
    renderer_ = std::make_unique<VulkanRenderer>(std::move(*made));
  }

  [[nodiscard]] VulkanPicture picture_of_sky(int width, int height) {
    VulkanPicture picture(*renderer_);
    RenderOptions options;
    options.width = width;
    options.height = height;
    const Status drawn = renderer_->draw(picture, *look_at({0, 0, 0}, {1, 0.2, 0}, 1.0), options, true);
    EXPECT_TRUE(drawn) << to_string(drawn.error());
    return picture;
  }
};

constexpr std::array<std::uint8_t, 4> kFont = {255, 255, 0, 255};
constexpr std::array kCorners = {OverlayVertex{0, 0, 0, 0, 0xFF0000FFU}, OverlayVertex{50, 0, 1, 0, 0xFF00FF00U},
                                 OverlayVertex{0, 50, 0, 1, 0x80FF0000U}};
constexpr std::array<std::uint16_t, 3> kIndices = {0, 1, 2};

TEST_F(VulkanWindowTest, ShowsPicturesOfEverySizeAndOverlays) {
  auto window = VulkanWindow::create(*renderer_);
  ASSERT_TRUE(window) << to_string(window.error());
  ASSERT_TRUE(window->set_font(2, 2, kFont));
  const VulkanPicture whole = picture_of_sky(160, 90);
  const VulkanPicture coarse = picture_of_sky(20, 12);
  const VulkanPicture never_drawn(*renderer_);
  const std::array draws = {OverlayDraw{{0, 0, 40, 40}, 0, 3, 0}, OverlayDraw{{-50, -50, 10, 10}, 0, 3, 0},
                            OverlayDraw{{100, 50, 5000, 5000}, 0, 3, 0}};
  const Overlay overlay{kCorners, kIndices, draws};
  for (const VulkanPicture* picture : {&whole, &coarse, &never_drawn, static_cast<const VulkanPicture*>(nullptr)}) {
    for (const PixelRect place : {PixelRect{0, 0, 160, 90}, {-20, 30, 70, 500}, {10, 10, 0, 0}, {500, 500, 10, 10}}) {
      const Status shown = window->present(160, 90, picture, place, overlay);
      ASSERT_TRUE(shown) << to_string(shown.error());
    }
  }
}

TEST_F(VulkanWindowTest, FollowsTheWindowsSizeAndRestsWhileMinimised) {
  auto window = VulkanWindow::create(*renderer_, false);
  ASSERT_TRUE(window) << to_string(window.error());
  const VulkanPicture picture = picture_of_sky(64, 64);
  for (const auto& [width, height] : {std::pair{64, 64}, {300, 20}, {0, 0}, {1, 1}, {64, 0}, {640, 480}, {64, 64}}) {
    const Status shown = window->present(width, height, &picture, {0, 0, width, height}, {});
    ASSERT_TRUE(shown) << width << " x " << height << ": " << to_string(shown.error());
  }
}

TEST_F(VulkanWindowTest, AnOverlayWithoutAFontIsNotDrawn) {
  auto window = VulkanWindow::create(*renderer_);
  ASSERT_TRUE(window) << to_string(window.error());
  const std::array draws = {OverlayDraw{{0, 0, 40, 40}, 0, 3, 0}};
  EXPECT_TRUE(window->present(64, 64, nullptr, {}, {kCorners, kIndices, draws}));
}

TEST_F(VulkanWindowTest, OpensAndClosesFiftyTimes) {
  const VulkanPicture picture = picture_of_sky(32, 32);
  for (int i = 0; i < 50; ++i) {
    auto window = VulkanWindow::create(*renderer_);
    ASSERT_TRUE(window) << to_string(window.error());
    ASSERT_TRUE(window->present(32, 32, &picture, {0, 0, 32, 32}, {}));
  }
}

TEST_F(VulkanTest, ARendererWithoutAWindowShowsNothing) {
  const auto window = VulkanWindow::create(*renderer_);
  ASSERT_FALSE(window);
  EXPECT_EQ(window.error().code, ErrorCode::InvalidArgument);
}

TEST(VulkanWindowErrors, AWindowThatCannotBeMadeIsTold) {
  VulkanOptions options;
  options.surface = {{"VK_QUOIN_no_such_thing"}, make_headless};
  auto made = VulkanRenderer::create(options);
  ASSERT_FALSE(made);
  EXPECT_EQ(made.error().code, ErrorCode::Unsupported);
  options.surface = {{}, [](void*) { return std::uint64_t{0}; }};
  made = VulkanRenderer::create(options);
  ASSERT_FALSE(made);
  EXPECT_EQ(made.error().code, ErrorCode::Unsupported);
}

}  // namespace
}  // namespace quoin
