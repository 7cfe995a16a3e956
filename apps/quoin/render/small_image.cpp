#include "render/small_image.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>

#include <quoin/io/image_files.h>
#include <quoin/render/cpu_renderer.h>

#include "run_control.h"

namespace quoin::tool {
namespace {

constexpr int kFiner = 2;  // samples per pixel along each side

float light_of(std::uint8_t encoded) {
  const float value = static_cast<float>(encoded) / 255.0F;
  return value <= 0.04045F ? value / 12.92F : std::pow((value + 0.055F) / 1.055F, 2.4F);
}

std::uint8_t encoded(float light) {
  const float value = light <= 0.0031308F ? light * 12.92F : 1.055F * std::pow(light, 1.0F / 2.4F) - 0.055F;
  return static_cast<std::uint8_t>(std::lround(std::clamp(value, 0.0F, 1.0F) * 255.0F));
}

/// Shrinks an image by averaging blocks of pixels in linear light. Pixels without a hit are transparent.
AlphaImage shrunk(const RenderedImage& rendered, int size) {
  std::array<float, 256> light{};
  for (std::size_t i = 0; i < light.size(); ++i) light[i] = light_of(static_cast<std::uint8_t>(i));
  AlphaImage image{size, size, {}};
  image.rgba.reserve(static_cast<std::size_t>(4) * static_cast<std::size_t>(size) * static_cast<std::size_t>(size));
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      std::array<float, 3> sum{};
      int hit = 0;
      for (int i = 0; i < kFiner * kFiner; ++i) {
        const auto from =
            static_cast<std::size_t>((y * kFiner + i / kFiner) * rendered.colour.width + x * kFiner + i % kFiner);
        if (!std::isfinite(rendered.depth.values[from])) continue;
        ++hit;
        for (std::size_t channel = 0; channel < 3; ++channel)
          sum[channel] += light[rendered.colour.rgb[3 * from + channel]];
      }
      for (const float each : sum)
        image.rgba.push_back(hit > 0 ? encoded(each / static_cast<float>(hit)) : std::uint8_t{0});
      image.rgba.push_back(static_cast<std::uint8_t>((255 * hit + kFiner * kFiner / 2) / (kFiner * kFiner)));
    }
  }
  return image;
}

}  // namespace

Result<SmallImage> draw_small(const Scene& scene, int size, InstanceFilter filter, Threads threads,
                              const Progress& progress) {
  RenderOptions options;
  options.light = natural_light();
  options.environment = scene.environment.value_or(Environment::natural());
  options.light.occlusion_mode = OcclusionMode::Vertex;
  options.light.max_lamps = 4;
  options.width = options.height = size * kFiner;
  options.depth = true;
  const CpuRenderer renderer(scene, filter, threads);
  auto image = renderer.render(frame_scene(scene, View::Iso, 1.0, filter), options, threads, progress);
  if (!image) return image.error();
  return SmallImage{shrunk(*image, size), image->pixels_hit == 0};
}

Status put_thumbnail(const Scene& scene, Threads threads, WorldChanges& changes) {
  const auto drawn =
      draw_small(scene, kThumbnailSize, InstanceFilter::Visible, threads, [](double) { return !was_interrupted(); });
  if (!drawn) return drawn.error();
  if (drawn->is_empty) return {};
  auto png = write_png(drawn->image);
  if (!png) return png.error();
  changes.put_thumbnail(std::move(*png));
  return {};
}

}  // namespace quoin::tool
