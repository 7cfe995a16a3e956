#include "render/path/scatter.h"

#include <array>
#include <cstddef>
#include <limits>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <quoin/core/assert.h>

#include "render/path/path_math.h"

namespace quoin::path {
namespace {

constexpr float kDielectric = 0.04F;   // reflectance of a dielectric at normal incidence: glTF's index 1.5
constexpr float kMirrorAlpha = 1e-4F;  // smaller values are mirrors

float schlick(float cosine) {
  const float x = std::clamp(1.0F - cosine, 0.0F, 1.0F);
  return x * x * (x * x) * x;
}

Vec3 fresnel(Vec3 at_normal, float cosine) {
  return at_normal + (Vec3(1.0F) - at_normal) * schlick(cosine);
}

float lambda_term(Vec3 v, float alpha2) {
  return std::sqrt(alpha2 + (1.0F - alpha2) * v.z * v.z);
}

// GGX times Smith's masking and shadowing, divided by 4 out.z: the value with the cosine but without Fresnel's share.
float microfacets(Vec3 out, Vec3 in, Vec3 half, float alpha) {
  const float alpha2 = alpha * alpha;
  const float d = 1.0F + (alpha2 - 1.0F) * half.z * half.z;
  const float ggx = alpha2 / (kPi * d * d);
  const float shadowing = 2.0F * in.z * out.z / (in.z * lambda_term(out, alpha2) + out.z * lambda_term(in, alpha2));
  return ggx * shadowing / (4.0F * out.z);
}

// Returns the probability density of `in` in visible_normal, per solid angle.
float microfacet_density(Vec3 out, Vec3 half, float alpha) {
  const float alpha2 = alpha * alpha;
  const float d = 1.0F + (alpha2 - 1.0F) * half.z * half.z;
  const float ggx = alpha2 / (kPi * d * d);
  return ggx / (2.0F * (out.z + lambda_term(out, alpha2)));
}

Vec3 visible_normal(Vec3 out, float alpha, Pair u) {
  const Vec3 stretched = glm::normalize(Vec3(alpha * out.x, alpha * out.y, out.z));
  const float z = (1.0F - u.y) * (1.0F + stretched.z) - stretched.z;
  const float radius = std::sqrt(std::clamp(1.0F - z * z, 0.0F, 1.0F));
  const SineCosine turn = of_turns(u.x);
  const Vec3 half = Vec3(radius * turn.cosine, radius * turn.sine, z) + stretched;
  return glm::normalize(Vec3(alpha * half.x, alpha * half.y, std::max(half.z, 1e-9F)));
}

// The total reflectance of gloss for F0 = 1 and F0 = 0: the share is white * F0 + black * (1 - F0).
class GlossTable {
 public:
  static const GlossTable& shared() {
    static const GlossTable table;
    return table;
  }
  struct Entry {
    float scale = 1.0F;  // times F0
    float bias = 0.0F;
  };
  static_assert(sizeof(Entry) == 2 * sizeof(float));
  [[nodiscard]] std::span<const float> numbers() const { return {&entries_[0].scale, 2 * entries_.size()}; }
  [[nodiscard]] Entry at(float cosine, float roughness) const {
    const float x = std::clamp(cosine, 0.0F, 1.0F) * (kEdge - 1);
    const float y = std::clamp(roughness, 0.0F, 1.0F) * (kEdge - 1);
    const int i = std::min(static_cast<int>(x), kEdge - 2);
    const int j = std::min(static_cast<int>(y), kEdge - 2);
    const float fx = x - static_cast<float>(i);
    const float fy = y - static_cast<float>(j);
    const auto mix = [&](float Entry::*of) {
      const float low = get(i, j).*of * (1.0F - fx) + get(i + 1, j).*of * fx;
      const float high = get(i, j + 1).*of * (1.0F - fx) + get(i + 1, j + 1).*of * fx;
      return low * (1.0F - fy) + high * fy;
    };
    return {mix(&Entry::scale), mix(&Entry::bias)};
  }

 private:
  static constexpr int kEdge = kGlossEdge;
  GlossTable() {
    for (int j = 0; j < kEdge; ++j) {
      for (int i = 0; i < kEdge; ++i) entries_[static_cast<std::size_t>(j * kEdge + i)] = integrate(i, j);
    }
  }
  [[nodiscard]] const Entry& get(int i, int j) const {
    QUOIN_ASSERT(i >= 0 && i < kEdge && j >= 0 && j < kEdge, "an entry of the table");
    return entries_[static_cast<std::size_t>(j * kEdge + i)];
  }

  static Entry integrate(int i, int j) {
    const float cosine = std::max(static_cast<float>(i) / (kEdge - 1), 1e-3F);
    const float roughness = static_cast<float>(j) / (kEdge - 1);
    const float alpha = std::max(roughness * roughness, kMirrorAlpha);
    const Vec3 out{std::sqrt(1.0F - cosine * cosine), 0.0F, cosine};
    constexpr std::uint32_t kSamples = 256;
    float scale = 0.0F;
    float bias = 0.0F;
    for (std::uint32_t k = 0; k < kSamples; ++k) {
      const Vec3 half = visible_normal(out, alpha, {unit_of(reversed(k)), unit_of(reversed(pascal(k)))});
      const Vec3 in = half * (2.0F * glm::dot(out, half)) - out;
      if (!(in.z > 0.0F)) continue;
      const float part = microfacets(out, in, half, alpha) / microfacet_density(out, half, alpha);
      const float grazing = schlick(glm::dot(out, half));
      scale += part * (1.0F - grazing);
      bias += part * grazing;
    }
    return {scale / kSamples, bias / kSamples};
  }

  std::array<Entry, std::size_t{kEdge} * kEdge> entries_{};
};

}  // namespace

std::span<const float> gloss_table() {
  return GlossTable::shared().numbers();
}

Scatter::Scatter(const Material& material, Vec3 out) : out_(out), colour_(material.colour) {
  QUOIN_ASSERT(out.z > 0.0F, "a viewer above the surface");
  const float metal = std::clamp(material.metalness, 0.0F, 1.0F);
  const float rough = std::clamp(material.roughness, 0.0F, 1.0F);
  matte_ = colour_ * (1.0F - metal);
  if (metal <= 0.0F && rough >= 1.0F) return;
  alpha_ = rough * rough;
  is_mirror_ = alpha_ < kMirrorAlpha;
  const GlossTable::Entry gloss = GlossTable::shared().at(out.z, rough);
  const float whole = std::max(gloss.scale + gloss.bias, 1e-3F);
  const auto gain_of = [&](Vec3 at_normal) {
    return is_mirror_ ? Vec3(1.0F) : Vec3(1.0F) + at_normal * (1.0F / whole - 1.0F);
  };
  const auto reflected_of = [&](Vec3 at_normal, Vec3 gain) {
    return is_mirror_ ? fresnel(at_normal, out.z) : (at_normal * gloss.scale + gloss.bias) * gain;
  };
  const Vec3 metal_gain = gain_of(colour_);
  const Vec3 dielectric_gain = rough < 1.0F ? gain_of(Vec3(kDielectric)) : Vec3(0.0F);
  const Vec3 by_dielectric = rough < 1.0F ? reflected_of(Vec3(kDielectric), dielectric_gain) : Vec3(0.0F);
  metal_gain_ = metal_gain * metal;
  dielectric_gain_ = dielectric_gain * (1.0F - metal);
  // glTF mixes a metal with a dielectric; only the dielectric has a matte layer below its gloss.
  matte_ *= 1.0F - std::min(by_dielectric.x, 1.0F);
  const float shine = largest(reflected_of(colour_, metal_gain) * metal + by_dielectric * (1.0F - metal));
  const float below = largest(matte_);
  gloss_share_ = shine > 0.0F ? std::clamp(shine / (shine + below), below > 0.0F ? 0.1F : 1.0F, 1.0F) : 0.0F;
}

Scatter::Scatter(Vec3 colour, float anisotropy) : colour_(colour), is_medium_(true), anisotropy_(anisotropy) {
  QUOIN_ASSERT(std::abs(anisotropy) < 1.0F, "-1 < anisotropy < 1");
}

float Scatter::phase(float cosine) const {
  const float g = anisotropy_;
  const float under = std::max(1.0F + g * g - 2.0F * g * cosine, 1e-6F);
  return (1.0F - g * g) / (4.0F * kPi * under * std::sqrt(under));
}

Vec3 Scatter::gloss_at(float cosine) const {
  return fresnel(colour_, cosine) * metal_gain_ + fresnel(Vec3(kDielectric), cosine) * dielectric_gain_;
}

Scatter::Both Scatter::evaluate(Vec3 in) const {
  if (is_medium_) {
    const float share = phase(in.z);
    return {colour_ * share, share};
  }
  if (!(in.z > 0.0F)) return {};
  Both both{matte_ * (in.z / kPi), (1.0F - gloss_share_) * in.z / kPi};
  if (gloss_share_ <= 0.0F || is_mirror_) return both;
  const Vec3 half = glm::normalize(out_ + in);
  both.value += gloss_at(glm::dot(out_, half)) * microfacets(out_, in, half, alpha_);
  both.density += gloss_share_ * microfacet_density(out_, half, alpha_);
  return both;
}

Vec3 Scatter::value(Vec3 in) const {
  return evaluate(in).value;
}

float Scatter::density(Vec3 in) const {
  return evaluate(in).density;
}

Scattered Scatter::sample(Pair u, float choice) const {
  if (is_medium_) {
    const float g = anisotropy_;
    float cosine = 1.0F - 2.0F * u.x;
    if (std::abs(g) > 1e-3F) {
      const float part = (1.0F - g * g) / (1.0F + g - 2.0F * g * u.x);
      cosine = std::clamp((1.0F + g * g - part * part) / (2.0F * g), -1.0F, 1.0F);
    }
    const float sine = std::sqrt(1.0F - cosine * cosine);
    const SineCosine turn = of_turns(u.y);
    return {{sine * turn.cosine, sine * turn.sine, cosine}, colour_, phase(cosine)};
  }
  if (choice >= gloss_share_) {
    const Vec3 in = cosine_weighted(u);
    if (!(in.z > 0.0F)) return {};
    if (gloss_share_ <= 0.0F) return {in, matte_, in.z / kPi};
    const Both both = evaluate(in);
    return {in, both.value / both.density, both.density};
  }
  if (is_mirror_) {
    const Vec3 in{-out_.x, -out_.y, out_.z};
    return {in, gloss_at(out_.z) / gloss_share_, std::numeric_limits<float>::infinity()};
  }
  const Vec3 half = visible_normal(out_, alpha_, u);
  const Vec3 in = half * (2.0F * glm::dot(out_, half)) - out_;
  if (!(in.z > 0.0F)) return {};
  const Both both = evaluate(in);
  if (!(both.density > 0.0F)) return {};
  return {glm::normalize(in), both.value / both.density, both.density};
}

}  // namespace quoin::path
