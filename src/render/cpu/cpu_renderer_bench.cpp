// render/terrain/1280x720: the 256x128x256 terrain with shadows and nine occlusion rays per hit, one thread.

#include <benchmark/benchmark.h>

#include <quoin/render/cpu_renderer.h>

#include "bench/image_loop.h"

namespace quoin {
namespace {

using workloads::fail_unless;

void image(benchmark::State& state, const LightOptions& light, Threads threads = {1}, bool with_textures = false) {
  static const Scene plain = workloads::image_scene();
  static const Scene with = workloads::textured(workloads::image_scene());
  const Scene& scene = with_textures ? with : plain;
  fail_unless(scene.voxel_count() == workloads::kImageVoxels, "the number of voxels", scene.voxel_count());
  const CpuRenderer renderer(scene, InstanceFilter::Visible, {1});
  RenderOptions options;
  options.light = light;
  workloads::time_images(state, options, [&](const Camera& camera, const RenderOptions& wanted) {
    return renderer.render(camera, wanted, threads);
  });
}

void full(benchmark::State& state) {
  image(state, {});
}
void all_threads(benchmark::State& state) {
  image(state, {}, {});
  state.counters["threads"] = thread_count(Threads{});
}
void unlit(benchmark::State& state) {
  LightOptions light;
  light.shading = Shading::Unlit;
  image(state, light);
}
void unlit_textures(benchmark::State& state) {
  LightOptions light;
  light.shading = Shading::Unlit;
  image(state, light, {1}, true);
}
void full_textures(benchmark::State& state) {
  image(state, {}, {1}, true);
}
void vertex(benchmark::State& state) {
  LightOptions light;
  light.occlusion_mode = OcclusionMode::Vertex;
  image(state, light);
}
BENCHMARK(full)->Name("render/terrain/1280x720")->Unit(benchmark::kMillisecond)->Iterations(5);
BENCHMARK(all_threads)
    ->Name("render/terrain/1280x720/all_threads")
    ->Unit(benchmark::kMillisecond)
    ->Iterations(5)
    ->UseRealTime();
BENCHMARK(unlit)->Name("render/terrain/1280x720/unlit")->Unit(benchmark::kMillisecond)->Iterations(5);
BENCHMARK(unlit_textures)->Name("render/terrain/1280x720/unlit/textures")->Unit(benchmark::kMillisecond)->Iterations(5);
BENCHMARK(full_textures)->Name("render/terrain/1280x720/textures")->Unit(benchmark::kMillisecond)->Iterations(5);
BENCHMARK(vertex)->Name("render/terrain/1280x720/vertex")->Unit(benchmark::kMillisecond)->Iterations(5);

}  // namespace
}  // namespace quoin
