// scene/select10000: selects the visible instances of a scene of 10,000 instances of mixed sizes, and their levels of
// detail.

#include <array>
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <vector>

#include <benchmark/benchmark.h>

#include <quoin/scene/level_of_detail.h>

#include "scene/tracer/mixed_scene_for_tests.h"

namespace quoin {
namespace {

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
