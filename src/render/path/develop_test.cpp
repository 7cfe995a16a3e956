#include <cmath>
#include <limits>
#include <numeric>

#include <gtest/gtest.h>

#include <quoin/render/path_tracer.h>

#include "core/srgb.h"

namespace quoin {
namespace {

PathImage rendered_of(int width, int height, Vec3 light) {
  PathImage image;
  image.width = width;
  image.height = height;
  image.radiance.assign(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), light);
  image.scene = image.radiance;
  image.alpha.assign(image.radiance.size(), 1.0F);
  return image;
}

TEST(PathDevelop, MapsBrightnessMonotonicallyToFullRange) {
  PathImage rendered;
  rendered.width = 64;
  rendered.height = 1;
  for (int i = 0; i < 64; ++i) rendered.radiance.emplace_back(std::pow(1.3F, static_cast<float>(i - 40)));
  rendered.scene = rendered.radiance;
  rendered.alpha.assign(64, 1.0F);
  for (const ToneCurve tone : {ToneCurve::Clamp, ToneCurve::Neutral, ToneCurve::Agx, ToneCurve::Aces}) {
    const auto image = develop(rendered, {1.0, tone});
    ASSERT_TRUE(image.has_value());
    for (std::size_t i = 3; i < image->rgb.size(); ++i) EXPECT_GE(int{image->rgb[i]} + 1, image->rgb[i - 3]);
    EXPECT_LE(image->rgb.front(), 10);
    EXPECT_GE(image->rgb.back(), 250);
  }
  EXPECT_FALSE(develop(rendered, {std::numeric_limits<double>::quiet_NaN()}).has_value());
  EXPECT_FALSE(develop(rendered, {-1.0}).has_value());
}

// The published values for grey of 0.18 and for white.
TEST(PathDevelop, CurvesMatchPublishedValues) {
  PathImage image;
  image.width = 2;
  image.height = 1;
  image.radiance = {Vec3(0.18F), Vec3(1.0F)};
  image.scene = image.radiance;
  image.alpha = {1.0F, 1.0F};
  const auto neutral = develop(image, {1.0, ToneCurve::Neutral});
  const SrgbEncoder& encode = SrgbEncoder::shared();
  EXPECT_EQ(neutral->rgb[0], encode(0.14F));  // minus the 0.04 of Fresnel
  EXPECT_NEAR(neutral->rgb[3], encode(0.88F), 2);
  const auto clamp = develop(image, {1.0, ToneCurve::Clamp});
  EXPECT_EQ(clamp->rgb[0], encode(0.18F));
  EXPECT_EQ(clamp->rgb[3], 255);
}

TEST(PathDevelop, FindsExposureOfDarkImage) {
  PathImage image;
  image.width = 10;
  image.height = 10;
  image.radiance.assign(100, Vec3(0.002F));
  image.scene = image.radiance;
  image.alpha.assign(100, 1.0F);
  EXPECT_NEAR(find_exposure(image), 90.0, 0.1);
  image.radiance.assign(100, Vec3(0.0F));
  image.scene = image.radiance;
  EXPECT_EQ(find_exposure(image), 1.0);
}

// For dark, bright, colourful and grey images every curve gives the same mean as the neutral curve.
TEST(PathDevelop, AutomaticExposureGivesSameMeanForEveryCurve) {
  PathImage rendered = rendered_of(64, 64, Vec3(0.0F));
  for (std::size_t i = 0; i < rendered.radiance.size(); ++i) {
    const float light = std::pow(1.4F, static_cast<float>(i % 23) - 18.0F);
    rendered.radiance[i] = light * Vec3(1.0F, 0.4F + 0.1F * static_cast<float>(i % 5), 0.3F);
  }
  rendered.scene = rendered.radiance;
  const auto mean_of = [&](ToneCurve tone) {
    const auto image = develop(rendered, {find_exposure(rendered, tone), tone});
    EXPECT_TRUE(image.has_value());
    return image ? std::accumulate(image->rgb.begin(), image->rgb.end(), 0.0) / static_cast<double>(image->rgb.size())
                 : 0.0;
  };
  const double neutral = mean_of(ToneCurve::Neutral);
  EXPECT_GT(neutral, 60.0);
  for (const ToneCurve tone : {ToneCurve::Clamp, ToneCurve::Agx, ToneCurve::Aces}) {
    EXPECT_NEAR(mean_of(tone) / neutral, 1.0, 0.01) << static_cast<int>(tone);
  }
  EXPECT_EQ(find_exposure(rendered_of(2, 2, Vec3(0.0F)), ToneCurve::Aces), 1.0);
}

// A bright pixel in the centre of a dark image lights its surroundings and leaves the rest.
TEST(PathDevelop, BloomSpreadsBrightPixels) {
  PathImage rendered = rendered_of(65, 65, Vec3(0.1F));
  const std::size_t middle = 32 * 65 + 32;
  rendered.radiance[middle] = Vec3(40.0F);
  DevelopOptions options{1.0, ToneCurve::Clamp};
  options.bloom = {0.5, 0.05, 0.0, 1.0};
  const auto image = develop(rendered, options);
  ASSERT_TRUE(image.has_value());
  const int dark = SrgbEncoder::shared()(0.1F);
  const auto at = [&](int x, int y) { return int{image->rgb[3 * static_cast<std::size_t>(y * 65 + x)]}; };
  EXPECT_EQ(at(32, 32), 255);
  EXPECT_GT(at(33, 32), dark + 30);
  EXPECT_GT(at(33, 32), at(36, 32));
  EXPECT_EQ(at(33, 32), at(32, 31));  // round
  EXPECT_EQ(at(0, 0), dark);          // no change below the threshold
  options.bloom.aspect = 1.0;
  const auto wide = develop(rendered, options);
  ASSERT_TRUE(wide.has_value());
  EXPECT_GT(wide->rgb[3 * (32 * 65 + 40)], wide->rgb[3 * (40 * 65 + 32)]);
}

TEST(PathDevelop, BloomKeepsUniformImage) {
  const PathImage image = rendered_of(33, 20, Vec3(0.3F, 0.2F, 0.1F));
  DevelopOptions options{1.5, ToneCurve::Clamp};
  const auto plain = develop(image, options);
  options.bloom = {1.0, 0.2, 0.3, 0.0};
  const auto bloomed = develop(image, options);
  ASSERT_TRUE(plain.has_value() && bloomed.has_value());
  for (std::size_t i = 0; i < plain->rgb.size(); ++i) EXPECT_NEAR(int{plain->rgb[i]}, int{bloomed->rgb[i]}, 1);
}

TEST(PathDevelop, VignetteDarkensCorners) {
  const PathImage rendered = rendered_of(64, 64, Vec3(0.5F));
  DevelopOptions options{1.0, ToneCurve::Clamp, 1.0};
  const auto image = develop(rendered, options);
  ASSERT_TRUE(image.has_value());
  EXPECT_NEAR(image->rgb[3 * (32 * 64 + 32)], SrgbEncoder::shared()(0.5F), 1);
  EXPECT_LT(image->rgb[0], 40);
}

TEST(PathDevelop, SmallerGammaDarkens) {
  const PathImage rendered = rendered_of(1, 1, Vec3(0.25F));
  DevelopOptions options{1.0, ToneCurve::Clamp, 0.0, 1.1};
  const auto image = develop(rendered, options);
  ASSERT_TRUE(image.has_value());
  EXPECT_NEAR(image->rgb[0], SrgbEncoder::shared()(0.0625F), 1);
}

TEST(PathDevelop, RejectsInvalidOptions) {
  const PathImage image = rendered_of(1, 1, Vec3(0.25F));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto refuses = [&](auto&& change) {
    DevelopOptions options;
    change(options);
    return !develop(image, options) && !develop_with_alpha(image, options);
  };
  EXPECT_TRUE(refuses([&](DevelopOptions& o) { o.vignette = nan; }));
  EXPECT_TRUE(refuses([&](DevelopOptions& o) { o.vignette = 1.5; }));
  EXPECT_TRUE(refuses([&](DevelopOptions& o) { o.gamma = 0.0; }));
  EXPECT_TRUE(refuses([&](DevelopOptions& o) { o.bloom.mix = -0.1; }));
  EXPECT_TRUE(refuses([&](DevelopOptions& o) { o.bloom.radius = 2.0; }));
  EXPECT_TRUE(refuses([&](DevelopOptions& o) { o.bloom.aspect = nan; }));
  EXPECT_TRUE(refuses([&](DevelopOptions& o) { o.bloom.threshold = -1.0; }));
}

}  // namespace
}  // namespace quoin
