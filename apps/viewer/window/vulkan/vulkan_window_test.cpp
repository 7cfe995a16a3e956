// Small, short-lived Vulkan windows on a display; tests/viewer/window.sh checks a large one. Uses the validation layer
// if it is installed.

#include "vulkan_window.h"

#include <SDL.h>
#include <imgui.h>

#include <cstdlib>
#include <tuple>

#include <gtest/gtest.h>

#include "core/work/nightly_for_tests.h"
#include "viewer/viewer_fixture.h"
#include "viewer/window/process_facts_for_tests.h"
#include "viewer/window/screen.h"
#include "viewer/window/viewer.h"
#include "window_device.h"

namespace quoin::viewer {
namespace {

/// Skipped without a display or a device that can present to it.
class VulkanWindowTest : public ::testing::Test {
 protected:
  void SetUp() override {
    ::unsetenv("SDL_VIDEODRIVER");
    auto video = SdlVideo::start();
    if (!video) GTEST_SKIP() << video.error().message;
    video_ = std::move(*video);
    window_.reset(SDL_CreateWindow("test", 0, 0, 160, 90, SDL_WINDOW_VULKAN | SDL_WINDOW_RESIZABLE));
    if (!window_) GTEST_SKIP() << sdl_says();
    auto made = WindowDevice::create(options(true));
    if (!made) made = WindowDevice::create(options(false));
    if (!made) GTEST_SKIP() << made.error().message;
    device_ = std::move(*made);
    auto renderer = make_renderer(device_);
    ASSERT_TRUE(renderer) << to_string(renderer.error());
    renderer_ = std::move(*renderer);
    scene_ = small_scene();
    ASSERT_TRUE(renderer_->update(scene_.scene));
  }
  void TearDown() override {
    renderer_.reset();
    device_.reset();
    window_.reset();
    for (const std::string& message : messages_) ADD_FAILURE() << message;
  }

  [[nodiscard]] WindowDeviceOptions options(bool is_validated) {
    auto options = device_options(window_.get());
    EXPECT_TRUE(options) << to_string(options.error());
    if (!options) return {};
    if (is_validated) options->on_validation_message = [this](const std::string& text) { messages_.push_back(text); };
    return *options;
  }

  [[nodiscard]] VulkanImage drawn(int width, int height) {
    VulkanImage image(*renderer_);
    RenderOptions wanted;
    wanted.width = width;
    wanted.height = height;
    const Camera camera = frame_scene(scene_.scene, View::Iso, 16.0 / 9.0);
    const Status status = renderer_->draw(image, camera, wanted, Accumulation::Restart);
    EXPECT_TRUE(status) << to_string(status.error());
    return image;
  }

  std::unique_ptr<SdlVideo> video_;
  SdlPointer<SDL_Window> window_;
  std::shared_ptr<WindowDevice> device_;
  std::shared_ptr<VulkanRenderer> renderer_;
  LoadedScene scene_;
  std::vector<std::string> messages_;
};

/// A Dear ImGui context for tests that draw a GUI.
class TestGui {
 public:
  TestGui() {
    ImGui::CreateContext();
    ImGui::GetIO().IniFilename = nullptr;
  }
  ~TestGui() { ImGui::DestroyContext(); }
  TestGui(const TestGui&) = delete;
  TestGui& operator=(const TestGui&) = delete;

  /// Returns a GUI of this size with text and shapes, some of them outside the window.
  const ImDrawData& frame(float width, float height, float pixels_per_unit = 1.0F) {
    ImGuiIO& io = ImGui::GetIO();
    io.DisplaySize = {width, height};
    io.DisplayFramebufferScale = {pixels_per_unit, pixels_per_unit};
    ImGui::NewFrame();
    ImDrawList& list = *ImGui::GetForegroundDrawList();
    list.AddText({5.0F, 5.0F}, IM_COL32_WHITE, "text");
    for (const ImVec4 clip :
         {ImVec4{0, 0, 40, 40}, {-50, -50, -40, -40}, {100, 50, 5000, 5000}, {10.5F, 0, 20.7F, 9}}) {
      list.PushClipRect({clip.x, clip.y}, {clip.z, clip.w});
      list.AddTriangleFilled({0, 0}, {50, 0}, {0, 50}, 0x80FF0000U);
      list.PopClipRect();
    }
    ImGui::Render();
    return *ImGui::GetDrawData();
  }
};

TEST_F(VulkanWindowTest, PresentsImagesOfAnySizeWithGui) {
  TestGui gui;
  auto window = VulkanWindow::create(device_);
  ASSERT_TRUE(window) << to_string(window.error());
  const Status opened = window->open_gui();
  ASSERT_TRUE(opened) << to_string(opened.error());
  const VulkanImage whole = drawn(160, 90);
  const VulkanImage coarse = drawn(20, 12);
  const VulkanImage never_drawn(*renderer_);
  for (const VulkanImage* image : {&whole, &coarse, &never_drawn, static_cast<const VulkanImage*>(nullptr)}) {
    for (const SDL_Rect place : {SDL_Rect{0, 0, 160, 90}, {-20, 30, 70, 500}, {10, 10, 0, 0}, {500, 500, 10, 10}}) {
      const Status shown = window->present(160, 90, image, place, gui.frame(160, 90));
      ASSERT_TRUE(shown) << to_string(shown.error());
    }
  }
  window->close_gui();
}

TEST_F(VulkanWindowTest, DrawsGuiAtOtherSizeThanWindow) {
  TestGui gui;
  auto window = VulkanWindow::create(device_);
  ASSERT_TRUE(window) << to_string(window.error());
  ASSERT_TRUE(window->open_gui());
  for (const auto& [width, height, scale] :
       {std::tuple{300.0F, 200.0F, 1.0F}, {20.0F, 10.0F, 1.0F}, {80.0F, 45.0F, 2.0F}, {107.0F, 60.0F, 1.5F}}) {
    const Status shown = window->present(160, 90, nullptr, {}, gui.frame(width, height, scale));
    EXPECT_TRUE(shown) << to_string(shown.error());
  }
  window->close_gui();
}

TEST_F(VulkanWindowTest, ReopensGuiForNewContext) {
  auto window = VulkanWindow::create(device_);
  ASSERT_TRUE(window) << to_string(window.error());
  for (int i = 0; i < 5; ++i) {
    TestGui gui;
    EXPECT_TRUE(window->present(160, 90, nullptr, {}, {})) << "a GUI that is not open is not drawn";
    ASSERT_TRUE(window->open_gui());
    ASSERT_TRUE(window->present(160, 90, nullptr, {}, gui.frame(160, 90)));
    window->close_gui();
  }
}

TEST_F(VulkanWindowTest, AllowsDestroyingImagesAfterPresenting) {
  auto window = VulkanWindow::create(device_);
  ASSERT_TRUE(window) << to_string(window.error());
  for (int i = 0; i < cases(14, 40); ++i) {
    VulkanImage image(*renderer_);
    const int edge = 1500 + 10 * (i % 7);
    const auto bytes = std::size_t{3} * static_cast<std::size_t>(edge) * static_cast<std::size_t>(edge);
    ASSERT_TRUE(image.write({edge, edge, std::vector<std::uint8_t>(bytes, 90)}));
    const Status shown = window->present(160, 90, &image, {0, 0, 160, 90}, {});
    ASSERT_TRUE(shown) << to_string(shown.error());
    if (i % 2 == 0) {
      ASSERT_TRUE(image.write({2, 1, {10, 20, 30, 250, 240, 230}}));
    }
  }
}

TEST_F(VulkanWindowTest, FollowsWindowSizeAndMinimising) {
  auto window = VulkanWindow::create(device_, false);
  ASSERT_TRUE(window) << to_string(window.error());
  const VulkanImage image = drawn(64, 64);
  for (const auto& [width, height] : {std::pair{64, 64}, {300, 20}, {0, 0}, {640, 480}, {64, 0}, {64, 64}}) {
    if (width > 0 && height > 0) SDL_SetWindowSize(window_.get(), width, height);
    for (int frame = 0; frame < 3; ++frame) {
      SDL_PumpEvents();
      const Status shown = window->present(width, height, &image, {0, 0, width, height}, {});
      ASSERT_TRUE(shown) << width << " x " << height << ": " << to_string(shown.error());
    }
  }
}

TEST_F(VulkanWindowTest, OpensAndClosesFiftyTimes) {
  const VulkanImage image = drawn(32, 32);
  for (int i = 0; i < 50; ++i) {
    auto window = VulkanWindow::create(device_);
    ASSERT_TRUE(window) << to_string(window.error());
    ASSERT_TRUE(window->present(160, 90, &image, {0, 0, 32, 32}, {}));
  }
}

TEST_F(VulkanWindowTest, LeaksNothingOverManyViewerStarts) {
  // The viewer starts and ends SDL itself.
  renderer_.reset();
  device_.reset();
  window_.reset();
  video_.reset();
  const ScratchFolder folder("vulkan_starts");
  std::vector<std::string> warnings;
  ASSERT_TRUE(small_document().write(folder.file("hill.vox"), warnings));
  ViewerOptions given;
  given.file = folder.file("hill.vox");
  given.width = 64;
  given.height = 48;
  given.is_bare = true;
  given.backend = ViewerBackend::Vulkan;
  const auto start = [&] {
    constexpr int kFrames = 3;
    int asked = 0;
    const Status status = run_viewer(given, [&asked] { return ++asked > kFrames; });
    ASSERT_TRUE(status) << to_string(status.error());
  };
  for (int i = 0; i < 5; ++i) start();
  const std::size_t files = open_files();
  const std::size_t threads_before = threads();
  const double memory = held_megabytes();
  const double in_ram = resident_megabytes();
  for (int i = 0; i < cases(15, 45); ++i) start();
  EXPECT_EQ(open_files(), files);
  EXPECT_LE(threads_after_joining(threads_before), threads_before);
  RecordProperty("megabytes_in_ram", std::to_string(resident_megabytes() - in_ram));
  RecordProperty("megabytes", std::to_string(held_megabytes() - memory));
  // Mesa keeps 6 to 10 MB of compiled code, however often the viewer starts.
  EXPECT_LT(held_megabytes() - memory, cases(16, 25));
}

TEST_F(VulkanWindowTest, PresentsUploadedCpuImages) {
  VulkanImage rendered(*renderer_);
  EXPECT_EQ(rendered.write({}).error().code, ErrorCode::InvalidArgument);
  const Image image{2, 1, {10, 20, 30, 250, 240, 230}};
  ASSERT_TRUE(rendered.write(image));
  const auto read = rendered.read();
  ASSERT_TRUE(read);
  EXPECT_EQ(read->rgb, image.rgb);
  auto window = VulkanWindow::create(device_);
  ASSERT_TRUE(window) << to_string(window.error());
  EXPECT_TRUE(window->present(160, 90, &rendered, {0, 0, 160, 90}, {}));
}

TEST_F(VulkanWindowTest, ReportsUnsupportedDevices) {
  const auto expect_refusal = [](const WindowDeviceOptions& wrong, const std::string& why) {
    const auto made = WindowDevice::create(wrong);
    ASSERT_FALSE(made);
    EXPECT_EQ(made.error().code, ErrorCode::Unsupported);
    EXPECT_NE(made.error().message.find(why), std::string::npos) << made.error().message;
  };
  WindowDeviceOptions wrong = options(false);
  wrong.instance_extensions = {"VK_QUOIN_no_such_thing"};
  expect_refusal(wrong, "no driver can show images in windows");
  wrong = options(false);
  wrong.make_surface = [](VkInstance) { return VkSurfaceKHR{VK_NULL_HANDLE}; };
  expect_refusal(wrong, "the window cannot show images");
  wrong = options(false);
  wrong.device = "no such device";
  expect_refusal(wrong, "no device \"no such device\"; available: 0 ");
  wrong = options(false);
  wrong.get_instance_proc_addr = nullptr;
  expect_refusal(wrong, "the Vulkan loader is missing");
}

}  // namespace
}  // namespace quoin::viewer
