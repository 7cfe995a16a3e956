#pragma once

// Shared by the Vulkan renderer's tests: images of one scene by both renderers, and their differences.

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <quoin/io/image_files.h>
#include <quoin/render/vulkan_renderer.h>

#include "core/work/nightly_for_tests.h"
#include "render/cpu/render_test_support.h"

namespace quoin::vulkan_test {

/// Tests are skipped without a device and fail on every validation layer message. The tests of a suite in one process
/// share a renderer, since its pipelines compile longer than most images render. The next test's `update` replaces the
/// state left by a test.
class VulkanTest : public ::testing::Test {
 protected:
  static void TearDownTestSuite() { shared_.reset(); }

  void SetUp() override {
    messages_->clear();
    is_validated_ = true;
    if (!shared_) {
      VulkanOptions options = test_options();
      auto made = VulkanRenderer::create(options);
      if (!made && made.error().message.find("validation") != std::string::npos) {
        options.on_validation_message = {};
        made = VulkanRenderer::create(options);
      }
      if (!made) GTEST_SKIP() << made.error().message;
      shared_ = std::make_unique<Shared>(Shared{std::move(*made), options.on_validation_message != nullptr});
    }
    is_validated_ = shared_->is_validated;
    renderer_ = &shared_->renderer;
  }
  void TearDown() override {
    for (const std::string& message : *messages_) ADD_FAILURE() << message;
  }

  [[nodiscard]] static VulkanOptions test_options() {
    VulkanOptions options;
    options.on_validation_message = [messages = messages_](const std::string& message) {
      messages->push_back(message);
    };
    if (const char* device = std::getenv("QUOIN_VULKAN_DEVICE")) options.device = device;
    return options;
  }

  RenderedImage taken(const Scene& scene, const Camera& camera, const RenderOptions& options) {
    const Status updated = renderer_->update(scene);
    EXPECT_TRUE(updated) << to_string(updated.error());
    return taken_as_is(camera, options);
  }
  RenderedImage taken_as_is(const Camera& camera, const RenderOptions& options) {
    auto image = renderer_->render(camera, options);
    EXPECT_TRUE(image) << to_string(image.error());
    return image ? std::move(*image) : RenderedImage{};
  }

  VulkanRenderer* renderer_ = nullptr;
  bool is_validated_ = true;
  static inline const auto messages_ = std::make_shared<std::vector<std::string>>();

 private:
  struct Shared {
    VulkanRenderer renderer;
    bool is_validated;
  };
  static inline std::unique_ptr<Shared> shared_;
};

/// Returns noise of 16 x 16 texels; a third of them have the alpha `least_alpha`, the others 200.
inline Texture noise_with_alpha(unsigned seed, std::uint8_t least_alpha) {
  std::mt19937 random(seed);
  AlphaImage image{16, 16, {}};
  for (int i = 0; i < 256; ++i) {
    for (int channel = 0; channel < 3; ++channel) image.rgba.push_back(static_cast<std::uint8_t>(random()));
    image.rgba.push_back(random() % 3 == 0 ? least_alpha : std::uint8_t{200});
  }
  return Texture::from_image("noise", image).value();
}

/// Returns true if the distances around a pixel jump, or if a neighbour shows the background.
inline bool is_at_silhouette(const FloatImage& depth, int x, int y) {
  float least = INFINITY;
  float greatest = 0.0F;
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) {
      const int u = std::clamp(x + dx, 0, depth.width - 1);
      const int v = std::clamp(y + dy, 0, depth.height - 1);
      const float d = depth.values[static_cast<std::size_t>(v) * static_cast<std::size_t>(depth.width) +
                                   static_cast<std::size_t>(u)];
      least = std::min(least, d);
      greatest = std::max(greatest, d);
    }
  }
  return greatest - least > 0.004F * least;
}

/// The differences of two images.
struct Differences {
  int pixels = 0;     ///< by more than 2 in a channel
  int elsewhere = 0;  ///< subset that is not at a silhouette
  int depths = 0;     ///< differences of more than 1e-4 of the distance
  int total = 0;
};

inline Differences differences(const RenderedImage& a, const RenderedImage& b) {
  Differences found;
  EXPECT_EQ(a.colour.rgb.size(), b.colour.rgb.size());
  EXPECT_EQ(a.depth.values.size(), b.depth.values.size());
  if (a.colour.rgb.size() != b.colour.rgb.size() || a.depth.values.size() != b.depth.values.size()) return found;
  found.total = a.colour.width * a.colour.height;
  for (int i = 0; i < found.total; ++i) {
    const auto at = static_cast<std::size_t>(i);
    int most = 0;
    for (std::size_t c = 3 * at; c < 3 * at + 3; ++c)
      most = std::max(most, std::abs(a.colour.rgb[c] - b.colour.rgb[c]));
    if (most > 2) {
      if (std::getenv("QUOIN_WRITE_VULKAN") != nullptr) {
        std::printf("  (%d, %d): %d %d %d, not %d %d %d; depth %.9g, not %.9g\n", i % a.colour.width,
                    i / a.colour.width, a.colour.rgb[3 * at], a.colour.rgb[3 * at + 1], a.colour.rgb[3 * at + 2],
                    b.colour.rgb[3 * at], b.colour.rgb[3 * at + 1], b.colour.rgb[3 * at + 2],
                    static_cast<double>(a.depth.values[at]), static_cast<double>(b.depth.values[at]));
      }
      ++found.pixels;
      found.elsewhere += !is_at_silhouette(b.depth, i % a.colour.width, i / a.colour.width);
    }
    const float d = a.depth.values[at];
    const float e = b.depth.values[at];
    found.depths += d != e && !(std::abs(d - e) <= 1e-4F * std::max(d, e));
  }
  return found;
}

/// Returns the options of an image of half the width and height and the same details, except in nightly runs: drivers
/// for processors take most of the time of the tests.
inline RenderOptions of_day(RenderOptions options) {
  if (is_nightly()) return options;
  options.width = std::max(options.width / 2, 1);
  options.height = std::max(options.height / 2, 1);
  if (options.detail.policy) {
    options.detail.policy->voxel_pixels /= 2.0;
    options.detail.policy->cell_pixels /= 2.0;
    options.detail.policy->far_pixels /= 2;
  }
  return options;
}

/// Checks the differences that VulkanRenderer permits. Writes both images on failure.
inline void expect_equal(const RenderedImage& vulkan, const RenderedImage& cpu, const std::string& name) {
  const Differences found = differences(vulkan, cpu);
  EXPECT_LE(found.pixels * 1000, found.total) << name;
  EXPECT_LE(found.depths * 1000, found.total) << name;
  EXPECT_NEAR(static_cast<double>(vulkan.rays), static_cast<double>(cpu.rays), 0.001 * static_cast<double>(cpu.rays))
      << name;
  EXPECT_NEAR(static_cast<double>(vulkan.pixels_hit), static_cast<double>(cpu.pixels_hit), 0.001 * found.total) << name;
  const bool is_wanted = std::getenv("QUOIN_WRITE_VULKAN") != nullptr;
  if (is_wanted || ::testing::Test::HasFailure()) {
    const std::string base = QUOIN_BINARY_DIR "/vulkan_" + name;
    EXPECT_TRUE(write_png(vulkan.colour, base + ".vulkan.png"));
    EXPECT_TRUE(write_png(cpu.colour, base + ".cpu.png"));
  }
  ::testing::Test::RecordProperty(name, std::to_string(found.pixels) + " pixels, " + std::to_string(found.depths) +
                                            " depths of " + std::to_string(found.total));
  if (is_wanted) {
    std::printf("%s: %d pixels (%d not at silhouettes), %d depths of %d\n", name.c_str(), found.pixels, found.elsewhere,
                found.depths, found.total);
  }
}

}  // namespace quoin::vulkan_test
