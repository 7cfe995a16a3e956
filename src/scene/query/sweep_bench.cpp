// scene/sweep/*: sweeps of a player's box of 0.8x1.8x0.8 on the benchmark terrain of 256x128x256, as blocks and as a
// smooth field, plain and with dug holes, one skin above the ground. The box moves by 0.2 along the ground (level) or
// into it (down); it is upright, turned about its height, or arbitrarily rotated. Also measured: a step of walking with
// gravity, and a capsule of the same size. Times are per query.

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>
#include <glm/geometric.hpp>

#include <quoin/scene/sweep.h>

#include "bench/workloads.h"

namespace quoin {
namespace {

enum class Turn { None, Upright, Any };

struct Query {
  OrientedBox box;
  DVec3 displacement{0.0};
};

struct World {
  Scene scene;
  SceneTracer tracer;

  explicit World(SceneGrid grid) : scene(scene_of(std::move(grid))), tracer(scene, InstanceFilter::Visible, {1}) {}

  static Scene scene_of(SceneGrid grid) {
    Scene scene;
    if (!scene.types.add({}).has_value()) std::abort();
    Instance instance;
    instance.grid = scene.add_grid(std::move(grid));
    scene.add_instance(instance);
    return scene;
  }
};

constexpr IBox kBounds{IVec3{0}, IVec3{256, 128, 256}};

const World& field_world() {
  static const World world = [] {
    SceneGrid grid;
    grid.field.edit(kBounds, [](IVec3 p, DensitySample) {
      return DensitySample{static_cast<float>(p.y - workloads::smooth_height(p.x, p.z)), 1};
    });
    return World(std::move(grid));
  }();
  return world;
}

// The same ground with 400 round holes, whose rims are sharp.
const World& dug_world() {
  static const World world = [] {
    SceneGrid grid;
    grid.field = field_world().scene.grids()[field_world().scene.grids().handles().front()].field.snapshot();
    std::mt19937 random(3);
    std::uniform_real_distribution<double> share(0.0, 1.0);
    for (int i = 0; i < 400; ++i) {
      const double x = 8.0 + 240.0 * share(random);
      const double z = 8.0 + 240.0 * share(random);
      grid.field.remove_sphere({x, workloads::smooth_height(x, z), z}, 2.0 + 2.0 * share(random));
    }
    return World(std::move(grid));
  }();
  return world;
}

const World& block_world() {
  static const World world = [] {
    SceneGrid grid;
    grid.grid.edit(kBounds, [](IVec3 p, VoxelType) { return VoxelType{p.y <= workloads::height(p.x, p.z)}; });
    return World(std::move(grid));
  }();
  return world;
}

std::vector<Query> queries(const World& world, Turn turn, double down) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  std::vector<Query> all;
  while (all.size() < 4'096) {
    const double angle = 2.0 * std::numbers::pi * share(random);
    const DVec3 axis = turn == Turn::Any ? glm::normalize(DVec3(1, 2, 3)) : DVec3(0, 1, 0);
    OrientedBox box{{20.0 + 216.0 * share(random), 100.0, 20.0 + 216.0 * share(random)}, {0.4, 0.9, 0.4}};
    if (turn != Turn::None) box.rotation = glm::angleAxis(angle, axis);
    const auto ground = sweep_box(world.tracer, box, {0, -100, 0});
    if (!ground || ground->depth > 0.0) std::abort();
    box.centre.y -= 100.0 * ground->fraction - 1e-3 / std::max(0.3, ground->normal.y);
    all.push_back({box, 0.2 * glm::normalize(DVec3(std::cos(angle), -down, std::sin(angle)))});
  }
  return all;
}

void sweeps(benchmark::State& state, const World& (*world_of)(), Turn turn, double down) {
  const World& world = world_of();
  const std::vector<Query> all = queries(world, turn, down);
  std::size_t next = 0;
  for (auto _ : state) {
    const Query& query = all[next++ % all.size()];
    benchmark::DoNotOptimize(sweep_box(world.tracer, query.box, query.displacement));
  }
  int hits = 0;
  for (const Query& query : all) {
    const auto hit = sweep_box(world.tracer, query.box, query.displacement);
    if (hit && hit->depth > 0.0) state.SkipWithError("a box starts inside");
    hits += hit.has_value();
  }
  state.counters["hits"] = hits;
}

// Returns the largest capsule inside the box.
Capsule capsule_in(const OrientedBox& box) {
  return {box.half_size.x, box.centre, box.rotation * DVec3(0.0, box.half_size.y - box.half_size.x, 0.0)};
}

void capsule_sweeps(benchmark::State& state, const World& (*world_of)(), Turn turn, double down) {
  const World& world = world_of();
  const std::vector<Query> all = queries(world, turn, down);
  std::size_t next = 0;
  for (auto _ : state) {
    const Query& query = all[next++ % all.size()];
    benchmark::DoNotOptimize(sweep_capsule(world.tracer, capsule_in(query.box), query.displacement));
  }
}

void capsule_walks(benchmark::State& state, const World& (*world_of)()) {
  const World& world = world_of();
  const std::vector<Query> all = queries(world, Turn::None, 0.3);
  SlideOptions options;
  options.floor = FloorOptions{{0, 1, 0}, 50.0, 1.1, 0.5};
  std::size_t next = 0;
  for (auto _ : state) {
    const Query& query = all[next++ % all.size()];
    benchmark::DoNotOptimize(move_and_slide(world.tracer, capsule_in(query.box), query.displacement, options).centre);
  }
}

void walks(benchmark::State& state, const World& (*world_of)()) {
  const World& world = world_of();
  const std::vector<Query> all = queries(world, Turn::None, 0.3);
  SlideOptions options;
  options.floor = FloorOptions{{0, 1, 0}, 50.0, 1.1, 0.5};
  std::size_t next = 0;
  for (auto _ : state) {
    const Query& query = all[next++ % all.size()];
    benchmark::DoNotOptimize(move_and_slide(world.tracer, query.box, query.displacement, options).centre);
  }
}

// Displaces boxes from ground in which they stand `depth` deep.
void free_places(benchmark::State& state, const World& (*world_of)(), Turn turn, double depth) {
  const World& world = world_of();
  std::vector<Query> all = queries(world, turn, 0.3);
  for (Query& query : all) query.box.centre.y -= depth;
  std::size_t next = 0;
  int found = 0;
  for (auto _ : state) {
    const Query& query = all[next++ % all.size()];
    const auto away = depenetration(world.tracer, query.box, 2.0);
    found += away.has_value();
    benchmark::DoNotOptimize(away);
  }
  state.counters["found"] = static_cast<double>(found) / static_cast<double>(state.iterations());
}

[[maybe_unused]] const bool registered = [] {
  struct Place {
    const char* name;
    const World& (*world)();
  };
  for (const Place& place :
       {Place{"field", field_world}, Place{"dug_field", dug_world}, Place{"blocks", block_world}}) {
    const auto world = place.world;
    const std::string path = std::string("scene/sweep/") + place.name + "/";
    const auto add = [&](const std::string& name, Turn turn, double down) {
      benchmark::RegisterBenchmark((path + name).c_str(), sweeps, world, turn, down);
    };
    add("level", Turn::None, 0.0);
    add("down", Turn::None, 0.3);
    add("down_upright", Turn::Upright, 0.3);
    add("down_any", Turn::Any, 0.3);
    benchmark::RegisterBenchmark((path + "walk").c_str(), walks, world);
    benchmark::RegisterBenchmark((path + "capsule/level").c_str(), capsule_sweeps, world, Turn::None, 0.0);
    benchmark::RegisterBenchmark((path + "capsule/down").c_str(), capsule_sweeps, world, Turn::None, 0.3);
    benchmark::RegisterBenchmark((path + "capsule/down_any").c_str(), capsule_sweeps, world, Turn::Any, 0.3);
    benchmark::RegisterBenchmark((path + "capsule/walk").c_str(), capsule_walks, world);
    benchmark::RegisterBenchmark((path + "free_place").c_str(), free_places, world, Turn::None, 0.7);
    benchmark::RegisterBenchmark((path + "free_place_any").c_str(), free_places, world, Turn::Any, 0.7);
  }
  return true;
}();

}  // namespace
}  // namespace quoin
