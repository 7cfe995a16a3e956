// view/*: images as in a window, kept on the best device found, compared with the CPU renderer on all threads: the
// 256x128x256 terrain and a world of 4096x256x4096, at 1920x1080 and 3840x2160, with shadows and six occlusion rays;
// also by ray kind. `device` is skipped without a device.

#include <cmath>
#include <memory>
#include <string>

#include <benchmark/benchmark.h>

#include <quoin/render/cpu_renderer.h>
#include <quoin/render/vulkan_renderer.h>
#include <quoin/terrain/terrain.h>

#include "bench/image_workload.h"

namespace quoin {
namespace {

using workloads::fail_unless;

struct World {
  Scene scene;
  Camera camera;
};

const World& small_world() {
  static const World world{workloads::image_scene(), workloads::over_the_terrain()};
  return world;
}

const World& large_world() {
  static const World world = [] {
    World made;
    const auto types = add_terrain_types(made.scene.types);
    fail_unless(types.has_value(), "types", 0);
    TerrainOptions options;
    options.size = {128, 8, 128};
    options.water = false;
    auto grid = generate_terrain(options, *types);
    fail_unless(grid.has_value(), "a world", 0);
    SceneGrid placed;
    placed.grid = std::move(*grid);
    made.scene.add_instance({"world", made.scene.add_grid(std::move(placed))});
    made.camera = *look_at({2048, 300, 2048}, {2600, 60, 2700}, 1.2);
    return made;
  }();
  return world;
}

enum class Kind { Primary, Shadow, Full };

RenderOptions options_for(int height, Kind kind) {
  RenderOptions options;
  options.height = height;
  options.width = height * 16 / 9;
  options.light.occlusion_rays = 6;
  if (kind == Kind::Primary) options.light.shading = Shading::Unlit;
  if (kind == Kind::Shadow) options.light.occlusion_mode = OcclusionMode::Off;
  return options;
}

void count(benchmark::State& state, std::int64_t rays) {
  state.counters["rays"] = static_cast<double>(rays);
  state.counters["rays_per_second"] =
      benchmark::Counter(static_cast<double>(rays), benchmark::Counter::kIsIterationInvariantRate);
  state.counters["frames_per_second"] = benchmark::Counter(1.0, benchmark::Counter::kIsIterationInvariantRate);
}

void on_device(benchmark::State& state, const World& world, const RenderOptions& options) {
  auto renderer = VulkanRenderer::create();
  if (!renderer) return state.SkipWithError(renderer.error().message.c_str());
  fail_unless(renderer->update(world.scene).has_value(), "the update's success", 0);
  VulkanImage image(*renderer);
  for (auto _ : state) {
    fail_unless(renderer->draw(image, world.camera, options, Accumulation::Restart).has_value(), "the image's success",
                0);
  }
  state.SetLabel(renderer->device().name);
  count(state, image.rays());
}

void on_processor(benchmark::State& state, const World& world, const RenderOptions& options) {
  const CpuRenderer renderer(world.scene);
  std::int64_t rays = 0;
  for (auto _ : state) {
    const auto image = renderer.render(world.camera, options);
    fail_unless(image.has_value(), "the image's success", 0);
    rays = image->rays;
  }
  state.SetLabel(std::to_string(thread_count(Threads{})) + " threads");
  count(state, rays);
}

const World& world_of(bool is_large) {
  return is_large ? large_world() : small_world();
}

void add(bool is_large, int height, Kind kind, const std::string& name) {
  const auto finish = [](benchmark::internal::Benchmark* one) {
    one->Unit(benchmark::kMillisecond)->Iterations(2)->UseRealTime();
  };
  finish(benchmark::RegisterBenchmark((name + "/device").c_str(), [=](benchmark::State& state) {
    on_device(state, world_of(is_large), options_for(height, kind));
  }));
  finish(benchmark::RegisterBenchmark((name + "/processor").c_str(), [=](benchmark::State& state) {
    on_processor(state, world_of(is_large), options_for(height, kind));
  }));
}

const bool kIsAdded = [] {
  add(false, 1080, Kind::Primary, "view/terrain/1080/primary");
  add(false, 1080, Kind::Shadow, "view/terrain/1080/shadow");
  add(false, 1080, Kind::Full, "view/terrain/1080");
  add(false, 2160, Kind::Full, "view/terrain/2160");
  add(true, 1080, Kind::Full, "view/world4096/1080");
  add(true, 2160, Kind::Full, "view/world4096/2160");
  return true;
}();

}  // namespace
}  // namespace quoin
