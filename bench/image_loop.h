#pragma once

#include <cmath>
#include <cstdint>
#include <random>

#include <benchmark/benchmark.h>

#include <quoin/render/cpu_renderer.h>

#include "bench/image_workload.h"

namespace quoin::workloads {

/// Gives each type of a scene a texture of 64 x 64 texels.
inline Scene textured(Scene scene) {
  std::mt19937 random(1);
  for (std::size_t i = 1; i < scene.types.size(); ++i) {
    AlphaImage noise{64, 64, {}};
    for (int k = 0; k < 4 * 64 * 64; ++k) {
      noise.rgba.push_back(k % 4 == 3 ? 255 : static_cast<std::uint8_t>(random()));
    }
    VoxelProperties type = scene.types[static_cast<VoxelType>(i)];
    type.faces = Texture::from_image(type.name, noise).value();
    scene.types.replace(static_cast<VoxelType>(i), type);
  }
  return scene;
}

/// Times the benchmarks' image, rendered by `render(camera, options)`, and counts its rays.
template <class Render>
void time_images(benchmark::State& state, const RenderOptions& options, Render&& render) {
  std::int64_t rays = 0;
  for (auto _ : state) {
    const auto made = render(over_the_terrain(), options);
    fail_unless(made.has_value() && std::abs(made->pixels_hit - kPixelsHit) < 50, "pixels hit",
                made ? made->pixels_hit : -1);
    rays = made->rays;
  }
  state.counters["rays"] = static_cast<double>(rays);
  state.counters["rays_per_second"] =
      benchmark::Counter(static_cast<double>(rays), benchmark::Counter::kIsIterationInvariantRate);
}

}  // namespace quoin::workloads
