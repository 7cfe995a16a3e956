// light/propagated/*: sky and lamps of a 512x128x512 terrain of 128 chunks, with caves and a lamp in one of 2,000 cave
// voxels, from scratch and after edits; also the sky of the same terrain without caves.
// light/propagated/streamed/ORDER/N/AIR: the same terrain under AIR chunks of air, loaded in an order, with an update
// after each N chunks.

#include <quoin/render/propagated_light.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <utility>
#include <vector>

#include <benchmark/benchmark.h>

#include <quoin/mesh/blocky.h>

#include "bench/workloads.h"

namespace quoin {
namespace {

constexpr VoxelType kLamp = 4;

struct World {
  Grid grid;
  VoxelRegistry types = workloads::three_types();
};

// `lamps`: adds lamps of two colours in the caves.
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

World plain_world() {
  World world;
  world.grid.edit(workloads::kCaveTerrain, [](IVec3 v, VoxelType) { return workloads::cave_terrain_rock(v); });
  world.grid.compact();
  return world;
}

void first(benchmark::State& state, const World& world) {
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
void plain(benchmark::State& state) {
  first(state, plain_world());
}
void sky(benchmark::State& state) {
  first(state, made_world(false));
}
void sky_and_lamps(benchmark::State& state) {
  first(state, made_world(true));
}
BENCHMARK(plain)->Name("light/propagated/plain")->Unit(benchmark::kMillisecond);
BENCHMARK(sky)->Name("light/propagated/sky")->Unit(benchmark::kMillisecond);
BENCHMARK(sky_and_lamps)->Name("light/propagated/sky_and_lamps")->Unit(benchmark::kMillisecond);

// Loads the chunks of a world, and air above them, into a partial grid.
void stream(const World& world, const std::vector<IVec3>& order, std::size_t step, PropagatedLight& light) {
  Grid grid;
  grid.make_partial();
  for (std::size_t i = 0; i < order.size(); ++i) {
    const Chunk* voxels = world.grid.find_chunk(order[i]);
    grid.load_chunk(order[i], voxels == nullptr ? Chunk() : *voxels);
    if ((i + 1) % step == 0 || i + 1 == order.size()) light.update(grid, world.types, {1});
  }
}

// Rank of a chunk in an order of arrival; equal ranks arrive by z, y and x.
using ArrivalRank = int (*)(IVec3);
int from_near(IVec3 c) {
  return (c.x - 4) * (c.x - 4) + c.y * c.y + (c.z - 4) * (c.z - 4);
}
int from_far(IVec3 c) {
  return -from_near(c);
}
int from_above(IVec3 c) {
  return -c.y;
}
int from_below(IVec3 c) {
  return c.y;
}
int by_column(IVec3 c) {
  return c.x + 8 * c.z;
}
int at_random(IVec3 c) {
  return static_cast<int>(static_cast<std::uint32_t>(c.x + 8 * c.z + 64 * c.y + 1) * 2'654'435'761U >> 8);
}

// Arguments: chunks per update, chunks of air. Counter `rows_of_at_once`: visited rows, relative to the light of the
// whole world at once.
void streamed(benchmark::State& state, ArrivalRank rank) {
  const World world = made_world(true);
  PropagatedLight once;
  once.update(world.grid, world.types, {1});
  const int height = 2 + static_cast<int>(state.range(1));
  std::vector<IVec3> order;
  for (int z = 0; z < 8; ++z) {
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < 8; ++x) order.push_back({x, y, z});
    }
  }
  std::stable_sort(order.begin(), order.end(), [&](IVec3 a, IVec3 b) { return rank(a) < rank(b); });
  const auto step = static_cast<std::size_t>(state.range(0));
  PropagatedLight light;
  stream(world, order, step, light);
  std::array<std::uint16_t, kChunkEdge> row;
  std::array<std::uint16_t, kChunkEdge> expected;
  for (int z = -64; z < 576; ++z) {
    for (int y = -64; y < 192; ++y) {
      for (int x = -64; x < 576; x += kChunkEdge) {
        light.read_row({x, y, z}, row);
        once.read_row({x, y, z}, expected);
        if (row == expected) continue;
        std::fprintf(stderr, "light benchmark: streamed light differs at %d %d %d\n", x, y, z);
        std::exit(1);
      }
    }
  }
  state.counters["rows_of_at_once"] =
      static_cast<double>(light.visited_rows()) / static_cast<double>(once.visited_rows());
  for (auto _ : state) {
    PropagatedLight again;
    stream(world, order, step, again);
  }
}
void stream_steps(benchmark::internal::Benchmark* of) {
  of->ArgsProduct({{1, 16}, {4, 8, 16}})->Unit(benchmark::kMillisecond);
}
BENCHMARK_CAPTURE(streamed, near, from_near)->Name("light/propagated/streamed/near")->Apply(stream_steps);
BENCHMARK_CAPTURE(streamed, far, from_far)->Name("light/propagated/streamed/far")->Apply(stream_steps);
BENCHMARK_CAPTURE(streamed, above, from_above)->Name("light/propagated/streamed/above")->Apply(stream_steps);
BENCHMARK_CAPTURE(streamed, below, from_below)->Name("light/propagated/streamed/below")->Apply(stream_steps);
BENCHMARK_CAPTURE(streamed, columns, by_column)->Name("light/propagated/streamed/columns")->Apply(stream_steps);
BENCHMARK_CAPTURE(streamed, random, at_random)->Name("light/propagated/streamed/random")->Apply(stream_steps);

// Returns positions in caves, or in their walls where a lamp shines at them.
std::vector<IVec3> places_in_caves(const World& world, const PropagatedLight& light, bool in_walls) {
  constexpr std::size_t kPlaces = 64;
  std::vector<IVec3> places;
  std::uint32_t random = 7;
  const auto below = [&](std::uint32_t n) {
    random = random * 1'664'525U + 1'013'904'223U;
    return static_cast<int>((random >> 8) % n);
  };
  while (places.size() < kPlaces) {
    const IVec3 at{32 + below(448), 5 + below(30), 32 + below(448)};
    const VoxelType type = world.grid.get(at);
    const bool is_lit_wall = type != kAir && type < kLamp && light.at(at + IVec3(0, 1, 0)).red > 3;
    if (in_walls ? is_lit_wall : type == kAir) places.push_back(at);
  }
  return places;
}

// Alternates between placing and removing, at one position after another; each counts as an iteration.
void edits_in_caves(benchmark::State& state, bool in_walls, VoxelType type) {
  World world = made_world(true);
  PropagatedLight light;
  light.update(world.grid, world.types, {1});
  const std::vector<IVec3> places = places_in_caves(world, light, in_walls);
  VoxelType before = kAir;
  std::size_t done = 0;
  for (auto _ : state) {
    const IVec3 at = places[done / 2 % places.size()];
    if (done % 2 == 0) before = world.grid.get(at);
    world.grid.set(at, done % 2 == 0 ? type : before);
    light.update(world.grid, world.types, {1});
    ++done;
  }
}
BENCHMARK_CAPTURE(edits_in_caves, lamps, false, kLamp)
    ->Name("light/propagated/lamps_in_caves")
    ->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(edits_in_caves, walls, true, kAir)
    ->Name("light/propagated/dug_in_caves")
    ->Unit(benchmark::kMicrosecond);

// Places or removes a lamp in the middle of a chunk, until all chunks with lit faces are split again.
void edit_to_mesh(benchmark::State& state) {
  World world = made_world(true);
  PropagatedLight light;
  light.update(world.grid, world.types, {1});
  ChangeCursor lit;
  static_cast<void>(light.changes_since(lit));
  BlockyMesher mesher;
  QuadBuffer quads;
  QuadBuffer split;
  std::vector<std::uint16_t> levels;
  bool is_there = false;
  for (auto _ : state) {
    is_there = !is_there;
    world.grid.set({224, 24, 224}, is_there ? kLamp : kAir);
    light.update(world.grid, world.types, {1});
    for (const ChunkChange& change : light.changes_since(lit).items_unless_all()) {
      mesher.mesh(world.grid.neighbourhood(change.chunk), world.types, {}, quads);
      light.split(quads, change.chunk, split, levels);
    }
    benchmark::DoNotOptimize(levels.data());
  }
}
BENCHMARK(edit_to_mesh)->Name("light/propagated/edit_to_mesh")->Unit(benchmark::kMicrosecond);

// Splits all chunks once.
void split(benchmark::State& state) {
  const World world = made_world(true);
  PropagatedLight light;
  light.update(world.grid, world.types, {1});
  BlockyMesher mesher;
  std::vector<std::pair<IVec3, QuadBuffer>> meshes;
  for (const IVec3 chunk : world.grid.chunks()) {
    mesher.mesh(world.grid.neighbourhood(chunk), world.types, {}, meshes.emplace_back(chunk, QuadBuffer()).second);
  }
  QuadBuffer out;
  std::vector<std::uint16_t> levels;
  for (auto _ : state) {
    for (const auto& [chunk, quads] : meshes) light.split(quads, chunk, out, levels);
  }
}
BENCHMARK(split)->Name("light/propagated/split")->Unit(benchmark::kMillisecond);

// Alternates between placing and removing; each counts as an iteration.
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
BENCHMARK_CAPTURE(edit, roof, IVec3(230, 100, 230), VoxelType{1})
    ->Name("light/propagated/roof")
    ->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace quoin
