// impostor/build26: all snapshots of the ball W4; render/far1000: a thousand far instances of five grids, 1280x720,
// traced and drawn from impostors. One thread.

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <random>

#include <benchmark/benchmark.h>
#include <glm/geometric.hpp>

#include <quoin/render/impostor.h>

#include "bench/workloads.h"

namespace quoin {
namespace {

void fail_unless(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "impostor benchmark: %s\n", what);
  std::exit(1);
}

void build26(benchmark::State& state) {
  const VoxelRegistry types = workloads::three_types();
  Grid grid;
  grid.put_chunk({0, 0, 0}, workloads::blocky_chunk(workloads::Blocky::W4));
  const OccupancyTree tree = OccupancyTree::build(grid, types, Occupancy::Opaque);
  for (auto _ : state) {
    const Impostor impostor = Impostor::build(grid, types, tree);
    fail_unless(impostor.bytes() > 100'000, "too little was seen");
  }
}
BENCHMARK(build26)->Name("impostor/build26")->Unit(benchmark::kMillisecond);

Grid model(int which) {
  Grid grid;
  if (which == 0) grid.put_chunk({0, 0, 0}, workloads::blocky_chunk(workloads::Blocky::W4));
  if (which == 1) grid.put_chunk({0, 0, 0}, workloads::blocky_chunk(workloads::Blocky::W1));
  if (which == 2) grid.put_chunk({0, 0, 0}, workloads::blocky_chunk(workloads::Blocky::W2));
  if (which > 2) {
    std::mt19937 random(static_cast<unsigned>(which));
    for (int i = 0; i < 40; ++i) {
      const auto coordinate = [&] { return static_cast<int>(random() % 41); };
      const IVec3 at{coordinate(), coordinate(), coordinate()};
      grid.fill_box({at, at + IVec3(static_cast<int>(random() % 9)) + 1}, static_cast<VoxelType>(1 + random() % 3));
    }
  }
  return grid;
}

Scene far_scene() {
  Scene scene;
  scene.types = workloads::three_types();
  std::vector<GridHandle> grids;
  for (int i = 0; i < 5; ++i) {
    SceneGrid grid;
    grid.grid = model(i);
    grid.pivot = content_sphere(grid.grid).centre;
    grids.push_back(scene.add_grid(std::move(grid)));
  }
  std::mt19937 random(3);
  const auto share = [&] { return static_cast<double>(random()) / 4294967296.0 * 2.0 - 1.0; };
  for (std::size_t i = 0; i < 1000; ++i) {
    Instance instance;
    instance.grid = grids[i % grids.size()];
    const double depth = 1100.0 + 500.0 * share();
    instance.position = {share() * 0.95 * depth, share() * 0.5 * depth, -depth};
    instance.rotation = glm::normalize(DQuat(share(), share(), share(), share() + 0.01));
    scene.add_instance(instance);
  }
  return scene;
}

void far1000(benchmark::State& state, bool impostors) {
  static const Scene scene = far_scene();
  static const CpuRenderer renderer(scene, InstanceFilter::Visible, {1});
  Camera camera;
  camera.vertical_fov = 0.9;
  RenderOptions options;
  options.threads = {1};
  if (impostors) options.detail = DetailPolicy{};
  const auto first = renderer.render(camera, options);  // takes the impostors
  fail_unless(first.has_value() && first->pixels_hit > 100'000, "too little is seen");
  std::vector<SelectedInstance> selected;
  DetailSelector().select(scene, camera, options.width, options.height, DetailPolicy{}, selected);
  fail_unless(selected.size() > 950, "too few are in the picture");
  for (const SelectedInstance& each : selected) fail_unless(each.detail == Detail::Far, "an instance is not far");
  for (auto _ : state) benchmark::DoNotOptimize(renderer.render(camera, options));
  state.counters["pixels_hit"] = static_cast<double>(first->pixels_hit);
}
void traced(benchmark::State& state) {
  far1000(state, false);
}
void from_impostors(benchmark::State& state) {
  far1000(state, true);
}
BENCHMARK(traced)->Name("render/far1000/traced")->Unit(benchmark::kMillisecond)->Iterations(5);
BENCHMARK(from_impostors)->Name("render/far1000/impostors")->Unit(benchmark::kMillisecond)->Iterations(5);

}  // namespace
}  // namespace quoin
