// Draws into images of a program that itself uses Vulkan.

#ifdef QUOIN_HAVE_VULKAN

#include <algorithm>
#include <random>

#include <quoin/live/live_meshes.h>
#include <quoin/render/vulkan_mesh_renderer.h>

#include "render/vulkan/device/own_device_for_tests.h"
#include "render/vulkan/device/vulkan_for_tests.h"
#include "tests/golden_views.h"

namespace quoin {
namespace {

using vulkan_test::OwnDevice;
using vulkan_test::OwnImage;

constexpr std::array kFormats = {VK_FORMAT_R8G8B8A8_UNORM, VK_FORMAT_R8G8B8A8_SRGB, VK_FORMAT_B8G8R8A8_UNORM,
                                 VK_FORMAT_B8G8R8A8_SRGB};

/// Skips without a device; fails on every message of the validation layer. The tests share a device and a renderer:
/// creating them takes longer than most of the images.
class VulkanImages : public ::testing::Test {
 protected:
  static void TearDownTestSuite() {
    renderer_.reset();
    own_.reset();
  }

  void SetUp() override {
    if (!renderer_) {
      std::string why;
      own_ = OwnDevice::create(why);
      if (!own_) GTEST_SKIP() << why;
      auto made = VulkanRenderer::create(own_->lent());
      ASSERT_TRUE(made) << to_string(made.error());
      renderer_ = std::make_unique<VulkanRenderer>(std::move(*made));
    }
    image_ = std::make_unique<VulkanImage>(*renderer_);
  }
  void TearDown() override { image_.reset(); }

  void draw(int width, int height) {
    RenderOptions options;
    options.width = width;
    options.height = height;
    const Status drawn =
        renderer_->draw(*image_, golden::camera_for(golden::kViews[0]), options, Accumulation::Restart);
    ASSERT_TRUE(drawn) << to_string(drawn.error());
  }
  void draw_noise(int width, int height, std::mt19937& random) {
    Image image{width, height, {}};
    image.rgb.resize(std::size_t{3} * static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    for (std::uint8_t& byte : image.rgb) byte = static_cast<std::uint8_t>(random());
    ASSERT_TRUE(image_->write(image));
  }

  void put(const VulkanImageTarget& target, bool is_recorded = true) {
    if (!is_recorded) {
      const Status copied = image_->copy_to(target);
      ASSERT_TRUE(copied) << to_string(copied.error());
      return;
    }
    own_->run([&](VkCommandBuffer commands) {
      const Status recorded = image_->record_copy(commands, target);
      ASSERT_TRUE(recorded) << to_string(recorded.error());
    });
  }

  /// Returns the image's bytes in the target's format.
  [[nodiscard]] std::vector<std::uint8_t> bytes() const {
    const Image image = image_->read().value();
    std::vector<std::uint8_t> all;
    for (std::size_t i = 0; i < image.rgb.size(); i += 3) {
      all.insert(all.end(), {image.rgb[i], image.rgb[i + 1], image.rgb[i + 2], 255});
    }
    return all;
  }

  void expect_error(const VulkanImageTarget& target, ErrorCode code, const std::string& message) {
    const Status copied = image_->copy_to(target);
    ASSERT_FALSE(copied) << message;
    EXPECT_EQ(copied.error().code, code);
    EXPECT_NE(copied.error().message.find(message), std::string::npos) << copied.error().message;
    own_->run([&](VkCommandBuffer commands) {
      const Status recorded = image_->record_copy(commands, target);
      ASSERT_FALSE(recorded);
      EXPECT_EQ(recorded.error().message, copied.error().message);
    });
  }

  static inline std::unique_ptr<OwnDevice> own_;
  static inline std::unique_ptr<VulkanRenderer> renderer_;
  std::unique_ptr<VulkanImage> image_;
};

TEST_F(VulkanImages, MatchImageBytesInEveryFormat) {
  const Scene scene = golden::terrain_scene();
  ASSERT_TRUE(renderer_->update(scene));
  draw(130, 90);
  RenderOptions options;
  options.width = 130;
  options.height = 90;
  const RenderedImage cpu = CpuRenderer(scene).render(golden::camera_for(golden::kViews[0]), options).value();
  const std::vector<std::uint8_t> right = bytes();
  for (const VkFormat format : kFormats) {
    for (const bool is_recorded : {true, false}) {
      OwnImage image(*own_, format, 130, 90);
      put(image.target(), is_recorded);
      const std::vector<std::uint8_t> got = image.read(image.target());
      EXPECT_EQ(got, right) << "VkFormat " << format;
      int different = 0;
      for (std::size_t i = 0; i < got.size(); ++i) {
        const int byte = i % 4 == 3 ? 255 : cpu.colour.rgb[i / 4 * 3 + i % 4];
        different += std::abs(got[i] - byte) > 2;
      }
      EXPECT_LE(different * 1000, 3 * 130 * 90) << "but at silhouettes";
    }
  }
}

TEST_F(VulkanImages, KeepPixelsOutsideTarget) {
  constexpr unsigned kSeed = 61;
  std::mt19937 random(kSeed);
  const auto below = [&](int end) { return static_cast<int>(random() % static_cast<unsigned>(end)); };
  for (int round = 0; round < 24; ++round) {
    const VkFormat format = kFormats[static_cast<std::size_t>(below(4))];
    const int width = 2 + below(60);
    const int height = 2 + below(60);
    OwnImage image(*own_, format, width, height);
    VulkanImageTarget target = image.target(static_cast<std::uint32_t>(below(2)), static_cast<std::uint32_t>(below(2)));
    draw_noise(1 + below(target.width), 1 + below(target.height), random);
    target.x = below(target.width - image_->width() + 1);
    target.y = below(target.height - image_->height() + 1);
    target.layout_before = VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL;
    std::vector<std::uint8_t> right(std::size_t{4} * static_cast<std::size_t>(target.width) *
                                    static_cast<std::size_t>(target.height));
    for (std::uint8_t& byte : right) byte = static_cast<std::uint8_t>(random());
    image.write(target, right);
    put(target, round % 2 == 0);
    const std::vector<std::uint8_t> rendered = bytes();
    for (int y = 0; y < image_->height(); ++y) {
      const auto from = rendered.begin() + std::ptrdiff_t{4} * y * image_->width();
      std::copy_n(from, 4 * image_->width(),
                  right.begin() + std::ptrdiff_t{4} * ((target.y + y) * target.width + target.x));
    }
    ASSERT_EQ(image.read(target), right) << "seed " << kSeed << ", round " << round;
  }
}

// Later recordings must not change earlier ones.
TEST_F(VulkanImages, OneCommandBufferFillsSeveralImages) {
  std::mt19937 random(5);
  draw_noise(70, 50, random);
  VulkanImage other(*renderer_);
  const Image grey{3, 2, std::vector<std::uint8_t>(18, 99)};
  ASSERT_TRUE(other.write(grey));
  std::vector<std::unique_ptr<OwnImage>> images;
  for (const VkFormat format : kFormats) images.push_back(std::make_unique<OwnImage>(*own_, format, 70, 50));
  own_->run([&](VkCommandBuffer commands) {
    for (const auto& image : images) {
      ASSERT_TRUE(image_->record_copy(commands, image->target()));
      VulkanImageTarget corner = image->target();
      corner.layout_before = corner.layout_after;
      ASSERT_TRUE(other.record_copy(commands, corner));
      corner.x = 60;
      ASSERT_TRUE(other.record_copy(commands, corner));
    }
  });
  for (const auto& image : images) {
    const std::vector<std::uint8_t> got = image->read(image->target());
    EXPECT_EQ(got, images[0]->read(images[0]->target()));
    EXPECT_EQ(got[0], 99);
    EXPECT_EQ(got[60 * 4 + 2], 99);
    EXPECT_EQ(got[70 * 4 * 2], bytes()[70 * 4 * 2]);
  }
}

TEST_F(VulkanImages, CopyMeshImages) {
  const Scene scene = golden::terrain_scene();
  auto meshes = VulkanMeshRenderer::create(*renderer_);
  ASSERT_TRUE(meshes) << to_string(meshes.error());
  LiveMeshOptions options;
  options.region_edge = kChunkEdge;  // as the viewer
  LiveMeshes live(options);
  ASSERT_TRUE(renderer_->update(scene));
  ASSERT_TRUE(meshes->update(scene));
  live.update(scene, {});
  while (live.pending() > 0) {
    ASSERT_TRUE(meshes->put(live.take()));
    live.update(scene, {});
  }
  ASSERT_TRUE(meshes->put(live.take()));
  MeshImageOptions wanted;
  wanted.width = 64;
  wanted.height = 48;
  wanted.light.shading = Shading::Unlit;  // drawn by shaders that other tests use too, not only by this one
  ASSERT_TRUE(meshes->draw(*image_, golden::camera_for(golden::kViews[0]), wanted));
  for (const VkFormat format : kFormats) {
    OwnImage image(*own_, format, 64, 48);
    put(image.target());
    const std::vector<std::uint8_t> got = image.read(image.target());
    const std::vector<std::uint8_t> right = bytes();
    ASSERT_EQ(got.size(), right.size());
    for (std::size_t i = 0; i < got.size(); ++i) ASSERT_EQ(int{got[i]}, int{right[i]}) << "byte " << i;
  }
  wanted.wireframe = Wireframe::Over;
  const Status refused = meshes->draw(*image_, golden::camera_for(golden::kViews[0]), wanted);
  ASSERT_FALSE(refused) << "that feature was not enabled";
  EXPECT_EQ(refused.error().code, ErrorCode::Unsupported);
}

TEST_F(VulkanImages, RejectInvalidTargets) {
  OwnImage image(*own_, VK_FORMAT_R8G8B8A8_UNORM, 40, 30);
  const VulkanImageTarget right = image.target();
  expect_error(right, ErrorCode::InvalidArgument, "nothing was drawn");
  std::mt19937 random(1);
  draw_noise(20, 10, random);
  VulkanImageTarget wrong = right;
  wrong.image = VK_NULL_HANDLE;
  expect_error(wrong, ErrorCode::InvalidArgument, "the image is null");
  for (const VkFormat format : {VK_FORMAT_R16G16B16A16_SFLOAT, VK_FORMAT_UNDEFINED, VK_FORMAT_R8G8B8_UNORM}) {
    wrong = right;
    wrong.format = format;
    expect_error(wrong, ErrorCode::Unsupported, "not VkFormat " + std::to_string(format));
  }
  for (const auto& [width, height] : {std::pair{0, 30}, {40, 0}, {-40, 30}}) {
    wrong = right;
    wrong.width = width;
    wrong.height = height;
    expect_error(wrong, ErrorCode::InvalidArgument, "invalid image size " + std::to_string(width) + " x ");
  }
  constexpr int kMost = std::numeric_limits<int>::max();
  for (const auto& [x, y] : {std::pair{21, 0}, {0, 21}, {-1, 0}, {0, -1}, {kMost, 0}, {0, kMost}}) {
    wrong = right;
    wrong.x = x;
    wrong.y = y;
    expect_error(wrong, ErrorCode::InvalidArgument, "does not fit the target image of 40 x 30");
  }
  for (const VkImageLayout layout : {VK_IMAGE_LAYOUT_UNDEFINED, VK_IMAGE_LAYOUT_PREINITIALIZED}) {
    wrong = right;
    wrong.layout_after = layout;
    expect_error(wrong, ErrorCode::InvalidArgument, "cannot be left in VkImageLayout");
  }
  const Status nowhere = image_->record_copy(nullptr, right);
  ASSERT_FALSE(nowhere);
  EXPECT_EQ(nowhere.error().message, "vulkan: the command buffer is null");
  EXPECT_TRUE(image_->copy_to(right));
}

}  // namespace
}  // namespace quoin

#endif
