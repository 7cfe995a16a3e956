// live/tracer_flight: flies at 60 voxels per second and 60 frames per second over a partial grid. Chunks are loaded
// ahead and unloaded behind. Measures the processor time that the tracer's update takes from the caller's thread.
// here: SceneTracer; worker: LiveTracer. QUOIN_FLIGHT_SECONDS: duration. QUOIN_FLIGHT_RADIUS: of the loaded chunks.

#include <quoin/live/live_tracer.h>

#include <time.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <map>
#include <memory>
#include <numbers>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <benchmark/benchmark.h>

#include <quoin/scene/scene_query.h>
#include <quoin/terrain/noise.h>

namespace quoin {
namespace {

using Clock = std::chrono::steady_clock;

// Processor time of this thread only.
double processor_milliseconds() {
  timespec time{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return 1e3 * static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_nsec);
}

double number_of(const char* name, double otherwise) {
  const char* const text = std::getenv(name);
  return text == nullptr ? otherwise : std::atof(text);
}

/// A landscape of hills with caves and lakes, four chunks high, that repeats every 24 chunks.
class Land {
 public:
  static constexpr int kHigh = 4;

  const Chunk& chunk(IVec3 at) {
    const auto wrap = [](int i) { return (i % kPeriod + kPeriod) % kPeriod; };
    std::unique_ptr<Chunk>& known = made_[{wrap(at.x), at.y, wrap(at.z)}];
    if (known == nullptr) known = std::make_unique<Chunk>(make({wrap(at.x), at.y, wrap(at.z)}));
    return *known;
  }

 private:
  static constexpr int kPeriod = 24;
  static constexpr VoxelType kStone = 1;
  static constexpr VoxelType kEarth = 2;
  static constexpr VoxelType kGrass = 3;
  static constexpr VoxelType kWater = 4;

  static int height(int x, int z) {
    const double turn = 2.0 * std::numbers::pi / (kPeriod * kChunkEdge);
    return static_cast<int>(90.0 + 40.0 * std::sin(3.0 * turn * x) * std::cos(2.0 * turn * z) +
                            25.0 * std::sin(7.0 * turn * x + 1.0) * std::sin(9.0 * turn * z) +
                            10.0 * fractal2(1, x / 60.0, z / 60.0, 3));
  }
  // Noise at every fourth voxel, in between by the nearest of them.
  static bool is_cave(IVec3 voxel) {
    const DVec3 at(voxel / 4 * 4);
    return std::abs(noise3(3, at.x / 40.0, at.y / 28.0, at.z / 40.0)) +
               std::abs(noise3(4, at.x / 40.0, at.y / 28.0, at.z / 40.0)) <
           0.12;
  }
  static Chunk make(IVec3 at) {
    Chunk chunk;
    const IVec3 origin = at * kChunkEdge;
    std::array<VoxelType, kChunkEdge> row;
    for (int z = 0; z < kChunkEdge; ++z) {
      std::array<int, kChunkEdge> heights;
      for (int x = 0; x < kChunkEdge; ++x) {
        heights[static_cast<std::size_t>(x)] = height(origin.x + x, origin.z + z);
      }
      for (int y = 0; y < kChunkEdge; ++y) {
        for (int x = 0; x < kChunkEdge; ++x) {
          const auto i = static_cast<std::size_t>(x);
          row[i] = type_at(origin + IVec3{x, y, z}, heights[i], x % 4 == 0 ? kAir : row[i & ~std::size_t{3}]);
        }
        chunk.write_row(y, z, row);
      }
    }
    return chunk;
  }
  // `before`: the type of the first of four voxels; air if it is in a cave.
  static VoxelType type_at(IVec3 voxel, int top, VoxelType before) {
    if (voxel.y > top) return voxel.y < 70 ? kWater : kAir;
    const bool is_below = voxel.y > 3 && voxel.y < top - 6;
    if (is_below && (voxel.x % 4 != 0 ? before == kAir : is_cave(voxel))) return kAir;
    return voxel.y < top - 3 ? kStone : voxel.y < top ? kEarth : kGrass;
  }

  std::map<std::array<int, 3>, std::unique_ptr<Chunk>> made_;
};

/// A scene with the chunks around a viewer.
class LoadedScene {
 public:
  LoadedScene() : radius_(number_of("QUOIN_FLIGHT_RADIUS", 1'024.0) / kChunkEdge) {
    for (const std::uint8_t alpha : {255, 255, 255, 120}) {
      VoxelProperties properties;
      properties.name = std::to_string(scene.types.size());
      properties.colour = {90, 120, 60, alpha};
      if (alpha != 255) properties.visibility = Visibility::Transparent;
      if (!scene.types.add(properties)) std::abort();
    }
    grid_ = scene.add_grid({});
    scene.add_instance({"land", grid_});
    scene.edit(grid_).grid.make_partial();
  }

  /// Loads and unloads up to `most` columns of chunks. Returns true if any are left to load.
  bool load(std::size_t most) {
    Grid& grid = scene.edit(grid_).grid;
    std::vector<std::pair<double, std::array<int, 2>>> wanted;
    const int edge = static_cast<int>(radius_) + 2;
    for (int z = -edge; z <= edge; ++z) {
      for (int x = -edge; x <= edge; ++x) {
        const std::array<int, 2> column{chunk_of(eye.x) + x, chunk_of(eye.z) + z};
        if (distance(column) <= radius_ && !loaded_.contains(column)) wanted.push_back({distance(column), column});
      }
    }
    std::sort(wanted.begin(), wanted.end());
    for (std::size_t i = 0; i < std::min(most, wanted.size()); ++i) {
      const auto [x, z] = wanted[i].second;
      for (int y = 0; y < Land::kHigh; ++y) grid.load_chunk({x, y, z}, land_.chunk({x, y, z}));
      loaded_.insert({x, z});
    }
    for (auto each = loaded_.begin(); each != loaded_.end() && most > 0;) {
      if (distance(*each) <= radius_ + 2.0) {
        ++each;
        continue;
      }
      for (int y = 0; y < Land::kHigh; ++y) grid.unload_chunk({(*each)[0], y, (*each)[1]});
      each = loaded_.erase(each);
      --most;
    }
    return wanted.size() > most;
  }

  Scene scene;
  DVec3 eye{32.5, 200.0, 32.5};

 private:
  static int chunk_of(double x) { return static_cast<int>(std::floor(x / kChunkEdge)); }
  [[nodiscard]] double distance(std::array<int, 2> column) const {
    return std::hypot(column[0] + 0.5 - eye.x / kChunkEdge, column[1] + 0.5 - eye.z / kChunkEdge);
  }

  Land land_;
  GridHandle grid_;
  std::set<std::array<int, 2>> loaded_;
  double radius_;
};

struct Here {
  explicit Here(const Scene& scene) : tracer(scene, InstanceFilter::Visible, {1}) {}
  void update(const Scene& /*scene*/) { tracer.update({1}); }
  void finish(const Scene& /*scene*/) {}
  [[nodiscard]] const SceneTracer& shown() const { return tracer; }
  SceneTracer tracer;
};

struct OnWorker {
  explicit OnWorker(const Scene& /*scene*/) {}
  void update(const Scene& scene) {
    live.update(scene);
    live.take();
  }
  void finish(const Scene& scene) { live.finish(scene); }
  [[nodiscard]] const SceneTracer& shown() const { return live.shown(); }
  LiveTracer live;
};

void report(benchmark::State& state, std::vector<double> milliseconds) {
  std::sort(milliseconds.begin(), milliseconds.end());
  for (const auto& [name, share] : {std::pair("p50_ms", 0.5), {"p99_ms", 0.99}, {"p999_ms", 0.999}, {"max_ms", 1.0}}) {
    state.counters[name] = milliseconds[static_cast<std::size_t>(share * static_cast<double>(milliseconds.size() - 1))];
  }
}

template <class Tracer>
void fly(benchmark::State& state) {
  for (auto _ : state) {
    LoadedScene world;
    while (world.load(1'000)) continue;
    Tracer tracer(world.scene);
    tracer.update(world.scene);
    tracer.finish(world.scene);
    std::vector<double> times;
    const Clock::time_point start = Clock::now();
    const int frames = static_cast<int>(60.0 * number_of("QUOIN_FLIGHT_SECONDS", 20.0));
    for (int frame = 1; frame <= frames; ++frame) {
      world.eye += DVec3(0.95, 0.0, 0.3);
      world.load(2);
      const double before = processor_milliseconds();
      tracer.update(world.scene);
      times.push_back(processor_milliseconds() - before);
      benchmark::DoNotOptimize(first_hit(tracer.shown(), {world.eye, {0.1, -1.0, 0.1}}));
      std::this_thread::sleep_until(start + std::chrono::microseconds(16'667LL * frame));
    }
    tracer.finish(world.scene);
    const SceneTracer fresh(world.scene);
    const Ray down{world.eye, {0.1, -1.0, 0.1}};
    const auto hit = first_hit(tracer.shown(), down);
    const auto expected = first_hit(fresh, down);
    if (!hit || !expected || hit->voxel != expected->voxel)
      return state.SkipWithError("the tracer is not of the scene");
    state.counters["tree_MB"] = static_cast<double>(tracer.shown().bytes()) / 1e6;
    report(state, std::move(times));
  }
}

BENCHMARK(fly<Here>)->Name("live/tracer_flight/here")->Iterations(1)->Unit(benchmark::kSecond);
BENCHMARK(fly<OnWorker>)->Name("live/tracer_flight/worker")->Iterations(1)->Unit(benchmark::kSecond);

}  // namespace
}  // namespace quoin
