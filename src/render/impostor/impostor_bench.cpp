// impostor/build26: all snapshots of the ball W4; render/far1000: a thousand far instances of five grids, 1280x720,
// traced and drawn from impostors. One thread.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <random>
#include <thread>
#include <vector>

#include <benchmark/benchmark.h>
#include <glm/geometric.hpp>

#include <quoin/render/cpu_renderer.h>
#include <quoin/render/impostor_cache.h>
#include <quoin/terrain/terrain.h>

#include "bench/workloads.h"
#include "render/shared/image_detail.h"

namespace quoin {
namespace {

void fail_unless(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "impostor benchmark: %s\n", what);
  std::exit(1);
}

void build26(benchmark::State& state) {
  const VoxelRegistry types = workloads::three_types();
  Grid grid;
  grid.put_chunk({0, 0, 0}, workloads::blocky_chunk(workloads::Blocky::W4));
  const OccupancyTree tree = OccupancyTree::build(grid, types, Occupancy::Opaque);
  for (auto _ : state) {
    const Impostor impostor = Impostor::build(grid, types, tree);
    fail_unless(impostor.bytes() > 100'000, "too little was seen");
  }
}
BENCHMARK(build26)->Name("impostor/build26")->Unit(benchmark::kMillisecond);

// Returns caves and hills of 256x113x256 voxels.
Grid wide_terrain(VoxelRegistry& types) {
  const auto of_terrain = add_terrain_types(types);
  fail_unless(of_terrain.has_value(), "no types");
  return generate_terrain({.seed = 42, .size = {8, 4, 8}}, *of_terrain).value();
}

void build_terrain(benchmark::State& state) {
  VoxelRegistry types;
  const Grid grid = wide_terrain(types);
  for (auto _ : state) benchmark::DoNotOptimize(Impostor::build(grid, types));
}
BENCHMARK(build_terrain)->Name("impostor/terrain/build")->Unit(benchmark::kMillisecond)->Iterations(3);

// Measures the rebuild after one voxel was removed or set.
void rebuild_terrain(benchmark::State& state) {
  VoxelRegistry types;
  Grid grid = wide_terrain(types);
  Impostor impostor = Impostor::build(grid, types);
  ChangeCursor cursor = grid.cursor();
  std::mt19937 random(4);
  for (auto _ : state) {
    const auto coordinate = [&] { return 8 + static_cast<int>(random() % 240); };
    grid.set({coordinate(), 30 + static_cast<int>(random() % 40), coordinate()},
             random() % 2 == 0 ? kAir : VoxelType{1});
    const GridChanges changes = grid.changes_since(cursor);
    impostor = impostor.rebuilt(grid, types, changes);
  }
}
BENCHMARK(rebuild_terrain)->Name("impostor/terrain/edit")->Unit(benchmark::kMillisecond)->Iterations(10);

// A flight with one edit per frame among 200 models, the largest of 256^3 voxels: measures the frame thread's cost for
// impostors while a worker builds them. Counters: milliseconds, over all frames.
Scene models_of_a_flight() {
  Scene scene;
  const auto types = add_terrain_types(scene.types);
  fail_unless(types.has_value(), "no types");
  std::mt19937 random(1);
  const auto below = [&](unsigned limit) { return static_cast<int>(random() % limit); };
  for (int i = 0; i < 200; ++i) {
    SceneGrid model;
    if (i == 0) {
      model.grid = generate_terrain({.seed = 42, .size = {8, 8, 8}}, *types).value();
      for (int tower = 0; tower < 60; ++tower) {
        const int x = below(240);
        const int z = below(240);
        model.grid.fill_box({{x, 0, z}, {x + 8, 256, z + 8}}, 2);
      }
    } else {
      for (int box = 0; box < 40; ++box) {
        const IVec3 at{below(48), below(48), below(48)};
        model.grid.fill_box({at, at + 1 + below(12)}, static_cast<VoxelType>(1 + below(3)));
      }
    }
    model.pivot = content_sphere(model.grid).centre;
    Instance instance;
    instance.grid = scene.add_grid(std::move(model));
    instance.position = {i % 20 * 120.0, 0.0, i == 0 ? -3500.0 : -1500.0 - i / 20 * 120.0};
    scene.add_instance(instance);
  }
  return scene;
}

void flight(benchmark::State& state) {
  using Clock = std::chrono::steady_clock;
  Scene scene = models_of_a_flight();
  const std::vector<GridHandle> grids = scene.grids().handles();
  ImpostorCache cache;
  DetailSelector view;
  std::vector<SelectedInstance> selected;
  std::vector<double> milliseconds;
  std::mt19937 random(2);
  for (auto _ : state) {
    const std::size_t frame = milliseconds.size();
    Grid& edited = scene.edit(grids[frame % 2 == 0 ? 0 : random() % grids.size()]).grid;
    const IVec3 size = edited.bounds().max - edited.bounds().min;
    const auto within = [&](int length) { return static_cast<int>(random() % static_cast<unsigned>(length)); };
    edited.set(edited.bounds().min + IVec3{within(size.x), within(size.y), within(size.z)},
               random() % 2 == 0 ? kAir : VoxelType{1});
    Camera camera;
    camera.position = {1200.0, 100.0, 1000.0 - static_cast<double>(frame)};
    view.select(scene, camera, 1280, 720, {}, selected);
    const auto begin = Clock::now();
    benchmark::DoNotOptimize(take_impostors(cache, scene, selected, 0.0, {}));
    const std::chrono::duration<double, std::milli> taken = Clock::now() - begin;
    milliseconds.push_back(taken.count());
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  std::sort(milliseconds.begin(), milliseconds.end());
  state.counters["median"] = milliseconds[milliseconds.size() / 2];
  state.counters["p99"] = milliseconds[milliseconds.size() * 99 / 100];
  state.counters["worst"] = milliseconds.back();
  fail_unless(cache.stats().rebuilt > 10, "nothing was rebuilt");
}
BENCHMARK(flight)->Name("impostor/flight200")->Unit(benchmark::kMillisecond)->Iterations(600);

Grid model(int which) {
  Grid grid;
  if (which == 0) grid.put_chunk({0, 0, 0}, workloads::blocky_chunk(workloads::Blocky::W4));
  if (which == 1) grid.put_chunk({0, 0, 0}, workloads::blocky_chunk(workloads::Blocky::W1));
  if (which == 2) grid.put_chunk({0, 0, 0}, workloads::blocky_chunk(workloads::Blocky::W2));
  if (which > 2) {
    std::mt19937 random(static_cast<unsigned>(which));
    for (int i = 0; i < 40; ++i) {
      const auto coordinate = [&] { return static_cast<int>(random() % 41); };
      const IVec3 at{coordinate(), coordinate(), coordinate()};
      grid.fill_box({at, at + IVec3(static_cast<int>(random() % 9)) + 1}, static_cast<VoxelType>(1 + random() % 3));
    }
  }
  return grid;
}

Scene far_scene() {
  Scene scene;
  scene.types = workloads::three_types();
  std::vector<GridHandle> grids;
  for (int i = 0; i < 5; ++i) {
    SceneGrid grid;
    grid.grid = model(i);
    grid.pivot = content_sphere(grid.grid).centre;
    grids.push_back(scene.add_grid(std::move(grid)));
  }
  std::mt19937 random(3);
  const auto share = [&] { return static_cast<double>(random()) / 4294967296.0 * 2.0 - 1.0; };
  for (std::size_t i = 0; i < 1000; ++i) {
    Instance instance;
    instance.grid = grids[i % grids.size()];
    const double depth = 1100.0 + 500.0 * share();
    instance.position = {share() * 0.95 * depth, share() * 0.5 * depth, -depth};
    instance.rotation = glm::normalize(DQuat(share(), share(), share(), share() + 0.01));
    scene.add_instance(instance);
  }
  return scene;
}

void far1000(benchmark::State& state, bool impostors) {
  static const Scene scene = far_scene();
  static const CpuRenderer renderer(scene, InstanceFilter::Visible, {1});
  Camera camera;
  camera.vertical_fov_radians = 0.9;
  RenderOptions options;
  if (impostors) options.detail.policy = DetailPolicy{};
  const auto first = renderer.render(camera, options, {1});  // creates the impostors
  fail_unless(first.has_value() && first->pixels_hit > 100'000, "too little is seen");
  std::vector<SelectedInstance> selected;
  DetailSelector().select(scene, camera, options.width, options.height, DetailPolicy{}, selected);
  fail_unless(selected.size() > 950, "too few are in the image");
  for (const SelectedInstance& each : selected) fail_unless(each.detail == Detail::Far, "an instance is not far");
  for (auto _ : state) benchmark::DoNotOptimize(renderer.render(camera, options, {1}));
  state.counters["pixels_hit"] = static_cast<double>(first->pixels_hit);
}
void traced(benchmark::State& state) {
  far1000(state, false);
}
void from_impostors(benchmark::State& state) {
  far1000(state, true);
}
BENCHMARK(traced)->Name("render/far1000/traced")->Unit(benchmark::kMillisecond)->Iterations(5);
BENCHMARK(from_impostors)->Name("render/far1000/impostors")->Unit(benchmark::kMillisecond)->Iterations(5);

}  // namespace
}  // namespace quoin
