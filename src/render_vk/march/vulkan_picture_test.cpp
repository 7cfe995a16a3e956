// Images that stay on the device and improve sample by sample.

#include "render_vk/device/vulkan_for_tests.h"
#include "tests/golden_views.h"

namespace quoin {
namespace {

using vulkan_test::VulkanTest;

class VulkanPictures : public VulkanTest {
 protected:
  void SetUp() override {
    VulkanTest::SetUp();
    if (IsSkipped()) return;
    ASSERT_TRUE(renderer_->update(golden::terrain_scene()));
  }

  void add(VulkanPicture& picture, int samples, Accumulation accumulation, int width = 200) {
    options_.width = width;
    options_.samples = samples;
    const Status drawn = renderer_->draw(picture, golden::camera_for(golden::kViews[0]), options_, accumulation);
    ASSERT_TRUE(drawn) << to_string(drawn.error());
  }
  Picture rendered(int samples) {
    options_.samples = samples;
    return taken_as_is(golden::camera_for(golden::kViews[0]), options_);
  }
  static std::vector<std::uint8_t> bytes_of(const VulkanPicture& picture) {
    const auto image = picture.read();
    EXPECT_TRUE(image) << to_string(image.error());
    return image ? image->rgb : std::vector<std::uint8_t>{};
  }

  RenderOptions options_ = [] {
    RenderOptions options;
    options.height = 130;
    return options;
  }();
};

TEST_F(VulkanPictures, SamplesAddUpToTheRenderedPicture) {
  VulkanPicture picture(*renderer_);
  add(picture, 1, Accumulation::Restart);
  EXPECT_EQ(bytes_of(picture), rendered(1).colour.rgb);
  add(picture, 1, Accumulation::Continue);
  add(picture, 3, Accumulation::Continue);
  EXPECT_EQ(picture.samples(), 5);
  const Picture whole = rendered(5);
  EXPECT_EQ(bytes_of(picture), whole.colour.rgb);
  EXPECT_EQ(picture.rays(), whole.rays);
}

TEST_F(VulkanPictures, RestartOnRequestAndOnResize) {
  VulkanPicture picture(*renderer_);
  add(picture, 2, Accumulation::Restart);
  add(picture, 1, Accumulation::Restart);
  EXPECT_EQ(picture.samples(), 1);
  EXPECT_EQ(bytes_of(picture), rendered(1).colour.rgb);
  add(picture, 1, Accumulation::Continue, 64);
  EXPECT_EQ(picture.samples(), 1);
  EXPECT_EQ(picture.width(), 64);
  EXPECT_EQ(bytes_of(picture), rendered(1).colour.rgb);
}

TEST_F(VulkanPictures, AddNothingToWhatIsNoSumOfSamples) {
  options_.width = 200;
  const std::vector<std::uint8_t> alone = rendered(1).colour.rgb;
  VulkanPicture picture(*renderer_);
  Image grey{200, 130, std::vector<std::uint8_t>(std::size_t{3} * 200 * 130, 128)};
  for (const bool was_drawn : {false, true}) {
    if (was_drawn) add(picture, 2, Accumulation::Restart);
    ASSERT_TRUE(picture.write(grey));
    add(picture, 1, Accumulation::Continue);
    EXPECT_EQ(picture.samples(), 1);
    EXPECT_EQ(bytes_of(picture), alone);
  }
}

TEST_F(VulkanPictures, RejectInvalidInput) {
  VulkanPicture picture(*renderer_);
  EXPECT_EQ(picture.read().error().code, ErrorCode::InvalidArgument);
  add(picture, 1, Accumulation::Restart);
  const Camera camera = golden::camera_for(golden::kViews[0]);
  options_.samples = 4096;
  EXPECT_EQ(renderer_->draw(picture, camera, options_, Accumulation::Continue).error().code, ErrorCode::LimitExceeded);
  options_.samples = 0;
  EXPECT_EQ(renderer_->draw(picture, camera, options_, Accumulation::Continue).error().code,
            ErrorCode::InvalidArgument);
  EXPECT_EQ(picture.samples(), 1) << "a refusal changes nothing";
  options_.samples = 1;
  const Status stopped =
      renderer_->draw(picture, camera, options_, Accumulation::Continue, {}, [](double) { return false; });
  ASSERT_FALSE(stopped);
  EXPECT_EQ(stopped.error().code, ErrorCode::Cancelled);
  EXPECT_EQ(picture.samples(), 0);
}

}  // namespace
}  // namespace quoin
