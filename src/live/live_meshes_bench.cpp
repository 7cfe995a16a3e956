// live: time from an edit to the new meshes of all affected chunks, and from an empty start to all meshes. Terrain of
// 256x128x256 voxels, the default number of workers of `LiveMeshOptions`.

#include <quoin/live/live_meshes.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>

#include <benchmark/benchmark.h>

#include <quoin/terrain/terrain.h>

namespace quoin {
namespace {

struct Land {
  Land() {
    const TerrainTypes materials = add_terrain_types(scene.types).value();
    TerrainOptions options;
    options.size = {8, 4, 8};
    SceneGrid land;
    land.grid = generate_terrain(options, materials).value();
    Instance instance;
    instance.grid = grid = scene.add_grid(std::move(land));
    scene.add_instance(instance);
  }
  // Returns the first air voxel above the ground.
  IVec3 above(int x, int z) const {
    int y = 127;
    while (y > 0 && scene.grids()[grid].grid.get({x, y - 1, z}) == kAir) --y;
    return {x, y, z};
  }

  Scene scene;
  GridHandle grid;
};

void fail_unless(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "live benchmark: %s\n", what);
  std::exit(1);
}

LiveMeshOptions options_of(SurfaceStyle style) {
  LiveMeshOptions options;
  options.style = style;
  return options;
}

void load(benchmark::State& state, SurfaceStyle style) {
  const Land land;
  std::size_t surfaces = 0;
  for (auto _ : state) {
    LiveMeshes meshes(options_of(style));
    meshes.finish(land.scene, {128, 100, 128});
    surfaces = meshes.take().size();
  }
  fail_unless(surfaces >= 16, "the land has too few surfaces");
  state.counters["chunks"] = static_cast<double>(surfaces);
}

// Toggles a voxel; `x` and `z` choose how many chunks it affects.
void edit(benchmark::State& state, SurfaceStyle style, int x, int z) {
  Land land;
  Grid& grid = land.scene.edit(land.grid).grid;
  const IVec3 at = land.above(x, z);
  const DVec3 eye(at);
  LiveMeshes meshes(options_of(style));
  meshes.finish(land.scene, eye);
  fail_unless(!meshes.take().empty(), "nothing was meshed");
  std::size_t surfaces = 0;
  double update_seconds = 0.0;
  double latency_seconds = 0.0;
  bool is_set = false;
  for (auto _ : state) {
    is_set = !is_set;
    grid.set(at, is_set ? VoxelType{1} : kAir);
    const auto start = std::chrono::steady_clock::now();
    meshes.update(land.scene, eye);
    update_seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    meshes.finish(land.scene, eye);
    surfaces = meshes.take().size();
    latency_seconds += meshes.stats().last_latency_seconds;
    fail_unless(surfaces != 0, "the edit changed nothing");
  }
  state.counters["chunks"] = static_cast<double>(surfaces);
  state.counters["update_seconds"] = benchmark::Counter(update_seconds, benchmark::Counter::kAvgIterations);
  state.counters["latency_seconds"] = benchmark::Counter(latency_seconds, benchmark::Counter::kAvgIterations);
}

// Digs a ball of radius 6 into smooth ground and fills it again, on one thread. `corner`: at the corner of eight
// chunks.
void dig(benchmark::State& state, bool corner) {
  Scene scene;
  VoxelProperties ground;
  fail_unless(scene.types.add(ground).has_value(), "no type");
  const double surface = corner ? 128.3 : 96.3;
  SceneGrid land;
  land.field.edit({{0, 64, 0}, {256, 160, 256}}, [&](IVec3 p, DensitySample) {
    const double waves = 3.0 * std::sin(0.07 * p.x) + 3.0 * std::cos(0.09 * p.z);
    const double centre = corner ? 0.0 : 1.3;
    return DensitySample{static_cast<float>(p.y - surface - 0.3 * waves + centre), VoxelType{1}};
  });
  Instance instance;
  instance.grid = scene.add_grid(std::move(land));
  scene.add_instance(instance);
  DensityGrid& field = scene.edit(instance.grid).field;
  const DVec3 at = corner ? DVec3(128.0) : DVec3(96.0);
  LiveMeshOptions options;
  options.workers = {1};
  LiveMeshes meshes(options);
  meshes.finish(scene, at);
  fail_unless(!meshes.take().empty(), "nothing was meshed");
  std::size_t surfaces = 0;
  bool is_dug = false;
  double update_seconds = 0.0;
  for (auto _ : state) {
    is_dug = !is_dug;
    if (is_dug) {
      field.remove_sphere(at, 6.0);
    } else {
      field.add_sphere(at, 6.0, 1);
    }
    const auto start = std::chrono::steady_clock::now();
    meshes.update(scene, at);
    update_seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    meshes.finish(scene, at);
    surfaces = meshes.take().size();
    fail_unless(surfaces != 0, "the edit changed nothing");
  }
  state.counters["chunks"] = static_cast<double>(surfaces);
  state.counters["update_seconds"] = benchmark::Counter(update_seconds, benchmark::Counter::kAvgIterations);
}

void register_all() {
  for (const bool corner : {false, true}) {
    benchmark::RegisterBenchmark(corner ? "live/density/edit_corner" : "live/density/edit",
                                 [=](benchmark::State& state) { dig(state, corner); })
        ->Unit(benchmark::kMillisecond)
        ->UseRealTime();
  }
  for (const SurfaceStyle style : {SurfaceStyle::Blocky, SurfaceStyle::Smooth}) {
    const std::string name = style == SurfaceStyle::Blocky ? "live/blocky" : "live/smooth";
    const auto add = [&](const char* which, auto&& run) {
      benchmark::RegisterBenchmark((name + which).c_str(), run)->Unit(benchmark::kMillisecond)->UseRealTime();
    };
    add("/load", [=](benchmark::State& state) { load(state, style); });
    add("/edit", [=](benchmark::State& state) { edit(state, style, 96, 96); });
    add("/edit_corner", [=](benchmark::State& state) { edit(state, style, 128, 128); });
  }
}

const bool kRegistered = (register_all(), true);

}  // namespace
}  // namespace quoin
