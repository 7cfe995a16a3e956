// connected/*: finds the pieces of a 512x128x512 terrain of 128 chunks, with caves, from scratch and after an edit.
// connected/mass/*: mass, centre and inertia of a ship and of a ball of 130,000 voxels.

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

// A hollow ship of some 130,000 voxels of three types.
const Grid& ship() {
  static const Grid made = [] {
    Grid grid;
    grid.fill_box({{-20, -10, -100}, {60, 30, 100}}, 1);
    grid.fill_box({{-17, -8, -97}, {57, 28, 97}}, kAir);
    for (int deck = 0; deck < 2; ++deck) grid.fill_box({{-17, 2 + 12 * deck, -97}, {57, 4 + 12 * deck, 97}}, 2);
    for (int wall = -90; wall < 90; wall += 36) grid.fill_box({{-17, -8, wall}, {57, 28, wall + 1}}, 3);
    return grid;
  }();
  return made;
}

double density_of(VoxelType type) {
  return 0.5 * type;
}

// The loop that a program would write without the function.
double mass_by_voxel(const Grid& grid, DVec3& first, DVec3& squares, DVec3& mixed) {
  double mass = 0.0;
  grid.for_each([&](IVec3 voxel, VoxelType type) {
    const DVec3 at = DVec3(voxel) + 0.5;
    const double own = density_of(type);
    mass += own;
    first += own * at;
    squares += own * at * at;
    mixed += own * DVec3(at.y * at.z, at.x * at.z, at.x * at.y);
  });
  return mass;
}

void mass(benchmark::State& state, bool is_plain) {
  ConnectedPieces pieces;
  pieces.update(ship(), {1});
  double total = 0.0;
  for (auto _ : state) {
    if (is_plain) {
      DVec3 first(0.0);
      DVec3 squares(0.0);
      DVec3 mixed(0.0);
      total = mass_by_voxel(ship(), first, squares, mixed);
      benchmark::DoNotOptimize(first);
      benchmark::DoNotOptimize(squares);
      benchmark::DoNotOptimize(mixed);
    } else {
      const MassProperties found = mass_properties(pieces, 0, density_of);
      benchmark::DoNotOptimize(&found);
      total = found.mass;
    }
  }
  if (pieces.size() != 1 || total != mass_properties(ship(), density_of).mass) state.SkipWithError("another mass");
  state.counters["voxels"] = static_cast<double>(ship().voxel_count());
}
BENCHMARK_CAPTURE(mass, of_piece, false)->Name("connected/mass/piece")->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(mass, plain_loop, true)->Name("connected/mass/plain_loop")->Unit(benchmark::kMicrosecond);

void mass_of_field(benchmark::State& state) {
  static const DensityGrid field = [] {
    DensityGrid made;
    made.add_sphere({5.0, 7.0, 9.0}, 31.4, 1);
    return made;
  }();
  MassProperties found;
  for (auto _ : state) {
    found = mass_properties(field, density_of);
    benchmark::DoNotOptimize(found);
  }
  const double wanted = 0.5 * 4.0 / 3.0 * 3.14159265 * 31.4 * 31.4 * 31.4;
  if (std::abs(found.mass - wanted) > 0.01 * wanted) state.SkipWithError("another mass");
}
BENCHMARK(mass_of_field)->Name("connected/mass/field")->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace quoin
