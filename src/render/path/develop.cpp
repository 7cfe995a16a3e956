#include <algorithm>
#include <cmath>
#include <limits>
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
  // What is infinite or no number becomes what can be shown.
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

Status check_exposure(double exposure) {
  if (std::isfinite(exposure) && exposure >= 0.0) return {};
  return make_error(ErrorCode::InvalidArgument, "exposure: must be finite and at least 0");
}

}  // namespace

double find_exposure(const PathPicture& picture) {
  constexpr double kMiddle = 0.18;
  constexpr double kBrightest = 4.0;
  constexpr double kBrightShare = 0.99;
  std::vector<float> lights;
  double sum = 0.0;
  for (std::size_t i = 0; i < picture.radiance.size(); ++i) {
    const float light = luminance(picture.alpha[i] > 0.5F ? picture.scene[i] : picture.radiance[i]);
    if (!(light > 1e-9F)) continue;
    lights.push_back(light);
    sum += static_cast<double>(log_of_two(light));
  }
  if (lights.empty()) return 1.0;
  const auto mean = static_cast<float>(sum / static_cast<double>(lights.size()));
  const double by_mean = kMiddle / std::max(static_cast<double>(path::power_of_two(mean)), 1e-12);
  const auto bright =
      lights.begin() + static_cast<std::ptrdiff_t>(static_cast<double>(lights.size() - 1) * kBrightShare);
  std::nth_element(lights.begin(), bright, lights.end());
  return std::min(by_mean, kBrightest / static_cast<double>(*bright));
}

Result<Image> develop(const PathPicture& picture, const DevelopOptions& options) {
  if (Status status = check_exposure(options.exposure); !status) return status.error();
  const SrgbEncoder& encode = SrgbEncoder::shared();
  const auto exposure = static_cast<float>(std::min(options.exposure, 1e30));
  Image image{picture.width, picture.height, {}};
  image.rgb.reserve(3 * picture.radiance.size());
  for (const Vec3& light : picture.radiance) {
    const Vec3 shown = toned(light, exposure, options.tone);
    for (int channel = 0; channel < 3; ++channel) image.rgb.push_back(encode(shown[channel]));
  }
  return image;
}

Result<AlphaImage> develop_with_alpha(const PathPicture& picture, const DevelopOptions& options) {
  if (Status status = check_exposure(options.exposure); !status) return status.error();
  const SrgbEncoder& encode = SrgbEncoder::shared();
  const auto exposure = static_cast<float>(std::min(options.exposure, 1e30));
  AlphaImage image{picture.width, picture.height, {}};
  image.rgba.reserve(4 * picture.scene.size());
  for (std::size_t i = 0; i < picture.scene.size(); ++i) {
    const float alpha = picture.alpha[i];
    const Vec3 shown = alpha > 0.0F ? toned(picture.scene[i] / alpha, exposure, options.tone) : Vec3(0.0F);
    for (int channel = 0; channel < 3; ++channel) image.rgba.push_back(encode(shown[channel]));
    image.rgba.push_back(static_cast<std::uint8_t>(std::lround(std::clamp(alpha, 0.0F, 1.0F) * 255.0F)));
  }
  return image;
}

}  // namespace quoin
