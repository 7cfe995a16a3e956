// stream/flight: flies over a landscape that is generated, meshed, edited, saved and unloaded on the way, at 60 frames
// per second. Measures the caller's thread time and the memory in use. QUOIN_FLIGHT_SECONDS: duration.
// QUOIN_FLIGHT_SPEED: voxels per second. QUOIN_FLIGHT_RADIUS: the viewer's radius. QUOIN_FLIGHT_BUDGET: MiB.
// QUOIN_FLIGHT_PLOT: output file with one line per second. QUOIN_FLIGHT_KEEPS: the allocator keeps freed memory.
// QUOIN_FLIGHT_UPDATE: StreamOptions::update_seconds. QUOIN_FLIGHT_BARE: no meshes.

#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <string>
#include <thread>
#include <tuple>
#include <utility>
#include <vector>

#include <benchmark/benchmark.h>
#include <quoin/core/memory.h>
#include <quoin/live/live_meshes.h>
#include <quoin/stream/streamed_world.h>

#include "store/world/world_for_tests.h"

namespace quoin {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

// CPU time of this thread only.
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

double number_of(const char* name, double otherwise) {
  const char* const text = std::getenv(name);
  return text == nullptr ? otherwise : std::atof(text);
}

/// Records the measurements of a flight; writes one line per second to a file for plotting.
class FlightLog {
 public:
  FlightLog() {
    const char* const file = std::getenv("QUOIN_FLIGHT_PLOT");
    if (file == nullptr) return;
    plot_.open(file);
    plot_ << "seconds,resident_MB,counted_MB,chunks,radius,slowest_update_us\n";
  }

  /// `resident`: memory in addition to the memory before there was a world.
  void note(int frame, double own_seconds, double update_seconds, const StreamStats& now, double base) {
    own.push_back(own_seconds);
    updates.push_back(update_seconds);
    least_radius = std::min(least_radius, now.complete_radius);
    const double counted = static_cast<double>(now.loaded_bytes + now.other_bytes) / 1e6;
    most_counted = std::max(most_counted, counted);
    slowest_ = std::max(slowest_, own_seconds);
    if (frame % 60 != 0) return;
    const double resident = resident_megabytes() - base;
    residents.push_back(resident);
    if (plot_.is_open()) {
      plot_ << frame / 60 << ',' << resident << ',' << counted << ',' << now.loaded_chunks << ',' << now.complete_radius
            << ',' << 1e6 * slowest_ << std::endl;
    }
    slowest_ = 0.0;
  }
  void report(benchmark::State& state) const {
    const auto put = [&](const std::string& name, const std::vector<double>& all, double factor) {
      for (const auto& [end, share] : {std::pair("_p50", 0.5), {"_p99", 0.99}, {"_p999", 0.999}, {"_max", 1.0}}) {
        state.counters[name + end] = factor * quantile(all, share);
      }
    };
    put("update_us", updates, 1e6);
    put("update_own_us", own, 1e6);
    put("meshes_us", follows, 1e6);
    put("control_us", control, 1e6);
    put("resident_MB", residents, 1.0);
    state.counters["least_radius"] = least_radius;
    state.counters["counted_MB_most"] = most_counted;
  }

  std::vector<double> updates;
  std::vector<double> own;  // the part of `own` spent on the CPU
  std::vector<double> follows;
  std::vector<double> control;    // a fixed workload: shows disturbance by the machine
  std::vector<double> residents;  // megabytes
  double least_radius = std::numeric_limits<double>::infinity();
  double most_counted = 0.0;

 private:
  std::ofstream plot_;
  double slowest_ = 0.0;
};

/// A world, its meshes, and the viewer that flies through it.
struct Flight {
  Flight(StreamedWorld streamed, bool smooth) : world(std::move(streamed)), is_smooth(smooth) {}

  Status begin() {
    viewer.radius = number_of("QUOIN_FLIGHT_RADIUS", 448.0);
    // The fixed cost of such a program at any world size: its code, its workers and their buffers.
    const Viewer near{.position = viewer.position, .radius = 100.0};
    if (auto done = world.load_all({&near, 1}); !done) return done;
    meshes.finish(world.scene(), viewer.position);
    drawn.take(meshes);
    const StreamStats first = world.stats();
    base = resident_megabytes() - static_cast<double>(first.loaded_bytes + drawn.bytes()) / 1e6;
    return world.load_all({&viewer, 1});
  }
  void dig() {
    SceneGrid& land = world.scene().edit(grid);
    const DVec3 below = viewer.position - DVec3(0.0, 80.0, 0.0);
    if (is_smooth) {
      land.field.remove_sphere(below, 6.0);
    } else {
      land.grid.fill_sphere(below, 6.0, kAir);
    }
  }
  Status frame(int number, FlightLog& log) {
    viewer.position.x += number_of("QUOIN_FLIGHT_SPEED", 100.0) / 60.0;
    if (number % 10 == 0) dig();
    const double control_before = processor_seconds();
    for (unsigned i = 0; i < 60'000; ++i) benchmark::DoNotOptimize(i);
    const Clock::time_point at = Clock::now();
    const double own_before = processor_seconds();
    if (auto done = world.update({&viewer, 1}); !done) return done;
    log.control.push_back(own_before - control_before);
    const double own = processor_seconds() - own_before;
    const Clock::time_point then = Clock::now();
    if (!is_bare) {
      meshes.update(world.scene(), viewer.position);
      drawn.take(meshes);
    }
    log.follows.push_back(seconds_since(then));
    log.note(number, own, std::chrono::duration<double>(then - at).count(), world.stats(), base);
    return {};
  }

  StreamedWorld world;
  bool is_smooth;
  bool is_bare = std::getenv("QUOIN_FLIGHT_BARE") != nullptr;
  GridHandle grid;
  LiveMeshes meshes;
  Drawn drawn;
  Viewer viewer{.position = {0.0, 150.0, 0.0}, .direction = {1.0, -0.2, 0.0}};
  double base = 0.0;  // megabytes
};

Status fly_through(Flight& flight, benchmark::State& state) {
  const Clock::time_point began = Clock::now();
  if (auto done = flight.begin(); !done) return done;
  state.counters["first_seconds"] = seconds_since(began);
  if (!flight.is_bare) flight.meshes.finish(flight.world.scene(), flight.viewer.position);
  flight.drawn.take(flight.meshes);
  const StreamStats before = flight.world.stats();
  FlightLog log;
  const double length = number_of("QUOIN_FLIGHT_SECONDS", 8.0);
  const Clock::time_point start = Clock::now();
  int frame = 0;
  for (; seconds_since(start) < length; ++frame) {
    if (auto done = flight.frame(frame, log); !done) return done;
    std::this_thread::sleep_until(start + std::chrono::microseconds(16'667LL * (frame + 1)));
  }
  const double seconds = seconds_since(start);
  const StreamStats after = flight.world.stats();
  if (auto saved = flight.world.flush(); !saved) return saved;
  const auto rate = [&](double count) { return benchmark::Counter(count / seconds); };
  log.report(state);
  state.counters["made_a_second"] = rate(static_cast<double>(after.chunks_made - before.chunks_made));
  state.counters["meshed_a_second"] = rate(static_cast<double>(flight.meshes.stats().chunks_meshed));
  state.counters["unloaded_a_second"] = rate(static_cast<double>(after.chunks_unloaded - before.chunks_unloaded));
  state.counters["saved_chunks"] = static_cast<double>(flight.world.store().stats().saved_chunks);
  state.counters["loaded_chunks"] = static_cast<double>(after.loaded_chunks);
  state.counters["made_chunks"] = static_cast<double>(after.chunks_made);
  state.counters["missing_chunks"] = static_cast<double>(after.missing_chunks);
  state.counters["last_radius"] = after.complete_radius;
  state.counters["base_MB"] = flight.base;
  state.counters["frames_a_second"] = rate(frame);
  return {};
}

void fly(benchmark::State& state, bool is_smooth) {
  // Streaming programs return freed memory; QUOIN_FLIGHT_KEEPS measures programs that do not.
  if (std::getenv("QUOIN_FLIGHT_KEEPS") == nullptr) return_freed_memory();
  for (auto _ : state) {
    const WorldFolder folder;
    Flight* flying = nullptr;
    StreamOptions options;
    options.budget_bytes = static_cast<std::size_t>(number_of("QUOIN_FLIGHT_BUDGET", 192.0)) << 20;
    options.update_seconds = number_of("QUOIN_FLIGHT_UPDATE", options.update_seconds);
    options.other_bytes = [&flying] { return flying == nullptr ? 0 : flying->drawn.bytes(); };
    auto world = StreamedWorld::open_or_create(folder / "flight.quoin", options);
    if (!world) return state.SkipWithError(to_string(world.error()).c_str());
    Flight flight(std::move(*world), is_smooth);
    const auto grid = flight.world.add_terrain({.seed = 9, .is_smooth = is_smooth});
    if (!grid) return state.SkipWithError(to_string(grid.error()).c_str());
    flight.grid = *grid;
    flying = &flight;
    if (auto done = fly_through(flight, state); !done) return state.SkipWithError(to_string(done.error()).c_str());
    state.counters["file_MB"] = static_cast<double>(std::filesystem::file_size(folder / "flight.quoin")) / 1e6;
  }
}

BENCHMARK_CAPTURE(fly, voxels, false)->Name("stream/flight/voxels")->Iterations(1)->Unit(benchmark::kSecond);
BENCHMARK_CAPTURE(fly, smooth, true)->Name("stream/flight/smooth")->Iterations(1)->Unit(benchmark::kSecond);

}  // namespace
}  // namespace quoin
