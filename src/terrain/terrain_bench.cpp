// terrain/generate: 512x128x512 voxels, on one thread.

#include <quoin/terrain/terrain.h>

#include <cstdlib>

#include <benchmark/benchmark.h>

namespace quoin {
namespace {

void generate(benchmark::State& state) {
  VoxelRegistry registry;
  const TerrainTypes types = add_terrain_types(registry).value();
  TerrainOptions options;
  options.size = {16, 4, 16};
  std::size_t bytes = 0;
  for (auto _ : state) {
    const Grid grid = generate_terrain(options, types, {1}).value();
    bytes = grid.bytes();
    if (grid.bounds().size().x != 512) std::exit(1);
  }
  state.counters["bytes"] = static_cast<double>(bytes);
  state.counters["columns_per_second"] =
      benchmark::Counter(512.0 * 512.0, benchmark::Counter::kIsIterationInvariantRate);
}
BENCHMARK(generate)->Name("terrain/generate")->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace quoin
