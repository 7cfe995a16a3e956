// solid/*: physics shapes of a 512x128x512 terrain of 128 chunks, with caves, from scratch and after an edit.

#include <quoin/scene/solid_shapes.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>

#include <benchmark/benchmark.h>

#include "bench/workloads.h"

namespace quoin {
namespace {

const Grid& terrain() {
  static const Grid made = workloads::cave_terrain();
  return made;
}

// Checks before timing: the boxes contain as many voxels as the world.
void check(const SolidShapes& shapes, const Grid& world) {
  std::int64_t voxels = 0;
  for (const IVec3 chunk : world.chunks()) {
    for (const IBox& box : shapes.boxes(chunk)) voxels += std::int64_t{box.size().x} * box.size().y * box.size().z;
  }
  if (voxels == world.voxel_count()) return;
  std::fprintf(stderr, "solid benchmark: boxes hold %lld voxels of %lld\n", static_cast<long long>(voxels),
               static_cast<long long>(world.voxel_count()));
  std::exit(1);
}

void make(benchmark::State& state, bool boxes) {
  const Grid& world = terrain();
  const VoxelRegistry types = workloads::three_types();
  std::size_t shapes_made = 0;
  std::size_t bytes = 0;
  for (auto _ : state) {
    SolidShapes shapes({.boxes = boxes, .faces = !boxes});
    shapes.update(world, types, {1});
    if (boxes) check(shapes, world);
    shapes_made = 0;
    for (const IVec3 chunk : world.chunks()) shapes_made += shapes.boxes(chunk).size() + shapes.faces(chunk).size();
    bytes = shapes.bytes();
  }
  const auto chunks = static_cast<double>(world.chunk_count());
  state.counters["chunks"] = chunks;
  state.counters["a_chunk"] = static_cast<double>(shapes_made) / chunks;
  state.counters["bytes"] = static_cast<double>(bytes);
}
BENCHMARK_CAPTURE(make, boxes, true)->Name("solid/boxes")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(make, faces, false)->Name("solid/faces")->Unit(benchmark::kMillisecond);

void edit(benchmark::State& state) {
  Grid world = terrain().snapshot();
  const VoxelRegistry types = workloads::three_types();
  SolidShapes shapes;
  shapes.update(world, types, {1});
  int step = 0;
  for (auto _ : state) {
    world.set({200 + step % 50, 20, 200}, step / 50 % 2 == 0 ? kAir : VoxelType{1});
    shapes.update(world, types, {1});
    ++step;
  }
  check(shapes, world);
}
BENCHMARK(edit)->Name("solid/edit")->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace quoin
