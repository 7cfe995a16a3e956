#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include <glm/common.hpp>
#include <glm/mat3x3.hpp>

#include <quoin/render/path_tracer.h>

#include "core/srgb.h"
#include "render/path/path_math.h"

namespace quoin {
namespace {

using path::largest;
using path::log_of_two;
using path::luminance;
using path::power;

// Source: Khronos, "PBR Neutral tone mapper" (specification, 2024).
Vec3 neutral(Vec3 colour) {
  constexpr float kStart = 0.8F - 0.04F;
  constexpr float kDesaturation = 0.15F;
  const float least = std::min({colour.x, colour.y, colour.z});
  colour -= Vec3(least < 0.08F ? least - 6.25F * least * least : 0.04F);
  const float peak = largest(colour);
  if (peak < kStart) return colour;
  constexpr float kRest = 1.0F - kStart;
  const float rolled = 1.0F - kRest * kRest / (peak + kRest - kStart);
  colour *= rolled / peak;
  const float pale = 1.0F - 1.0F / (kDesaturation * (peak - rolled) + 1.0F);
  return colour * (1.0F - pale) + Vec3(rolled) * pale;
}

// Source: S. Hill's fit of the ACES reference and output transforms for sRGB (2016).
Vec3 aces(Vec3 colour) {
  constexpr float kInput[3][3] = {
      {0.59719F, 0.35458F, 0.04823F}, {0.07600F, 0.90834F, 0.01566F}, {0.02840F, 0.13383F, 0.83777F}};
  constexpr float kOutput[3][3] = {
      {1.60475F, -0.53108F, -0.07367F}, {-0.10208F, 1.10813F, -0.00605F}, {-0.00327F, -0.07276F, 1.07602F}};
  const auto times = [](const float(&rows)[3][3], Vec3 v) {
    Vec3 out;
    for (int i = 0; i < 3; ++i) out[i] = rows[i][0] * v.x + rows[i][1] * v.y + rows[i][2] * v.z;
    return out;
  };
  const Vec3 v = times(kInput, colour);
  Vec3 fitted;
  for (int i = 0; i < 3; ++i) {
    fitted[i] = (v[i] * (v[i] + 0.0245786F) - 0.000090537F) / (v[i] * (0.983729F * v[i] + 0.4329510F) + 0.238081F);
  }
  return times(kOutput, fitted);
}

// Source: T. Sobotka's AgX, its base look, by the polynomial of B. Wrensch, "Minimal AgX implementation" (2023).
Vec3 agx(Vec3 colour) {
  constexpr float kInset[3][3] = {{0.842479062F, 0.0784335999F, 0.0792237451F},
                                  {0.0423282422F, 0.878468636F, 0.0791661274F},
                                  {0.0423756549F, 0.0784336F, 0.879142973F}};
  constexpr float kOutset[3][3] = {{1.19687900F, -0.0980208811F, -0.0990297440F},
                                   {-0.0528968517F, 1.15190312F, -0.0989611768F},
                                   {-0.0529716355F, -0.0980434500F, 1.15107367F}};
  constexpr float kLeast = -12.47393F;
  constexpr float kMost = 4.026069F;
  Vec3 inset;
  for (int i = 0; i < 3; ++i) {
    const float light = kInset[i][0] * colour.x + kInset[i][1] * colour.y + kInset[i][2] * colour.z;
    const float x = (std::clamp(log_of_two(light), kLeast, kMost) - kLeast) / (kMost - kLeast);
    const float xx = x * x;
    const float x4 = xx * xx;
    inset[i] =
        15.5F * x4 * xx - 40.14F * x4 * x + 31.96F * x4 - 6.868F * xx * x + 0.4298F * xx + 0.1191F * x - 0.00232F;
  }
  Vec3 out;
  for (int i = 0; i < 3; ++i) {
    const float light = kOutset[i][0] * inset.x + kOutset[i][1] * inset.y + kOutset[i][2] * inset.z;
    out[i] = power(std::clamp(light, 0.0F, 1.0F), 2.2F);
  }
  return out;
}

Vec3 toned(Vec3 light, float exposure, ToneCurve tone) {
  // Replaces infinite values and NaN by values that can be shown.
  constexpr float kMost = 1e6F;
  const Vec3 exposed = glm::min(glm::max(Vec3(0.0F), light * exposure), Vec3(kMost));
  switch (tone) {
    case ToneCurve::Neutral:
      return neutral(exposed);
    case ToneCurve::Agx:
      return agx(exposed);
    case ToneCurve::Aces:
      return aces(exposed);
    case ToneCurve::Clamp:
      break;
  }
  return exposed;
}

// Computes means of `2 radius + 1` pixels along lines of `count` values with a stride of `step`. Values outside equal
// the edge's.
void blur_line(std::vector<Vec3>& values, std::size_t first, std::size_t step, int count, int radius,
               std::vector<Vec3>& line) {
  const auto at = [&](int i) -> Vec3& {
    return values[first + step * static_cast<std::size_t>(std::clamp(i, 0, count - 1))];
  };
  line.clear();
  DVec3 sum(0.0);
  for (int i = -radius; i <= radius; ++i) sum += DVec3(at(i));
  for (int i = 0; i < count; ++i) {
    line.push_back(Vec3(sum / (2.0 * radius + 1.0)));
    sum += DVec3(at(i + radius + 1)) - DVec3(at(i - radius));
  }
  for (int i = 0; i < count; ++i) at(i) = line[static_cast<std::size_t>(i)];
}

// Blurs by three box filters, which approximate a Gaussian. `radius`: its standard deviation, in pixels.
void blur(std::vector<Vec3>& values, int width, int height, double radius_x, double radius_y) {
  std::vector<Vec3> line;
  const auto box_of = [](double radius, int most) {
    return std::min(static_cast<int>(std::lround(std::sqrt(radius * radius + 0.25) - 0.5)), most);
  };
  const auto w = static_cast<std::size_t>(width);
  for (int pass = 0; pass < 3; ++pass) {
    for (std::size_t y = 0; y < static_cast<std::size_t>(height); ++y) {
      blur_line(values, y * w, 1, width, box_of(radius_x, width), line);
    }
    for (std::size_t x = 0; x < w; ++x) blur_line(values, x, w, height, box_of(radius_y, height), line);
  }
}

// Returns the light before the tone curve: exposed, with bloom from bright pixels. `most` limits the bloom, so that one
// pixel of a lamp does not fill the image.
std::vector<Vec3> bloomed(const std::vector<Vec3>& light, int width, int height, float exposure, const Bloom& bloom) {
  constexpr float kMost = 64.0F;
  constexpr float kWide = 4.0F;  // ratio of the widest to the narrowest blur
  constexpr std::array kSpreads = {0.25, 1.0};
  constexpr int kSpreadCount = static_cast<int>(kSpreads.size());
  const auto threshold = static_cast<float>(bloom.threshold);
  std::vector<Vec3> spread(light.size());
  for (std::size_t i = 0; i < light.size(); ++i) {
    const Vec3 exposed = glm::min(glm::max(Vec3(0.0F), light[i] * exposure), Vec3(kMost));
    const float brightest = largest(exposed);
    const float kept = threshold > 0.0F ? std::max(brightest - threshold, 0.0F) / std::max(brightest, 1e-9F) : 1.0F;
    spread[i] = exposed * kept;
  }
  const double radius = bloom.radius * height;
  const auto stretch = static_cast<double>(power(kWide, static_cast<float>(bloom.aspect)));
  std::vector<Vec3> out(light.size());
  const auto mix = static_cast<float>(bloom.mix);
  for (std::size_t i = 0; i < light.size(); ++i) out[i] = light[i] * exposure - spread[i] * mix;
  for (const double part : kSpreads) {  // near glare and far haze
    std::vector<Vec3> blurred = spread;
    blur(blurred, width, height, radius * part * stretch, radius * part / stretch);
    for (std::size_t i = 0; i < out.size(); ++i) out[i] += blurred[i] * (mix / kSpreadCount);
  }
  return out;
}

// Converts linear light to bytes.
class Developer {
 public:
  Developer(const DevelopOptions& options, int width, int height)
      : options_(&options),
        exposure_(static_cast<float>(std::min(options.exposure, 1e30))),
        bends_(options.gamma != kUsualGamma),
        bend_(static_cast<float>(kUsualGamma / options.gamma)),
        middle_x_(static_cast<float>(width) * 0.5F),
        middle_y_(static_cast<float>(height) * 0.5F) {}

  // Returns the light to display. If `exposure` is 1, the exposure is already applied.
  [[nodiscard]] std::vector<Vec3> spread(const std::vector<Vec3>& light, int width, int height) {
    std::vector<Vec3> out = bloomed(light, width, height, exposure_, options_->bloom);
    exposure_ = 1.0F;
    return out;
  }
  [[nodiscard]] bool has_bloom() const { return options_->bloom.mix > 0.0 && options_->bloom.radius > 0.0; }

  void put(Vec3 light, std::size_t x, std::size_t y, std::vector<std::uint8_t>& bytes) const {
    if (options_->vignette > 0.0) light *= 1.0F - static_cast<float>(options_->vignette) * corner(x, y);
    Vec3 shown = toned(light, exposure_, options_->tone);
    if (bends_) shown = {power(shown.x, bend_), power(shown.y, bend_), power(shown.z, bend_)};
    for (int channel = 0; channel < 3; ++channel) bytes.push_back(encode_(shown[channel]));
  }

 private:
  static constexpr double kUsualGamma = 2.2;

  // Returns 0 in the middle and 1 in the corners, by the square of the distance.
  [[nodiscard]] float corner(std::size_t x, std::size_t y) const {
    const float across = (static_cast<float>(x) + 0.5F - middle_x_) / middle_x_;
    const float down = (static_cast<float>(y) + 0.5F - middle_y_) / middle_y_;
    return 0.5F * (across * across + down * down);
  }

  const DevelopOptions* options_;
  float exposure_;
  bool bends_;
  float bend_;
  float middle_x_;
  float middle_y_;
  const SrgbEncoder& encode_ = SrgbEncoder::shared();
};

// Returns the exposure of the neutral curve; nullopt for a black image.
std::optional<double> neutral_exposure(const PathImage& image) {
  constexpr double kMiddle = 0.18;
  constexpr double kBrightest = 4.0;
  constexpr double kBrightShare = 0.99;
  std::vector<float> lights;
  double sum = 0.0;
  for (std::size_t i = 0; i < image.radiance.size(); ++i) {
    const float light = luminance(image.alpha[i] > 0.5F ? image.scene[i] : image.radiance[i]);
    if (!(light > 1e-9F)) continue;
    lights.push_back(light);
    sum += static_cast<double>(log_of_two(light));
  }
  if (lights.empty()) return std::nullopt;
  const auto mean = static_cast<float>(sum / static_cast<double>(lights.size()));
  const double by_mean = kMiddle / std::max(static_cast<double>(path::power_of_two(mean)), 1e-12);
  const auto bright =
      lights.begin() + static_cast<std::ptrdiff_t>(static_cast<double>(lights.size() - 1) * kBrightShare);
  std::nth_element(lights.begin(), bright, lights.end());
  return std::min(by_mean, kBrightest / static_cast<double>(*bright));
}

// Returns the mean of the developed bytes, estimated from some thousand pixels.
double mean_byte(const std::vector<Vec3>& light, double exposure, ToneCurve tone) {
  constexpr std::size_t kPixels = 1U << 14U;
  const std::size_t step = light.size() / kPixels + 1;
  const SrgbEncoder& encode = SrgbEncoder::shared();
  std::int64_t sum = 0;
  std::int64_t count = 0;
  for (std::size_t i = 0; i < light.size(); i += step) {
    const Vec3 shown = toned(light[i], static_cast<float>(exposure), tone);
    for (int channel = 0; channel < 3; ++channel) sum += encode(shown[channel]);
    count += 3;
  }
  return static_cast<double>(sum) / static_cast<double>(std::max<std::int64_t>(count, 1));
}

}  // namespace

double find_exposure(const PathImage& image, ToneCurve tone) {
  constexpr double kWidest = 256.0;  // maximum ratio between the exposures of two curves
  constexpr int kHalvings = 24;
  const std::optional<double> neutral = neutral_exposure(image);
  if (!neutral || tone == ToneCurve::Neutral) return neutral.value_or(1.0);
  const double wanted = mean_byte(image.radiance, *neutral, ToneCurve::Neutral);
  double low = *neutral / kWidest;
  double high = *neutral * kWidest;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = std::sqrt(low * high);
    (mean_byte(image.radiance, middle, tone) < wanted ? low : high) = middle;
  }
  return std::sqrt(low * high);
}

Result<Image> develop(const PathImage& rendered, const DevelopOptions& options) {
  if (Status status = check(options); !status) return status.error();
  Developer developer(options, rendered.width, rendered.height);
  std::vector<Vec3> spread;
  if (developer.has_bloom()) spread = developer.spread(rendered.radiance, rendered.width, rendered.height);
  const std::vector<Vec3>& light = spread.empty() ? rendered.radiance : spread;
  Image image{rendered.width, rendered.height, {}};
  image.rgb.reserve(3 * light.size());
  const auto width = static_cast<std::size_t>(rendered.width);
  for (std::size_t i = 0; i < light.size(); ++i) developer.put(light[i], i % width, i / width, image.rgb);
  return image;
}

Result<AlphaImage> develop_with_alpha(const PathImage& rendered, const DevelopOptions& options) {
  if (Status status = check(options); !status) return status.error();
  Developer developer(options, rendered.width, rendered.height);
  std::vector<Vec3> spread;
  if (developer.has_bloom()) spread = developer.spread(rendered.scene, rendered.width, rendered.height);
  const std::vector<Vec3>& light = spread.empty() ? rendered.scene : spread;
  AlphaImage image{rendered.width, rendered.height, {}};
  image.rgba.reserve(4 * light.size());
  const auto width = static_cast<std::size_t>(rendered.width);
  for (std::size_t i = 0; i < light.size(); ++i) {
    const float alpha = rendered.alpha[i];
    developer.put(alpha > 0.0F ? light[i] / alpha : Vec3(0.0F), i % width, i / width, image.rgba);
    image.rgba.push_back(static_cast<std::uint8_t>(std::lround(std::clamp(alpha, 0.0F, 1.0F) * 255.0F)));
  }
  return image;
}

}  // namespace quoin
