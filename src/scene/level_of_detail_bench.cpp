// scene/select10000: what is in the picture of a scene of 10,000 instances of mixed sizes, and in what detail.

#include <array>
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <random>
#include <vector>

#include <benchmark/benchmark.h>
#include <glm/geometric.hpp>

#include <quoin/scene/level_of_detail.h>

namespace quoin {
namespace {

Scene mixed_scene(std::int64_t count) {
  Scene scene;
  std::mt19937 random(11);
  std::uniform_real_distribution<double> share(-1.0, 1.0);
  std::vector<GridHandle> grids;
  for (const int edge : {8, 30, 90, 200, 500}) {
    SceneGrid grid;
    grid.grid.fill_box({0, 0, 0}, IVec3(edge - 1), 1);
    grids.push_back(scene.add_grid(std::move(grid)));
  }
  for (std::int64_t i = 0; i < count; ++i) {
    Instance instance;
    instance.grid = grids[static_cast<std::size_t>(i) % grids.size()];
    instance.position = DVec3(share(random), 0.1 * share(random), share(random)) * 6000.0;
    instance.rotation = glm::normalize(DQuat(share(random), share(random), share(random), 1.1));
    scene.add_instance(instance);
  }
  return scene;
}

void select(benchmark::State& state) {
  const Scene scene = mixed_scene(state.range(0));
  const Camera camera = look_at({0, 300, 5000}, {0, 0, 0}, std::numbers::pi / 3).value();
  DetailSelector selector;
  std::vector<SelectedInstance> selected;
  selector.select(scene, camera, 1920, 1080, {}, selected);
  std::array<double, 3> counts{};
  for (const SelectedInstance& each : selected) ++counts.at(static_cast<std::size_t>(each.detail));
  if (counts[0] == 0.0 || counts[1] == 0.0 || counts[2] == 0.0) {
    std::fprintf(stderr, "select benchmark: a detail is missing\n");
    std::exit(1);
  }
  for (auto _ : state) {
    selector.select(scene, camera, 1920, 1080, {}, selected);
    benchmark::DoNotOptimize(selected.data());
  }
  state.counters["near"] = counts[0];
  state.counters["mid"] = counts[1];
  state.counters["far"] = counts[2];
}
BENCHMARK(select)->Name("scene/select10000")->Arg(10'000)->Arg(20'000)->Arg(40'000)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace quoin
