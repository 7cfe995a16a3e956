// shapes/halve/*: one chunk of a halved grid with voxels of types with shapes, and */cubes: the same voxels as cubes.
// One thread.
//
//   ocean    water above a sea floor of hills
//   rapids   flowing water of random levels with a tenth air and a tenth stone: most shapes follow their neighbours
//   fences   a solid block of fences
//   mixed    random slabs, stairs, fences, flowers and stone, and a third air
//   town     the middle of the town

#include <quoin/grid/downsample.h>

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <utility>

#include <benchmark/benchmark.h>

#include <quoin/core/hash.h>

#include "bench/town_workload.h"

namespace quoin {
namespace {

constexpr IBox kFine{IVec3(-2), IVec3(2 * kChunkEdge + 2)};  // all that the chunk at the origin reads

struct HalvingWorld {
  VoxelRegistry types;
  Grid grid;
  IVec3 chunk{0};
};

std::uint32_t number_at(IVec3 v, std::uint32_t limit) {
  return mix_bits(mix_bits(mix_bits(static_cast<std::uint32_t>(v.x)) ^ static_cast<std::uint32_t>(v.y)) ^
                  static_cast<std::uint32_t>(v.z)) %
         limit;
}

template <class TypeAt>
void fill(Grid& grid, TypeAt&& type_at) {
  grid.edit(kFine, [&](IVec3 v, VoxelType) { return type_at(v); });
}

VoxelType add_water(VoxelRegistry& types, bool with_shapes) {
  VoxelProperties water{.name = "water", .visibility = Visibility::Transparent, .state_bits = 4};
  if (with_shapes) water.shapes = *VoxelShapes::from_rules({.neighbours = ShapeNeighbours::Fluid});
  return *types.add(std::move(water));
}

HalvingWorld ocean(bool with_shapes) {
  HalvingWorld world;
  const VoxelType stone = *world.types.add({.name = "stone"});
  const VoxelType water = add_water(world.types, with_shapes);
  fill(world.grid, [&](IVec3 v) {
    const double floor = 14.0 + 6.0 * std::sin(v.x / 17.0) + 6.0 * std::cos(v.z / 13.0);
    return v.y <= floor ? stone : v.y < 118 ? water : kAir;
  });
  return world;
}

HalvingWorld rapids(bool with_shapes) {
  HalvingWorld world;
  const VoxelType stone = *world.types.add({.name = "stone"});
  const VoxelType water = add_water(world.types, with_shapes);
  fill(world.grid, [&](IVec3 v) {
    const std::uint32_t number = number_at(v, 10);
    return number == 0 ? kAir : number == 1 ? stone : water;
  });
  world.grid.for_each([&](IVec3 v, VoxelType type) {
    if (type == water) world.grid.set_data(v, {.state = number_at(v, 8)});
  });
  return world;
}

HalvingWorld of_town_types(bool with_shapes, bool is_mixed) {
  HalvingWorld world;
  const workloads::TownTypes types(world.types, with_shapes);
  if (!is_mixed) {
    fill(world.grid, [&](IVec3) { return types.fence; });
    return world;
  }
  const std::array<VoxelType, 9> all = {kAir,         kAir,        kAir,         types.slab, types.stairs,
                                        types.stairs, types.fence, types.flower, types.wall};
  fill(world.grid, [&](IVec3 v) { return all.at(number_at(v, 9)); });
  world.grid.for_each([&](IVec3 v, VoxelType type) {
    if (type == types.stairs) world.grid.set_data(v, {.state = number_at(v, 8)});
  });
  return world;
}

HalvingWorld town(bool with_shapes) {
  HalvingWorld world;
  world.grid = workloads::town_grid(workloads::TownTypes(world.types, with_shapes));
  world.chunk = {2, 0, 2};
  return world;
}

void halve(benchmark::State& state, HalvingWorld (*make)(bool), bool with_shapes) {
  const HalvingWorld world = make(with_shapes);
  std::optional<Chunk> made;
  for (auto _ : state) made = downsample_chunk(world.grid, world.types, world.chunk);
  if (world.types.has_shapes() != with_shapes || made->non_air_count() < 10'000) {
    std::fprintf(stderr, "halving benchmark: %d cells\n", made->non_air_count());
    std::exit(1);
  }
  state.counters["cells"] = made->non_air_count();
}

HalvingWorld fences(bool with_shapes) {
  return of_town_types(with_shapes, false);
}
HalvingWorld mixed(bool with_shapes) {
  return of_town_types(with_shapes, true);
}

BENCHMARK_CAPTURE(halve, ocean, ocean, true)->Name("shapes/halve/ocean")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(halve, ocean_cubes, ocean, false)->Name("shapes/halve/ocean/cubes")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(halve, rapids, rapids, true)->Name("shapes/halve/rapids")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(halve, rapids_cubes, rapids, false)->Name("shapes/halve/rapids/cubes")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(halve, fences, fences, true)->Name("shapes/halve/fences")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(halve, fences_cubes, fences, false)->Name("shapes/halve/fences/cubes")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(halve, mixed, mixed, true)->Name("shapes/halve/mixed")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(halve, mixed_cubes, mixed, false)->Name("shapes/halve/mixed/cubes")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(halve, town, town, true)->Name("shapes/halve/town")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(halve, town_cubes, town, false)->Name("shapes/halve/town/cubes")->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace quoin
