// copy/*: copies, turns and mirrors the 256x128x256 terrain into another grid; a time covers all 32 chunks.

#include <quoin/grid/copy_box.h>

#include <cstdio>
#include <cstdlib>

#include <benchmark/benchmark.h>

#include "bench/workloads.h"

namespace quoin {
namespace {

constexpr IBox kAll{{0, 0, 0}, {256, 128, 256}};

const Grid& world() {
  static const Grid grid = [] {
    Grid made;
    made.edit(kAll, [](IVec3 v, VoxelType) { return workloads::terrain_type(v.y, workloads::height(v.x, v.z)); });
    made.compact();
    return made;
  }();
  return grid;
}

void check(const Grid& copy) {
  if (copy.voxel_count() == world().voxel_count()) return;
  std::fprintf(stderr, "copy benchmark: %lld voxels\n", static_cast<long long>(copy.voxel_count()));
  std::exit(1);
}

void copy(benchmark::State& state, IVec3 to_min, AxisOrientation orientation) {
  for (auto _ : state) {
    Grid to;
    copy_box(world(), kAll, to, to_min, orientation);
    state.PauseTiming();
    check(to);
    state.ResumeTiming();
  }
  state.counters["seconds_per_voxel"] = benchmark::Counter(
      256.0 * 128.0 * 256.0, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}
BENCHMARK_CAPTURE(copy, chunks, IVec3(640, 0, 64), AxisOrientation())
    ->Name("copy/by_chunks")
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(copy, moved, IVec3(7, 3, 11), AxisOrientation())->Name("copy/moved")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(copy, mirrored, IVec3(0), AxisOrientation::mirror(0))
    ->Name("copy/mirrored_x")
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(copy, about_x, IVec3(0), AxisOrientation::quarter_turns(0, 1))
    ->Name("copy/turned_x")
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(copy, about_y, IVec3(0), AxisOrientation::quarter_turns(1, 1))
    ->Name("copy/turned_y")
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(copy, about_z, IVec3(0), AxisOrientation::quarter_turns(2, 1))
    ->Name("copy/turned_z")
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(copy, moved_about_y, IVec3(7, 3, 11), AxisOrientation::quarter_turns(1, 1))
    ->Name("copy/turned_y_and_moved")
    ->Unit(benchmark::kMillisecond);

// The voxel loop that a game would write instead of copy_box.
void copy_voxels(benchmark::State& state) {
  for (auto _ : state) {
    Grid to;
    GridWriter writer(to);
    world().for_each([&](IVec3 v, VoxelType type) { writer.set(IVec3(v.z, v.y, 255 - v.x) + IVec3(7, 3, 11), type); });
    writer.flush();
    state.PauseTiming();
    check(to);
    state.ResumeTiming();
  }
}
BENCHMARK(copy_voxels)->Name("copy/voxel_by_voxel/turned_y_and_moved")->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace quoin
