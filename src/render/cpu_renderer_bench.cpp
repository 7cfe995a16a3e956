// render/terrain/1280x720: the 256x128x256 terrain with shadows and nine occlusion rays a hit, one thread.

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>

#include <benchmark/benchmark.h>
#include <glm/geometric.hpp>

#include <quoin/render/cpu_renderer.h>

#include "bench/workloads.h"

namespace quoin {
namespace {

constexpr std::int64_t kVoxels = 2'062'206;
constexpr std::int64_t kPixelsHit = 474'308;

Scene terrain() {
  Scene scene;
  scene.types = workloads::three_types();
  SceneGrid grid;
  grid.grid.edit({IVec3{0}, IVec3{256, 128, 256}},
                 [](IVec3 v, VoxelType) { return workloads::terrain_type(v.y, workloads::height(v.x, v.z)); });
  scene.add_instance({"terrain", scene.add_grid(std::move(grid))});
  return scene;
}

Camera over_the_terrain() {
  Camera camera;
  camera.position = {20, 90, 20};
  camera.forward = glm::normalize(DVec3{128, 40, 128} - camera.position);
  camera.right = glm::normalize(glm::cross(camera.forward, DVec3{0, 1, 0}));
  camera.up = glm::cross(camera.right, camera.forward);
  camera.vertical_fov = 70.0 * std::numbers::pi / 180.0;
  return camera;
}

void fail_unless(bool holds, const char* what, std::int64_t found) {
  if (holds) return;
  std::fprintf(stderr, "render benchmark: %s is %lld\n", what, static_cast<long long>(found));
  std::exit(1);
}

void picture(benchmark::State& state, const LightOptions& light, Threads threads = {1}) {
  static const Scene scene = terrain();
  fail_unless(scene.voxel_count() == kVoxels, "the number of voxels", scene.voxel_count());
  const CpuRenderer renderer(scene, false, {1});
  RenderOptions options;
  options.threads = threads;
  options.light = light;
  std::int64_t rays = 0;
  for (auto _ : state) {
    const auto made = renderer.render(over_the_terrain(), options);
    fail_unless(made.has_value() && std::abs(made->pixels_hit - kPixelsHit) < 50, "pixels hit",
                made ? made->pixels_hit : -1);
    rays = made->rays;
  }
  state.counters["rays"] = static_cast<double>(rays);
  state.counters["rays_per_second"] =
      benchmark::Counter(static_cast<double>(rays), benchmark::Counter::kIsIterationInvariantRate);
}

void full(benchmark::State& state) {
  picture(state, {});
}
void all_threads(benchmark::State& state) {
  picture(state, {}, {});
  state.counters["threads"] = resolve(Threads{});
}
void unlit(benchmark::State& state) {
  LightOptions light;
  light.lit = false;
  picture(state, light);
}
void vertex(benchmark::State& state) {
  LightOptions light;
  light.occlusion = OcclusionMode::Vertex;
  picture(state, light);
}
BENCHMARK(full)->Name("render/terrain/1280x720")->Unit(benchmark::kMillisecond)->Iterations(5);
BENCHMARK(all_threads)
    ->Name("render/terrain/1280x720/all_threads")
    ->Unit(benchmark::kMillisecond)
    ->Iterations(5)
    ->UseRealTime();
BENCHMARK(unlit)->Name("render/terrain/1280x720/unlit")->Unit(benchmark::kMillisecond)->Iterations(5);
BENCHMARK(vertex)->Name("render/terrain/1280x720/vertex")->Unit(benchmark::kMillisecond)->Iterations(5);

}  // namespace
}  // namespace quoin
