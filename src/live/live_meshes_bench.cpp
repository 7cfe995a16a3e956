// live: time from an edit to the new meshes of all affected chunks, and from an empty start to all meshes. Terrain of
// 256x128x256 voxels, the default number of workers of `LiveMeshOptions`. live/*/frames: a game that digs at 60 frames
// per second, with times from the edit to the `take` that returns it. QUOIN_LIVE_DIGS: number of digs (default 120).

#include <quoin/live/live_meshes.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <thread>
#include <vector>

#include <benchmark/benchmark.h>
#include <quoin/live/live_light.h>

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

// An update of 300 grids after no change.
void unchanged(benchmark::State& state) {
  Scene scene;
  fail_unless(scene.types.add({}).has_value(), "no type");
  for (int i = 0; i < 300; ++i) {
    SceneGrid ship;
    ship.grid.fill_box({{0, 0, 0}, {40, 8, 12}}, 1);
    scene.add_instance({.grid = scene.add_grid(std::move(ship)), .position = {60.0 * (i % 20), 0.0, 60.0 * (i / 20)}});
  }
  LiveMeshes meshes;
  meshes.finish(scene, {});
  fail_unless(meshes.take().size() >= 300, "a grid was not meshed");
  for (auto _ : state) meshes.update(scene, {});
}

// Digs near the border of two or four chunks every fifth frame.
void frames(benchmark::State& state, bool is_lit) {
  using Clock = std::chrono::steady_clock;
  const auto milliseconds = [](Clock::duration time) {
    return std::chrono::duration<double, std::milli>(time).count();
  };
  constexpr std::chrono::microseconds kFrame{16'667};
  const char* const wanted = std::getenv("QUOIN_LIVE_DIGS");
  const int digs = std::max(1, wanted == nullptr ? 120 : std::atoi(wanted));
  Land land;
  LiveLight light;
  LiveMeshes meshes;
  if (is_lit) meshes.use_light(light);
  meshes.finish(land.scene, {128, 100, 128});
  fail_unless(!meshes.take().empty(), "nothing was meshed");
  std::vector<double> latency;
  std::vector<double> calls;  // of `update` and `take`, in one frame
  for (auto _ : state) {
    Clock::time_point frame = Clock::now();
    for (int dig = 0; dig < digs; ++dig) {
      const IVec3 at = land.above(62 + dig % 4 + 64 * (dig % 3), 10 + dig * 7 % 236) - IVec3{0, 1, 0};
      land.scene.edit(land.grid).grid.set(at, kAir);
      const Clock::time_point edited = Clock::now();
      std::uint64_t number = 0;
      bool is_shown = false;
      for (int i = 0; i < 5 || !is_shown; ++i) {
        const Clock::time_point start = Clock::now();
        const std::uint64_t update = meshes.update(land.scene, DVec3(at));
        if (i == 0) number = update;
        const std::size_t surfaces = meshes.take().size();
        const Clock::time_point end = Clock::now();
        calls.push_back(milliseconds(end - start));
        if (!is_shown && meshes.shown_update() >= number) {
          fail_unless(surfaces != 0, "the edit changed nothing");
          latency.push_back(milliseconds(end - edited));
          is_shown = true;
        }
        frame = std::max(frame + kFrame, end);
        std::this_thread::sleep_until(frame);
      }
    }
  }
  const auto report = [&](const char* name, std::vector<double>& all) {
    std::sort(all.begin(), all.end());
    state.counters[std::string(name) + "_ms_p50"] = all[all.size() / 2];
    state.counters[std::string(name) + "_ms_p99"] = all[all.size() * 99 / 100];
  };
  report("latency", latency);
  report("calls", calls);
}

void register_all() {
  for (const bool is_lit : {false, true}) {
    benchmark::RegisterBenchmark(is_lit ? "live/lit/frames" : "live/blocky/frames",
                                 [=](benchmark::State& state) { frames(state, is_lit); })
        ->Unit(benchmark::kMillisecond)
        ->Iterations(1)
        ->UseRealTime();
  }

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
  benchmark::RegisterBenchmark("live/blocky/unchanged", unchanged)->Unit(benchmark::kMicrosecond);
}

const bool kRegistered = (register_all(), true);

}  // namespace
}  // namespace quoin
