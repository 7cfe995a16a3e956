// shapes/town/rays: primary rays through a town of 9x9 chunks with shapes (bench/town_workload.h), in packets.
// shapes/town/rays/cubes: the same voxels as cubes. shapes/town/image, shapes/town/image/cubes: images with shadows and
// nine occlusion rays per hit. One thread.

#include <bit>
#include <cstdint>
#include <cstdio>
#include <cstdlib>

#include <benchmark/benchmark.h>

#include <quoin/render/cpu_renderer.h>
#include <quoin/scene/camera.h>

#include "bench/town_workload.h"
#include "render/shared/image_request.h"
#include "scene/tracer/scene_view.h"

namespace quoin {
namespace {

constexpr int kWidth = 640;
constexpr int kHeight = 360;

const Scene& town(bool with_shapes) {
  static const Scene shapes = workloads::town_scene(true);
  static const Scene cubes = workloads::town_scene(false);
  return with_shapes ? shapes : cubes;
}

Camera above_streets() {
  return look_at({290.0, 45.0, 290.0}, {330.0, 28.0, 340.0}, 1.0).value();
}

void rays(benchmark::State& state, bool with_shapes) {
  const Camera camera = above_streets();
  const SceneTracer tracer(town(with_shapes), InstanceFilter::Visible, {1});
  const SceneView view(tracer, camera.position);
  const CameraRays camera_rays(camera, kWidth, kHeight);
  std::int64_t hits = 0;
  std::int64_t in_shapes = 0;
  for (auto _ : state) {
    hits = in_shapes = 0;
    for (int y = 0; y < kHeight; y += CameraRays::kBlock) {
      for (int x = 0; x < kWidth; x += CameraRays::kBlock) {
        RayPacket packet;
        camera_rays.block(x, y, sample_point(0), packet);
        SceneHits found;
        view.first_hits(packet, found);
        hits += std::popcount(found.grids.hit);
        in_shapes += std::popcount(found.in_shape);
      }
    }
  }
  if (hits < 150'000 || (in_shapes > 20'000) != with_shapes) {
    std::fprintf(stderr, "town benchmark: %lld hits, %lld of shapes\n", static_cast<long long>(hits),
                 static_cast<long long>(in_shapes));
    std::exit(1);
  }
  state.counters["hits"] = static_cast<double>(hits);
  state.counters["rays_per_second"] =
      benchmark::Counter(double{kWidth} * kHeight, benchmark::Counter::kIsIterationInvariantRate);
}

void image(benchmark::State& state, bool with_shapes) {
  const CpuRenderer renderer(town(with_shapes), InstanceFilter::Visible, {1});
  RenderOptions options;
  options.width = kWidth;
  options.height = kHeight;
  for (auto _ : state) benchmark::DoNotOptimize(renderer.render(above_streets(), options, {1}));
}

BENCHMARK_CAPTURE(rays, shapes, true)->Name("shapes/town/rays")->Unit(benchmark::kMillisecond)->Iterations(20);
BENCHMARK_CAPTURE(rays, cubes, false)->Name("shapes/town/rays/cubes")->Unit(benchmark::kMillisecond)->Iterations(20);
BENCHMARK_CAPTURE(image, shapes, true)->Name("shapes/town/image")->Unit(benchmark::kMillisecond)->Iterations(5);
BENCHMARK_CAPTURE(image, cubes, false)->Name("shapes/town/image/cubes")->Unit(benchmark::kMillisecond)->Iterations(5);

}  // namespace
}  // namespace quoin
