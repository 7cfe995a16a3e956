// grid/*: memory of the 256x128x256 terrain and the cost of getting and setting its voxels.

#include <quoin/grid/grid.h>
#include <quoin/grid/voxel_field.h>

#include <cstdio>
#include <cstdlib>
#include <random>
#include <utility>
#include <vector>

#include <benchmark/benchmark.h>

#include "bench/workloads.h"

namespace quoin {
namespace {

constexpr int kWidth = 256;
constexpr int kHeight = 128;
constexpr std::int64_t kSolid = 2'062'206;

const Grid& world() {
  static const Grid grid = [] {
    Grid g;
    g.edit({IVec3{0}, IVec3{kWidth, kHeight, kWidth}},
           [](IVec3 v, VoxelType) { return static_cast<VoxelType>(v.y <= workloads::height(v.x, v.z)); });
    g.compact();
    if (g.voxel_count() != kSolid) {
      std::fprintf(stderr, "grid benchmark: %lld voxels, expected %lld\n", static_cast<long long>(g.voxel_count()),
                   static_cast<long long>(kSolid));
      std::exit(1);
    }
    return g;
  }();
  return grid;
}

void memory(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(world().bytes());
  state.counters["bytes"] = static_cast<double>(world().bytes());
  state.counters["voxels"] = static_cast<double>(kSolid);
}
BENCHMARK(memory)->Name("grid/world");

void get_sequential(benchmark::State& state) {
  GridReader reader(world());
  for (auto _ : state) {
    std::int64_t sum = 0;
    for (int z = 0; z < kWidth; ++z) {
      for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x) sum += reader.get({x, y, z});
      }
    }
    if (sum != kSolid) std::exit(1);
  }
  state.counters["seconds_per_get"] = benchmark::Counter(
      double{kWidth} * kHeight * kWidth, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}
BENCHMARK(get_sequential)->Name("grid/get_sequential")->Unit(benchmark::kMillisecond);

// Each position depends on the voxel read before.
void get_dependent(benchmark::State& state) {
  constexpr int kGets = 1'000'000;
  const Grid& grid = world();
  for (auto _ : state) {
    std::uint32_t s = 12'345;
    for (int i = 0; i < kGets; ++i) {
      const IVec3 at{static_cast<int>(s >> 8 & 255U), static_cast<int>(s >> 16 & 127U), static_cast<int>(s >> 24)};
      s = s * 1'664'525U + 1'013'904'223U + grid.get(at);
    }
    benchmark::DoNotOptimize(s);
  }
  state.counters["seconds_per_get"] =
      benchmark::Counter(double{kGets}, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}
BENCHMARK(get_dependent)->Name("grid/get_dependent")->Unit(benchmark::kMillisecond);

// The same walk through a plain array of 8,388,608 bytes.
void get_dependent_dense(benchmark::State& state) {
  constexpr int kGets = 1'000'000;
  std::vector<std::uint8_t> dense;
  for (int z = 0; z < kWidth; ++z) {
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) dense.push_back(static_cast<std::uint8_t>(world().get({x, y, z})));
    }
  }
  for (auto _ : state) {
    std::uint32_t s = 12'345;
    for (int i = 0; i < kGets; ++i) {
      const std::size_t at =
          (static_cast<std::size_t>(s >> 24) * kHeight + (s >> 16 & 127U)) * kWidth + (s >> 8 & 255U);
      s = s * 1'664'525U + 1'013'904'223U + dense[at];
    }
    benchmark::DoNotOptimize(s);
  }
  state.counters["seconds_per_get"] =
      benchmark::Counter(double{kGets}, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}
BENCHMARK(get_dependent_dense)->Name("grid/dense/get_dependent")->Unit(benchmark::kMillisecond);

void set_sequential(benchmark::State& state) {
  constexpr int kEdge = 128;
  for (auto _ : state) {
    Grid grid;
    GridWriter writer(grid);
    for (int z = 0; z < kEdge; ++z) {
      for (int y = 0; y < kEdge; ++y) {
        for (int x = 0; x < kEdge; ++x) writer.set({x, y, z}, static_cast<VoxelType>(1 + (x & y & 1)));
      }
    }
    writer.flush();
    if (grid.voxel_count() != kEdge * kEdge * kEdge) std::exit(1);
  }
  state.counters["seconds_per_set"] = benchmark::Counter(
      double{kEdge} * kEdge * kEdge, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}
BENCHMARK(set_sequential)->Name("grid/set_sequential")->Unit(benchmark::kMillisecond);

// The same with one edit per voxel.
void set_alone(benchmark::State& state) {
  constexpr int kEdge = 128;
  for (auto _ : state) {
    Grid grid;
    for (int z = 0; z < kEdge; ++z) {
      for (int y = 0; y < kEdge; ++y) {
        for (int x = 0; x < kEdge; ++x) grid.set({x, y, z}, static_cast<VoxelType>(1 + (x & y & 1)));
      }
    }
    if (grid.voxel_count() != kEdge * kEdge * kEdge) std::exit(1);
  }
  state.counters["seconds_per_set"] = benchmark::Counter(
      double{kEdge} * kEdge * kEdge, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}
BENCHMARK(set_alone)->Name("grid/set_alone")->Unit(benchmark::kMillisecond);

// Sets a million voxels to random ones of `types` types and back, several times. Compares the grid's memory
// with that of a new grid.
void edits_undone(benchmark::State& state, std::uint32_t types) {
  constexpr int kEdits = 1'000'000;
  Grid grid = world().snapshot();
  std::vector<std::pair<IVec3, VoxelType>> undo(kEdits);
  std::uint64_t s = 42;
  for (auto _ : state) {
    for (auto& [at, old] : undo) {
      s ^= s << 13;
      s ^= s >> 7;
      s ^= s << 17;
      at = {static_cast<int>(s >> 8 & 255U), static_cast<int>(s >> 16 & 127U), static_cast<int>(s >> 24 & 255U)};
      old = grid.get(at);
      grid.set(at, static_cast<VoxelType>((s >> 32) % types));
    }
    for (auto it = undo.rbegin(); it != undo.rend(); ++it) grid.set(it->first, it->second);
    if (grid.voxel_count() != kSolid) std::exit(1);
  }
  state.counters["bytes"] = static_cast<double>(grid.bytes());
  state.counters["bytes_of_a_new_one"] = static_cast<double>(world().bytes());
  state.counters["seconds_per_set"] =
      benchmark::Counter(2.0 * kEdits, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}
BENCHMARK_CAPTURE(edits_undone, few, 4U)->Name("grid/edits_undone/4_types")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(edits_undone, many, 60'000U)->Name("grid/edits_undone/60000_types")->Unit(benchmark::kMillisecond);

// Sand that falls in 289 chunks: two voxels for each of 9,400 grains, in an order in which neighbours in the list lie
// in different chunks. A snapshot shares all chunks.
void set_list(benchmark::State& state, Threads threads) {
  constexpr int kChunks = 17;
  constexpr int kGrains = 9'400;
  Grid grid;
  for (int z = 0; z < kChunks * kChunkEdge; ++z) {
    for (int x = 0; x < kChunks * kChunkEdge; ++x) {
      const int height = static_cast<int>(workloads::height(x, z)) % 40;
      grid.fill_box({{x, 0, z}, {x + 1, height + 1, z + 1}}, static_cast<VoxelType>(1 + (x + z) % 7));
    }
  }
  std::mt19937 random(5);
  std::vector<IVec3> grains(kGrains);
  const auto below = [&](int end) { return static_cast<int>(random() % static_cast<unsigned>(end)); };
  for (IVec3& grain : grains) grain = {below(kChunks * kChunkEdge), 46 + below(16), below(kChunks * kChunkEdge)};
  std::vector<PlacedVoxel> moves;
  for (auto _ : state) {
    state.PauseTiming();
    const Grid shown = grid.snapshot();
    moves.clear();
    for (IVec3& grain : grains) {
      moves.push_back({grain, kAir});
      grain.y = grain.y == 46 ? 62 : grain.y - 1;
      moves.push_back({grain, 9});
    }
    state.ResumeTiming();
    if (grid.set(moves, threads) == 0) std::exit(1);
  }
}
BENCHMARK_CAPTURE(set_list, one, Threads{1})->Name("grid/set_list/1_thread")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(set_list, all, Threads{})->Name("grid/set_list/threads")->Unit(benchmark::kMillisecond);

// A sphere becomes a field.
void to_field(benchmark::State& state) {
  const auto width = static_cast<int>(state.range(0));
  Grid grid;
  grid.fill_sphere(IVec3(width / 2), width / 2.0, 1);
  for (auto _ : state) {
    const auto field = field_from_grid(grid, Threads{1});
    if (!field || field->solid_count() != grid.voxel_count()) std::exit(1);
  }
}
BENCHMARK(to_field)->Name("grid/to_field")->Arg(4)->Arg(64)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace quoin
