// connected/*: finds the pieces of a 512x128x512 terrain of 128 chunks, with caves, from scratch and after an edit.

#include <quoin/grid/connected.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>

#include <benchmark/benchmark.h>
#include <quoin/core/direction.h>

#include "bench/workloads.h"

namespace quoin {
namespace {

const Grid& terrain() {
  static const Grid made = workloads::cave_terrain();
  return made;
}

// Checks before timing: the number of pieces matches a flood fill.
void check(std::size_t pieces, std::size_t expected) {
  if (pieces == expected) return;
  std::fprintf(stderr, "connected benchmark: %zu pieces, expected %zu\n", pieces, expected);
  std::exit(1);
}

void find(benchmark::State& state, Connectivity connectivity, std::size_t expected) {
  const Grid& world = terrain();
  ConnectedOptions options;
  options.connectivity = connectivity;
  std::size_t pieces = 0;
  std::size_t bytes = 0;
  for (auto _ : state) {
    ConnectedPieces found(options);
    found.update(world, {1});
    pieces = found.size();
    bytes = found.bytes();
  }
  check(pieces, expected);
  state.counters["chunks"] = static_cast<double>(world.chunk_count());
  state.counters["voxels"] = static_cast<double>(world.voxel_count());
  state.counters["pieces"] = static_cast<double>(pieces);
  state.counters["bytes"] = static_cast<double>(bytes);
}
BENCHMARK_CAPTURE(find, faces, Connectivity::Faces6, 114)->Name("connected/find/faces")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(find, corners, Connectivity::Corners26, 2)
    ->Name("connected/find/corners")
    ->Unit(benchmark::kMillisecond);

// Measures a chunk of noise, a third of it solid: about ten thousand pieces.
void find_in_noise(benchmark::State& state) {
  Grid world;
  std::uint64_t s = 42;
  world.edit(kWholeChunk, [&](IVec3, VoxelType) {
    s ^= s << 13;
    s ^= s >> 7;
    s ^= s << 17;
    return static_cast<VoxelType>((s >> 32) % 3 == 0);
  });
  std::size_t pieces = 0;
  std::size_t bytes = 0;
  for (auto _ : state) {
    ConnectedPieces found;
    found.update(world, {1});
    pieces = found.size();
    bytes = found.bytes();
  }
  state.counters["pieces"] = static_cast<double>(pieces);
  state.counters["bytes"] = static_cast<double>(bytes);
}
BENCHMARK(find_in_noise)->Name("connected/find/noise")->Unit(benchmark::kMillisecond);

// Removes a sphere and restores it, and searches for loose pieces each time.
void follow(benchmark::State& state) {
  Grid world = terrain().snapshot();
  ConnectedPieces pieces;
  pieces.update(world, {1});
  const IBox ground{{0, 0, 0}, {512, 1, 512}};
  bool out = true;
  std::size_t loose = 0;
  for (auto _ : state) {
    state.PauseTiming();
    world.fill_sphere({250.0, 70.0, 250.0}, 8.0, out ? kAir : VoxelType{1});
    out = !out;
    state.ResumeTiming();
    pieces.update(world, {1});
    loose += pieces.not_touching(ground).size();
  }
  benchmark::DoNotOptimize(loose);
}
BENCHMARK(follow)->Name("connected/follow")->Unit(benchmark::kMicrosecond);

// The simple method: a flood fill by voxels of the same terrain.
void flood(benchmark::State& state) {
  const Grid& world = terrain();
  std::size_t pieces = 0;
  for (auto _ : state) {
    std::vector<std::uint8_t> is_left(std::size_t{512} * 128 * 512);
    const auto index = [](IVec3 v) { return static_cast<std::size_t>((v.z * 128 + v.y) * 512 + v.x); };
    world.for_each([&](IVec3 v, VoxelType) { is_left[index(v)] = 1; });
    pieces = 0;
    std::vector<IVec3> open;
    world.for_each([&](IVec3 start, VoxelType) {
      if (is_left[index(start)] == 0) return;
      ++pieces;
      is_left[index(start)] = 0;
      open.push_back(start);
      while (!open.empty()) {
        const IVec3 at = open.back();
        open.pop_back();
        for (const Direction d : kDirections) {
          const IVec3 next = at + normal_of(d);
          if (!workloads::kCaveTerrain.contains(next) || is_left[index(next)] == 0) continue;
          is_left[index(next)] = 0;
          open.push_back(next);
        }
      }
    });
  }
  check(pieces, 114);
}
BENCHMARK(flood)->Name("connected/flood_fill")->Unit(benchmark::kMillisecond)->Iterations(2);

}  // namespace
}  // namespace quoin
