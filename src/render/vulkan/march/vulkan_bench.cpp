// render/terrain/1280x720/vulkan: the image of cpu_renderer_bench.cpp on the best device found, and the cost of editing
// one voxel. Skipped without a device.

#include <utility>

#include <benchmark/benchmark.h>

#include <quoin/render/vulkan_renderer.h>

#include "bench/image_loop.h"

namespace quoin {
namespace {

using workloads::fail_unless;

void image(benchmark::State& state, const LightOptions& light, bool with_textures = false) {
  Scene scene = workloads::image_scene();
  if (with_textures) scene = workloads::textured(std::move(scene));
  auto renderer = VulkanRenderer::create();
  if (!renderer) return state.SkipWithError(renderer.error().message.c_str());
  fail_unless(renderer->update(scene).has_value(), "the update's success", 0);
  RenderOptions options;
  options.light = light;
  workloads::time_images(state, options, [&](const Camera& camera, const RenderOptions& wanted) {
    return renderer->render(camera, wanted);
  });
  state.SetLabel(renderer->device().name);
}

void full(benchmark::State& state) {
  image(state, {});
}
void unlit(benchmark::State& state) {
  LightOptions light;
  light.shading = Shading::Unlit;
  image(state, light);
}
void unlit_textures(benchmark::State& state) {
  LightOptions light;
  light.shading = Shading::Unlit;
  image(state, light, true);
}
void full_textures(benchmark::State& state) {
  image(state, {}, true);
}
void vertex(benchmark::State& state) {
  LightOptions light;
  light.occlusion_mode = OcclusionMode::Vertex;
  image(state, light);
}

void update(benchmark::State& state) {
  Scene scene = workloads::image_scene();
  auto renderer = VulkanRenderer::create();
  if (!renderer) return state.SkipWithError(renderer.error().message.c_str());
  fail_unless(renderer->update(scene).has_value(), "the update's success", 0);
  Grid& grid = scene.edit(scene.grids().handles().front()).grid;
  VoxelType type = kAir;
  for (auto _ : state) {
    type = type == kAir ? 1 : kAir;
    grid.set({100, 60, 100}, type);
    fail_unless(renderer->update(scene).has_value(), "the update's success", 0);
  }
  state.SetLabel(renderer->device().name);
  state.counters["bytes"] = static_cast<double>(renderer->uploaded_bytes());
}

BENCHMARK(full)->Name("render/terrain/1280x720/vulkan")->Unit(benchmark::kMillisecond)->Iterations(3)->UseRealTime();
BENCHMARK(unlit)
    ->Name("render/terrain/1280x720/unlit/vulkan")
    ->Unit(benchmark::kMillisecond)
    ->Iterations(3)
    ->UseRealTime();
BENCHMARK(full_textures)
    ->Name("render/terrain/1280x720/textures/vulkan")
    ->Unit(benchmark::kMillisecond)
    ->Iterations(3)
    ->UseRealTime();
BENCHMARK(unlit_textures)
    ->Name("render/terrain/1280x720/unlit/textures/vulkan")
    ->Unit(benchmark::kMillisecond)
    ->Iterations(3)
    ->UseRealTime();
BENCHMARK(vertex)
    ->Name("render/terrain/1280x720/vertex/vulkan")
    ->Unit(benchmark::kMillisecond)
    ->Iterations(3)
    ->UseRealTime();
BENCHMARK(update)->Name("vulkan/update/one_voxel")->Unit(benchmark::kMicrosecond)->UseRealTime();

}  // namespace
}  // namespace quoin
