// journal: the cost of finding the changes of one edit in worlds of 100 and of 100,000 chunks, and the cost of
// snapshots. journal/find/*: finding only, in microseconds. journal/follow/*: a consumer's whole work after an edit of
// one voxel.

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <vector>

#include <benchmark/benchmark.h>

#include <quoin/grid/density_grid.h>
#include <quoin/grid/downsample.h>
#include <quoin/grid/grid.h>
#include <quoin/live/live_meshes.h>
#include <quoin/scene/level_of_detail.h>
#include <quoin/scene/scene.h>
#include <quoin/scene/scene_tracer.h>

#include "scene/tracer/tree_cache.h"

namespace quoin {
namespace {

void fail_unless(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "journal benchmark: %s\n", what);
  std::exit(1);
}

// Returns a square of chunks with a few voxels each.
Grid sparse_world(int chunks) {
  Grid grid;
  int edge = 1;
  while (edge * edge < chunks) ++edge;
  for (int i = 0; i < chunks; ++i) {
    const IVec3 at{64 * (i % edge), 0, 64 * (i / edge)};
    grid.set(at + IVec3{20, 20, 20}, 1);
    grid.set(at + IVec3{40, 30, 20}, 2);
  }
  return grid;
}

VoxelRegistry two_types() {
  VoxelRegistry types;
  for (int i = 0; i < 2; ++i) fail_unless(types.add({}).has_value(), "a type was not added");
  return types;
}

struct World {
  explicit World(int chunks) {
    scene.types = two_types();
    SceneGrid made;
    made.grid = sparse_world(chunks);
    handle = scene.add_grid(std::move(made));
    Instance instance;
    instance.grid = handle;
    scene.add_instance(instance);
    edge = 64 * ((grid().bounds().max.x + 63) / 64);
  }
  Grid& grid() { return scene.edit(handle).grid; }
  // Toggles a voxel in the middle of the world and of a chunk.
  void edit() {
    const IVec3 at{edge / 128 * 64 + 30, 33, edge / 128 * 64 + 30};
    fail_unless(scene.edit(handle).grid.set(at, (++edits & 1) != 0 ? VoxelType{1} : kAir), "the edit changed nothing");
  }
  Scene scene;
  GridHandle handle;
  int edge = 0;
  int edits = 0;
};

// Measures `follow` after each edit.
template <class Follow>
void after_edits(benchmark::State& state, World& world, Follow&& follow) {
  // Excludes the work that happens only at the first change.
  for (int i = 0; i < 4; ++i) {
    world.edit();
    follow();
  }
  for (auto _ : state) {
    world.edit();
    const auto start = std::chrono::steady_clock::now();
    follow();
    state.SetIterationTime(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }
}

void find_in_grid(benchmark::State& state) {
  World world(static_cast<int>(state.range(0)));
  const Grid& grid = world.grid();
  ChangeCursor cursor = grid.cursor();
  after_edits(state, world, [&] {
    const GridChanges changes = grid.changes_since(cursor);
    fail_unless(chunks_to_mesh(grid, changes).size() == 1, "one chunk should be reported");
  });
}

void find_in_scene(benchmark::State& state) {
  World world(100);
  for (int i = 0; i < state.range(0); ++i) {
    Instance instance;
    instance.grid = world.handle;
    instance.position = {300.0 * i, 0.0, 0.0};
    world.scene.add_instance(instance);
  }
  ChangeCursor cursor = world.scene.cursor();
  const InstanceHandle moved = world.scene.instances().handles().back();
  after_edits(state, world, [&] {
    world.scene.edit(moved).position.y += 1.0;
    const SceneChanges changes = world.scene.changes_since(cursor);
    fail_unless(changes.grids.size() == 1 && changes.instances.size() == 1,
                "the edited grid and instance should be reported");
  });
}

void find_in_types(benchmark::State& state) {
  VoxelRegistry types;
  VoxelProperties properties;
  for (int i = 0; i < state.range(0); ++i) fail_unless(types.add(properties).has_value(), "a type was not added");
  ChangeCursor cursor = types.cursor();
  for (auto _ : state) {
    properties.colour.r = static_cast<std::uint8_t>(properties.colour.r + 1);
    types.replace(1, properties);
    const auto start = std::chrono::steady_clock::now();
    fail_unless(types.changes_since(cursor).items_unless_all().size() == 1, "one type should be reported");
    state.SetIterationTime(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }
}

void find_in_densities(benchmark::State& state) {
  DensityGrid grid;
  for (int i = 0; i < state.range(0); ++i) grid.set({64 * (i % 300) + 30, 30, 64 * (i / 300) + 30}, {-1.0F, 1});
  ChangeCursor cursor = grid.cursor();
  float density = 0.0F;
  for (auto _ : state) {
    density = density == -2.0F ? -3.0F : -2.0F;
    grid.set({94, 30, 30}, {density, 1});
    const auto start = std::chrono::steady_clock::now();
    fail_unless(chunks_to_mesh(grid, grid.changes_since(cursor), 12).size() == 1, "one chunk should be reported");
    state.SetIterationTime(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }
}

void follow_bounds(benchmark::State& state) {
  World world(static_cast<int>(state.range(0)));
  after_edits(state, world, [&] { benchmark::DoNotOptimize(world.grid().bounds()); });
}

void follow_trees(benchmark::State& state) {
  World world(static_cast<int>(state.range(0)));
  TreeCache trees;
  trees.update(world.grid(), world.scene.types);
  after_edits(state, world, [&] { fail_unless(trees.update(world.grid(), world.scene.types), "nothing was updated"); });
}

void follow_pyramid(benchmark::State& state) {
  World world(static_cast<int>(state.range(0)));
  GridPyramid pyramid;
  pyramid.update(world.grid(), world.scene.types, 1);
  after_edits(state, world, [&] { pyramid.update(world.grid(), world.scene.types, 1); });
}

void follow_tracer(benchmark::State& state) {
  World world(static_cast<int>(state.range(0)));
  SceneTracer tracer(world.scene);
  after_edits(state, world, [&] { fail_unless(tracer.update({1}), "nothing was updated"); });
}

void follow_selector(benchmark::State& state) {
  World world(static_cast<int>(state.range(0)));
  DetailSelector selector;
  std::vector<SelectedInstance> selected;
  const Camera camera = look_at({-50, 300, -50}, {500, 0, 500}, 1.0).value();
  selector.select(world.scene, camera, 640, 480, {}, selected);
  after_edits(state, world, [&] { selector.select(world.scene, camera, 640, 480, {}, selected); });
}

// Measures only `update` on the editing thread; the mesh may or may not be ready by then.
void follow_live(benchmark::State& state, SurfaceStyle style) {
  World world(static_cast<int>(state.range(0)));
  LiveMeshOptions options;
  options.style = style;
  options.occlusion.method = SmoothOcclusion::None;
  options.workers = {1};
  LiveMeshes meshes(options);
  meshes.finish(world.scene, {});
  (void)meshes.take();
  for (auto _ : state) {
    world.edit();
    const auto start = std::chrono::steady_clock::now();
    meshes.update(world.scene, {});
    state.SetIterationTime(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
    meshes.finish(world.scene, {});
    fail_unless(!meshes.take().empty(), "nothing was meshed");
  }
}

void snapshot_grid(benchmark::State& state) {
  const Grid grid = sparse_world(static_cast<int>(state.range(0)));
  for (auto _ : state) benchmark::DoNotOptimize(grid.snapshot().chunk_count());
}

void snapshot_scene(benchmark::State& state) {
  World world(static_cast<int>(state.range(0)));
  for (auto _ : state) benchmark::DoNotOptimize(world.scene.snapshot().grids().size());
}

// Measures the first edit of a chunk after a snapshot, which copies the chunk and the path to it.
void snapshot_and_edit(benchmark::State& state) {
  World world(static_cast<int>(state.range(0)));
  for (auto _ : state) {
    const Grid copy = world.grid().snapshot();
    world.edit();
    benchmark::DoNotOptimize(copy.chunk_count());
  }
}

void register_all() {
  const auto add = [](const char* name, auto&& run, std::vector<int> sizes, bool manual) {
    auto* made = benchmark::RegisterBenchmark(name, run)->Unit(benchmark::kMicrosecond);
    for (const int size : sizes) made->Arg(size);
    if (manual) made->UseManualTime();
  };
  add("journal/find/grid", find_in_grid, {100, 100'000}, true);
  add("journal/find/densities", find_in_densities, {100, 100'000}, true);
  add("journal/find/scene", find_in_scene, {100, 10'000}, true);
  add("journal/find/types", find_in_types, {100, 60'000}, true);
  add("journal/follow/bounds", follow_bounds, {100, 100'000}, true);
  add("journal/follow/trees", follow_trees, {100, 100'000}, true);
  add("journal/follow/pyramid", follow_pyramid, {100, 100'000}, true);
  add("journal/follow/tracer", follow_tracer, {100, 100'000}, true);
  add("journal/follow/selector", follow_selector, {100, 100'000}, true);
  add(
      "journal/follow/live_blocky", [](benchmark::State& s) { follow_live(s, SurfaceStyle::Blocky); }, {100, 100'000},
      true);
  add("snapshot/grid", snapshot_grid, {1'024, 100'000}, false);
  add("snapshot/scene", snapshot_scene, {1'024, 100'000}, false);
  add("snapshot/grid_and_edit", snapshot_and_edit, {1'024, 100'000}, false);
}

const bool kRegistered = (register_all(), true);

}  // namespace
}  // namespace quoin
