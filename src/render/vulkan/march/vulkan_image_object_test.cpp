// Images that stay on the device and improve sample by sample.

#include "render/vulkan/device/vulkan_for_tests.h"
#include "tests/golden_views.h"

namespace quoin {
namespace {

using vulkan_test::VulkanTest;

constexpr int kWidth = 140;  // more than one tile
constexpr int kHeight = 40;

class VulkanImageObject : public VulkanTest {
 protected:
  void SetUp() override {
    VulkanTest::SetUp();
    if (IsSkipped()) return;
    ASSERT_TRUE(renderer_->update(golden::terrain_scene()));
  }

  void add(VulkanImage& rendered, int samples, Accumulation accumulation, int width = kWidth) {
    options_.width = width;
    options_.samples = samples;
    const Status drawn = renderer_->draw(rendered, golden::camera_for(golden::kViews[0]), options_, accumulation);
    ASSERT_TRUE(drawn) << to_string(drawn.error());
  }
  RenderedImage rendered(int samples) {
    options_.samples = samples;
    return taken_as_is(golden::camera_for(golden::kViews[0]), options_);
  }
  static std::vector<std::uint8_t> bytes_of(const VulkanImage& rendered) {
    const auto image = rendered.read();
    EXPECT_TRUE(image) << to_string(image.error());
    return image ? image->rgb : std::vector<std::uint8_t>{};
  }

  RenderOptions options_ = [] {
    RenderOptions options;
    options.height = kHeight;
    return options;
  }();
};

TEST_F(VulkanImageObject, SamplesAddUpToRenderedImage) {
  VulkanImage image(*renderer_);
  add(image, 1, Accumulation::Restart);
  EXPECT_EQ(bytes_of(image), rendered(1).colour.rgb);
  add(image, 1, Accumulation::Continue);
  add(image, 3, Accumulation::Continue);
  EXPECT_EQ(image.samples(), 5);
  const RenderedImage whole = rendered(5);
  EXPECT_EQ(bytes_of(image), whole.colour.rgb);
  EXPECT_EQ(image.rays(), whole.rays);
}

TEST_F(VulkanImageObject, RestartsOnRequestAndOnResize) {
  VulkanImage image(*renderer_);
  add(image, 2, Accumulation::Restart);
  add(image, 1, Accumulation::Restart);
  EXPECT_EQ(image.samples(), 1);
  EXPECT_EQ(bytes_of(image), rendered(1).colour.rgb);
  add(image, 1, Accumulation::Continue, 64);
  EXPECT_EQ(image.samples(), 1);
  EXPECT_EQ(image.width(), 64);
  EXPECT_EQ(bytes_of(image), rendered(1).colour.rgb);
}

TEST_F(VulkanImageObject, RestartsAfterWrittenImage) {
  options_.width = kWidth;
  const std::vector<std::uint8_t> alone = rendered(1).colour.rgb;
  VulkanImage image(*renderer_);
  Image grey{kWidth, kHeight, std::vector<std::uint8_t>(std::size_t{3} * kWidth * kHeight, 128)};
  for (const bool was_drawn : {false, true}) {
    if (was_drawn) add(image, 2, Accumulation::Restart);
    ASSERT_TRUE(image.write(grey));
    add(image, 1, Accumulation::Continue);
    EXPECT_EQ(image.samples(), 1);
    EXPECT_EQ(bytes_of(image), alone);
  }
}

TEST_F(VulkanImageObject, RejectsInvalidInput) {
  VulkanImage image(*renderer_);
  EXPECT_EQ(image.read().error().code, ErrorCode::InvalidArgument);
  add(image, 1, Accumulation::Restart);
  const Camera camera = golden::camera_for(golden::kViews[0]);
  options_.samples = 4096;
  EXPECT_EQ(renderer_->draw(image, camera, options_, Accumulation::Continue).error().code, ErrorCode::LimitExceeded);
  options_.samples = 0;
  EXPECT_EQ(renderer_->draw(image, camera, options_, Accumulation::Continue).error().code, ErrorCode::InvalidArgument);
  EXPECT_EQ(image.samples(), 1) << "a refusal changes nothing";
  options_.samples = 1;
  const Status stopped =
      renderer_->draw(image, camera, options_, Accumulation::Continue, {}, [](double) { return false; });
  ASSERT_FALSE(stopped);
  EXPECT_EQ(stopped.error().code, ErrorCode::Cancelled);
  EXPECT_EQ(image.samples(), 0);
}

}  // namespace
}  // namespace quoin
