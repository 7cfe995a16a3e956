// light/surface/*: light at the quads of a 512x128x512 terrain of 128 chunks, with caves and a lamp in one of 2,000
// cave voxels, and at the vertices of its smooth surface.

#include <quoin/core/memory.h>
#include <quoin/render/surface_light.h>

#include <cstdlib>
#include <optional>

#include <benchmark/benchmark.h>

#include <quoin/grid/voxel_field.h>
#include <quoin/mesh/blocky.h>
#include <quoin/mesh/smooth_mesh.h>

#include "bench/workloads.h"

namespace quoin {
namespace {

struct World {
  Grid grid;
  VoxelRegistry types = workloads::three_types();
  PropagatedLight light;
  std::vector<QuadBuffer> quads;  // by chunk
};

void add_lamps(World& world) {
  VoxelProperties lamp;
  lamp.emission = 1.0F;
  for (const Rgba8 colour : {Rgba8{255, 200, 120, 255}, Rgba8{80, 120, 255, 255}}) {
    lamp.colour = colour;
    if (!world.types.add(lamp)) std::exit(1);
  }
}

const World& world_with_lamps() {
  static const World made = [] {
    World world;
    add_lamps(world);
    std::uint32_t random = 1;
    world.grid.edit(workloads::kCaveTerrain, [&](IVec3 v, VoxelType) {
      const VoxelType type = workloads::cave_terrain_rock(v);
      if (!workloads::is_cave(v)) return type;
      random = random * 1'664'525U + 1'013'904'223U;
      const bool is_lamp = type != kAir && (random >> 8) % 2'000 == 0;
      return is_lamp ? static_cast<VoxelType>(4 + (random >> 30 & 1U)) : kAir;
    });
    world.grid.compact();
    world.light.update(world.grid, world.types);
    BlockyMesher mesher;
    for (const IVec3 chunk : world.grid.chunks()) {
      mesher.mesh(world.grid.neighbourhood(chunk), world.types, {}, world.quads.emplace_back());
    }
    return world;
  }();
  return made;
}

// Without `merging`: light levels of whole faces.
void split(benchmark::State& state, std::optional<LightMerging> merging) {
  const World& world = world_with_lamps();
  SurfaceLight surface(world.light, world.grid, world.types);
  const std::vector<IVec3> chunks = world.grid.chunks();
  QuadBuffer lit;
  BlockVector<FaceLight> corners;
  std::vector<std::uint16_t> levels;
  std::size_t before = 0;
  std::size_t after = 0;
  for (auto _ : state) {
    before = after = 0;
    for (std::size_t i = 0; i < chunks.size(); ++i) {
      if (merging) {
        surface.split(world.quads[i], chunks[i], *merging, lit, corners);
      } else {
        world.light.split(world.quads[i], chunks[i], lit, levels);
      }
      before += world.quads[i].size();
      after += lit.size();
    }
  }
  state.counters["quads_before"] = static_cast<double>(before);
  state.counters["quads"] = static_cast<double>(after);
  state.counters["chunks"] = static_cast<double>(chunks.size());
}
BENCHMARK_CAPTURE(split, flat, std::nullopt)->Name("light/surface/flat")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(split, constant, LightMerging::Constant)
    ->Name("light/surface/constant")
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(split, linear, LightMerging::Linear)->Name("light/surface/linear")->Unit(benchmark::kMillisecond);

void vertices(benchmark::State& state) {
  const World& world = world_with_lamps();
  const auto field = field_from_grid(world.grid);
  if (!field) std::exit(1);
  const auto mesh = build_smooth_mesh(*field, world.types);
  if (!mesh) std::exit(1);
  SurfaceLight surface(world.light, world.grid, world.types);
  std::vector<MeanLevels> levels(mesh->positions.size());
  for (auto _ : state) surface.read({mesh->positions, mesh->normals}, levels);
  state.counters["vertices"] = static_cast<double>(levels.size());
}
BENCHMARK(vertices)->Name("light/surface/vertices")->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace quoin
