// light/propagated/*: sky and lamps of a 512x128x512 terrain of 128 chunks, with caves and a lamp in 2,000 voxels of
// these, at first and after edits.

#include <quoin/light/propagated_light.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>

#include <benchmark/benchmark.h>

#include "bench/workloads.h"

namespace quoin {
namespace {

constexpr VoxelType kLamp = 4;

struct World {
  Grid grid;
  VoxelRegistry types = workloads::three_types();
};

// `lamps`: in caves, of two colours.
World made_world(bool lamps) {
  World world;
  VoxelProperties lamp;
  lamp.emission = 1.0F;
  for (const Rgba8 colour : {Rgba8{255, 200, 120, 255}, Rgba8{80, 120, 255, 255}}) {
    lamp.colour = colour;
    if (!world.types.add(lamp)) std::exit(1);
  }
  std::uint32_t random = 1;
  world.grid.edit(workloads::kCaveTerrain, [&](IVec3 v, VoxelType) {
    const VoxelType type = workloads::cave_terrain_rock(v);
    if (!workloads::is_cave(v)) return type;
    random = random * 1'664'525U + 1'013'904'223U;
    const bool is_lamp = lamps && type != kAir && (random >> 8) % 2'000 == 0;
    return is_lamp ? static_cast<VoxelType>(kLamp + (random >> 30 & 1U)) : kAir;
  });
  world.grid.compact();
  return world;
}

void first(benchmark::State& state, bool lamps) {
  const World world = made_world(lamps);
  std::size_t bytes = 0;
  for (auto _ : state) {
    PropagatedLight light;
    light.update(world.grid, world.types, {1});
    bytes = light.bytes();
  }
  const auto chunks = static_cast<double>(world.grid.chunk_count());
  state.counters["chunks"] = chunks;
  state.counters["bytes_a_voxel"] = static_cast<double>(bytes) / static_cast<double>(world.grid.voxel_count());
}
BENCHMARK_CAPTURE(first, sky, false)->Name("light/propagated/sky")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(first, lamps, true)->Name("light/propagated/sky_and_lamps")->Unit(benchmark::kMillisecond);

// Placed and removed by turns; each is one iteration.
void edit(benchmark::State& state, IVec3 at, VoxelType type) {
  World world = made_world(true);
  PropagatedLight light;
  light.update(world.grid, world.types, {1});
  const VoxelType before = world.grid.get(at);
  const LightLevels first = light.at(at + IVec3(0, 1, 0));
  bool is_there = false;
  for (auto _ : state) {
    is_there = !is_there;
    world.grid.set(at, is_there ? type : before);
    light.update(world.grid, world.types, {1});
  }
  world.grid.set(at, before);
  light.update(world.grid, world.types, {1});
  if (light.at(at + IVec3(0, 1, 0)) == first) return;
  std::fprintf(stderr, "light benchmark: edits that were taken back leave another light\n");
  std::exit(1);
}
BENCHMARK_CAPTURE(edit, lamp, IVec3(200, 24, 216), kLamp)->Name("light/propagated/lamp")->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(edit, ground, IVec3(230, 40, 230), kAir)->Name("light/propagated/dig")->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(edit, roof, IVec3(230, 100, 230), VoxelType{1})
    ->Name("light/propagated/roof")
    ->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace quoin
