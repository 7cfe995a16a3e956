// scene/update10000: updates a tracer of 10,000 instances after a change: a tenth of the instances moved, one voxel
// edited, no change, an instance added. Also measures a rebuild. One thread.

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <utility>
#include <vector>

#include <benchmark/benchmark.h>

#include <quoin/scene/scene_tracer.h>

#include "scene/tracer/mixed_scene_for_tests.h"
#include "scene/tracer/placed_grid.h"

namespace quoin {
namespace {

constexpr std::int64_t kInstances = 10'000;

void fail_unless(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "update benchmark: %s\n", what);
  std::exit(1);
}

void expect_up_to_date(const SceneTracer& tracer, const Scene& scene) {
  fail_unless(placed_in(tracer).size() == static_cast<std::size_t>(kInstances), "an instance is missing");
  for (const PlacedGrid& placed : placed_in(tracer)) {
    fail_unless(placed.position == scene.instances()[placed.instance].position,
                "an instance is not where it should be");
    fail_unless(placed.opaque->bounds() == placed.grid->grid.bounds(), "a tree is not of its grid");
  }
}

// Moves a tenth of the instances, a different one in each round, by up to `step`. Instances that leave the square
// return.
void tenth_moved(benchmark::State& state, double step) {
  Scene scene = mixed_scene(kInstances);
  SceneTracer tracer(scene, InstanceFilter::Visible, {1});
  const std::vector<InstanceHandle> handles = scene.instances().handles();
  std::mt19937 random(12);
  std::uniform_real_distribution<double> by(-step, step);
  std::size_t round = 0;
  for (auto _ : state) {
    state.PauseTiming();
    for (std::size_t i = round++ % 10; i < handles.size(); i += 10) {
      Instance& instance = scene.edit(handles[i]);
      instance.position += DVec3(by(random), by(random), by(random));
      for (int axis = 0; axis < 3; ++axis) instance.position[axis] = std::remainder(instance.position[axis], 12'000.0);
    }
    state.ResumeTiming();
    tracer.update({1});
  }
  expect_up_to_date(tracer, scene);
}
void near(benchmark::State& state) {
  tenth_moved(state, 5.0);
}
void far(benchmark::State& state) {
  tenth_moved(state, 6000.0);
}
BENCHMARK(near)->Name("scene/update10000/tenth_moved")->Unit(benchmark::kMicrosecond);
BENCHMARK(far)->Name("scene/update10000/tenth_moved_far")->Unit(benchmark::kMicrosecond);

void one_voxel(benchmark::State& state) {
  Scene scene = mixed_scene(kInstances);
  SceneTracer tracer(scene, InstanceFilter::Visible, {1});
  // The largest grid: 512 chunks.
  Grid& grid = scene.edit(scene.grids().handles().back()).grid;
  bool is_solid = true;
  for (auto _ : state) {
    state.PauseTiming();
    is_solid = !is_solid;
    grid.set({77, 250, 133}, is_solid ? 1 : kAir);
    state.ResumeTiming();
    fail_unless(tracer.update({1}), "the edit was not seen");
  }
  expect_up_to_date(tracer, scene);
}
BENCHMARK(one_voxel)->Name("scene/update10000/one_voxel")->Unit(benchmark::kMicrosecond);

// A world of 16x4x16 chunks, with default threads: sets and removes a distant voxel. Both are timed.
void edit_far(benchmark::State& state) {
  Scene scene;
  VoxelProperties properties;
  fail_unless(scene.types.add(properties).has_value(), "no type");
  SceneGrid world;
  for (int x = 0; x < 16; ++x) {
    for (int z = 0; z < 16; ++z) {
      const IVec3 corner{64 * x, 0, 64 * z};
      world.grid.fill_box({corner, corner + IVec3{63, 20 + x + z, 63}}, 1);
    }
  }
  const GridHandle handle = scene.add_grid(std::move(world));
  scene.add_instance({"", handle});
  SceneTracer tracer(scene);
  Grid& grid = scene.edit(handle).grid;
  bool is_there = false;
  for (auto _ : state) {
    is_there = !is_there;
    grid.set({1'000'000, 77, -3'000}, is_there ? 1 : kAir);
    fail_unless(tracer.update(), "the edit was not seen");
  }
}
BENCHMARK(edit_far)->Name("scene/edit_far")->Unit(benchmark::kMicrosecond);

void update_idle(benchmark::State& state) {
  const Scene scene = mixed_scene(kInstances);
  SceneTracer tracer(scene);
  for (auto _ : state) fail_unless(!tracer.update(), "something changed");
}
BENCHMARK(update_idle)->Name("scene/update_idle")->Unit(benchmark::kMicrosecond);

void nothing(benchmark::State& state) {
  const Scene scene = mixed_scene(kInstances);
  SceneTracer tracer(scene, InstanceFilter::Visible, {1});
  for (auto _ : state) fail_unless(!tracer.update({1}), "something is said to have changed");
}
BENCHMARK(nothing)->Name("scene/update10000/nothing")->Unit(benchmark::kMicrosecond);

void one_added(benchmark::State& state) {
  Scene scene = mixed_scene(kInstances);
  SceneTracer tracer(scene, InstanceFilter::Visible, {1});
  for (auto _ : state) {
    state.PauseTiming();
    const InstanceHandle first = scene.instances().handles().front();
    const Instance instance = scene.instances()[first];
    scene.remove_instance(first);
    scene.add_instance(instance);
    state.ResumeTiming();
    tracer.update({1});
  }
  expect_up_to_date(tracer, scene);
}
BENCHMARK(one_added)->Name("scene/update10000/one_replaced")->Unit(benchmark::kMicrosecond);

void anew(benchmark::State& state) {
  const Scene scene = mixed_scene(kInstances);
  for (auto _ : state) {
    const SceneTracer tracer(scene, InstanceFilter::Visible, {1});
    benchmark::DoNotOptimize(placed_in(tracer).data());
  }
}
BENCHMARK(anew)->Name("scene/update10000/anew")->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace quoin
