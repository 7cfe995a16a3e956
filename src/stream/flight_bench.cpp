// stream/flight: 100 voxels a second over a landscape that is generated, meshed, edited, saved and let go of meanwhile,
// at 60 frames a second. What it takes of the caller's thread, and what is in memory. QUOIN_FLIGHT_SECONDS: how long.

#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>
#include <string>
#include <thread>
#include <tuple>
#include <vector>

#include <benchmark/benchmark.h>
#include <quoin/live/live_meshes.h>
#include <quoin/stream/streamed_world.h>

#include "store/world/world_for_tests.h"

namespace quoin {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

// Of this thread: what others are given meanwhile does not count.
double processor_seconds() {
  timespec time{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

double resident_megabytes() {
  std::ifstream in("/proc/self/statm");
  double total = 0.0;
  double resident = 0.0;
  in >> total >> resident;
  return resident * static_cast<double>(::sysconf(_SC_PAGESIZE)) / 1e6;
}

double quantile(std::vector<double> all, double share) {
  if (all.empty()) return 0.0;
  const auto at = static_cast<std::ptrdiff_t>(static_cast<double>(all.size() - 1) * share);
  std::nth_element(all.begin(), all.begin() + at, all.end());
  return all[static_cast<std::size_t>(at)];
}

/// The meshes that a program would draw, and their bytes.
class Drawn {
 public:
  void take(LiveMeshes& meshes) {
    for (SurfaceUpdate& update : meshes.take(std::size_t{4} << 20)) {
      const auto key = std::tuple(update.content, update.chunk.x, update.chunk.y, update.chunk.z);
      const auto found = surfaces_.find(key);
      if (found != surfaces_.end()) bytes_ -= found->second->bytes();
      if (update.surface == nullptr) {
        surfaces_.erase(key);
      } else {
        bytes_ += update.surface->bytes();
        surfaces_[key] = std::move(update.surface);
      }
    }
  }
  [[nodiscard]] std::size_t bytes() const { return bytes_; }

 private:
  std::map<std::tuple<SurfaceContent, int, int, int>, std::shared_ptr<const ChunkSurface>> surfaces_;
  std::size_t bytes_ = 0;
};

void fly(benchmark::State& state, bool is_smooth) {
  const char* const wanted = std::getenv("QUOIN_FLIGHT_SECONDS");
  const double length = wanted == nullptr ? 8.0 : std::atof(wanted);
  for (auto _ : state) {
    const WorldFolder folder;
    Drawn drawn;
    StreamOptions options;
    options.budget_bytes = std::size_t{192} << 20;
    options.other_bytes = [&] { return drawn.bytes(); };
    auto world = StreamedWorld::open_or_create(folder / "flight.quoin", options);
    const auto grid =
        world ? world->add_terrain({.seed = 9, .is_smooth = is_smooth}) : Result<GridHandle>(world.error());
    if (!grid) {
      state.SkipWithError(to_string(grid.error()).c_str());
      return;
    }
    LiveMeshes meshes;
    Viewer viewer{.position = {0.0, 150.0, 0.0}, .direction = {1.0, -0.2, 0.0}, .radius = 448.0};
    const Clock::time_point began = Clock::now();
    if (const auto done = world->load_all({&viewer, 1}); !done) {
      state.SkipWithError(to_string(done.error()).c_str());
      return;
    }
    const double first_seconds = seconds_since(began);
    meshes.finish(world->scene(), viewer.position);
    drawn.take(meshes);
    const StreamStats before = world->stats();
    std::vector<double> updates;
    std::vector<double> own;  // of these, what the processor did for them
    std::vector<double> follows;
    double least_radius = viewer.radius;
    double most_resident = resident_megabytes();
    const double first_resident = most_resident;
    std::size_t most_counted = 0;
    const Clock::time_point start = Clock::now();
    int frame = 0;
    for (; seconds_since(start) < length; ++frame) {
      viewer.position.x += 100.0 / 60.0;
      if (frame % 10 == 0) {
        SceneGrid& land = world->scene().edit(*grid);
        if (is_smooth) {
          land.field.remove_sphere(viewer.position - DVec3(0.0, 80.0, 0.0), 6.0);
        } else {
          land.grid.fill_sphere(viewer.position - DVec3(0.0, 80.0, 0.0), 6.0, kAir);
        }
      }
      const Clock::time_point at = Clock::now();
      const double own_before = processor_seconds();
      if (const auto done = world->update({&viewer, 1}); !done) {
        state.SkipWithError(to_string(done.error()).c_str());
        return;
      }
      own.push_back(processor_seconds() - own_before);
      updates.push_back(seconds_since(at));
      const Clock::time_point then = Clock::now();
      meshes.update(world->scene(), viewer.position);
      drawn.take(meshes);
      follows.push_back(seconds_since(then));
      const StreamStats now = world->stats();
      least_radius = std::min(least_radius, now.complete_radius);
      most_counted = std::max(most_counted, now.loaded_bytes + now.other_bytes);
      if (frame % 30 == 0) most_resident = std::max(most_resident, resident_megabytes());
      if (std::getenv("QUOIN_FLIGHT_PLOT") != nullptr && frame % 60 == 0) {
        std::fprintf(stderr, "%d s: %.0f MB resident, %.0f MB counted, %zu chunks, complete to %.0f\n", frame / 60,
                     resident_megabytes(), static_cast<double>(now.loaded_bytes + now.other_bytes) / 1e6,
                     now.loaded_chunks, now.complete_radius);
      }
      std::this_thread::sleep_until(start + std::chrono::microseconds(16'667LL * (frame + 1)));
    }
    const double seconds = seconds_since(start);
    const StreamStats after = world->stats();
    const auto saved = world->flush();
    if (!saved) state.SkipWithError(to_string(saved.error()).c_str());
    const auto rate = [&](double count) { return benchmark::Counter(count / seconds); };
    state.counters["update_us_p50"] = 1e6 * quantile(updates, 0.5);
    state.counters["update_us_p99"] = 1e6 * quantile(updates, 0.99);
    state.counters["update_us_p999"] = 1e6 * quantile(updates, 0.999);
    state.counters["update_us_max"] = 1e6 * quantile(updates, 1.0);
    state.counters["update_own_us_p50"] = 1e6 * quantile(own, 0.5);
    state.counters["update_own_us_p99"] = 1e6 * quantile(own, 0.99);
    state.counters["update_own_us_p999"] = 1e6 * quantile(own, 0.999);
    state.counters["update_own_us_max"] = 1e6 * quantile(own, 1.0);
    state.counters["meshes_us_p50"] = 1e6 * quantile(follows, 0.5);
    state.counters["meshes_us_p99"] = 1e6 * quantile(follows, 0.99);
    state.counters["meshes_us_max"] = 1e6 * quantile(follows, 1.0);
    state.counters["made_a_second"] = rate(static_cast<double>(after.chunks_made - before.chunks_made));
    state.counters["meshed_a_second"] = rate(static_cast<double>(meshes.stats().chunks_meshed));
    state.counters["saved_chunks"] = static_cast<double>(world->store().stats().saved_chunks);
    state.counters["unloaded_a_second"] = rate(static_cast<double>(after.chunks_unloaded - before.chunks_unloaded));
    state.counters["loaded_chunks"] = static_cast<double>(after.loaded_chunks);
    state.counters["first_seconds"] = first_seconds;
    state.counters["least_radius"] = least_radius;
    state.counters["resident_MB_first"] = first_resident;
    state.counters["resident_MB_most"] = most_resident;
    state.counters["counted_MB_most"] = static_cast<double>(most_counted) / 1e6;
    state.counters["frames_a_second"] = rate(frame);
  }
}

BENCHMARK_CAPTURE(fly, voxels, false)->Name("stream/flight/voxels")->Iterations(1)->Unit(benchmark::kSecond);
BENCHMARK_CAPTURE(fly, smooth, true)->Name("stream/flight/smooth")->Iterations(1)->Unit(benchmark::kSecond);

}  // namespace
}  // namespace quoin
