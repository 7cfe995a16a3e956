#pragma once

#include <cmath>
#include <cstdint>

#include <benchmark/benchmark.h>

#include <quoin/render/cpu_renderer.h>

#include "bench/image_workload.h"

namespace quoin::workloads {

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
