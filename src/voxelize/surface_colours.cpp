#include "voxelize/surface_colours.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <quoin/core/assert.h>

#include "core/srgb.h"

namespace quoin::voxelizing {

namespace {

// Emission within a texture is quantised to 16ths of the material's.
constexpr std::uint32_t kEmissionSteps = 16;

// The colour of a mesh without materials: a light grey that shows its shape, sRGB 200.
constexpr float kGrey = 0.577580F;

std::uint16_t unit_of(float value) {
  return static_cast<std::uint16_t>(std::lround(std::clamp(value, 0.0F, 1.0F) * 65'535.0F));
}

Rgba8 encoded(glm::vec4 light) {
  Rgba8 colour = srgb_colour(glm::vec3(light));
  const float alpha = light.a > 0.0F ? std::min(light.a, 1.0F) : 0.0F;
  colour.a = static_cast<std::uint8_t>(std::lround(alpha * 255.0F));
  return colour;
}

/// A table of linear_from_srgb for every byte, which is slow to compute.
const std::array<float, 256>& linear_of_bytes() {
  static const std::array<float, 256> all = [] {
    std::array<float, 256> made{};
    for (std::size_t i = 0; i < made.size(); ++i) made[i] = linear_from_srgb(static_cast<std::uint8_t>(i));
    return made;
  }();
  return all;
}

/// Returns a pixel's index within an image. Requires: `at` is finite.
int wrapped(double at, int size, TextureWrap wrap) {
  QUOIN_ASSERT(size > 0 && std::isfinite(at), "at least one pixel, and a place");
  if (wrap == TextureWrap::Clamp) return static_cast<int>(std::clamp(at, 0.0, static_cast<double>(size - 1)));
  const int period = wrap == TextureWrap::Mirror ? 2 * size : size;
  constexpr double kMostOfInt = 2e9;
  int within = static_cast<int>(std::abs(at) <= kMostOfInt ? at : std::fmod(at, period)) % period;
  if (within < 0) within += period;
  return within < size ? within : period - 1 - within;
}

/// Returns a valid texture coordinate: 0 for NaN and for values far outside the texture.
double sound_place(double at) {
  constexpr double kFarthest = 1e6;
  return std::abs(at) <= kFarthest ? at : 0.0;
}

}  // namespace

SurfaceColours::SurfaceColours(const Frame& frame) : frame_(&frame), materials_(frame.mesh().materials) {
  const TriangleMesh& mesh = frame.mesh();
  if (materials_.empty()) {
    materials_.emplace_back();
    materials_.back().colour = {kGrey, kGrey, kGrey, 1.0F};
    if (!mesh.colours.empty()) materials_.back().colour = glm::vec4(1.0F);
  }
  bool is_textured = false;
  for (MeshMaterial& material : materials_) {
    if (mesh.uvs.empty()) material.texture.reset();
    if (material.emissive_texture && mesh.emissive_uvs.empty()) material.emission = 0.0F;
    if (mesh.emissive_uvs.empty()) material.emissive_texture.reset();
    is_textured |= material.texture.has_value() || material.emissive_texture.has_value();
    VoxelProperties type;
    type.name = material.name;
    type.roughness = std::clamp(material.roughness, 0.0F, 1.0F);
    type.metalness = std::clamp(material.metalness, 0.0F, 1.0F);
    type.emission = material.emission > 0.0F && std::isfinite(material.emission) ? material.emission : 0.0F;
    properties_.push_back(std::move(type));
  }
  images_.resize(mesh.textures.size());
  for (const MeshMaterial& material : materials_) {
    for (const auto& texture : {material.texture, material.emissive_texture}) {
      if (texture && images_[*texture].levels.empty()) make_halves(*texture);
    }
  }
  for (std::size_t i = 0; i < materials_.size(); ++i) {
    first_steps_.push_back(static_cast<std::uint32_t>(properties_.size()));
    if (!materials_[i].emissive_texture) continue;
    for (std::uint32_t step = 0; step < kEmissionSteps; ++step) {
      VoxelProperties part = properties_[i];
      part.emission *= static_cast<float>(step) / static_cast<float>(kEmissionSteps);
      properties_.push_back(std::move(part));
    }
  }
  is_plain_ = materials_.size() == 1 && !is_textured && mesh.colours.empty() &&
              (materials_[0].alpha_mode == AlphaMode::Opaque || materials_[0].colour.a >= 1.0F);
  find_mean();
}

std::optional<std::uint32_t> SurfaceColours::only_material() const {
  const auto& of = frame_->mesh().material_of;
  if (of.empty()) return 0;
  const bool is_one = std::all_of(of.begin(), of.end(), [&](std::uint32_t material) { return material == of.front(); });
  return is_one ? std::optional(of.front()) : std::nullopt;
}

std::uint32_t SurfaceColours::look_of(std::uint32_t material, float share) const {
  const auto step = static_cast<std::uint32_t>(std::lround(share * static_cast<float>(kEmissionSteps)));
  QUOIN_ASSERT(material < first_steps_.size(), "one of the materials");
  return step >= kEmissionSteps ? material : first_steps_[material] + step;
}

std::uint32_t SurfaceColours::look_index(std::uint32_t triangle, DVec3 shares) const {
  return look_of(material_index(triangle), emission_share(triangle, shares));
}

std::optional<std::uint32_t> SurfaceColours::deep_look() const {
  const auto material = only_material();
  return material ? std::optional(look_of(*material, mean_emission_)) : std::nullopt;
}

float SurfaceColours::emission_share(std::uint32_t triangle, DVec3 shares) const {
  const MeshMaterial& material = material_of(triangle);
  if (!material.emissive_texture) return 1.0F;
  const glm::vec2* const places = frame_->mesh().emissive_uvs.data() + std::size_t{3} * triangle;
  const glm::vec3 glow =
      glm::vec3(colour_in(*material.emissive_texture, triangle, places, shares)) * material.emissive_tint;
  const float most = std::max({glow.r, glow.g, glow.b});
  constexpr float kDark = 1.0F / 255.0F;
  if (!(most > kDark)) return 0.0F;
  // A type emits its own colour: the share is relative to that, so that a written file is read as it was.
  const glm::vec4 base = light(triangle, shares);
  return std::min(most / std::max({base.r, base.g, base.b, most}), 1.0F);
}

void SurfaceColours::make_halves(std::size_t texture) {
  const AlphaImage& image = frame_->mesh().textures[texture].image;
  std::vector<Level>& levels = images_[texture].levels;
  levels.push_back({image.width, image.height, {}});
  while (levels.back().width > 1 || levels.back().height > 1) {
    const Level& finer = levels.back();
    Level level{std::max(finer.width / 2, 1), std::max(finer.height / 2, 1), {}};
    level.pixels.resize(std::size_t{4} * static_cast<std::size_t>(level.width) *
                        static_cast<std::size_t>(level.height));
    std::uint16_t* out = level.pixels.data();
    for (int y = 0; y < level.height; ++y) {
      for (int x = 0; x < level.width; ++x) {
        // With odd sizes all pixels count: uses the full extent of this pixel.
        const int end_x = (x + 1) * finer.width / level.width;
        const int end_y = (y + 1) * finer.height / level.height;
        glm::vec4 sum(0.0F);
        int count = 0;
        for (int j = y * finer.height / level.height; j < end_y; ++j) {
          for (int i = x * finer.width / level.width; i < end_x; ++i, ++count) {
            sum += texel(texture, levels.size() - 1, i, j);
          }
        }
        sum /= static_cast<float>(count);
        for (int channel = 0; channel < 4; ++channel) *out++ = unit_of(sum[channel]);
      }
    }
    levels.push_back(std::move(level));
  }
}

/// Linear light times alpha, and alpha.
glm::vec4 SurfaceColours::texel(std::size_t texture, std::size_t level, int x, int y) const {
  QUOIN_ASSERT(texture < images_.size() && level < images_[texture].levels.size(), "a level of a used texture");
  const Level& of = images_[texture].levels[level];
  QUOIN_ASSERT(x >= 0 && x < of.width && y >= 0 && y < of.height, "a pixel of the level");
  const std::size_t at =
      std::size_t{4} * (static_cast<std::size_t>(y) * static_cast<std::size_t>(of.width) + static_cast<std::size_t>(x));
  if (level > 0) {
    const std::uint16_t* p = of.pixels.data() + at;
    return glm::vec4(p[0], p[1], p[2], p[3]) * (1.0F / 65'535.0F);
  }
  const std::uint8_t* p = frame_->mesh().textures[texture].image.rgba.data() + at;
  const float alpha = static_cast<float>(p[3]) * (1.0F / 255.0F);
  const std::array<float, 256>& linear = linear_of_bytes();
  return {linear[p[0]] * alpha, linear[p[1]] * alpha, linear[p[2]] * alpha, alpha};
}

glm::vec4 SurfaceColours::sample(std::size_t texture, std::size_t level, DVec3 place) const {
  const Level& of = images_[texture].levels[level];
  const MeshTexture& how = frame_->mesh().textures[texture];
  const double u = sound_place(place.x) * of.width;
  const double v = sound_place(place.y) * of.height;
  const auto at = [&](double x, double y) {
    return texel(texture, level, wrapped(x, of.width, how.wrap_u), wrapped(y, of.height, how.wrap_v));
  };
  if (!how.is_smooth && level == 0) return at(std::floor(u), std::floor(v));
  const double left = std::floor(u - 0.5);
  const double top = std::floor(v - 0.5);
  const auto share_u = static_cast<float>(u - 0.5 - left);
  const auto share_v = static_cast<float>(v - 0.5 - top);
  return glm::mix(glm::mix(at(left, top), at(left + 1.0, top), share_u),
                  glm::mix(at(left, top + 1.0), at(left + 1.0, top + 1.0), share_u), share_v);
}

/// Returns the mip level whose pixels are about as large as a voxel.
std::size_t SurfaceColours::level_of(std::uint32_t triangle, const glm::vec2* places, std::size_t texture) const {
  const Corners corners = frame_->corners(triangle);
  const double area = glm::length(glm::cross(corners[1] - corners[0], corners[2] - corners[0]));
  const glm::vec2 a = places[1] - places[0];
  const glm::vec2 b = places[2] - places[0];
  const std::vector<Level>& levels = images_[texture].levels;
  QUOIN_ASSERT(!levels.empty(), "a used texture");
  const double pixels = std::abs(double{a.x} * b.y - double{a.y} * b.x) * levels[0].width * levels[0].height;
  if (!(area > 0.0) || !(pixels > area)) return 0;
  const double level = std::floor(0.5 * std::log2(pixels / area) + 0.5);
  return static_cast<std::size_t>(std::clamp(level, 0.0, static_cast<double>(levels.size() - 1)));
}

glm::vec4 SurfaceColours::colour_in(std::size_t texture, std::uint32_t triangle, const glm::vec2* places,
                                    DVec3 shares) const {
  const glm::vec2 place = places[0] * static_cast<float>(shares.x) + places[1] * static_cast<float>(shares.y) +
                          places[2] * static_cast<float>(shares.z);
  const glm::vec4 found = sample(texture, level_of(triangle, places, texture), DVec3(place.x, place.y, 0.0));
  return found.a > 0.0F ? glm::vec4(glm::vec3(found) / found.a, found.a) : found;
}

glm::vec4 SurfaceColours::light(std::uint32_t triangle, DVec3 shares) const {
  const TriangleMesh& mesh = frame_->mesh();
  const MeshMaterial& material = material_of(triangle);
  glm::vec4 light = material.colour;
  if (!mesh.colours.empty()) {
    const auto& corner = mesh.triangles[triangle];
    light *= mesh.colours[corner[0]] * static_cast<float>(shares.x) +
             mesh.colours[corner[1]] * static_cast<float>(shares.y) +
             mesh.colours[corner[2]] * static_cast<float>(shares.z);
  }
  if (material.texture) {
    light *= colour_in(*material.texture, triangle, mesh.uvs.data() + std::size_t{3} * triangle, shares);
  }
  return light;
}

bool SurfaceColours::has_surface(std::uint32_t triangle, DVec3 shares) const {
  const MeshMaterial& material = material_of(triangle);
  if (material.alpha_mode == AlphaMode::Opaque) return true;
  const float alpha = light(triangle, shares).a;
  return material.alpha_mode == AlphaMode::Mask ? alpha >= material.alpha_cutoff : encoded({0, 0, 0, alpha}).a > 0;
}

Rgba8 SurfaceColours::colour(std::uint32_t triangle, DVec3 shares) const {
  glm::vec4 seen = light(triangle, shares);
  if (material_of(triangle).alpha_mode != AlphaMode::Blend) seen.a = 1.0F;
  return encoded(seen);
}

void SurfaceColours::find_mean() {
  // With several materials the core is opaque; a single glass material is glass throughout.
  const auto one = only_material();
  const bool has_alpha = one && materials_[*one].alpha_mode == AlphaMode::Blend;
  glm::dvec4 sum(0.0);
  double alpha = 0.0;
  double emission = 0.0;
  for (std::size_t i = 0; i < frame_->triangle_count(); ++i) {
    const auto triangle = static_cast<std::uint32_t>(i);
    const Corners c = frame_->corners(i);
    const DVec3 third(1.0 / 3.0);
    const double area = glm::length(glm::cross(c[1] - c[0], c[2] - c[0]));
    if (!has_surface(triangle, third)) continue;
    const glm::vec4 seen = light(triangle, third);
    sum += glm::dvec4(glm::vec3(seen), 1.0) * area;
    alpha += (has_alpha ? seen.a : 1.0) * area;
    emission += (one ? emission_share(triangle, third) : 1.0) * area;
  }
  const glm::vec4 plain = materials_[0].colour;
  const bool has_area = sum.a > 0.0;
  if (has_area) mean_emission_ = static_cast<float>(emission / sum.a);
  mean_ = encoded(has_area ? glm::vec4(glm::vec3(sum / sum.a), static_cast<float>(alpha / sum.a))
                           : glm::vec4(glm::vec3(plain), 1.0F));
}

}  // namespace quoin::voxelizing
