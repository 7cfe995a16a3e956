#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>

#include <gtest/gtest.h>

#include <quoin/render/light_options.h>
#include <quoin/render/path_tracer.h>

#include "render/path/town_for_tests.h"

namespace quoin {
namespace {

using namespace render_test;

constexpr int kSize = 24;

Scene white_block() {
  Scene scene;
  Grid grid;
  grid.fill_box({{0, 0, 0}, {8, 8, 8}}, add_type(scene, {255, 255, 255, 255}));
  place(scene, std::move(grid));
  return scene;
}

// `from`: the camera's direction from the block's centre.
Image natural_image(DVec3 from, SkyModel sky, bool has_ground, DVec3 sun = Sun{}.direction) {
  const Scene scene = white_block();
  PathOptions options;
  Environment& environment = options.environment.emplace(Environment::natural(sun));
  environment.sky.model = sky;
  options.width = options.height = kSize;
  options.samples = 32;
  if (has_ground) environment.ground.emplace().colour = Vec3(sky == SkyModel::Uniform ? 1.0F : 0.5F);
  const DVec3 middle(4.0);
  const PathImage rendered = path_image(scene, towards(middle + from * 24.0, middle, 0.9), options);
  auto image = develop(rendered, develop_options(environment));
  EXPECT_TRUE(image.has_value());
  return image ? std::move(*image) : Image{};
}

// Returns each channel's mean over a square of pixels.
std::array<double, 3> channel_means(const Image& image, int x, int y, int size) {
  std::array<double, 3> means{};
  for (std::size_t channel = 0; channel < 3; ++channel) {
    for (int i = 0; i < size * size; ++i) {
      const auto pixel = static_cast<std::size_t>((y + i / size) * image.width + x + i % size);
      means.at(channel) += static_cast<double>(image.rgb[3 * pixel + channel]) / (size * size);
    }
  }
  return means;
}

double darkest_channel(const Image& image, int x, int y, int size) {
  return std::ranges::min(channel_means(image, x, y, size));
}

double middle_of_image(const Image& image) {
  return darkest_channel(image, kSize / 2 - 2, kSize / 2 - 2, 4);
}

TEST(NaturalEnvironment, IsoViewHasBrightBackground) {
  const Image image = natural_image(glm::normalize(DVec3(1.0, 1.0, 1.0)), SkyModel::Gradient, false);
  for (const int y : {0, kSize - 3}) {
    EXPECT_GE(darkest_channel(image, 0, y, 3), 150.0);
    EXPECT_GE(darkest_channel(image, kSize - 3, y, 3), 150.0);
  }
}

TEST(NaturalEnvironment, WhiteInFullShadowIsNotDark) {
  // The sun is at -x and +z: the block's sides towards +x and -z are in shadow.
  for (const SkyModel sky : {SkyModel::Gradient, SkyModel::Physical}) {
    for (const DVec3& side : {DVec3(1.0, 0.05, 0.0), DVec3(0.0, 0.05, -1.0)}) {
      const double shadow = middle_of_image(natural_image(glm::normalize(side), sky, false));
      EXPECT_GE(shadow, 60.0) << static_cast<int>(sky);
      const double lit = middle_of_image(natural_image(glm::normalize(DVec3(-side.x, 0.05, -side.z)), sky, false));
      EXPECT_GT(lit, shadow + 10.0) << static_cast<int>(sky) << ": shadows still show";
    }
  }
}

// As in marched images: dark, but not black.
TEST(NaturalEnvironment, WhiteIsVisibleAfterSunset) {
  for (const double degrees : {-5.0, -20.0, -60.0}) {
    const double radians = degrees * std::numbers::pi / 180.0;
    const DVec3 sun{0.6 * std::cos(radians), std::sin(radians), 0.8 * std::cos(radians)};
    for (const DVec3& side : {DVec3(1.0, 0.05, 0.0), DVec3(0.0, 0.05, -1.0), DVec3(0.1, 1.0, 0.1)}) {
      const Image image = natural_image(glm::normalize(side), SkyModel::Gradient, false, sun);
      const double white = std::ranges::max(channel_means(image, kSize / 2 - 2, kSize / 2 - 2, 4));
      const double sky = std::ranges::max(channel_means(image, 0, 0, 3));
      EXPECT_GE(white, 60.0) << degrees << ", " << side.x;
      EXPECT_LE(white, 170.0) << degrees << ", " << side.x;
      EXPECT_GE(sky, 45.0) << degrees << ", " << side.x;
    }
  }
}

TEST(NaturalEnvironment, WhiteStaysWhiteUnderUniformSky) {
  for (const bool has_ground : {false, true}) {
    for (const DVec3& side : {DVec3(1.0, 0.05, 0.0), DVec3(-1.0, 0.05, 0.0), DVec3(0.1, 1.0, 0.1)}) {
      const Image image = natural_image(glm::normalize(side), SkyModel::Uniform, has_ground);
      EXPECT_GE(middle_of_image(image), 250.0) << has_ground << side.x;
      EXPECT_GE(darkest_channel(image, 0, 0, 3), 250.0) << has_ground << side.x;
    }
  }
}

}  // namespace
}  // namespace quoin
