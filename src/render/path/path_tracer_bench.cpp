// path/terrain/640x360: the 256x128x256 terrain by day, four samples and four bounces, one thread; rays per second.
// path/lamps: the same by night, with a thousand lamps.
// path/sky: a physical sky for another position of the sun.

#include <benchmark/benchmark.h>

#include <quoin/core/hash.h>
#include <quoin/render/path_tracer.h>

#include "bench/image_workload.h"
#include "render/cpu/environment_for_tests.h"
#include "render/path/sky_light.h"

namespace quoin {
namespace {

using workloads::fail_unless;

void time_paths(benchmark::State& state, const Scene& scene, PathOptions options) {
  const PathTracer tracer(scene, InstanceFilter::Visible, {1});
  options.width = 640;
  options.height = 360;
  options.samples = 4;
  options.max_bounces = 4;
  const Camera camera = frame_view(scene.bounds(), View::Iso, 16.0 / 9.0);
  std::int64_t rays = 0;
  fail_unless(tracer.render(camera, options, {1}).has_value(), "an image", 0);  // builds the sky once
  for (auto _ : state) {
    const auto image = tracer.render(camera, options, {1});
    fail_unless(image.has_value() && image->rays > 0, "an image", 0);
    rays += image->rays;
  }
  state.counters["rays"] = benchmark::Counter(static_cast<double>(rays), benchmark::Counter::kIsRate);
}

void terrain(benchmark::State& state) {
  static const Scene scene = workloads::image_scene();
  fail_unless(scene.voxel_count() == workloads::kImageVoxels, "the number of voxels", scene.voxel_count());
  time_paths(state, scene, {});
}

void lamps(benchmark::State& state) {
  static const Scene scene = [] {
    Scene made = workloads::image_scene();
    VoxelProperties glow;
    glow.colour = {255, 190, 110, 255};
    glow.emission = 20.0F;
    const VoxelType lamp = made.types.add(glow).value_or(kAir);
    Grid& grid = made.edit(made.grids().handles().front()).grid;
    std::uint32_t seed = 1;
    for (int placed = 0; placed < 1000;) {
      seed = mix_bits(seed + 0x9E37'79B9U);
      const int x = static_cast<int>(seed & 255U);
      const int z = static_cast<int>(seed >> 8 & 255U);
      int y = 127;
      while (y > 0 && grid.get({x, y - 1, z}) == kAir) --y;
      if (y > 120) continue;
      grid.set({x, y, z}, lamp);
      ++placed;
    }
    return made;
  }();
  PathOptions options;
  physical_in(options).sun.brightness = 0.0;
  physical_in(options).sky.brightness = 0.01;
  time_paths(state, scene, options);
}

void sky(benchmark::State& state) {
  PathOptions options;
  Environment& environment = physical_in(options);
  for (auto _ : state) {
    environment.sun.direction.x += 0.01;
    const path::SkyLight light(environment);
    fail_unless(light.air() != nullptr && light.has_sun(), "a sky with a sun", 0);
  }
}

BENCHMARK(terrain)->Name("path/terrain/640x360")->Unit(benchmark::kMillisecond)->Iterations(3);
BENCHMARK(lamps)->Name("path/lamps/640x360")->Unit(benchmark::kMillisecond)->Iterations(3);
BENCHMARK(sky)->Name("path/sky")->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace quoin
